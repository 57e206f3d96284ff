"""The Makefile in folders and with files of any name: a clear error or the name as it is, never a command."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# `make test` hands its own settings down, and PYTHON or CXX of a user would be tried.
ENVIRONMENT = {name: os.environ[name] for name in ("PATH", "HOME", "LANG") if name in os.environ}

pytestmark = pytest.mark.skipif(not shutil.which("make"), reason="make is not installed")


def clone(folder):
    """As much of a clone as make reads before it installs anything."""
    folder.mkdir()
    shutil.copy(ROOT / "Makefile", folder)
    shutil.copytree(ROOT / "scripts", folder / "scripts")
    for name in ("pyproject.toml", "pip-constraints.txt"):
        (folder / name).touch()
    return folder


def make(folder, *arguments):
    command = ["make", *arguments]
    return subprocess.run(command, cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, timeout=250)


NAMES = ["a$(touch owned)b", "a`touch owned`b", 'a"b', "a\tb", "a\nb", "a#b", "a:b"]


@pytest.mark.parametrize(("name", "goal"), [*((name, "test") for name in NAMES), ("a:b", "check"), ("a:b", "lint")])
def test_a_folder_that_make_cannot_build_in_is_reported(tmp_path, name, goal):
    done = make(clone(tmp_path / name), goal)
    assert done.returncode == 2
    assert "The path of this folder contains one of" in done.stderr
    assert not list(tmp_path.rglob("owned"))


def test_a_folder_with_a_control_character_is_reported_without_it(tmp_path):
    done = make(clone(tmp_path / "a\x1b[31mb"), "check")
    assert done.returncode == 2
    assert "a?[31mb" in done.stderr
    assert "\x1b[31mb\n    " not in done.stderr


@pytest.mark.parametrize("name", ["plain-1.2_x@y+z", "a,b", "ünï", "a~b", "a (copy) b", "R&D", "Bob's"])
def test_other_folders_will_do(tmp_path, name):
    assert "The path of this folder" not in make(clone(tmp_path / name), "check").stderr


@pytest.mark.parametrize(("goal", "asked"), [("sim", False), ("test", True)])
def test_the_first_command_asks_for_no_compiler(tmp_path, goal, asked):
    assert ("check compiler" in make(clone(tmp_path / "clone"), "-n", goal).stdout) == asked


def test_a_moved_clone_gets_its_environment_anew(tmp_path):
    folder = clone(tmp_path / "clone")
    (folder / ".venv").mkdir()
    (folder / ".venv" / ".folder").write_text(f"{folder.resolve()}\n")
    (folder / ".venv" / ".stamp-venv").touch()
    assert "-m venv" not in make(folder, "-n", "lint").stdout
    moved = folder.rename(tmp_path / "moved")
    assert "-m venv" in make(moved, "-n", "lint").stdout


@pytest.mark.parametrize("name", ["my file", "a'b", 'a"b', "a$(touch owned)b", "a$HOME`id`;x"])
@pytest.mark.parametrize(
    ("goal", "option"), [("bitstream", "--skin"), ("bitstream-replay", "--skin"), ("bitstream-replay", "--recordings")]
)
def test_names_of_files_reach_the_command_as_they_are(tmp_path, goal, option, name):
    variable = option.removeprefix("--").upper()
    done = make(clone(tmp_path / "clone"), "-n", goal, "BOARD=icestick", f"{variable}={name}")
    printed = done.stdout.replace("\\\n", " ").splitlines()
    started = r"\S*(contactfpga build|python -m contactfpga_sim.verify.netlist.replay)"
    (command,) = (line for line in printed if re.match(started, line))
    words = shlex.split(command)
    assert words[words.index(option) + 1] == name
    assert "icestick" in words
    assert not list(tmp_path.rglob("owned"))


def test_the_python_that_is_named_may_have_spaces_in_its_path(tmp_path):
    named = tmp_path / "my  own" / "python $x"
    named.parent.mkdir()
    named.symlink_to(sys.executable)
    done = make(clone(tmp_path / "clone"), "check", f"PYTHON={str(named).replace('$', '$$')}")
    assert f": {named}\n" in done.stdout


def test_a_python_that_does_not_exist_is_reported(tmp_path):
    done = make(clone(tmp_path / "clone"), "check", "PYTHON=/no such/python")
    assert done.returncode == 2
    assert "    /no such/python: not found\n" in done.stderr
