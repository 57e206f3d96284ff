"""One board under recording: its data as bytes, and as messages for other programs."""

from __future__ import annotations

import collections
import contextlib
import dataclasses
import math
import threading
import time

from contactfpga.driver.board import Board
from contactfpga.driver.events import SideEvent, Silence
from contactfpga.driver.subscription import Events
from contactfpga.errors import ContactFPGAError, ReadTimeout, ReplayEnded, SkinMismatch, VersionMismatch
from contactfpga.robot.haptics import WithReadings
from contactfpga.robot.ros import convert
from contactfpga.robot.ros.cdr import encode
from contactfpga.robot.ros.convert import Place, markers, outline
from contactfpga.robot.ros.feed import Felt
from contactfpga.robot.ros.types import PACKAGE
from contactfpga.surfaces.shapes import Vector
from contactfpga.tools.recordings.mcap_file import RecordingFailed
from contactfpga.tools.recordings.recorder import LinkFile
from contactfpga.tracking.tracker import Tracker
from contactfpga.tracking.tracks import Tracks
from contactfpga.wire.faults import Faults
from contactfpga.zones.units import UnitSamples
from contactfpga.zones.zone import Zone, Zones

QUEUE = 1 << 16
"""Most frames that wait to be written as messages."""
POLL_S = 0.01
END_S = 1.0
"""Time for writing the remaining frames at the end."""
AT_ONCE_S = 1e-6
BATCH_BYTES = 2048
"""Bytes per write: about 100 frames with a zone each."""


class Buffer:
    events: Events

    def __init__(self) -> None:
        self._pieces: collections.deque[tuple[bytes, float]] = collections.deque()
        self._bytes = 0
        self._taken = 0  # bytes in all
        self._ended = False
        self._lock = threading.Lock()

    def opened(self, board: Board) -> None:
        self.events = board.events(QUEUE)

    def take(self, data: bytes, clock_s: float) -> None:
        with self._lock:
            if data and not self._ended:
                self._pieces.append((data, clock_s))
                self._bytes += len(data)
                self._taken += len(data)

    def end_at(self, count: int) -> bool:
        """Stop after this many bytes in all; returns whether they have arrived."""
        with self._lock:
            self._ended = self._ended or self._taken == count
            return self._ended

    def close(self) -> None:
        """End; buffered bytes stay readable."""

    def due(self, clock_s: float) -> bool:
        """Whether enough bytes wait, or for long enough."""
        return self._bytes >= BATCH_BYTES or (bool(self._pieces) and clock_s - self._pieces[0][1] >= POLL_S)

    def drain(self) -> tuple[bytes, float]:
        """All buffered bytes, and arrival of the last one."""
        with self._lock:
            data, moment = b"".join(piece for piece, _ in self._pieces), self._pieces[-1][1] if self._pieces else 0.0
            self._pieces.clear()
            self._bytes = 0
        return data, moment


class LinkRecorder:
    """Writes a board's data until it is stopped, the played recording ends, or the port is lost. ``events``: all of the
    board; ``said``: None for bytes only; ``late``: frames wait for their readings of pressure units.
    """

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
        self.seconds = 0.0
        """Recorded time: on the board's clock, for a recording in device time."""
        self.notes: list[str] = []
        self.error: ContactFPGAError | None = None
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
        """The next frame, after earlier data are written."""
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
        now_s = self.board.clock() if self.board.live else self._last_us / 1e6
        self._begun_s = now_s if self._begun_s is None else self._begun_s
        self.seconds = max(self.seconds, now_s - self._begun_s)
        return now_s

    def _drain(self, rest: bool = False) -> None:
        if self._buffer.due(math.inf if rest else self.board.clock()):
            data, clock_s = self._buffer.drain()
            self._link.take_bytes(data, clock_s if self.board.live else self._last_us / 1e6)


