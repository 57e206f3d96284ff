"""Who may import whom, what `import contactfpga` costs, and that the lock covers every dependency."""

import ast
import importlib.metadata
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = {
    "contactfpga": ROOT / "py" / "contactfpga",
    "contactfpga_hdl": ROOT / "hdl" / "contactfpga_hdl",
    "contactfpga_sim": ROOT / "sim" / "contactfpga_sim",
}
SHARED_WITH_GATEWARE = {"contactfpga.skin", "contactfpga.wire.protocol", "contactfpga.errors"}


class Import(NamedTuple):
    """A name that is imported; ``at_load``: when the file is imported, not only when a function is called."""

    name: str
    line: int
    at_load: bool


def imports_of(source: str, module: str, is_package: bool = False) -> list[Import]:
    """Everything ``source`` imports, relative names resolved; ``from a import b`` counts as ``a.b``."""
    return list(_walk(ast.parse(source), module if is_package else module.rpartition(".")[0], True))


def _walk(node: ast.AST, package: str, at_load: bool) -> Iterator[Import]:
    match node:
        case ast.Import(names=names):
            for alias in names:
                yield Import(alias.name, node.lineno, at_load)
        case ast.ImportFrom(module=base, names=names, level=level):
            parts = package.split(".")[: len(package.split(".")) - level + 1] if level else []
            origin = ".".join([*parts, *([base] if base else [])])
            for alias in names:
                yield Import(f"{origin}.{alias.name}", node.lineno, at_load)
        case ast.Call(func=ast.Name(id="__import__" | "import_module") | ast.Attribute(attr="import_module")):
            for argument in node.args[:1]:
                if isinstance(argument, ast.Constant) and isinstance(argument.value, str):
                    yield Import(argument.value, node.lineno, at_load)
            for child in ast.iter_child_nodes(node):
                yield from _walk(child, package, at_load)
        case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.Lambda():
            for child in ast.iter_child_nodes(node):
                yield from _walk(child, package, False)
        case ast.If(test=ast.Name(id="TYPE_CHECKING") | ast.Attribute(attr="TYPE_CHECKING")):
            for child in node.body:
                yield from _walk(child, package, False)
            for child in node.orelse:
                yield from _walk(child, package, at_load)
        case _:
            for child in ast.iter_child_nodes(node):
                yield from _walk(child, package, at_load)


def within(name: str, packages: Iterable[str]) -> bool:
    return any(name == package or name.startswith(package + ".") for package in packages)


def host_faults(imports: list[Import]) -> list[Import]:
    heavy = ("contactfpga_hdl", "contactfpga_sim", "amaranth", "cocotb")
    return [found for found in imports if found.at_load and within(found.name, heavy)]


def gateware_faults(imports: list[Import]) -> list[Import]:
    return [
        found
        for found in imports
        if within(found.name, ["contactfpga_sim"])
        or (within(found.name, ["contactfpga"]) and not within(found.name, SHARED_WITH_GATEWARE))
    ]


def golden_faults(imports: list[Import]) -> list[Import]:
    return [found for found in imports if within(found.name, ["amaranth", "contactfpga_hdl"])]


def project_modules() -> dict[str, Path]:
    modules = {}
    for package, folder in PACKAGES.items():
        for path in sorted(folder.rglob("*.py")):
            parts = path.relative_to(folder).with_suffix("").parts
            modules[".".join((package, *parts)).removesuffix(".__init__")] = path
    return modules


def imports_in(module: str) -> list[Import]:
    path = project_modules()[module]
    return imports_of(path.read_text(encoding="utf-8"), module, path.name == "__init__.py")


def reached_from(start: Iterable[str]) -> set[str]:
    """Modules of this project that importing ``start`` loads, the packages around them included."""
    known = project_modules()
    todo, seen = list(start), set()
    while todo:
        name = todo.pop()
        while name and name not in known:  # `a.b.Name` is a name in module `a.b`
            name = name.rpartition(".")[0]
        if not name or name in seen:
            continue
        seen.add(name)
        todo.append(name.rpartition(".")[0])
        todo += [found.name for found in imports_in(name) if found.at_load]
    return seen


def modules_in(package: str) -> list[str]:
    modules = [name for name in project_modules() if within(name, [package])]
    assert modules, f"there is no {package}"
    return modules


def complaints(modules: Iterable[str], faults) -> list[str]:
    return [f"{name}:{found.line} imports {found.name}" for name in modules for found in faults(imports_in(name))]


def test_host_imports_neither_gateware_nor_models_when_loaded():
    assert complaints(modules_in("contactfpga"), host_faults) == []


def test_gateware_imports_only_the_contracts_from_the_host():
    assert complaints(modules_in("contactfpga_hdl"), gateware_faults) == []


def test_golden_model_and_all_it_reaches_know_no_gateware():
    assert complaints(modules_in("contactfpga_sim.golden"), golden_faults) == []

    def faults(imports):
        return golden_faults([found for found in imports if found.at_load])

    assert complaints(sorted(reached_from(modules_in("contactfpga_sim.golden"))), faults) == []


def test_golden_model_computes_its_own_widths():
    def faults(imports):
        return [found for found in imports if within(found.name, ["contactfpga.skin.derived"])]

    assert complaints(modules_in("contactfpga_sim.golden"), faults) == []


