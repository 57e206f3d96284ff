"""Ctrl-C: every command ends at once, without a traceback, and leaves no process behind."""

import itertools
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from child_processes import alive, descendants
from fake_board import wait_until
from sample import sample
from terminals import OnTerminal, environment, listening

from contactfpga.tools.console import interrupt
from contactfpga_sim.lab import pool

SOON_S = 2.0
"""Within which a command ends, on a machine with nothing else to do."""

SLACK_S = 58.0
"""What other work on this machine may add; what is interrupted would take longer."""

SCENES = "examples/scenes-bumper.toml"
POOLS = {
    "chart": (
        [
            "study",
            "chart",
            "--placements",
            "125",
            "--method",
            "run, 10 mm, bare",
            "--method",
            "run, 20 mm, tiles",
            "--no-size",
        ],
        2,
    ),
    "fit": (["fit", SCENES, "--cover", "bare", "--placements", "80"], 2),
    "arm": (["study", "arm", "--charts"], 2),
}
"""Commands that have processes work for them; and how many they have."""


def command(arguments):
    return [sys.executable, "-m", "contactfpga.tools.cli", *map(str, arguments)]


def interrupted(arguments, ready, keys, cache, **variables):
    """Status, seconds and output of a command that is interrupted when ``ready(process)``: by a key on its terminal, or
    by a signal to its first process alone. Nothing that it started may be left."""
    terminal = OnTerminal(command(arguments), 80, CONTACTFPGA_CACHE=str(cache), **variables)
    try:
        wait_until(lambda: terminal.process.poll() is not None or ready(terminal), 120, pause_s=0.05)
        assert terminal.process.poll() is None, terminal.said[-1000:]
        below = descendants(terminal.process.pid)
        started = time.monotonic()
        terminal.type("\x03") if keys else terminal.process.send_signal(signal.SIGINT)
        status = terminal.wait(SOON_S + SLACK_S)
        took = time.monotonic() - started
        wait_until(lambda: not any(map(alive, below)), SOON_S + SLACK_S)
        return status, took, terminal.said
    finally:
        terminal.process.kill()


def assert_well_ended(status, took, said):
    said = said[-2000:]
    assert status == 130, said
    assert took < SOON_S + SLACK_S, said
    for word in ("Traceback", "Unused", "Warning", "Exception ignored", "KeyboardInterrupt"):
        assert word not in said, said


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "keys"),
    sample(itertools.product(POOLS, (True, False)), quick=[("chart", True), ("fit", False)]),
)
def test_commands_with_processes_end_with_all_of_them(name, keys, tmp_path):
    arguments, workers = POOLS[name]
    output = [] if name == "fit" else ["--output", tmp_path / "out"]
    many = ["--jobs", workers, *output]

    def ready(terminal):
        return len(descendants(terminal.process.pid)) >= workers and time.monotonic() > started + 2

    started = time.monotonic()
    assert_well_ended(*interrupted([*arguments, *many], ready, keys, tmp_path / "cache"))


@pytest.mark.slow
def test_what_the_arm_has_done_is_kept(tmp_path):
    def ready(terminal):
        return any(int(done) >= 3 for done in re.findall(r"(\d+)/\d+", terminal.said))

    status, took, said = interrupted(
        ["study", "arm", "--charts", "--output", tmp_path], ready, True, tmp_path / "cache"
    )
    assert_well_ended(status, took, said)
    lines = (tmp_path / "arm-charts-so-far.csv").read_text().splitlines()
    assert len(lines) >= 4
    assert len(re.findall(rf"interrupted; {len(lines) - 1} of \d+ runs are in", " ".join(said.split()))) == 1
    assert not (tmp_path / "arm-charts.csv").exists()


@pytest.mark.campaign  # it has a board to compile first
def test_failures_keep_the_rows_that_are_finished(tmp_path):
    def ready(terminal):
        return any(int(done) >= 1 for done in re.findall(r"(\d+)/\d+", terminal.said))

    status, took, said = interrupted(["study", "failures", "--output", tmp_path], ready, True, tmp_path / "cache")
    assert_well_ended(status, took, said)
    assert "of the table, all that was finished, in" in " ".join(said.split())
    assert (tmp_path / "failures-so-far.md").read_text().startswith("| knob | method |")
    assert not (tmp_path / "failures.md").exists()


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
    """SKIN is none of those whose boards the package carries."""
    np.save(tmp_path / "frames.npy", np.zeros((4, 8, 8), bool))
    (tmp_path / "skin.toml").write_text("rows = 8\ncolumns = 8\n")
    words = words.replace("FRAMES", str(tmp_path / "frames.npy")).replace("SKIN", str(tmp_path / "skin.toml"))
    assert_well_ended(
        *interrupted(words.split(), lambda terminal: f": {step}" in terminal.said, keys, tmp_path / "cache")
    )


