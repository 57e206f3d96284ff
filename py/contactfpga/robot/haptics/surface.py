"""What the bumper's outside is, and where a wrench pushes on it: the center of pressure of a single contact."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from contactfpga.inputs.values import shown
from contactfpga.robot.haptics.answer import Floats, HapticsError, Vector, number, positive
from contactfpga.robot.haptics.wrench import Wrench
from contactfpga.surfaces import shapes


@dataclasses.dataclass(frozen=True, slots=True)
class Center:
    """Where one contact alone would exert the wrench, if it pushes with a force and turns about the normal only."""

    point_m: Vector
    normal: Vector
    """Outward unit normal there."""
    normal_n: float
    """Push; above 0."""
    tangential_n: float
    """Size of the force along the surface."""
    torsion_nm: float
    """Moment about the outward normal."""
    force_n: Vector
    """On the link."""
    sheet_m: tuple[float, float]
    """The point on the surface laid flat: x and y of a plane, arc length and z of a cylinder."""
    covariance_m2: Floats | None
    """(2, 2) of ``sheet_m`` from the wrench's noise; None where that is not known."""


@dataclasses.dataclass(frozen=True)
class Plane:
    """The plane z = ``height_m`` of the link's frame; outside is where z is larger."""

    height_m: float = 0.0

    def __post_init__(self) -> None:
        number("height_m", self.height_m, -100, 100, "m")

    def center(self, wrench: Wrench) -> Center | None:
        """The center of pressure; None where the wrench does not push on the plane."""
        (fx, fy, fz), (mx, my, mz) = wrench.force_n, wrench.moment_nm
        if not fz < 0:
            return None
        h = self.height_m
        x, y = (h * fx - my) / fz, (h * fy + mx) / fz
        torsion = mz - (x * fy - y * fx)
        spread = None
        if wrench.covariance is not None:
            slopes = self.slopes(fz, x, y)
            spread = slopes @ wrench.covariance @ slopes.T
        return Center((x, y, h), (0.0, 0.0, 1.0), -fz, math.hypot(fx, fy), torsion, wrench.force_n, (x, y), spread)

    def slopes(self, fz: float, x_m: float, y_m: float) -> Floats:
        """Derivative (2, 6) of the center of pressure, in m per N and per Nm of the wrench."""
        h = self.height_m
        return np.array([[h, 0, -x_m, 0, -1, 0], [0, h, -y_m, 1, 0, 0]]) / fz

    def place(self, x_m: float, y_m: float) -> tuple[Vector, Vector]:
        """Point and outward normal at a place of the surface laid flat."""
        return shapes.on_plane(x_m, y_m, self.height_m)

    def flat(self, point_m: Vector) -> tuple[float, float]:
        """The place, laid flat, of the surface's point nearest to this one."""
        return point_m[0], point_m[1]


@dataclasses.dataclass(frozen=True)
class Cylinder:
    """A cylinder about the link's z axis. The force enters at the outside, so its radius is that with the foam."""

    radius_m: float

    def __post_init__(self) -> None:
        positive("radius_m", self.radius_m, "m")

    def center(self, wrench: Wrench) -> Center | None:
        """The center of pressure; None where no push on the cylinder exerts this wrench."""
        (fx, fy, fz), (mx, my, mz) = wrench.force_n, wrench.moment_nm
        radius = self.radius_m
        across, square = mz / radius, fx * fx + fy * fy
        inward = square - across * across
        if not inward > 0:
            return None
        push = -math.sqrt(inward)
        angle = math.atan2(fy, fx) - math.atan2(across, push)
        normal, tangent = (math.cos(angle), math.sin(angle), 0.0), (-math.sin(angle), math.cos(angle), 0.0)
        angle = math.atan2(normal[1], normal[0])
        z = (mx * tangent[0] + my * tangent[1] + radius * fz) / push
        torsion = (fx * mx + fy * my + fz * mz) / push
        point = (radius * normal[0], radius * normal[1], z)
        spread = None
        if wrench.covariance is not None:
            slopes = self.slopes(wrench, push, normal, z)
            spread = slopes @ wrench.covariance @ slopes.T
        sideways = math.hypot(across, fz)
        return Center(point, normal, -push, sideways, torsion, wrench.force_n, (radius * angle, z), spread)

    def slopes(self, wrench: Wrench, push: float, normal: Vector, z: float) -> Floats:
        """Derivative (2, 6) of arc length and z, in m per N and per Nm of the wrench."""
        (fx, fy, _), (mx, my, mz) = wrench.force_n, wrench.moment_nm
        radius, square = self.radius_m, fx * fx + fy * fy
        across = mz / radius
        d_across = np.array([0, 0, 0, 0, 0, 1 / radius])
        d_push = (np.array([fx, fy, 0, 0, 0, 0]) - across * d_across) / push
        d_angle = (np.array([-fy, fx, 0, 0, 0, 0]) - (push * d_across - across * d_push)) / square
        about_normal = mx * normal[0] + my * normal[1]
        d_z = np.array([0, 0, radius, -normal[1], normal[0], 0]) - about_normal * d_angle - z * d_push
        return np.stack([radius * d_angle, d_z / push])

    def place(self, x_m: float, y_m: float) -> tuple[Vector, Vector]:
        """Point and outward normal at a place of the surface laid flat."""
        return shapes.on_cylinder(x_m, y_m, self.radius_m)

    def flat(self, point_m: Vector) -> tuple[float, float]:
        """The place, laid flat, of the surface's point nearest to this one."""
        return shapes.off_cylinder(point_m, self.radius_m)


Surface = Plane | Cylinder
KINDS: dict[str, tuple[type[Plane] | type[Cylinder], str]] = {
    "plane": (Plane, "height_m"),
    "cylinder": (Cylinder, "radius_m"),
}


def read(values: Any, name: str = "surface") -> Surface:
    """The surface that a table describes; raises :class:`HapticsError`."""
    if not isinstance(values, dict) or values.get("kind") not in list(KINDS):
        kind = values.get("kind") if isinstance(values, dict) else values
        raise HapticsError(
            f"{name} is {shown(kind)}; its kind must be 'plane', with height_m, or 'cylinder', with radius_m"
        )
    made, length = KINDS[values["kind"]]
    for key in values:
        if key not in ("kind", length):
            raise HapticsError(f"unknown key {shown(key)} in {name}; known are kind, {length}")
    if length not in values:
        raise HapticsError(f"{length} is missing in {name}; a {values['kind']} has one")
    return made(values[length])
