"""Delay from the last byte to user code, with a reader in C or Python, beside a C program."""

from __future__ import annotations

import contextlib
import shutil
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

import contactfpga
from contactfpga.errors import ContactFPGAError, MissingTool
from contactfpga_sim.lab.reader.feeder import SKIN, Feeder, Pace

LEFT_OUT = 0.15
"""Ignored share of a stream's beginning."""
OPEN_S = 60.0
ENDED_S = 0.8
BEGUN = 20
"""Frames that begin a stream."""
READERS = ("native", "thread")


class Found(NamedTuple):
    us: np.ndarray
    """Delay from the last byte's write to user code, by returned call."""
    calls: float


@contextlib.contextmanager
def bare_program() -> Iterator[Path]:
    """The C program, compiled."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        raise MissingTool("comparing with a C program", "cc", "apt install gcc")
    with tempfile.TemporaryDirectory() as folder:
        built = Path(folder, "bare")
        source = Path(__file__).with_name("bare.c")
        subprocess.run([compiler, "-std=c99", "-O2", "-Ic", "-o", built, source], check=True)
        yield built


def _times(numbers: np.ndarray, seconds: np.ndarray, feeder: Feeder) -> Found:
    places = numbers - feeder.first[0]
    counted = (places > feeder.end.value * LEFT_OUT) & (places < feeder.end.value)
    places, seconds = places[counted], seconds[counted]
    if len(seconds) < 2:
        raise ContactFPGAError("too few calls returned; measure when less runs beside it")
    span = seconds[-1] - seconds[0]
    return Found((seconds - np.array(feeder.written_s)[places]) * 1e6, (len(seconds) - 1) / span)


def bare(program: Path, pace: Pace) -> Found:
    with contextlib.closing(Feeder(1, pace)) as feeder, tempfile.NamedTemporaryFile() as file:
        command = [str(program), feeder.ports[0], str(pace.step_us), file.name]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL) as running:
            feeder.begin()
            assert running.wait(OPEN_S) == 0
        numbers, seconds = np.fromfile(file.name).reshape(-1, 2).T
        return _times(numbers.astype(int), seconds, feeder)


def driver(reader: str, pace: Pace, busy: bool, call: str = "latest") -> Found:
    """Result of the driver; ``busy``: beside a computing Python thread."""
    numbers: list[int] = []
    seconds: list[float] = []
    with contextlib.closing(Feeder(1, pace)) as feeder:
        with contactfpga.open(feeder.ports[0], SKIN, timeout=OPEN_S, reader=reader) as board, computing(busy):
            take: Callable[[float], contactfpga.Zones] = getattr(board, call)
            feeder.begin()
            with contextlib.suppress(contactfpga.ReadTimeout):
                while True:
                    numbers.append(take(ENDED_S if len(seconds) > BEGUN else OPEN_S).time_us // pace.step_us)
                    seconds.append(time.monotonic())
            del numbers[len(seconds) :]
            assert not board.stats.lost
        return _times(np.array(numbers), np.array(seconds), feeder)


@contextlib.contextmanager
def computing(busy: bool) -> Iterator[None]:
    """If ``busy``, compute in a thread."""
    done: list[bool] = []

    def compute() -> None:
        value = 0
        while not done:
            value += 1

    thread = threading.Thread(target=compute, daemon=True)
    if busy:
        thread.start()
    try:
        yield
    finally:
        done.append(True)
        if busy:
            thread.join()
