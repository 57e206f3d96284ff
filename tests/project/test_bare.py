"""A machine with nothing but a Python, make and a C++ compiler: what is hidden there, and what a run says of it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

pytestmark = pytest.mark.skipif(os.name == "nt", reason="scripts/bare is a shell script")


def bare(*command, **variables):
    return subprocess.run(
        [ROOT / "scripts" / "bare", *command],
        env=os.environ | {"PYTHON": sys.executable} | variables,
        capture_output=True,
        text=True,
        timeout=250,
    )


def test_only_the_named_programs_are_found(tmp_path):
    for name in ("clang", "iverilog", "ngspice", "chromium", "git", "g++", "sed"):
        (tmp_path / name).write_text("#!/bin/sh\n")
        (tmp_path / name).chmod(0o755)
    look = 'for name in clang iverilog ngspice chromium git g++ sed; do command -v $name; done; echo "$PATH"'
    found, path = bare("sh", "-c", look, PATH=f"{tmp_path}:{os.environ['PATH']}").stdout.rsplit("\n", 2)[:2]
    assert [Path(line).name for line in found.split()] == ["g++", "sed"]
    assert not Path(path).exists()


def test_status_and_python_are_the_commands_own():
    assert bare("sh", "-c", "exit 3").returncode == 3
    assert bare("python3", "-c", "import sys; print(sys.prefix)").stdout.strip() == sys.prefix


def test_a_run_says_in_one_line_what_it_skipped():
    # ngspice is the absent tool, as the folder of links is all that is left of PATH.
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-n", "0", "tests/circuit/test_spice.py"]
    done = subprocess.run(
        command, cwd=ROOT, env=os.environ | {"PATH": "/nowhere"}, capture_output=True, text=True, timeout=250
    )
    (line,) = [line for line in done.stdout.splitlines() if line.startswith("Skipped: ")]
    assert "ngspice is not installed (" in line
