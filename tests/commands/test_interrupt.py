"""Ctrl-C and TERM: every command ends at once, without a traceback, and leaves no process behind; those that run until
Ctrl-C end with status 0."""

import itertools
import os
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from child_processes import alive, descendants
from fake_board import FakeBoard, wait_until
from net_processes import free_endpoint
from sample import sample
from terminals import OnTerminal, environment, listening

import contactfpga
from contactfpga.tools.console import interrupt

POOLS = {
    "chart": "study chart --placements 125 --no-size --output OUT",
    "fit": "fit examples/scenes-bumper.toml --cover bare --placements 80",
}
"""Commands that have processes work for them."""


def interrupted(arguments, ready, keys, folder):
    """Output of a command that is interrupted when ``ready(terminal)``: by a key on its terminal, or by a signal to its
    first process alone. It ends as it should, and nothing that it started is left."""
    command = [sys.executable, "-m", "contactfpga.tools.cli", *arguments.replace("OUT", str(folder / "out")).split()]
    terminal = OnTerminal(command, 80, CONTACTFPGA_CACHE=str(folder / "cache"))
    try:
        wait_until(lambda: terminal.process.poll() is not None or ready(terminal), pause_s=0.05)
        assert terminal.process.poll() is None, terminal.said[-1000:]
        below = descendants(terminal.process.pid)
        terminal.type("\x03") if keys else terminal.process.send_signal(signal.SIGINT)
        status, said = terminal.wait(), terminal.said[-2000:]
        wait_until(lambda: not any(map(alive, below)))
    finally:
        terminal.process.kill()
    assert status == 130, said
    for word in ("Traceback", "Unused", "Warning", "Exception ignored", "KeyboardInterrupt"):
        assert word not in said, said
    return " ".join(said.split())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "keys"),
    sample(itertools.product(POOLS, (True, False)), quick=[("chart", True), ("fit", False)]),
)
def test_commands_with_processes_end_with_all_of_them(name, keys, tmp_path):
    def ready(terminal):
        return len(descendants(terminal.process.pid)) >= 2 and time.monotonic() > started + 2

    started = time.monotonic()
    interrupted(f"{POOLS[name]} --jobs 2", ready, keys, tmp_path)


@pytest.mark.slow
def test_what_was_done_is_kept(tmp_path):
    def ready(terminal):
        return any(int(done) >= 3 for done in re.findall(r"(\d+)/\d+", terminal.said))

    said = interrupted("study chart --placements 12 --no-size --jobs 2 --output OUT", ready, True, tmp_path)
    (kept,) = (tmp_path / "out").iterdir()
    lines = kept.read_text().splitlines()
    assert "-so-far." in kept.name
    assert len(lines) > 1
    assert f"interrupted; {len(lines) - 1} of " in said


BUILDS = (
    ("zones sim://?skin=SKIN", "elaborate"),
    ("zones sim://?skin=SKIN", "compile"),
    ("board --skin SKIN", "yosys"),
    ("replay FRAMES", "elaborate"),
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "step", "keys"),
    sample(
        [(*build, keys) for build in BUILDS for keys in (True, False)],
        quick=[(*BUILDS[1], True), (*BUILDS[3], False)],
    ),
)
def test_the_gateware_being_built_is_no_more_than_that(words, step, keys, tmp_path):
    """The package carries no board for this Skin, so it has to be built."""
    np.save(tmp_path / "frames.npy", np.zeros((4, 8, 8), bool))
    (tmp_path / "skin.toml").write_text("rows = 8\ncolumns = 8\n")
    words = words.replace("FRAMES", str(tmp_path / "frames.npy")).replace("SKIN", str(tmp_path / "skin.toml"))
    interrupted(words, lambda terminal: f": {step}" in terminal.said, keys, tmp_path)


WAITS = """
import sys, time
from contactfpga.tools.console import interrupt

def body():
    print("waits", flush=True)
    time.sleep(9000)

sys.exit(interrupt.guarded(body))
"""


def test_a_command_listens_even_where_its_shell_would_have_it_ignore_the_signal():
    """As a shell does for what it starts with &."""

    def deaf():
        signal.signal(signal.SIGINT, signal.SIG_IGN)

    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    with subprocess.Popen(
        [sys.executable, "-c", WAITS], **pipes, text=True, preexec_fn=deaf, env=environment()
    ) as process:
        assert process.stdout.readline() == "waits\n"
        process.send_signal(signal.SIGINT)
        assert process.wait() == 130
        assert process.stdout.read() == ""


WORKERS = """
import os, subprocess, sys, time
from contactfpga_sim.apps import pool

def work(number):
    subprocess.run(["sleep", "9000"])

with pool.executor(2, None) as workers:
    found = [workers.submit(work, number) for number in range(20)]
    print("started", flush=True)
    if not sys.stdin.readline():
        raise ValueError("on the way")
    for one in found:
        one.result()
"""


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL, signal.SIGHUP, None])
def test_no_worker_outlives_the_pool(how, tmp_path):
    """Whatever ends it, what its workers have started included."""
    file = tmp_path / "workers.py"
    file.write_text(WORKERS)
    pipes = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
    with subprocess.Popen([sys.executable, file], **pipes, preexec_fn=listening, env=environment()) as process:
        process.stdout.readline()
        wait_until(lambda: sum("sleep 9000" in line for line in descendants(process.pid).values()) == 2, pause_s=0.05)
        below = descendants(process.pid)
        assert len(below) >= 4
        process.send_signal(how) if how else process.stdin.close()
        process.stdout.read()
        process.wait()
        wait_until(lambda: not any(map(alive, below)))


# ---- commands that run until Ctrl-C


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
"""The text that each command shows once it runs."""
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
            wait_until(lambda: terminal.process.poll() is not None or RUNNING[words] in terminal.said)
            terminal.process.send_signal(number)
            status, said = terminal.wait(), terminal.said[-2000:]
        finally:
            terminal.process.kill()
    assert status == 0, said
    for word in ("Traceback", "Exception", "Error"):
        assert word not in said, said


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