@pytest.mark.parametrize(
    ("faults", "module", "source", "refused"),
    [
        (host_faults, "contactfpga.a", "import contactfpga_hdl.top", True),
        (
            host_faults,
            "contactfpga.a",
            "try:\n  from contactfpga_sim import board\nexcept ImportError: pass",
            True,
        ),
        (host_faults, "contactfpga.a", "class A:\n  import amaranth", True),
        (host_faults, "contactfpga.a", "import importlib\nimportlib.import_module('contactfpga_hdl')", True),
        (host_faults, "contactfpga.a", "def f():\n  from contactfpga_sim import board", False),
        (
            host_faults,
            "contactfpga.a",
            "if TYPE_CHECKING:\n  import contactfpga_sim\nelse:\n  import os",
            False,
        ),
        (
            host_faults,
            "contactfpga.a",
            "if TYPE_CHECKING:\n  import os\nelse:\n  import contactfpga_sim",
            True,
        ),
        (host_faults, "contactfpga.a", "import contactfpga_hdlx, numpy, serial", False),
        (gateware_faults, "contactfpga_hdl.a", "from contactfpga import Skin", True),
        (gateware_faults, "contactfpga_hdl.a", "import contactfpga", True),
        (gateware_faults, "contactfpga_hdl.a", "from contactfpga.driver.driver import open", True),
        (gateware_faults, "contactfpga_hdl.a", "def f():\n  import contactfpga_sim.golden", True),
        (gateware_faults, "contactfpga_hdl.a", "from contactfpga.wire import protocol", False),
        (gateware_faults, "contactfpga_hdl.a", "from contactfpga.skin import Skin", False),
        (gateware_faults, "contactfpga_hdl.a", "from . import stack\nfrom .contactfpga import x", False),
        (golden_faults, "contactfpga_sim.golden", "def f():\n  from amaranth.sim import Simulator", True),
        (golden_faults, "contactfpga_sim.golden", "import contactfpga_hdl as h", True),
        (golden_faults, "contactfpga_sim.golden.a", "from ..amaranth import x\nimport numpy", False),
    ],
)
def test_the_checker_itself(faults, module, source, refused):
    assert bool(faults(imports_of(source, module))) is refused


def test_relative_imports_are_resolved():
    found = imports_of("from .. import a\nfrom . import b\nfrom .c.d import e", "p.q.r")
    assert [item.name for item in found] == ["p.a", "p.q.b", "p.q.c.d.e"]
    assert imports_of("from . import a", "p.q", is_package=True)[0].name == "p.q.a"


def test_the_folder_of_the_host_is_no_package():
    # py/__init__.py would take the name of the package `py`, which pytest provides.
    assert not [folder.parent for folder in PACKAGES.values() if (folder.parent / "__init__.py").exists()]


def project() -> dict:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def normal(requirement: str) -> str:
    """The name in a requirement, as registries compare names."""
    return re.sub(r"[-_.]+", "-", re.match(r"[\w.-]+", requirement)[0]).lower()


def loaded_by(module: str) -> set[str]:
    """Names of the top-level packages, standard library excepted, whose files ``import module`` loads."""
    program = (
        "import sys; before = set(sys.modules); "
        f"import {module}; "
        "new = set(sys.modules) - before; "
        "print(*{n.partition('.')[0] for n in new if getattr(sys.modules[n], '__file__', None)})"
    )
    run = subprocess.run([sys.executable, "-I", "-c", program], capture_output=True, text=True, timeout=60)
    assert run.returncode == 0, run.stderr
    return set(run.stdout.split()) - sys.stdlib_module_names


@pytest.mark.parametrize("module", ["contactfpga", project()["scripts"]["contactfpga"].partition(":")[0]])
def test_host_loads_only_its_dependencies(module):
    direct = {normal(requirement) for requirement in project()["dependencies"]}
    provided = importlib.metadata.packages_distributions()
    allowed = {name for name, owners in provided.items() if direct & {normal(owner) for owner in owners}}
    assert loaded_by(module) <= allowed | {"contactfpga"}


def test_golden_model_loads_no_amaranth():
    assert loaded_by("contactfpga_sim.golden").isdisjoint({"amaranth", "contactfpga_hdl"})


def test_pin_tables_load_no_amaranth():
    # so that `contactfpga flash` runs where only the host is installed
    assert loaded_by("contactfpga_hdl.board.boards").isdisjoint({"amaranth", "amaranth_boards"})


def test_what_a_module_loads_is_seen():
    assert "amaranth" in loaded_by("amaranth")


def test_lock_covers_every_dependency():
    lines = (ROOT / "pip-constraints.txt").read_text(encoding="utf-8").splitlines()
    lock = dict(line.split("==") for line in lines if line and not line.startswith("#"))
    wanted = chain(project()["dependencies"], *project()["optional-dependencies"].values())
    for requirement in wanted:
        name = normal(requirement)
        if name == "contactfpga":  # an extra that contains another one
            continue
        assert name in lock, f"pip-constraints.txt has no line for {name}"
        exact = re.search(r"==([\w.]+)", requirement)
        assert exact is None or exact[1] == lock[name], f"{requirement} in pyproject.toml, {lock[name]} locked"