@pytest.mark.campaign  # which has the tools for it
@pytest.mark.parametrize("keys", [True, False], ids=["by a key", "by a signal"])
def test_place_and_route_ends_too(keys, tmp_path):
    def ready(terminal):
        return any("yosys" in line or "nextpnr" in line for line in descendants(terminal.process.pid).values())

    arguments = ["build", "icebreaker", "--output", tmp_path / "out"]
    assert_well_ended(*interrupted(arguments, ready, keys, tmp_path / "cache"))


WAITS = """
import sys, time
from contactfpga.tools.console import interrupt

def body():
    print("waits", flush=True)
    time.sleep(90)

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
        assert process.wait(SOON_S + SLACK_S) == 130
        assert process.stdout.read() == ""


WORKERS = """
import os, subprocess, sys, time
from contactfpga_sim.lab import pool

def work(number):
    subprocess.run(["sleep", "90"])

with pool.executor(2, None) as workers:
    found = [workers.submit(work, number) for number in range(20)]
    print("started", flush=True)
    if sys.argv[1] == "fail":
        time.sleep(1)
        raise ValueError("on the way")
    for one in found:
        one.result()
"""


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL, signal.SIGHUP, None])
def test_no_worker_outlives_the_pool(how, tmp_path):
    """Whatever ends it, what its workers have started included."""
    file = tmp_path / "workers.py"
    file.write_text(WORKERS)
    arguments = [sys.executable, file, "wait" if how else "fail"]
    with subprocess.Popen(
        arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=listening, env=environment()
    ) as process:
        process.stdout.readline()
        wait_until(lambda: sum("sleep 90" in line for line in descendants(process.pid).values()) == 2, pause_s=0.05)
        below = descendants(process.pid)
        assert len(below) >= 4
        started = time.monotonic()
        if how:
            process.send_signal(how)
        process.stdout.read()
        process.wait(SOON_S + SLACK_S)
        assert time.monotonic() - started < 1 + SOON_S + SLACK_S
        wait_until(lambda: not any(map(alive, below)), SOON_S + SLACK_S)


def test_a_pool_that_is_done_ends_as_usual():
    with pool.executor(2) as workers:
        assert list(workers.map(abs, [-1, -2, 3])) == [1, 2, 3]


def test_the_signal_is_handled_as_before_when_a_command_is_done():
    before = signal.getsignal(signal.SIGINT)
    assert interrupt.guarded(lambda: 3) == 3
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.parametrize("number", interrupt.SIGNALS)
def test_a_signal_that_numpy_drops_comes_again(number):
    """While it looks whether a type is one of ctypes: else a command that runs until a signal would never end."""

    class Kind(type):
        @property
        def __mro__(cls):
            signal.raise_signal(number)

    def body():
        assert np.dtype(Kind("Any", (), {})) == object, "the signal is dropped"
        time.sleep(SLACK_S)
        pytest.fail("it goes on")

    assert interrupt.guarded(body) == 128 + number


def test_a_signal_is_not_repeated_while_the_command_cleans_up():
    def body():
        try:
            signal.raise_signal(signal.SIGINT)
        finally:
            time.sleep(10 * interrupt.AGAIN_S)
            cleaned.append(True)

    cleaned = []
    assert (interrupt.guarded(body), cleaned) == (130, [True])


def test_an_interrupt_says_what_was_kept(capsys):
    def body():
        raise interrupt.Interruption("interrupted; 3 of 7 are kept")

    assert interrupt.guarded(body) == 130
    assert capsys.readouterr().err == "contactfpga: interrupted; 3 of 7 are kept\n"


@pytest.mark.parametrize("moment", range(2 * len(interrupt.SIGNALS)))
def test_a_signal_while_listening_begins_or_ends_is_no_traceback(moment, monkeypatch):
    """One comes right after each change of a handler, to ours and back to what it was."""
    changed, right = [], signal.signal

    def change(number, handler):
        before = right(number, handler)
        changed.append(number)
        if len(changed) == moment + 1 and signal.getsignal(signal.SIGINT) is interrupt._interrupt:
            signal.raise_signal(signal.SIGINT)
        return before

    monkeypatch.setattr(signal, "signal", change)
    try:
        status = interrupt.guarded(lambda: 0)
    finally:
        monkeypatch.undo()
        for number in interrupt.SIGNALS:
            signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
    assert status in (0, 130)
    assert moment or status == 130
