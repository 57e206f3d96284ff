"""One board under recording: its data as bytes, and as messages for other programs."""

from __future__ import annotations

import collections
import contextlib
import dataclasses
import itertools
import json
import math
import re
import threading
import time
from collections.abc import Iterable
from typing import Protocol

from contactfpga.driver.board import Board
from contactfpga.driver.events import Silence
from contactfpga.errors import ContactFPGAError, ReadTimeout, ReplayEnded, SkinMismatch, VersionMismatch
from contactfpga.robot.haptics import WithReadings
from contactfpga.robot.ros.feed import Felt, offset_ns
from contactfpga.tools.recordings.mcap_file import McapFile, RecordingFailed
from contactfpga.tools.recordings.messages import BYTES, LinkMessages, Mount, of_bytes
from contactfpga.wire.hello import Cutter
from contactfpga.zones.zone import Zones

QUEUE = 1 << 16
"""Most frames that wait to be written as messages."""
POLL_S = 0.01
END_S = 1.0
"""Time for writing the remaining frames at the end."""
AT_ONCE_S = 1e-6
BATCH_BYTES = 2048
"""Bytes per write: about 100 frames with a zone each."""


class Files(Protocol):
    """The files of a recording."""

    file: McapFile
    """The newest file."""
    lock: threading.RLock
    """Held while files are written or change."""

    def poll(self) -> None:
        """Write old buffers, and begin a new file if due. Links call it often."""


