"""Keys of cached results: hashes of modules with all imports."""

from __future__ import annotations

import ast
import contextlib
import functools
import hashlib
import importlib.metadata
import importlib.util
import os
import re
import sys
import sysconfig
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path

from contactfpga.errors import MissingExtra

HOST, GATEWARE, SIMULATION = PACKAGES = ("contactfpga", "contactfpga_hdl", "contactfpga_sim")

# What only types need does nothing.
_TYPES = re.compile(r"^if TYPE_CHECKING:\n(?:[ \t]+.*\n|\n)+", re.MULTILINE)
_IMPORT = re.compile(r"^[ \t]*((?:from[ \t]+\S+[ \t]+import[ \t]*\([^)]*\)|from\b|import\b).*)", re.MULTILINE)
_WORD = re.compile(r"\bimport\b")
# Where a choice is; it is loaded from there.
_PLACE = re.compile(r"""\b(contactfpga\w*(?:\.\w+)+):\w+["']""")

_taken: dict[tuple[str, tuple[str, ...], bool], str] = {}
_read: dict[Path, object] = {}
"""Modules of the project read so far, with stamps that reveal later writes."""


def digest(root: str, packages: tuple[str, ...] = PACKAGES, documented: bool = True) -> str:
    """Hash of a module, or all modules of a package, with imports: text of ``packages`` and of data beside their
    modules, versions of other packages. ``documented=False`` ignores docstrings, in three times the time."""
    key = root, packages, documented
    if key not in _taken:
        _taken[key] = _digest(*key)
    return _taken[key]


@functools.cache
def texts(root: str, packages: tuple[str, ...] = PACKAGES) -> str:
    """Hash like :func:`digest` of the project's modules alone, equal in clone and wheel, for every Python and other
    versions."""
    folders = folders_of(packages)
    return _sha(_texts(_closure([root], folders), folders, _hash))


def changed() -> bool:
    """Whether a module was written since it was read."""
    return any(_stamp(file) != before for file, before in _read.items())


def own(files: Iterable[Path]) -> str:
    """Hash of a user's files, with imports from the project's packages and from beside themselves."""
    files = sorted(files)
    return _hashed([*map(_hash, files), *_marks(map(_name, files), folders_of(PACKAGES) | _beside(files))])


def find(name: str, folders: Mapping[str, Path]) -> Path | None:
    """File of a module in one of the folders of packages."""
    top = name.partition(".")[0]
    if top not in folders:
        return None
    path = f"{folders[top]}/{name.replace('.', '/')}"
    return next((Path(file) for file in (f"{path}/__init__.py", f"{path}.py") if os.path.isfile(file)), None)


def folders_of(packages: Iterable[str]) -> dict[str, Path]:
    """Folders that packages are in."""
    return {name: package(name).parent for name in packages}


def data(folder: Path) -> Iterator[Path]:
    """Files of other kinds in folders beside a module."""
    with os.scandir(folder) as entries:
        inner = [Path(entry) for entry in entries if entry.is_dir() and entry.name != "__pycache__"]
    for each in inner:
        if not (each / "__init__.py").is_file():
            yield from (file for file in each.rglob("*") if file.is_file())


def absolute(statement: ast.ImportFrom, name: str, is_package: bool) -> str:
    """Module from which a module imports."""
    parts = name.split(".") if statement.level else []
    above = parts[: len(parts) - statement.level + is_package]
    return ".".join((*above, *filter(None, (statement.module,))))


def package(name: str) -> Path:
    """Folder of a package. Raises :class:`MissingExtra`."""
    spec = importlib.util.find_spec(name)
    if spec is None or not spec.submodule_search_locations:
        raise MissingExtra("the virtual board", "sim")
    return Path(next(iter(spec.submodule_search_locations)))


@functools.cache
def version(name: str) -> str:
    """Version of an installed package; empty without it."""
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return ""


def _digest(root: str, packages: tuple[str, ...], documented: bool) -> str:
    folders = folders_of(packages)
    found = find(root, folders)
    if found is None:
        raise ModuleNotFoundError(f"no module named {root!r}", name=root)
    roots = found.parent.rglob("*.py") if found.name == "__init__.py" else [found]
    return _hashed(_marks(map(_name, roots), folders, True, _hash if documented else _undocumented))


def _hashed(marks: Iterable[str]) -> str:
    return _sha((sys.implementation.cache_tag, *marks))


