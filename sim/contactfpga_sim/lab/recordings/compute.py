"""Cost of recordings, and loss after kill -9, for docs/recordings.md."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import signal
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import contactfpga
from contactfpga.recordings import Recording, Session
from contactfpga.skin import Skin
from contactfpga.tools.recordings.link_recorder import LinkRecorder
from contactfpga.tools.recordings.recover import recover
from contactfpga_sim.model.board.virtual import VirtualBoard

SKINS = {10_000: Skin(), 1_000: Skin(settle_us=61.5)}
"""Boards by approximate frame rate."""

_PIECE = struct.Struct("<dQ")
"""Arrival times of bytes, and their number."""


def finger(seconds: float) -> np.ndarray:
    """A fingertip that circles once per second."""
    rows, columns = np.mgrid[:16, :16]
    row, column = 7.5 + 5 * np.sin(6.28 * seconds), 7.5 + 5 * np.cos(6.28 * seconds)
    return (rows - row) ** 2 + (columns - column) ** 2 <= 2.5


@contextlib.contextmanager
def folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


def bytes_of(skin: Skin, seconds: float, path: Path) -> int:
    """Write a board's bytes under a circling finger; return the frames' number."""
    with contactfpga.open(VirtualBoard(skin, finger), record=path) as board:
        count = 1
        while board.clock() < seconds:
            board.next()
            count += 1
    return count


@dataclasses.dataclass(frozen=True)
class Cost:
    frames_per_s: float
    bytes_per_frame: float
    frames_per_cpu_s: float
    """Frames per CPU second, with all of the driver's work."""

    @property
    def mb_an_hour(self) -> float:
        return self.frames_per_s * self.bytes_per_frame * 3600 / 1e6


def cost(source: Path, seconds: float, into: Path, bytes_only: bool) -> Cost:
    """Record bytes again, as fast as they are read."""
    before = time.process_time()
    with Session(into, bytes_only=bytes_only) as session:
        session.add(f"replay://{source}", name="skin")
        session.start()
        while session.running:
            session.wait(1.0)
    cpu_s = time.process_time() - before
    return Cost(session.frames / seconds, session.size / session.frames, session.frames / cpu_s)


@dataclasses.dataclass(frozen=True)
class Loss:
    came: int
    lost: int
    lost_s: float
    """Time from the last recovered byte to the last arrived one."""


def loss(source: Path, seconds: float, place: Path) -> Loss:
    """Record a board in real time, kill the program, and recover its file."""
    place.mkdir()
    file, log = place / "killed.mcap", place / "log"
    child = subprocess.Popen([sys.executable, "-m", __name__, f"replay://{source}?pace=1", str(file), str(log)])
    try:
        while not (log.exists() and log.stat().st_size):
            time.sleep(0.01)
        time.sleep(seconds)
    finally:
        child.send_signal(signal.SIGKILL)
        child.wait()
    data = log.read_bytes()
    came = list(_PIECE.iter_unpack(data[: len(data) // _PIECE.size * _PIECE.size]))
    kept = sum(len(piece) for _, piece in Recording(recover(file).path).raw_bytes())
    last_s = max((moment for moment, count in came if count <= kept), default=came[0][0])
    return Loss(came[-1][1], came[-1][1] - kept, came[-1][0] - last_s)


def _record(port: str, file: str, log: str) -> None:
    descriptor = os.open(log, os.O_WRONLY | os.O_CREAT)
    count = 0

    take = LinkRecorder.take

    def logged(link: LinkRecorder, data: bytes, clock_s: float) -> None:
        nonlocal count
        take(link, data, clock_s)
        count += len(data)
        os.write(descriptor, _PIECE.pack(time.monotonic(), count))

    LinkRecorder.take = logged  # type: ignore[assignment, method-assign]
    with Session(file) as session:
        session.add(port, name="skin")
        session.start()
        while session.running:
            session.wait(1.0)


if __name__ == "__main__":
    _record(*sys.argv[1:])