class LinkRecorder:
    """Records one board into a recording's current file, until it is stopped, the played recording ends, or the
    port is lost.

    It is the board's :class:`~contactfpga.driver.recording.Tap`: the port's reader only adds to a buffer, which the
    link's own thread writes.
    """

    board: Board
    name: str
    topic: str
    """Beginning of the topics of its messages."""

    file: McapFile
    """Where its data go."""
    felt: Felt | None = None
    """From a frame to the forces at its zones; then frames wait for their readings of pressure units."""

    def __init__(self, files: Files, mount: Mount | None):
        self.frames = 0
        self.seconds = 0.0
        """Recorded time: on the board's clock, for a recording in device time."""
        self.notes: list[str] = []
        self.error: ContactFPGAError | None = None
        self._files, self._mount = files, mount
        self._said: LinkMessages | None = None
        self._last_us = 0
        self._begun_s: float | None = None
        self._waiting: int | None = None  # events at the end
        self._pieces: collections.deque[tuple[bytes, float]] = collections.deque()
        self._buffered = self._taken = 0  # bytes that wait, and in all
        self._ended = False
        self._lock = threading.Lock()
        self._cutter: Cutter | None = None

    # ---- for the port's reader

    def opened(self, board: Board) -> None:
        self.board, self._events = board, board.events(QUEUE)

    def take(self, data: bytes, clock_s: float) -> None:
        with self._lock:
            if data and not self._ended:
                self._pieces.append((data, clock_s))
                self._buffered += len(data)
                self._taken += len(data)

    def end_at(self, count: int) -> bool:
        """Stop after this many bytes in all; returns whether they have arrived."""
        with self._lock:
            self._ended = self._ended or self._taken == count
            return self._ended

    def close(self) -> None:
        """End; buffered bytes are still written."""

    # ---- for the session

    def begin(self, messages: bool) -> None:
        """Prepare for :meth:`run`."""
        self.file = self._files.file
        self._epoch_ns = offset_ns(time.time_ns, self.board.clock)
        self._said = LinkMessages(self, self._mount, self.felt) if messages else None

    def run(self, stop: threading.Event, seconds: float | None = None) -> None:
        """Record, in a thread of its own."""
        try:
            with self._events:
                frames = self if self.felt is None else WithReadings(self)
                while not stop.is_set() and (seconds is None or self.seconds < seconds):
                    try:
                        self._take(frames.next(POLL_S))
                    except ReadTimeout:
                        self._clock_s()
                        self._drain()
                        self._files.poll()
                    except (SkinMismatch, VersionMismatch) as mismatch:
                        self.notes.append(str(mismatch))
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
        """The next frame, after earlier data are written."""
        while True:
            if self._waiting == 0:
                raise ReadTimeout(f"{self.name}: nothing more is to be recorded")
            item = self._events.next(timeout)
            self._waiting = None if self._waiting is None else self._waiting - 1
            if isinstance(item, Zones):
                return item
            clock_s = self._clock_s()
            if self._said is not None and not isinstance(item, Silence):
                self._said.write_event(item, clock_s)
            self._drain()

    def finish(self) -> None:
        """Close the board and write what is left."""
        self.board.close()
        with contextlib.suppress(RecordingFailed):  # was reported before
            self._drain(rest=True)

    def wait_for_hello(self) -> None:
        """Continue in the newest file with the next hello."""
        self._cutter = Cutter()

    def switch(self) -> None:
        """Continue in the newest file now."""
        cutter, self._cutter = self._cutter, None
        if cutter is not None:
            self._write_bytes(cutter.held, self._written_s)
        self.file = self._files.file

    # ---- for messages

    def time_ns(self, clock_s: float) -> int:
        return self._epoch_ns + round(clock_s * 1e9)

    def write(self, what: str, kind: str, data: bytes, clock_s: float) -> None:
        topic, link = (what, None) if what.startswith("/") else (f"{self.topic}/{what}", self.name)
        with self._files.lock:
            self.file.write(topic, kind, link, self.time_ns(clock_s), data, time.monotonic())

    def _take(self, zones: Zones) -> None:
        self._last_us = zones.time_us
        clock_s = self._clock_s()
        self.frames += 1
        if self._said is not None:
            self._said.frame(zones, clock_s)
        self._drain()

    def _take_rest(self, frames: WithReadings | LinkRecorder) -> int:
        until, left = time.monotonic() + END_S, 0
        with contextlib.suppress(ReadTimeout):
            self._waiting = self._events.settle(self.end_at)
        with contextlib.suppress(ReadTimeout):
            while True:
                zones = frames.next(AT_ONCE_S)
                if time.monotonic() < until:
                    self._take(zones)
                else:
                    left += 1
        return left

    def _clock_s(self) -> float:
        now_s = self.board.clock() if self.board.live else self._last_us / 1e6
        self._begun_s = now_s if self._begun_s is None else self._begun_s
        self.seconds = max(self.seconds, now_s - self._begun_s)
        return now_s

    def _drain(self, rest: bool = False) -> None:
        """Write the buffered bytes if they are enough, or have waited for long enough."""
        # Before the lock, which the port's reader takes inside its own.
        now_s = math.inf if rest else self.board.clock()
        with self._lock:
            if not self._pieces or (self._buffered < BATCH_BYTES and now_s - self._pieces[0][1] < POLL_S):
                return
            data, clock_s = b"".join(piece for piece, _ in self._pieces), self._pieces[-1][1]
            self._pieces.clear()
            self._buffered = 0
        clock_s = clock_s if self.board.live else self._last_us / 1e6
        with self._files.lock:
            before, after = (data, b"") if self._cutter is None else self._cutter.take(data)
            self._write_bytes(before, clock_s)
            if after:
                self.switch()
                self._write_bytes(after, clock_s)
            self._files.poll()

    def _write_bytes(self, data: bytes, clock_s: float) -> None:
        self._written_s = clock_s
        if data:
            self.write("bytes", BYTES, of_bytes(data, self.time_ns(clock_s), self.name), clock_s)

    @property
    def facts(self) -> dict[str, str]:
        """Metadata for readers before the first byte."""
        hello = self.board.hello
        try:
            skin = self.board.skin.to_toml()
        except ContactFPGAError:
            skin = ""
        return {
            "link": self.name,
            "port": self.board.port,
            "fingerprint": hello.fingerprint.hex(),
            "sheet": json.dumps(dataclasses.asdict(hello.sheet)),
            "skin": skin,
        }


def topic_of(link: str, taken: Iterable[str]) -> str:
    """Topic of a link's messages, with underscores for characters that ROS does not allow, and with a number at its end
    if the topic is ``taken`` by another link.
    """
    name = re.sub(r"\W", "_", link, flags=re.ASCII)
    topic = f"/{name}" if name and not name[0].isdigit() else f"/_{name}"
    numbered = (f"{topic}_{number}" for number in itertools.count(2))
    return next(one for one in itertools.chain([topic], numbered) if one not in taken)
