"""A file of a board's bytes as a recording that can be played from any moment on."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Protocol

from contactfpga.driver import driver
from contactfpga.driver.board import Board
from contactfpga.errors import ContactFPGAError, ReplayEnded
from contactfpga.skin.sheet import Sheet
from contactfpga.zones.zone import Zones


class Recorded(Protocol):
    """What can be played: a file of bytes, or one of :mod:`contactfpga.recordings`."""

    @property
    def duration_s(self) -> float:
        """From its first frame to its last one."""

    def frames(self, start_s: float = 0.0, end_s: float | None = None) -> Iterator[tuple[float, str, Zones]]:
        """Time from its beginning in s, name of the link, and frame, in order."""


class Clock:
    """Device times in us as seconds since the first one. They go on where a board was started again."""

    def __init__(self) -> None:
        self._before_us: int | None = None
        self._passed_us = 0

    def take(self, time_us: int) -> float:
        """The next frame's."""
        if self._before_us is not None:
            self._passed_us += max(0, time_us - self._before_us)
        self._before_us = time_us
        return self._passed_us / 1e6


@dataclasses.dataclass(frozen=True)
class _Piece:
    """What one read of the file gives."""

    frames: int
    last_s: float


class ByteRecording:
    """What ``contactfpga zones --record FILE`` writes: ``replay://FILE``."""

    def __init__(self, port: str, timeout: float = 1.0):
        self.port, self._timeout = port, timeout
        with self._opened() as board:
            self.sheet: Sheet = board.sheet
            self._pieces = list(_pieces(board))
        if not self._pieces:
            raise ContactFPGAError(f"{port} holds no frame that can be shown")

    def _opened(self) -> Board:
        return driver.open(self.port, timeout=self._timeout)

    @property
    def duration_s(self) -> float:
        return self._pieces[-1].last_s

    @property
    def count(self) -> int:
        """Frames in all."""
        return sum(piece.frames for piece in self._pieces)

    def frames(self, start_s: float = 0.0, end_s: float | None = None) -> Iterator[tuple[float, str, Zones]]:
        """As :meth:`Recorded.frames`; the link has no name. Frames before ``start_s`` are skipped at once."""
        clock = Clock()
        with self._opened() as board:
            for piece in self._pieces:
                if piece.last_s >= start_s:
                    break
                for time_us in board.batch(timeout=self._timeout).frames["time_us"].tolist():
                    clock.take(time_us)
            for zones in board:
                seconds = clock.take(zones.time_us)
                if end_s is not None and seconds > end_s:
                    return
                if seconds >= start_s:
                    yield seconds, "", zones


def _pieces(board: Board) -> Iterator[_Piece]:
    clock = Clock()
    while True:
        try:
            times_us = board.batch().frames["time_us"].tolist()
        except ReplayEnded:
            return
        seconds = [clock.take(time_us) for time_us in times_us]
        yield _Piece(len(seconds), seconds[-1])
