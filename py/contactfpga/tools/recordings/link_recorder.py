"""One board that is being recorded: takes what comes and writes it."""

from __future__ import annotations

import collections
import contextlib
import math
import threading
import time

from contactfpga.driver.board import Board
from contactfpga.driver.events import Silence
from contactfpga.driver.subscription import Events
from contactfpga.errors import ContactFPGAError, ReadTimeout, ReplayEnded, SkinMismatch, VersionMismatch
from contactfpga.robot.haptics import WithReadings
from contactfpga.tools.recordings.link_messages import LinkMessages
from contactfpga.tools.recordings.mcap_file import RecordingFailed
from contactfpga.tools.recordings.recorder import LinkFile
from contactfpga.zones.zone import Zones

QUEUE = 1 << 16
"""Frames that wait to be written as messages; what they were made of is written first."""
POLL_S = 0.01
"""How often bytes are written."""
END_S = 1.0
"""How long frames that wait at the end are written as messages."""
AT_ONCE_S = 1e-6
BATCH_BYTES = 2048
"""Of which so many are written at once: about 100 frames with a zone each."""


class Buffer:
    """A tap whose bytes wait to be written."""

    events: Events
    """All that the board says, from the first byte on."""

    def __init__(self) -> None:
        self._pieces: collections.deque[tuple[bytes, float]] = collections.deque()
        self._bytes = 0
        self._taken = 0  # bytes in all
        self._ended = False
        self._lock = threading.Lock()

    def opened(self, board: Board) -> None:
        """Listen to a board before its first byte."""
        self.events = board.events(QUEUE)

    def take(self, data: bytes, clock_s: float) -> None:
        """Bytes that came then."""
        with self._lock:
            if data and not self._ended:
                self._pieces.append((data, clock_s))
                self._bytes += len(data)
                self._taken += len(data)

    def end_at(self, count: int) -> bool:
        """Take no more once this many bytes were taken in all; returns whether that is so."""
        with self._lock:
            self._ended = self._ended or self._taken == count
            return self._ended

    def close(self) -> None:
        """What waits can still be taken out."""

    def due(self, clock_s: float) -> bool:
        """Whether enough waits, or for long enough."""
        return self._bytes >= BATCH_BYTES or (bool(self._pieces) and clock_s - self._pieces[0][1] >= POLL_S)

    def drain(self) -> tuple[bytes, float]:
        """All that waits, and when its last byte came."""
        with self._lock:
            data, moment = b"".join(piece for piece, _ in self._pieces), self._pieces[-1][1] if self._pieces else 0.0
            self._pieces.clear()
            self._bytes = 0
        return data, moment


class LinkRecorder:
    """Writes what a board says until it is stopped, the recording that it plays ends, or the port is lost. ``events``:
    of the board, from the first one on. Without ``said`` it writes the bytes alone. ``late``: a frame is taken once its
    readings of pressure units have come."""

    def __init__(
        self,
        board: Board,
        events: Events,
        buffer: Buffer,
        link: LinkFile,
        said: LinkMessages | None,
        late: bool = False,
    ):
        self.board = board
        self.name = link.name
        self.frames = 0
        """Frames that were taken."""
        self.seconds = 0.0
        """How long it has been recorded: on the board's clock, of a recording in device time."""
        self.notes: list[str] = []
        """What a user should hear of."""
        self.error: ContactFPGAError | None = None
        """Why it ended before it was stopped."""
        self._events = events
        self._buffer = buffer
        self._link = link
        self._said = said
        self._late = late
        self._last_us = 0
        self._begun_s: float | None = None
        self._left: int | None = None  # what waits at the end

    def run(self, stop: threading.Event, seconds: float | None = None) -> None:
        """Record, in a thread of its own."""
        try:
            with self._events:
                frames = WithReadings(self) if self._late else self
                while not stop.is_set() and (seconds is None or self.seconds < seconds):
                    try:
                        self._take(frames.next(POLL_S))
                    except ReadTimeout:
                        self._pause()
                    except (SkinMismatch, VersionMismatch) as told:
                        self.notes.append(str(told))
                left = self._take_rest(frames)
                if left := left + self._events.dropped:
                    self.notes.append(
                        f"{self.name}: {left} frames came faster than messages could be written of them; their "
                        "bytes are in the file. Leave messages out with --bytes-only"
                    )
        except ReplayEnded:
            pass
        except ContactFPGAError as error:
            self.error = error

    def next(self, timeout: float = 1.0) -> Zones:
        """The next frame; what comes before it is written."""
        while True:
            if self._left == 0:
                raise ReadTimeout(f"{self.name}: nothing more is to be recorded")
            item = self._events.next(timeout)
            self._left = None if self._left is None else self._left - 1
            if isinstance(item, Zones):
                return item
            clock_s = self._clock_s()
            if self._said is not None and not isinstance(item, Silence):
                self._said.told(item, clock_s)
            self._drain()

    def finish(self) -> None:
        """Close the board and write what is left."""
        self.board.close()
        with contextlib.suppress(RecordingFailed):  # was told before
            self._drain(rest=True)

    def _take(self, zones: Zones) -> None:
        self._last_us = zones.time_us
        clock_s = self._clock_s()
        self.frames += 1
        if self._said is not None:
            self._said.frame(zones, clock_s)
        self._drain()

    def _take_rest(self, frames: WithReadings | LinkRecorder) -> int:
        """Frames of the bytes that have come by the end, for a while; how many are left."""
        until, left = time.monotonic() + END_S, 0
        with contextlib.suppress(ReadTimeout):
            self._left = self._events.settle(self._buffer.end_at)
        with contextlib.suppress(ReadTimeout):
            while True:
                zones = frames.next(AT_ONCE_S)
                if time.monotonic() < until:
                    self._take(zones)
                else:
                    left += 1
        return left

    def _pause(self) -> None:
        self._clock_s()
        self._drain()
        self._link.poll()

    def _clock_s(self) -> float:
        """Now; of a recording, which has no clock, the time of its last frame."""
        now_s = self.board.clock() if self.board.live else self._last_us / 1e6
        self._begun_s = now_s if self._begun_s is None else self._begun_s
        self.seconds = max(self.seconds, now_s - self._begun_s)
        return now_s

    def _drain(self, rest: bool = False) -> None:
        if self._buffer.due(math.inf if rest else self.board.clock()):
            data, clock_s = self._buffer.drain()
            self._link.take_bytes(data, clock_s if self.board.live else self._last_us / 1e6)
