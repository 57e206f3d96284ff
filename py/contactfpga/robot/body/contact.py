"""A contact on a link: where, since when, and with units how hard."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from contactfpga.robot import haptics
from contactfpga.robot.body.folds import cells_of
from contactfpga.robot.body.pose import Pose
from contactfpga.robot.body.state import LinkState
from contactfpga.surfaces.shapes import Floats, Vector, vector
from contactfpga.tracking.tracks import Tracks
from contactfpga.zones.zone import Zone, Zones

if TYPE_CHECKING:
    from contactfpga.robot.body.plan import Plan


@dataclasses.dataclass(frozen=True, eq=False)
class Contact:
    """One zone of a link, in a frame of the robot."""

    link: str
    """Name of the link in `robot.toml`."""
    frame: str
    """The frame of point, normal and force: ``base``, or the link's."""
    time_us: int
    """Device time of its frame."""
    host_time_s: float
    """The same on the body's clock."""
    time_sigma_s: float | None
    """Standard deviation of ``host_time_s``; None if it is not known."""
    point_m: Vector | None
    """Where the contact is. None for a zone that has no place because it goes all the way round a closed sheet, or has
    no cells, which happens only in a frame flagged ``mismatch``."""
    normal: Vector | None
    """Outward unit normal; None as ``point_m``."""
    covariance_m2: Floats | None
    """(3, 3) covariance of the point, from the size of a cell along the surface, and in the base frame also from how
    far the joints moved the point within ``time_sigma_s``. None as ``point_m``, and if the angles just before and after
    the frame's time are not known."""
    zone: Zone
    flags: frozenset[str]
    """Flags of its frame."""
    force_n: Vector | None = None
    """Force on the link; None if there are no units, or their readings at that time have not come yet."""
    normal_n: float | None = None
    """Push, 0 or above; None as ``force_n``."""
    track: int | None = None
    """Id that stays with the contact, unique on this link; None for a zone without a place, or in frames that were not
    tracked."""
    fold: float | None = None
    """Share of its cells, 0 to 1, that the folding cover presses at the joint's angle; at 1 perhaps nobody touches.
    None if nothing was learned for this link or at this angle, or the angle is not known."""

    _felt: haptics.Contact | None = dataclasses.field(default=None, repr=False)

    @property
    def interval_n(self) -> tuple[float, float | None] | None:
        """Least and largest push that the same readings allow; the second is None where there is no largest one. None
        as ``force_n``. With three contacts or more it raises :class:`~contactfpga.MissingExtra` without ``haptics``."""
        return None if self._felt is None else self._felt.interval_n

    def moved(self, pose: Pose, frame: str) -> Contact:
        """The same in a frame in which its own one lies at ``pose``."""
        return dataclasses.replace(
            self,
            frame=frame,
            point_m=None if self.point_m is None else vector(pose.apply(np.array(self.point_m))),
            normal=None if self.normal is None else vector(pose.turn(np.array(self.normal))),
            covariance_m2=None if self.covariance_m2 is None else pose.rotation @ self.covariance_m2 @ pose.rotation.T,
            force_n=None if self.force_n is None else vector(pose.turn(np.array(self.force_n))),
        )

    def less_certain(self, other: Pose | None, pose: Pose) -> Contact:
        """The same with the spread of a point that is at ``pose``, or as far from there as ``other`` puts it; None:
        nobody knows how far."""
        if other is None or self.point_m is None or self.covariance_m2 is None:
            return dataclasses.replace(self, covariance_m2=None)
        own = (np.array(self.point_m) - pose.point_m) @ pose.rotation
        way = other.apply(own) - np.array(self.point_m)
        return dataclasses.replace(self, covariance_m2=self.covariance_m2 + np.outer(way, way))

    def to_dict(self) -> dict[str, object]:
        """All of it in plain Python values, ready for JSON."""
        names = [field.name for field in dataclasses.fields(self) if field.name != "_felt"]
        values = {name: getattr(self, name) for name in (*names, "interval_n")}
        spread = None if self.covariance_m2 is None else self.covariance_m2.tolist()
        values |= {"covariance_m2": spread, "flags": sorted(self.flags)}
        return values | {"zone": dataclasses.asdict(self.zone)}


def on_link(plan: Plan, state: LinkState, angles: Mapping[str, float] | None = None) -> list[Contact]:
    """The contacts in the link's frame, one per zone; with the joints' angles, they say how much of them is a fold."""
    zones = state.zones
    assert zones is not None
    assert state.frame_s is not None
    sigma_m = 1e-3 * plan.sigma_mm
    tracks = () if state.tracks is None else state.tracks.active
    ids = {id(track.zone): track.id for track in tracks if not track.held}
    found = []
    for zone in zones:
        point = normal = spread = None
        if zone.x_mm is not None and zone.y_mm is not None:
            point, normal = plan.place(zone.x_mm, zone.y_mm)
            spread = sigma_m**2 * (np.eye(3) - np.outer(normal, normal))
        when = zones.time_us, state.frame_s, zones.host_sigma_s
        fold = _fold(plan, zones, zone, angles)
        made = Contact(plan.name, plan.frame, *when, point, normal, spread, zone, zones.flags)
        found.append(dataclasses.replace(made, track=ids.get(id(zone)), fold=fold))
    return _felt(plan, zones, found)


def _felt(plan: Plan, zones: Zones, found: list[Contact]) -> list[Contact]:
    """The same with forces, where the units' readings have come, and each contact has a place."""
    forces = forces_of(plan, zones) if found else None
    if forces is None:
        return found
    return [
        dataclasses.replace(one, force_n=force.force_n, normal_n=force.normal_n, _felt=force)
        for one, force in zip(found, forces)
    ]


def forces_of(plan: Plan, zones: Zones, tracks: Tracks | None = None) -> haptics.Contacts | None:
    """The forces at the zones of a frame, in the link's frame; None where there are no readings of units, or a zone has
    no place."""
    if plan.units is None or zones.units is None:
        return None
    touches = []
    for zone in zones:
        if zone.x_mm is None or zone.y_mm is None:
            return None
        touches.append(haptics.Touch(*plan.place(zone.x_mm, zone.y_mm), plan.friction, 1e-3 * plan.sigma_mm))
    found = haptics.contacts(plan.units.wrench(zones.units.readings), touches)
    ids = {} if tracks is None else {id(track.zone): track.id for track in tracks.active}
    for one, zone in zip(found, zones):
        one.track = ids.get(id(zone))
    return found


def _fold(plan: Plan, zones: Zones, zone: Zone, angles: Mapping[str, float] | None) -> float | None:
    if plan.folds is None or angles is None or plan.folds.joint not in angles:
        return None
    cells = cells_of(zones, zone)
    return None if cells is None else plan.folds.share(angles[plan.folds.joint], cells)
