"""Which definitions a function may run, found in the sources by their names.

A name leads to the definition in its module, or to the one that its module imports. A name after the dot of anything
but a module leads to each method of that name in the classes that are reached. So more is found than runs; only names
that a program puts together while it runs are missed. Files of other kinds in a folder beside a reached module are
definitions, too.
"""

from __future__ import annotations

import ast
import builtins
import dataclasses
import functools
import hashlib
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path

from contactfpga_sim.model.board import sources

_FUNCTION = (ast.FunctionDef, ast.AsyncFunctionDef)
_WRAPPERS = ("cache", "contextlib", "contextmanager", "functools", "overload")
_PLACE = re.compile(r"contactfpga[\w.]*:\w+")
_UNREAD = ("annotation", "returns")
"""Parts of a definition that do not run."""


@dataclasses.dataclass(frozen=True)
class Definition:
    """A function, the rest of a class without its methods, a method, a variable, or a statement that names nothing."""

    module: str
    name: str
    """``Class.method`` of a method; empty for a statement that names nothing, which runs with its module."""
    mark: str
    """Hash of its syntax tree without imports, docstrings and positions."""
    chains: frozenset[tuple[str, ...]] = frozenset()
    """Names in it with the names after their dots; a name after the dot of something else follows an empty one."""
    bases: frozenset[str] = frozenset()
    """Names of a class's bases."""


def reached(roots: Iterable[str]) -> set[Definition]:
    """Definitions that functions, named ``module:function``, may run."""
    roots = list(roots)
    search = _Search({*sources.PACKAGES, *(root.partition(".")[0] for root in roots)})
    for root in roots:
        search.name(*root.split(":"))
    return search.run()


class _Search:
    def __init__(self, packages: Iterable[str]):
        self._folders = sources.folders_of(packages)
        self._files: dict[str, Path | None] = {}
        self._found: set[Definition] = set()
        self._todo: list[Definition] = []
        self._entered: set[str] = set()
        self._dotted: set[str] = set()
        self._methods: defaultdict[str, list[Definition]] = defaultdict(list)
        """Methods of reached classes by their names."""

    def run(self) -> set[Definition]:
        while self._todo:
            self._follow(self._todo.pop())
        folders = {self._module(name).file.parent for name in self._entered}
        return self._found | {_datum(file) for folder in folders for file in sources.data(folder)}

    def name(self, module: str, name: str) -> bool:
        """Follow a name of a module; whether it is a definition of ours."""
        here = self._module(module)
        if name in here.named:
            self._take(here.named[name])
            return True
        imported = here.imports.get(name, ()) or [(star, name) for star in here.stars]
        places = [place for place in imported if self._is_module(place[0]) and place != (module, name)]
        return sum(self.name(*place) for place in places) > 0

    def _follow(self, one: Definition) -> None:
        here = self._module(one.module)
        if one.module not in self._entered:
            self._entered.add(one.module)
            self._take(here.named.get("", []))
        methods = here.methods.get(one.name, {})
        foreign = any(not self._ours(here, base) for base in one.bases)
        for name, method in methods.items():
            self._methods[name].append(method)
            if name in self._dotted or name.startswith("__"):
                self._take([method])
        if foreign:
            # What calls them is not ours, and calls those of classes below, too.
            for name in methods:
                self._dot(name)
        for chain in one.chains:
            self._chain(here, chain)

    def _ours(self, here: _Module, base: str) -> bool:
        imported = here.imports.get(base)
        return base in here.named or hasattr(builtins, base) or bool(imported and self._is_module(imported[0][0]))

    def _chain(self, here: _Module, chain: tuple[str, ...]) -> None:
        first, *rest = chain
        if ":" in first:
            self.name(*first.split(":"))
        elif not rest:
            self.name(here.name, first)
        elif first in here.named or first not in here.imports:
            self._dot(rest[-1])
        else:
            for source, inner in here.imports[first]:
                self._through(f"{source}.{inner}" if inner else source, rest)

    def _through(self, place: str, names: list[str]) -> None:
        """Follow names after the dots of something imported."""
        while names and self._is_module(f"{place}.{names[0]}"):
            place, names = f"{place}.{names[0]}", names[1:]
        if names and self._is_module(place) and self.name(place, names[0]):
            names = names[1:]
        if names and self._is_module(place.partition(".")[0]):
            self._dot(names[-1])

    def _dot(self, name: str) -> None:
        if name not in self._dotted:
            self._dotted.add(name)
            self._take(self._methods[name])

    def _take(self, found: list[Definition]) -> None:
        self._todo += [one for one in found if one not in self._found]
        self._found.update(found)

    def _is_module(self, name: str) -> bool:
        return self._file(name) is not None

    def _module(self, name: str) -> _Module:
        file = self._file(name)
        if file is None:
            raise ModuleNotFoundError(f"no module named {name!r}", name=name)
        return _parsed(name, file)

    def _file(self, name: str) -> Path | None:
        if name not in self._files:
            self._files[name] = sources.find(name, self._folders)
        return self._files[name]


