"""The messages that a recording holds of a board, for programs that know nothing of us.

Those of a board on a robot have places in the robot's frame."""

from __future__ import annotations

import dataclasses

from contactfpga.driver.board import Board
from contactfpga.driver.events import SideEvent
from contactfpga.robot.ros import convert
from contactfpga.robot.ros.cdr import encode
from contactfpga.robot.ros.convert import Place, markers, outline
from contactfpga.robot.ros.feed import Felt
from contactfpga.surfaces.shapes import Vector
from contactfpga.tools.recordings import messages
from contactfpga.tools.recordings.recorder import LinkFile
from contactfpga.tracking.tracker import Tracker
from contactfpga.tracking.tracks import Tracks
from contactfpga.wire.faults import Faults
from contactfpga.zones.units import UnitSamples
from contactfpga.zones.zone import Zone, Zones


@dataclasses.dataclass(frozen=True)
class Mount:
    """Messages then have places in the robot's own frame, in place of the sheet's."""

    frame: str
    """Of the robot's link."""
    place: Place
    """In that frame."""

    def zone(self, zone: Zone) -> Zone:
        """The zone with its place there."""
        if zone.x_mm is None or zone.y_mm is None:
            return zone
        point_m, normal = self.place(zone.x_mm, zone.y_mm)
        return dataclasses.replace(zone, point_mm=_vector(1e3 * one for one in point_m), normal=_vector(normal))

    def tracks(self, tracks: Tracks) -> Tracks:
        """The same of all zones in them."""
        active = tuple(dataclasses.replace(one, zone=self.zone(one.zone)) for one in tracks.active)
        events = tuple(dataclasses.replace(one, zone=self.zone(one.zone)) for one in tracks.events)
        return dataclasses.replace(tracks, active=active, events=events)


def _vector(values) -> Vector:  # type: ignore[no-untyped-def]
    x, y, z = map(float, values)
    return x, y, z


DRAWN_S = 1 / 30
"""How often what 3-D programs show is written."""
WORLD = "world"
"""The frame that a board lies in which is on no robot."""
_ORIGIN = (0.0, 0.0, 0.0)


class LinkMessages:
    """Writes them for one link, in order."""

    def __init__(self, board: Board, link: LinkFile, mount: Mount | None = None, felt: Felt | None = None):
        self._link = link
        self._mount = mount
        self._felt = felt
        self._frame = link.name if mount is None else mount.frame
        self._tracker = Tracker()
        self._drawn_s = -1.0
        self._rim = outline(board.sheet, None if mount is None else mount.place)

    def told(self, item: SideEvent, clock_s: float) -> None:
        """What came between frames."""
        time_ns = self._link.time_ns(clock_s)
        if isinstance(item, Faults):
            self._link.write("faults", messages.FAULTS, messages.of_faults(item.names, time_ns, self._frame), clock_s)
        elif isinstance(item, UnitSamples):
            self._link.write("units", messages.UNITS, messages.of_units(item, time_ns, self._frame), clock_s)

    def frame(self, zones: Zones, clock_s: float) -> None:
        """A frame; contacts whenever something happens to them, and now and then, with what 3-D programs show."""
        known_s = [one for one in (zones.host_time_s, zones.arrived_s) if one is not None]
        sampled_s = known_s[0] if known_s else clock_s
        head = convert.header(self._link.time_ns(sampled_s), self._frame)
        tracks = self._tracker.update(zones)
        forces = None if self._felt is None else self._felt(zones, tracks)
        made = convert.zones(zones, head, zones.host_sigma_s)
        if self._mount is not None:
            made["zones"] = [convert.zone(self._mount.zone(zone)) for zone in zones]
            tracks = self._mount.tracks(tracks)
        self._put("zones", messages.ZONES, made, clock_s)
        if forces is not None:
            self._put("contacts", messages.CONTACTS, convert.contacts(tracks.active, head, forces), clock_s)
            self._put("wrench", messages.WRENCH, convert.wrench(forces.wrench, head), clock_s)
        drawn = clock_s - self._drawn_s >= DRAWN_S or clock_s < self._drawn_s
        if drawn or tracks.events:
            told = convert.tracks(tracks, tracks.events, tracks.restarted, head)
            self._put("tracks", messages.TRACKS, told, clock_s)
        if drawn:
            self._drawn_s = clock_s
            self._put("markers", messages.MARKERS, markers(self._rim, tracks.active, head, forces), clock_s)
            if self._mount is None:  # where the links of a robot are, the robot says
                world = convert.header(self._link.time_ns(clock_s), WORLD)
                here = convert.transform(world, self._frame, _ORIGIN, _ORIGIN)
                self._put("/tf", messages.TRANSFORMS, here, clock_s)

    def _put(self, what: str, kind: str, message: convert.Message, clock_s: float) -> None:
        self._link.write(what, kind, encode(kind, message), clock_s)
