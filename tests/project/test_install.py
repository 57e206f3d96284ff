"""What `make` shows of pip: a line, and where it fails the end of what pip said."""

import subprocess
import sys
from pathlib import Path

import pytest
from fake_board import wait_until
from terminals import OnTerminal

ROOT = Path(__file__).resolve().parents[2]

PIP = """
import os, sys, time
def wait_for(step):
    while "STEPS" in os.environ and not os.path.exists(os.environ["STEPS"] + step):
        time.sleep(0.01)
print("arguments:", sys.argv[1:])
print('Processing ./package.whl')
for number in range(39):
    print(f"Collecting package-{number}", flush=True)
wait_for("fetching")
print("Installing collected packages: a, b", flush=True)
wait_for("unpacking")
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

    terminal = OnTerminal(command, 80, PYTHONPATH=str(log.parent), STEPS=f"{log.parent}/")
    for step in ("fetching", "unpacking"):
        wait_until(lambda step=step: f"{step}, 40 packages, " in terminal.said)
        (log.parent / step).touch()
    assert terminal.wait() == 0
    assert "Collecting" not in terminal.said
    assert terminal.said.endswith("\r\033[K")
