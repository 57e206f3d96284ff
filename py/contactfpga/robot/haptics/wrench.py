"""Force and moment on the link, with their noise, and their center of pressure on the bumper's outside."""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import Any

import numpy as np

from contactfpga.inputs.values import shown, suggestion
from contactfpga.robot.haptics.values import LARGEST, SMALLEST, HapticsError, number, positive, within
from contactfpga.surfaces import shapes
from contactfpga.surfaces.shapes import Floats, Vector

ALARM = (10.828, 13.816, 16.266, 18.467, 20.515, 22.458)
"""Chi-square exceeded by chance once in a thousand times, with 1 to 6 degrees of freedom."""


class Noise:
    """The covariance of a wrench; one object serves all wrenches of the same units."""

    def __init__(self, covariance: Floats):
        self.covariance = covariance
        """(6, 6) in N2, Nm2 and N Nm, about the link's origin."""

    @classmethod
    def checked(cls, covariance: Floats) -> Noise | None:
        """The noise of a covariance; None if it is all 0. Raises :class:`HapticsError` if it is no covariance."""
        if not covariance.any():
            return None
        size = np.sqrt(np.abs(np.diag(covariance)))
        scale = np.outer(size, size)
        if (np.diag(covariance) < 0).any() or (np.abs(covariance) > scale * (1 + 1e-6)).any():
            raise HapticsError("covariance is no covariance: an entry exceeds what its variances allow")
        if not np.allclose(covariance, covariance.T, rtol=0, atol=1e-6 * scale.max()):
            raise HapticsError("covariance is not symmetric; entry [i][j] must equal entry [j][i]")
        made = cls((covariance + covariance.T) / 2)
        if made._spectrum[0][0] < -1e-6:
            raise HapticsError("covariance is no covariance: along some direction its variance is below 0")
        return made

    @functools.cached_property
    def _spectrum(self) -> tuple[Floats, Floats, Floats]:
        size = np.sqrt(np.diag(self.covariance))
        size = np.where(size > 1e-9 * size.max(), size, 0.0)
        over = np.where(size > 0, 1 / np.where(size > 0, size, 1.0), 0.0)
        values, vectors = np.linalg.eigh(self.covariance * np.outer(over, over))
        return values, vectors, over

    @functools.cached_property
    def information(self) -> Floats:
        """(6, 6): inverse of the covariance, without weight for a component that the units do not see."""
        return np.asarray(self.root.T @ self.root)

    @functools.cached_property
    def root(self) -> Floats:
        """(rank, 6): a root of the information."""
        values, vectors, over = self._spectrum
        seen = values > 1e-9 * values[-1]
        return np.asarray((vectors[:, seen] / np.sqrt(values[seen])).T * over)

    def widened(self, moments: Floats) -> Noise:
        """The noise with (3, 3) ``moments`` in N2m2 added to the covariance of the seen moments."""
        more = np.zeros((6, 6))
        more[3:, 3:] = moments
        if self.rank < 6:
            values, vectors, over = self._spectrum
            seen = vectors[:, values > 1e-9 * values[-1]]
            kept = np.sqrt(np.diag(self.covariance))[:, None] * (seen @ seen.T) * over
            more = kept @ more @ kept.T
        made = Noise(self.covariance + more)
        if self.rank == 6:
            made.root = np.asarray(np.linalg.inv(np.linalg.cholesky(made.covariance)), float)  # sooner than by spectrum
        return made

    @functools.cached_property
    def rank(self) -> int:
        """Independent components that the units see: 6 for all."""
        values = self._spectrum[0]
        return int((values > 1e-9 * values[-1]).sum())


@dataclasses.dataclass(frozen=True, slots=True)
class Wrench:
    """The common wrench of the contacts on the link."""

    force_n: Vector
    moment_nm: Vector
    """Moment about the origin of the link's frame."""
    noise: Noise | None = None
    """Noise of the wrench; None if unknown."""
    frame: str = ""
    """Name of the link's frame."""
    saturated: tuple[int, ...] = ()
    """Indexes of saturated units, which make the wrench wrong by an unknown amount."""
    lifted: tuple[int, ...] = ()
    """Indexes of lifted units, which would have to pull."""

    def __post_init__(self) -> None:
        within("force_n", self.force_n, "N")
        within("moment_nm", self.moment_nm, "Nm")

    @property
    def covariance(self) -> Floats | None:
        """(6, 6) covariance of :class:`Noise`."""
        return None if self.noise is None else self.noise.covariance

    @property
    def array(self) -> Floats:
        """(6,): force in N and moment in Nm."""
        return np.array((*self.force_n, *self.moment_nm))


@dataclasses.dataclass(frozen=True)
class Motion:
    """Motion of the link in its own frame, for the bumper's inertial force."""

    gravity_m_s2: Vector = (0.0, 0.0, -9.80665)
    """Gravity in the link's frame."""
    acceleration_m_s2: Vector = (0.0, 0.0, 0.0)
    """Acceleration of the frame's origin, without gravity."""
    turning_rad_s: Vector = (0.0, 0.0, 0.0)
    """Angular velocity."""
    turning_rad_s2: Vector = (0.0, 0.0, 0.0)
    """Angular acceleration."""

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            within(field.name, getattr(self, field.name), "")


