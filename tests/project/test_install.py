"""What `make` shows of pip: a line, and where it fails the end of what pip said."""

import subprocess
import sys
from pathlib import Path

import pytest
from fake_board import patiently
from terminals import OnTerminal

ROOT = Path(__file__).resolve().parents[2]

PIP = """
import os, sys, time
print("arguments:", sys.argv[1:])
print('Processing ./package.whl')
for number in range(39):
    print(f"Collecting package-{number}", flush=True)
time.sleep(float(os.environ.get("PAUSE", 0)))
print("Installing collected packages: a, b", flush=True)
time.sleep(float(os.environ.get("PAUSE", 0)))
print("ERROR: no room" if "--fail" in sys.argv else "Successfully installed a-1 b-2", file=sys.stderr)
sys.exit(3 if "--fail" in sys.argv else 0)
"""


@pytest.fixture
def install(tmp_path):
    """The command, with a pip that only talks, and the file of its words."""
    (tmp_path / "pip").mkdir()
    (tmp_path / "pip/__init__.py").touch()
    (tmp_path / "pip/__main__.py").write_text(PIP)
    log = tmp_path / "install.log"
    return [sys.executable, str(ROOT / "scripts/install.py"), str(log), "--editable", ".[sim]"], log


def run(command, log):
    return subprocess.run(command, capture_output=True, text=True, env={"PYTHONPATH": str(log.parent)}, timeout=250)


def test_pips_words_go_to_a_file(install):
    command, log = install
    done = run(command, log)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    words = log.read_text().splitlines()
    assert words[0].endswith("'--progress-bar', 'off', '--editable', '.[sim]']")
    assert words[-1] == "Successfully installed a-1 b-2"


def test_a_failure_shows_the_end_of_them_and_where_they_are(install):
    command, log = install
    done = run([*command, "--fail"], log)
    assert (done.returncode, done.stdout) == (3, "")
    lines = done.stderr.splitlines()
    assert lines[-2:] == ["ERROR: no room", f">>> pip failed; all of its words are in {log}"]
    assert lines[0] == "Collecting package-29"


def test_a_terminal_sees_how_far_it_is(install):
    command, log = install

    def shown(pause_s):
        terminal = OnTerminal(command, 80, PYTHONPATH=str(log.parent), PAUSE=str(pause_s))
        assert terminal.wait(200) == 0
        return terminal.said

    said = patiently(shown, lambda said: "fetching, 40" in said and "unpacking, 40" in said, (1.2, 6.0, 36.0))
    assert "fetching, 40 packages, " in said
    assert "unpacking, 40 packages, " in said
    assert "Collecting" not in said
    assert said.endswith("\r\033[K")