@dataclasses.dataclass(frozen=True)
class Mount:
    """A board's place on a robot, for messages with places in the frame of the robot's link."""

    frame: str
    place: Place

    def zone(self, zone: Zone) -> Zone:
        if zone.x_mm is None or zone.y_mm is None:
            return zone
        point_m, normal = self.place(zone.x_mm, zone.y_mm)
        return dataclasses.replace(zone, point_mm=_vector(1e3 * one for one in point_m), normal=_vector(normal))

    def tracks(self, tracks: Tracks) -> Tracks:
        active = tuple(dataclasses.replace(one, zone=self.zone(one.zone)) for one in tracks.active)
        events = tuple(dataclasses.replace(one, zone=self.zone(one.zone)) for one in tracks.events)
        return dataclasses.replace(tracks, active=active, events=events)


def _vector(values) -> Vector:  # type: ignore[no-untyped-def]
    x, y, z = map(float, values)
    return x, y, z


FAULTS, UNITS = f"{PACKAGE}/Faults", f"{PACKAGE}/Units"
ZONES, TRACKS, CONTACTS = (f"{PACKAGE}/{name}" for name in ("Zones", "Tracks", "Contacts"))
TRANSFORMS, MARKERS, WRENCH = "tf2_msgs/TFMessage", "visualization_msgs/MarkerArray", "geometry_msgs/WrenchStamped"

DRAWN_S = 1 / 30
WORLD = "world"
_ORIGIN = (0.0, 0.0, 0.0)


class LinkMessages:
    """Writes one link's data as standard messages, in order."""

    def __init__(self, board: Board, link: LinkFile, mount: Mount | None = None, felt: Felt | None = None):
        self._link = link
        self._mount = mount
        self._felt = felt
        self._frame = link.name if mount is None else mount.frame
        self._tracker = Tracker()
        self._drawn_s = -1.0
        self._rim = outline(board.sheet, None if mount is None else mount.place)

    def told(self, item: SideEvent, clock_s: float) -> None:
        time_ns = self._link.time_ns(clock_s)
        if isinstance(item, Faults):
            self._link.write("faults", FAULTS, of_faults(item.names, time_ns, self._frame), clock_s)
        elif isinstance(item, UnitSamples):
            self._link.write("units", UNITS, of_units(item, time_ns, self._frame), clock_s)

    def frame(self, zones: Zones, clock_s: float) -> None:
        """Write a frame; contacts when they change and periodically, with messages for 3-D programs."""
        known_s = [one for one in (zones.host_time_s, zones.arrived_s) if one is not None]
        sampled_s = known_s[0] if known_s else clock_s
        head = convert.header(self._link.time_ns(sampled_s), self._frame)
        tracks = self._tracker.update(zones)
        forces = None if self._felt is None else self._felt(zones, tracks)
        made = convert.zones(zones, head, zones.host_sigma_s)
        if self._mount is not None:
            made["zones"] = [convert.zone(self._mount.zone(zone)) for zone in zones]
            tracks = self._mount.tracks(tracks)
        self._put("zones", ZONES, made, clock_s)
        if forces is not None:
            self._put("contacts", CONTACTS, convert.contacts(tracks.active, head, forces), clock_s)
            self._put("wrench", WRENCH, convert.wrench(forces.wrench, head), clock_s)
        drawn = clock_s - self._drawn_s >= DRAWN_S or clock_s < self._drawn_s
        if drawn or tracks.events:
            told = convert.tracks(tracks, tracks.events, tracks.restarted, head)
            self._put("tracks", TRACKS, told, clock_s)
        if drawn:
            self._drawn_s = clock_s
            self._put("markers", MARKERS, markers(self._rim, tracks.active, head, forces), clock_s)
            if self._mount is None:  # where the links of a robot are, the robot says
                world = convert.header(self._link.time_ns(clock_s), WORLD)
                here = convert.transform(world, self._frame, _ORIGIN, _ORIGIN)
                self._put("/tf", TRANSFORMS, here, clock_s)

    def _put(self, what: str, kind: str, message: convert.Message, clock_s: float) -> None:
        self._link.write(what, kind, encode(kind, message), clock_s)


def of_faults(names: tuple[str, ...], time_ns: int, frame: str) -> bytes:
    return encode(FAULTS, {"header": convert.header(time_ns, frame), "names": names})


def of_units(samples: UnitSamples, time_ns: int, frame: str) -> bytes:
    values = {name: getattr(samples, name) for name in ("readings", "sigma", "saturated")}
    return encode(UNITS, {"header": convert.header(time_ns, frame), "device_time_us": samples.time_us} | values)
