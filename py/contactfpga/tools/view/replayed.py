"""Recordings of one board, playable from any moment."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from contactfpga.driver import driver
from contactfpga.driver.address import REPLAY, Replay
from contactfpga.driver.board import Board
from contactfpga.driver.conversation import Conversation
from contactfpga.driver.mcap import MAGIC, SUFFIX, files_of
from contactfpga.errors import ContactFPGAError, ReplayEnded
from contactfpga.inputs.files import open_regular
from contactfpga.skin.sheet import Sheet
from contactfpga.zones.run import Run
from contactfpga.zones.zone import Zones

if TYPE_CHECKING:
    from contactfpga.tools.recordings import Recording


class BoardRecording(Protocol):
    title: str
    sheet: Sheet

    @property
    def duration_s(self) -> float:
        """Duration in s."""

    def frames(self, start_s: float = 0.0, end_s: float | None = None) -> Iterator[tuple[float, Zones]]:
        """Seconds from the beginning and frame, in order, from ``start_s`` up to ``end_s``."""

    def lateness(self) -> Iterator[tuple[float, float]]:
        """Seconds from the beginning and delay in s of bytes that ended a frame beyond the earliest; empty without
        arrival times.
        """


Reading = Callable[[int, int], object]
"""Receives the number of bytes read of a file, and its size."""


def silent(done: int, of: int) -> None:
    """Ignore the progress."""


def is_recording(name: str) -> bool:
    """Whether a name is a recording, not a port: ``replay://FILE``, or a file."""
    return name.startswith(REPLAY) or name.endswith(SUFFIX) or Path(name).is_file()


def load(name: str, link: str | None = None, timeout: float = 1.0, reading: Reading = silent) -> BoardRecording:
    """A recording by its path, or by ``replay://FILE``; ``link``: one of several in the file. ``reading``: receives the
    progress for a file without index.

    Raises :class:`~contactfpga.ContactFPGAError`, and :class:`~contactfpga.MissingExtra` for an MCAP file without
    ``[record]``.
    """
    port = name if name.startswith(REPLAY) else f"{REPLAY}{name}"
    asked = Replay.parse(port)
    link = link or asked.link
    if not _is_mcap(asked.path):
        if link is not None:
            raise ContactFPGAError(f"{asked.path} holds one board; --link is for files of `contactfpga record`")
        return ByteRecording(f"{REPLAY}{asked.path}", timeout, reading)
    from contactfpga.tools.recordings import Recording

    return LinkRecording(Recording(asked.path), link)


def _is_mcap(path: Path) -> bool:
    try:
        with open_regular(files_of(path)[0]) as file:
            return file.read(len(MAGIC)) == MAGIC
    except (OSError, RuntimeError, ValueError):  # which is said where it is opened
        return False


class Clock:
    """Device times in us as seconds since the first, continued over restarts of a board."""

    def __init__(self) -> None:
        self._before_us: int | None = None
        self._passed_us = 0

    def take(self, time_us: int) -> float:
        if self._before_us is not None:
            self._passed_us += max(0, time_us - self._before_us)
        self._before_us = time_us
        return self._passed_us / 1e6


@dataclasses.dataclass(frozen=True)
class _Piece:
    frames: int
    last_s: float


class ByteRecording:
    """The output of ``contactfpga zones --record FILE``: ``replay://FILE``."""

    def __init__(self, port: str, timeout: float = 1.0, reading: Reading = silent):
        self.title = self.port = port
        self._timeout = timeout
        self._pieces: list[_Piece] = []
        with self._opened() as board:
            self.sheet: Sheet = board.sheet
            size = Replay.parse(port).path.stat().st_size
            for piece in _pieces(board):
                self._pieces.append(piece)
                reading(board.stats.bytes, size)
        if not self._pieces:
            raise ContactFPGAError(f"{port} holds no frame that can be shown")

    def _opened(self) -> Board:
        return driver.open(self.port, timeout=self._timeout)

    @property
    def duration_s(self) -> float:
        return self._pieces[-1].last_s

    @property
    def count(self) -> int:
        return sum(piece.frames for piece in self._pieces)

    def lateness(self) -> Iterator[tuple[float, float]]:
        return iter(())

    def frames(self, start_s: float = 0.0, end_s: float | None = None) -> Iterator[tuple[float, Zones]]:
        """:meth:`BoardRecording.frames`; earlier frames are skipped at once."""
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
                    yield seconds, zones


class LinkRecording:
    """A board in the output of ``contactfpga record``."""

    def __init__(self, recording: Recording, link: str | None = None):
        links = recording.links
        self.named = link is not None
        """Whether this link was requested, or is the first."""
        if link is None:
            link = next(iter(links))
        if link not in links:
            raise ContactFPGAError(f"{recording.path} has no link {link!r}; it has {', '.join(links)}")
        self.recording, self._link = recording, link
        self.title = f"{recording.path.name}, {link}"
        self.sheet = links[link].sheet

    @property
    def duration_s(self) -> float:
        return self.recording.duration_s

    def frames(self, start_s: float = 0.0, end_s: float | None = None) -> Iterator[tuple[float, Zones]]:
        return ((seconds, zones) for seconds, _, zones in self.recording.frames(start_s, end_s, self._link))

    def lateness(self) -> Iterator[tuple[float, float]]:
        conversation = Conversation(self.title, live=False)
        found = []
        for seconds, data in self.recording.raw_bytes(self._link):
            if runs := [event for event in conversation.receive(data, 0.0) if isinstance(event, Run)]:
                found.append((seconds, seconds - runs[-1].times_us[-1] / 1e6))
        least = min((late for _, late in found), default=0.0)
        return ((seconds, late - least) for seconds, late in found)


def _pieces(board: Board) -> Iterator[_Piece]:
    clock = Clock()
    while True:
        try:
            times_us = board.batch().frames["time_us"].tolist()
        except ReplayEnded:
            return
        seconds = [clock.take(time_us) for time_us in times_us]
        yield _Piece(len(seconds), seconds[-1])
