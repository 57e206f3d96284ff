"""A contact on a link: where, since when, and with units how hard."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np

from contactfpga import haptics
from contactfpga.body.pose import Pose
from contactfpga.surfaces.shapes import Floats, Vector
from contactfpga.zones.zone import Zone

if TYPE_CHECKING:
    from contactfpga.body.plan import Plan
    from contactfpga.body.snapshot import LinkState


@dataclasses.dataclass(frozen=True, eq=False)
class Contact:
    """One zone of a link, in a frame of the robot."""

    link: str
    """Name of the link in `robot.toml`."""
    frame: str
    """In which point, normal and force are: ``base``, or the link's."""
    time_us: int
    """Device time of its frame."""
    host_time_s: float
    """The same on the body's clock."""
    point_m: Vector
    normal: Vector
    """Outward unit normal."""
    covariance_m2: Floats
    """(3, 3) of the point: chance within a cell, along the surface."""
    zone: Zone
    flags: frozenset[str]
    """Of its frame."""
    force_n: Vector | None = None
    """On the link; None where no units are read, or their readings at that time have not come yet."""
    normal_n: float | None = None
    """Push, 0 or above; None as ``force_n``."""

    def moved(self, pose: Pose, frame: str) -> Contact:
        """The same in a frame in which its own one lies at ``pose``."""
        return dataclasses.replace(
            self,
            frame=frame,
            point_m=_vector(pose.apply(np.array(self.point_m))),
            normal=_vector(pose.turn(np.array(self.normal))),
            covariance_m2=pose.rotation @ self.covariance_m2 @ pose.rotation.T,
            force_n=None if self.force_n is None else _vector(pose.turn(np.array(self.force_n))),
        )

    def to_dict(self) -> dict[str, object]:
        """All of it in plain Python values, ready for JSON."""
        values = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        values |= {"covariance_m2": self.covariance_m2.tolist(), "flags": sorted(self.flags)}
        return values | {"zone": dataclasses.asdict(self.zone)}


def placed(plan: Plan, x_mm: float, y_mm: float) -> tuple[Vector, Vector]:
    """Point in m and outward normal, in the link's frame, of a place of its sheet."""
    x_mm = (plan.skin.columns - 1) * plan.skin.pitch_x_mm - x_mm if plan.mirrored else x_mm
    point_mm, normal = plan.surface.place(x_mm, y_mm)
    return _vector(plan.pose.apply(1e-3 * np.array(point_mm))), _vector(plan.pose.turn(np.array(normal)))


def on_link(plan: Plan, state: LinkState) -> list[Contact]:
    """The contacts in the link's frame. A zone without cells, which only a frame flagged ``mismatch`` can hold, lies
    nowhere and is none."""
    zones = state.zones
    assert zones is not None
    assert state.frame_s is not None
    sigma_m = 1e-3 * math.hypot(plan.skin.pitch_x_mm, plan.skin.pitch_y_mm) / math.sqrt(24)
    found = []
    for zone in zones:
        if zone.x_mm is None or zone.y_mm is None:
            continue
        point, normal = placed(plan, zone.x_mm, zone.y_mm)
        spread = sigma_m**2 * (np.eye(3) - np.outer(normal, normal))
        when = (zones.time_us, state.frame_s)
        found.append(Contact(plan.name, plan.frame, *when, point, normal, spread, zone, zones.flags))
    if plan.units is None or zones.units is None or not found:
        return found
    touches = [haptics.Touch(one.point_m, one.normal, plan.friction, sigma_m) for one in found]
    forces = haptics.contacts(plan.units.wrench(zones.units.readings), touches)
    return [
        dataclasses.replace(one, force_n=force.force_n, normal_n=force.normal_n) for one, force in zip(found, forces)
    ]


def _vector(values: Floats) -> Vector:
    x, y, z = values.tolist()
    return x, y, z
