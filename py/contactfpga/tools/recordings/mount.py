"""Where a link's sheet lies that is mounted on a robot."""

from __future__ import annotations

import dataclasses

from contactfpga.robot.ros.markers import Place
from contactfpga.surfaces.shapes import Vector
from contactfpga.tracking.tracks import Tracks
from contactfpga.zones.zone import Zone


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