@dataclasses.dataclass(frozen=True)
class _Module:
    name: str
    file: Path
    named: dict[str, list[Definition]]
    """Definitions by name; those that run with the module under the empty name."""
    methods: dict[str, dict[str, Definition]]
    """Methods by class and name."""
    imports: dict[str, list[tuple[str, str]]]
    """Modules and names in them, empty for the module itself, by name here."""
    stars: list[str]


@functools.cache
def _parsed(name: str, file: Path) -> _Module:
    tree = ast.parse(file.read_bytes())
    found = _Module(name, file, {}, {}, {}, [])
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                place = alias.name if alias.asname else alias.name.partition(".")[0]
                found.imports.setdefault(alias.asname or place, []).append((place, ""))
        elif isinstance(node, ast.ImportFrom):
            source = sources.absolute(node, name, file.name == "__init__.py")
            for alias in node.names:
                found.imports.setdefault(alias.asname or alias.name, []).append((source, alias.name))
            found.stars.extend(source for alias in node.names if alias.name == "*")
    for statement in tree.body:
        if not _says_nothing(statement):
            _define(found, statement)
    return found


def _define(module: _Module, statement: ast.stmt) -> None:
    if isinstance(statement, ast.ClassDef):
        methods = [one for one in statement.body if isinstance(one, _FUNCTION)]
        statement.body = [one for one in statement.body if one not in methods]
        own = module.methods.setdefault(statement.name, {})
        for method in methods:  # a property has two of one name
            name = method.name
            own[name] = _definition(module.name, f"{statement.name}.{name}", method, own.get(name))
        names = [statement.name]
    else:
        names = _names(statement)
    one = _definition(module.name, names[0], statement)
    for name in names:
        module.named.setdefault(name, []).append(one)


def _names(statement: ast.stmt) -> list[str]:
    """Names that a statement defines, and an empty one if it does more."""
    if isinstance(statement, _FUNCTION):
        plain = all(ast.unparse(one).startswith(_WRAPPERS) for one in statement.decorator_list)
        return [statement.name] if plain else [statement.name, ""]
    stored = [node for node in ast.walk(statement) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)]
    functions = [node.name for node in ast.walk(statement) if isinstance(node, (*_FUNCTION, ast.ClassDef))]
    alone = isinstance(statement, (ast.Assign, ast.AnnAssign, ast.AugAssign)) and stored
    return [*(node.id for node in stored), *functions, *([] if alone else [""])]


def _definition(module: str, name: str, statement: ast.stmt, before: Definition | None = None) -> Definition:
    text = repr((before and before.mark, _plain(statement)))
    chains = {*_chains(statement), *(before.chains if before else ())}
    bases = [ast.unparse(one) for one in statement.bases] if isinstance(statement, ast.ClassDef) else []
    heads = frozenset(base.partition("[")[0].partition(".")[0] for base in bases)
    return Definition(module, name, hashlib.sha256(text.encode()).hexdigest(), frozenset(chains), heads)


def _chains(node: ast.AST) -> Iterator[tuple[str, ...]]:
    if isinstance(node, (ast.Name, ast.Attribute)):
        yield _chain(node)
    elif isinstance(node, ast.Constant) and isinstance(node.value, str) and _PLACE.fullmatch(node.value):
        yield (node.value,)
    for name, value in ast.iter_fields(node):
        if name not in _UNREAD:
            for inner in value if isinstance(value, list) else [value]:
                if isinstance(inner, ast.AST):
                    yield from _chains(inner)


def _chain(node: ast.AST) -> tuple[str, ...]:
    if isinstance(node, ast.Attribute):
        return *_chain(node.value), node.attr
    return (node.id if isinstance(node, ast.Name) else "",)


@functools.cache
def _datum(file: Path) -> Definition:
    return Definition("", file.name, hashlib.sha256(file.read_bytes()).hexdigest())


def _says_nothing(statement: ast.AST) -> bool:
    if isinstance(statement, ast.If):
        return isinstance(statement.test, ast.Name) and statement.test.id == "TYPE_CHECKING"
    if isinstance(statement, ast.Expr):
        return isinstance(statement.value, ast.Constant)
    return isinstance(statement, (ast.Import, ast.ImportFrom))


def _plain(node: object) -> object:
    """A syntax tree as plain values, equal in all Python versions."""
    if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
        return "Raise", _plain(node.exc.func)  # its words change no page
    if isinstance(node, ast.AST):
        return type(node).__name__, *_fields(node)
    if isinstance(node, list):
        return [_plain(one) for one in node if not (isinstance(one, ast.stmt) and _says_nothing(one))]
    return node


def _fields(node: ast.AST) -> Iterator[tuple[str, object]]:
    for name, value in ast.iter_fields(node):
        if value not in (None, []) and name not in ("ctx", "kind", "type_comment"):
            yield name, _plain(value)