@dataclasses.dataclass(frozen=True)
class Bumper:
    """The mass on the units."""

    mass_kg: float
    center_m: Vector
    """Center of mass in the link's frame."""
    inertia_kg_m2: tuple[Vector, Vector, Vector] = ((0.0, 0.0, 0.0),) * 3
    """Inertia about the center of mass."""

    def __post_init__(self) -> None:
        number("mass_kg", self.mass_kg, 0, LARGEST, "kg")
        within("center_m", self.center_m, "m")
        for row in self.inertia_kg_m2:
            within("inertia_kg_m2", row, "kg m2")

    def wrench(self, motion: Motion) -> Floats:
        """(6,) wrench of the units on the bumper that moves it with the link."""
        center, inertia = np.array(self.center_m), np.array(self.inertia_kg_m2)
        spin, more = np.array(motion.turning_rad_s), np.array(motion.turning_rad_s2)
        felt = np.array(motion.acceleration_m_s2) - np.array(motion.gravity_m_s2)
        felt = felt + np.cross(more, center) + np.cross(spin, np.cross(spin, center))
        force = self.mass_kg * felt
        moment = inertia @ more + np.cross(spin, inertia @ spin) + np.cross(center, force)
        return np.concatenate([force, moment])


@dataclasses.dataclass(frozen=True, slots=True)
class Center:
    """The place where one contact alone would exert the wrench."""

    point_m: Vector
    normal: Vector
    """Outward unit normal at the point."""
    normal_n: float
    """Push, above 0."""
    tangential_n: float
    """Size of the force along the surface."""
    torsion_nm: float
    """Moment about the outward normal."""
    force_n: Vector
    """Force on the link."""
    sheet_m: tuple[float, float]
    """The point on the surface laid flat; x is the arc length of a cylinder, y its z."""
    covariance_m2: Floats | None
    """(2, 2) covariance of ``sheet_m`` from the wrench's noise; None if unknown."""


@dataclasses.dataclass(frozen=True)
class Plane:
    """The plane z = ``height_m`` of the link's frame; outside is larger z."""

    height_m: float = 0.0

    def __post_init__(self) -> None:
        number("height_m", self.height_m, -100, 100, "m")

    def center(self, wrench: Wrench) -> Center | None:
        """The center of pressure; None if the wrench does not push on the plane."""
        (fx, fy, fz), (mx, my, mz) = wrench.force_n, wrench.moment_nm
        if not fz < -SMALLEST:
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
        """(2, 6) derivative of the center of pressure by the wrench, in m per N and per Nm."""
        h = self.height_m
        return np.array([[h, 0, -x_m, 0, -1, 0], [0, h, -y_m, 1, 0, 0]]) / fz

    def place(self, x_m: float, y_m: float) -> tuple[Vector, Vector]:
        """Point and outward normal at a place of the surface laid flat."""
        return shapes.on_plane(x_m, y_m, self.height_m)

    def flat(self, point_m: Vector) -> tuple[float, float]:
        """The place, laid flat, of the nearest point of the surface."""
        return point_m[0], point_m[1]


@dataclasses.dataclass(frozen=True)
class Cylinder:
    """A cylinder about the link's z axis, whose radius includes the foam."""

    radius_m: float

    def __post_init__(self) -> None:
        positive("radius_m", self.radius_m, "m")

    def center(self, wrench: Wrench) -> Center | None:
        """The center of pressure; None if no push on the cylinder exerts this wrench."""
        (fx, fy, fz), (mx, my, mz) = wrench.force_n, wrench.moment_nm
        radius = self.radius_m
        across, square = mz / radius, fx * fx + fy * fy
        inward = square - across * across
        if not inward > SMALLEST**2:
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
        """(2, 6) derivative of arc length and z by the wrench, in m per N and per Nm."""
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
        """The place, laid flat, of the nearest point of the surface."""
        return shapes.off_cylinder(point_m, self.radius_m)


Surface = Plane | Cylinder
SURFACES: dict[str, tuple[type[Plane] | type[Cylinder], str]] = {
    "plane": (Plane, "height_m"),
    "cylinder": (Cylinder, "radius_m"),
}


def read_surface(values: Any, name: str = "surface") -> Surface:
    """The surface of a TOML table; raises :class:`HapticsError`."""
    if not isinstance(values, dict) or values.get("kind") not in list(SURFACES):
        kind = values.get("kind") if isinstance(values, dict) else values
        raise HapticsError(
            f"{name} is {shown(kind)}; its kind must be 'plane', with height_m, or 'cylinder', with radius_m"
        )
    made, length = SURFACES[values["kind"]]
    for key in values:
        if key not in ("kind", length):
            raise HapticsError(f"unknown key {shown(key)} in {name}; {suggestion(key, ('kind', length))}")
    if length not in values:
        raise HapticsError(f"{length} is missing in {name}; a {values['kind']} has one")
    return made(values[length])
