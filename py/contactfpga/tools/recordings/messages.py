"""The messages of a recording: one board's data for other programs."""

from __future__ import annotations

import dataclasses
from typing import Protocol

from contactfpga.driver.board import Board
from contactfpga.driver.events import SideEvent
from contactfpga.robot.ros import convert
from contactfpga.robot.ros.cdr import encode
from contactfpga.robot.ros.convert import Place, markers, outline
from contactfpga.robot.ros.feed import Felt
from contactfpga.robot.ros.types import PACKAGE
from contactfpga.surfaces.shapes import Vector
from contactfpga.tracking.tracker import Tracker
from contactfpga.tracking.tracks import Tracks
from contactfpga.wire.faults import Faults
from contactfpga.zones.units import UnitSamples
from contactfpga.zones.zone import Zone, Zones


class Output(Protocol):
    """Where the messages of a link go."""

    name: str
    board: Board

    def time_ns(self, clock_s: float) -> int:
        """Time in ns since 1970, of a moment on the board's :meth:`~contactfpga.Board.clock`."""

    def write(self, what: str, kind: str, data: bytes, clock_s: float) -> None:
        """Add a message; ``what`` ends its topic, or with a leading slash is all of it."""


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


BYTES, FAULTS, UNITS = f"{PACKAGE}/Bytes", f"{PACKAGE}/Faults", f"{PACKAGE}/Units"
ZONES, TRACKS, CONTACTS = (f"{PACKAGE}/{name}" for name in ("Zones", "Tracks", "Contacts"))
TRANSFORMS, MARKERS, WRENCH = "tf2_msgs/TFMessage", "visualization_msgs/MarkerArray", "geometry_msgs/WrenchStamped"

DRAWN_S = 1 / 30
WORLD = "world"
_ORIGIN = (0.0, 0.0, 0.0)


class LinkMessages:
    """Writes one link's data as standard messages, in order."""

    def __init__(self, link: Output, mount: Mount | None = None, felt: Felt | None = None):
        self._link = link
        self._mount = mount
        self._felt = felt
        self._frame = link.name if mount is None else mount.frame
        self._tracker = Tracker()
        self._drawn_s = -1.0
        self._rim = outline(link.board.sheet, None if mount is None else mount.place)

    def write_event(self, item: SideEvent, clock_s: float) -> None:
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
            message = convert.tracks(tracks, tracks.events, tracks.restarted, head)
            self._put("tracks", TRACKS, message, clock_s)
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


def of_bytes(data: bytes, time_ns: int, frame: str) -> bytes:
    """A message of bytes of which the last arrived then."""
    return encode(BYTES, {"header": convert.header(time_ns, frame), "data": data})