def _sha(marks: Iterable[str]) -> str:
    return hashlib.sha256("\n".join(marks).encode()).hexdigest()


def _beside(files: Iterable[Path]) -> dict[str, Path]:
    installed = {Path(path).resolve() for path in sysconfig.get_paths().values()}
    found = {}
    for file in files:
        top = _top(file)
        found[top.stem] = top.parent
        if top.parent.resolve() not in installed:
            found |= {path.stem: top.parent for path in top.parent.iterdir() if path.suffix == ".py" or path.is_dir()}
    return found


def _top(file: Path) -> Path:
    while (file.parent / "__init__.py").is_file():
        file = file.parent
    return file


def _name(file: Path) -> str:
    parts = file.relative_to(_top(file).parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _marks(
    roots: Iterable[str], folders: Mapping[str, Path], ours: bool = False, hashed: Callable[[Path], str] | None = None
) -> list[str]:
    found = _closure(roots, folders, _noted if ours else lambda _: None)
    marks = _texts(found, folders, hashed or _hash)
    for folder in {file.parent for file in found.values() if file} if ours else ():
        marks += (f"{file.name} {_hash(file)}" for file in data(folder))
    others = _tops(found) - set(folders) - set(PACKAGES) - sys.stdlib_module_names
    return sorted((*marks, *(f"{other} {version(other)}" for other in others)))


def _texts(found: Mapping[str, Path | None], folders: Mapping[str, Path], hashed: Callable[[Path], str]) -> list[str]:
    marks = [f"{name} {hashed(file)}" for name, file in found.items() if file]
    marks += (f"{top} {hashed(file)}" for top in _tops(found) - set(found) if (file := find(top, folders)))
    return sorted(marks)


def _tops(found: Iterable[str]) -> set[str]:
    return {name.partition(".")[0] for name in found}


def _closure(
    roots: Iterable[str], folders: Mapping[str, Path], about_to_read: Callable[[Path], None] = lambda _: None
) -> dict[str, Path | None]:
    todo, found = set(roots), dict[str, Path | None]()
    while todo:
        name = todo.pop()
        found[name] = file = find(name, folders)
        if file:
            about_to_read(file)
            text = file.read_bytes().decode(errors="replace")
            todo |= _imported(text, name, file.name == "__init__.py")
        # A package's own file runs before its modules. The outermost one only gathers names for users.
        if name.count(".") > 1:
            todo.add(name.rpartition(".")[0])
        todo -= set(found)
    return found


def _noted(file: Path) -> None:
    _read.setdefault(file, _stamp(file))


def _stamp(file: Path) -> object:
    with contextlib.suppress(OSError):
        found = file.stat()
        return found.st_mtime_ns, found.st_size, found.st_ino
    return None


def _hash(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


@functools.cache
def _undocumented(file: Path) -> str:
    text = file.read_bytes().decode(errors="replace")
    lines = text.splitlines()
    with contextlib.suppress(SyntaxError):  # nothing can import it
        for at in _docstrings(ast.parse(text)):
            lines[at] = ""
    return _sha(filter(str.strip, lines))


def _docstrings(block: ast.AST) -> Iterator[int]:
    """Lines, from 0, of docstrings, which in this project share no line with code."""
    for name in ("body", "orelse", "finalbody", "handlers"):
        for statement in getattr(block, name, ()):
            if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
                yield from range(statement.lineno - 1, statement.end_lineno or 0)
            yield from _docstrings(statement)


def _imported(text: str, name: str, is_package: bool) -> set[str]:
    found = set(_PLACE.findall(text))
    for statement in _statements(text):
        if isinstance(statement, ast.Import):
            found.update(alias.name for alias in statement.names)
        elif isinstance(statement, ast.ImportFrom):
            module = absolute(statement, name, is_package)
            found.update((module, *(f"{module}.{alias.name}" for alias in statement.names)))
    return found - {""}


def _statements(text: str) -> Iterator[ast.AST]:
    """Import statements, by a text search ten times faster than parsing; ambiguous files are parsed."""
    parts = _IMPORT.split(_TYPES.sub("", text))
    try:
        if any(map(_WORD.search, parts[::2])):
            raise SyntaxError
        yield from ast.parse("\n".join(parts[1::2])).body
    except SyntaxError:
        with contextlib.suppress(SyntaxError):  # nothing can import it
            yield from ast.walk(ast.parse(text))
