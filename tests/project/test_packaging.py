"""What importing a module loads, and that the lock covers every dependency. `make lint` knows who may import whom."""

import importlib.metadata
import re
import subprocess
import sys
import tomllib
import types
from itertools import chain
from pathlib import Path

import pytest

import contactfpga

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ("py", "hdl", "sim")


def test_the_folder_of_the_host_is_no_package():
    # py/__init__.py would take the name of the package `py`, which pytest provides.
    assert not [folder for folder in SOURCES if (ROOT / folder / "__init__.py").exists()]


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
    run = subprocess.run([sys.executable, "-I", "-c", program], capture_output=True, text=True, timeout=250)
    assert run.returncode == 0, run.stderr
    return set(run.stdout.split()) - sys.stdlib_module_names


def test_all_names_of_the_package_are_there():
    """They are imported when they are used first."""
    for name in contactfpga.__all__:
        assert getattr(contactfpga, name).__class__
        assert name in dir(contactfpga)
    shown = {name for name in dir(contactfpga) if not name.startswith("_")} - set(contactfpga.__all__)
    assert all(isinstance(getattr(contactfpga, name), types.ModuleType) for name in shown), shown
    assert set(contactfpga._PLACES) == set(contactfpga.__all__) - {"__version__"}
    assert contactfpga.skin.sheet.__name__ == "contactfpga.skin.sheet"
    with pytest.raises(AttributeError, match="module 'contactfpga' has no attribute 'zonse'"):
        contactfpga.zonse  # noqa: B018


def test_the_command_begins_without_anything_to_load():
    assert loaded_by(project()["scripts"]["contactfpga"].partition(":")[0]) == {"contactfpga"}


@pytest.mark.parametrize("module", ["contactfpga.driver.driver", "contactfpga.robot.haptics", "contactfpga.tools.cli"])
def test_host_loads_only_its_dependencies(module):
    direct = {normal(requirement) for requirement in project()["dependencies"]}
    provided = importlib.metadata.packages_distributions()
    allowed = {name for name, owners in provided.items() if direct & {normal(owner) for owner in owners}}
    assert loaded_by(module) <= allowed | {"contactfpga"}


def test_golden_model_loads_no_amaranth():
    assert loaded_by("contactfpga_sim.model.golden").isdisjoint({"amaranth", "contactfpga_hdl"})


def test_pin_tables_load_no_amaranth():
    # so that `contactfpga flash` runs where only the host is installed
    assert loaded_by("contactfpga.boards").isdisjoint({"amaranth", "amaranth_boards"})


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
