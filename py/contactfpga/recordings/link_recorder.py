"""One board that is being recorded: takes what comes and writes it."""

from __future__ import annotations

import collections
import contextlib
import threading

from contactfpga.driver.board import Board
from contactfpga.driver.silence import Silence
from contactfpga.driver.told import Told
from contactfpga.errors import ContactFPGAError, ReadTimeout, ReplayEnded, SkinMismatch, VersionMismatch
from contactfpga.recordings import messages
from contactfpga.recordings.recorder import LinkFile
from contactfpga.recordings.whole_file import RecordingFailed
from contactfpga.ros import convert
from contactfpga.ros.cdr import encode
from contactfpga.ros.markers import markers, outline
from contactfpga.tracking.tracker import Tracker
from contactfpga.wire.faults import Faults
from contactfpga.zones.units import UnitSamples
from contactfpga.zones.zone import Zones

QUEUE = 1 << 16
"""Frames that wait to be written as messages; what they were made of is written first."""
TURN_S = 0.01
"""How often bytes are written."""
BATCH_BYTES = 2048
"""Of which so many are written at once: about 100 frames with a zone each."""
DRAWN_S = 1 / 30
"""How often what 3-D programs show is written."""
WORLD = "world"
"""The frame that a board lies in which is on no robot."""
NOWHERE = (0.0,) * 3, (0.0,) * 3


class Buffer:
    """A tap whose bytes wait to be written."""

    def __init__(self) -> None:
        self._pieces: collections.deque[tuple[bytes, float]] = collections.deque()
        self._bytes = 0
        self._lock = threading.Lock()

    def take(self, data: bytes, clock_s: float) -> None:
        """Bytes that came then."""
        if data:
            with self._lock:
                self._pieces.append((data, clock_s))
                self._bytes += len(data)

    def close(self) -> None:
        """What waits can still be taken out."""

    def due(self, clock_s: float) -> bool:
        """Whether enough waits, or for long enough."""
        return self._bytes >= BATCH_BYTES or (bool(self._pieces) and clock_s - self._pieces[0][1] >= TURN_S)

    def drain(self) -> tuple[bytes, float]:
        """All that waits, and when its last byte came."""
        with self._lock:
            data, moment = b"".join(piece for piece, _ in self._pieces), self._pieces[-1][1] if self._pieces else 0.0
            self._pieces.clear()
            self._bytes = 0
        return data, moment


class LinkRecorder:
    """Writes what a board says until it is stopped, the recording that it plays ends, or the port is lost."""

    def __init__(self, board: Board, buffer: Buffer, link: LinkFile, bytes_only: bool = False):
        self.board = board
        self.frames = 0
        """Frames that were taken."""
        self.seconds = 0.0
        """How long it has been recorded: on the board's clock, of a recording in device time."""
        self.notes: list[str] = []
        """What a user should hear of."""
        self.error: ContactFPGAError | None = None
        """Why it ended before it was stopped."""
        self._buffer = buffer
        self._link = link
        self._bytes_only = bytes_only
        self._tracker = Tracker()
        self._drawn_s = -1.0
        self._last_us = 0
        self._begun_s: float | None = None
        self._rim = outline(board.sheet)

    def run(self, stop: threading.Event, seconds: float | None = None) -> None:
        """Record, in a thread of its own."""
        try:
            with self.board.events(QUEUE) as events:
                self._take(self.board.next())  # the answer to the first hello came before there were events
                while not stop.is_set() and (seconds is None or self.seconds < seconds):
                    try:
                        self._take(events.next(TURN_S))
                    except ReadTimeout:
                        self._take(None)
                    except (SkinMismatch, VersionMismatch) as told:
                        self.notes.append(str(told))
                if events.dropped:
                    self.notes.append(
                        f"{self._link.name}: {events.dropped} frames came faster than messages could be written of "
                        "them; their bytes are in the file. Leave messages out with --bytes-only"
                    )
        except ReplayEnded:
            pass
        except ContactFPGAError as error:
            self.error = error

    def finish(self) -> None:
        """Close the board and write what is left."""
        self.board.close()
        with contextlib.suppress(RecordingFailed):  # was told before
            self._drain()

    def _take(self, item: Zones | Told | Silence | None) -> None:
        clock_s = self._clock_s(item)
        if isinstance(item, Zones):
            self.frames += 1
        if not self._bytes_only:
            self._write(item, clock_s)
        if self._buffer.due(clock_s):
            self._drain()
        if item is None:
            self._link.turn()

    def _clock_s(self, item: object) -> float:
        """Now; of a recording, which has no clock, the time of its last frame."""
        if isinstance(item, Zones):
            self._last_us = item.time_us
        now_s = self.board.clock() if self.board.live else self._last_us / 1e6
        self._begun_s = now_s if self._begun_s is None else self._begun_s
        self.seconds = max(self.seconds, now_s - self._begun_s)
        return now_s

    def _drain(self) -> None:
        data, clock_s = self._buffer.drain()
        if data:
            self._link.take_bytes(data, clock_s if self.board.live else self._last_us / 1e6)

    def _write(self, item: Zones | Told | Silence | None, clock_s: float) -> None:
        link = self._link
        time_ns = link.time_ns(clock_s)
        if isinstance(item, Zones):
            self._write_frame(item, clock_s)
        elif isinstance(item, Faults):
            link.write("faults", messages.FAULTS, messages.of_faults(item.names, time_ns, link.name), clock_s)
        elif isinstance(item, UnitSamples):
            link.write("units", messages.UNITS, messages.of_units(item, time_ns, link.name), clock_s)

    def _write_frame(self, zones: Zones, clock_s: float) -> None:
        """A frame; contacts whenever something happens to them, and now and then, with what 3-D programs show."""
        link = self._link
        sampled_s = clock_s if zones.host_time_s is None else zones.host_time_s
        head = convert.header(link.time_ns(sampled_s), link.name)
        sigma_s = getattr(zones, "host_sigma_s", None)
        link.write("zones", messages.ZONES, encode(messages.ZONES, convert.zones(zones, head, sigma_s)), clock_s)
        tracks = self._tracker.update(zones)
        drawn = clock_s - self._drawn_s >= DRAWN_S or clock_s < self._drawn_s
        if drawn or tracks.events:
            told = convert.tracks(tracks, tracks.events, tracks.restarted, head)
            link.write("tracks", messages.TRACKS, encode(messages.TRACKS, told), clock_s)
        if drawn:
            self._drawn_s = clock_s
            shown = markers(self._rim, tracks.active, head)
            link.write("markers", messages.MARKERS, encode(messages.MARKERS, shown), clock_s)
            world = convert.transform(convert.header(link.time_ns(clock_s), WORLD), link.name, *NOWHERE)
            link.write("/tf", messages.TRANSFORMS, encode(messages.TRANSFORMS, world), clock_s)
