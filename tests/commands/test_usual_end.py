"""Commands that run until Ctrl-C: it ends them cleanly, with status 0, and so does the signal TERM."""

import itertools
import os
import signal
import subprocess
import sys

import pytest
from fake_board import FakeBoard, wait_until
from net_processes import free_endpoint
from sample import sample
from terminals import OnTerminal, environment

import contactfpga
from contactfpga.tools import cli
from contactfpga.tools.console import interrupt

CELLS = contactfpga.Skin(rows=3, columns=6, report="cells", settle_us=20.0)
RUNNING = {
    "zones PORT": "frame at",
    "zones --json PORT": '"time_us"',
    "wire PORT": "pressed (row, column)",
    "view --no-browser PORT": "Ctrl-C ends it",
    "record FILE PORT": "Ctrl-C ends it",
    "publish --listen ENDPOINT PORT": "zenoh://",
    "ros --domain 89 PORT": "Ctrl-C ends it",
}
"""What each shows once it runs."""
NEEDS = {"ros": "cyclonedds", "publish": "zenoh", "view": "viser", "record": "mcap"}


@pytest.mark.parametrize(
    ("words", "number"),
    sample(
        itertools.product(RUNNING, interrupt.SIGNALS),
        quick=[(list(RUNNING)[-1], signal.SIGINT), (list(RUNNING)[-2], signal.SIGTERM)],
    ),
)
def test_it_is_the_usual_end(words, number, tmp_path):
    pytest.importorskip(NEEDS.get(words.split()[0], "rich"))
    with FakeBoard(CELLS) as board:
        board.stream = board.frame
        named = {"PORT": board.path, "FILE": tmp_path / "x.mcap", "ENDPOINT": free_endpoint()}
        arguments = [str(named.get(word, word)) for word in [*words.split(), "--timeout", "60"]]
        terminal = OnTerminal([sys.executable, "-m", "contactfpga.tools.cli", *arguments], 80)
        try:
            wait_until(lambda: terminal.process.poll() is not None or RUNNING[words] in terminal.said, 60)
            terminal.process.send_signal(number)
            status, said = terminal.wait(60), terminal.said[-2000:]
        finally:
            terminal.process.kill()
    assert status == 0, said
    for word in ("Traceback", "Exception", "Error"):
        assert word not in said, said


def test_what_is_asked_to_do_one_thing_is_cut_short(board, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(contactfpga.Board, "next", interrupted)
    assert cli.main(["zones", "--once", board.path]) == 130


def test_term_is_handled_as_before_when_a_command_is_done():
    before = signal.getsignal(signal.SIGTERM)

    def body():
        with interrupt.usual_end():
            os.kill(os.getpid(), signal.SIGTERM)
            pytest.fail("TERM did not end it")
        return 7

    assert interrupt.guarded(body) == 7
    assert signal.getsignal(signal.SIGTERM) is before


PRINTS = """
import sys
from contactfpga import terminal
from contactfpga.tools.console import interrupt

def body():
    SAY
    terminal.say("shown", sys.stderr)

sys.exit(interrupt.guarded(body))
"""
NO_ROOM = "contactfpga: there is no room where the output goes: No space left on device\n"


@pytest.mark.parametrize(
    ("streams", "say", "status", "errors"),
    [
        (">&-", 'terminal.say("shown")', 0, "shown\n"),
        ("2>&-", 'terminal.say("shown")', 0, ""),
        (">/dev/full", 'terminal.say("shown")', 1, NO_ROOM),
        (">/dev/full", 'print("shown")', 1, "shown\n" + NO_ROOM),  # which Python keeps until the end
        ("| true", 'sys.stdin.read(); print("shown")', 0, "shown\n"),
    ],
)
def test_output_that_goes_nowhere(streams, say, status, errors):
    """A shell's `>&-` closes standard output: Python then has none."""
    if "full" in streams and not os.path.exists("/dev/full"):
        pytest.skip("this system has no full device")
    buffered = {name: value for name, value in environment().items() if name != "PYTHONUNBUFFERED"}
    shell = f'set -o pipefail; "$@" {streams}'
    command = ["bash", "-c", shell, "bash", sys.executable, "-c", PRINTS.replace("SAY", say)]
    done = subprocess.run(command, input="", capture_output=True, text=True, env=buffered, timeout=250, check=False)
    assert (done.returncode, done.stderr) == (status, errors)
