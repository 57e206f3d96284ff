"""A ball pressed on the cover: its patch, its pressure, and the stress below it in a half-space."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from contactfpga.design.cover.answer import not_negative, numbers, positive
from contactfpga.design.cover.patch import Ellipse
from contactfpga.design.cover.point import Switch


@dataclasses.dataclass(frozen=True)
class Ball:
    """Hertz contact of a ball (or of crossed equal cylinders) with the cover (Johnson 4.2)."""

    radius_m: float
    """R*; 1/R* is the sum of both bodies' curvatures."""
    modulus_pa: float
    """E*; 1/E* is the sum of (1 - nu^2)/E of both bodies."""

    def __post_init__(self) -> None:
        positive("radius_m", self.radius_m, "m")
        positive("modulus_pa", self.modulus_pa, "Pa")

    def patch_m(self, force_n: float) -> float:
        """Radius of the patch: a = (3 F R* / (4 E*))^(1/3)."""
        return math.cbrt(0.75 * positive("force_n", force_n, "N") * self.radius_m / self.modulus_pa)

    def indentation_m(self, force_n: float) -> float:
        """Indentation of the ball: delta = a^2 / R*."""
        return self.patch_m(force_n) ** 2 / self.radius_m

    def closing_n(self, switch: Switch, depth_m: float) -> float:
        """Force that closes a switch right below, ``depth_m`` deep in a half-space."""
        positive("depth_m", depth_m, "m")
        low = 2 * math.pi / 3 * switch.closing_pa * depth_m**2  # that of a point force: the stress below it is highest
        high = 2 * low
        while on_axis_pa(high, self.patch_m(high), depth_m) < switch.closing_pa:
            low, high = high, 2 * high
        while high - low > 1e-13 * high:
            middle = (low + high) / 2
            under = on_axis_pa(middle, self.patch_m(middle), depth_m) < switch.closing_pa
            low, high = (middle, high) if under else (low, middle)
        return high


@dataclasses.dataclass(frozen=True)
class HalfSpace:
    """The paper's cover, F = 4/3 E* sqrt(R*) d^1.5, whose thickness has no effect until it is pressed flat."""

    ball: Ball
    thickness_m: float
    base_n_m: float = 0.0

    def force_n(self, depth_m: float) -> float:
        """Force at a depth; 0 above the surface."""
        if depth_m <= 0:
            return 0.0
        hertz = 4 / 3 * self.ball.modulus_pa * math.sqrt(self.ball.radius_m * depth_m) * depth_m
        return hertz + self.base_n_m * max(0.0, depth_m - self.thickness_m)

    def depth_m(self, force_n: float) -> float:
        """Depth at a force, above the base; 0 without one."""
        return self.ball.indentation_m(force_n) if force_n > 0 else 0.0

    def parts_at(self, depth_m: float) -> tuple[Ellipse, ...]:
        """The patch at a depth above 0."""
        radius = math.sqrt(self.ball.radius_m * depth_m)
        return (Ellipse(radius, radius),)


def on_axis_pa(force_n: float, patch_m: float, depth_m: float) -> float:
    """Normal stress right below the middle of a Hertz patch (Johnson (3.45b)): 3 F / (2 pi (a^2 + z^2))."""
    not_negative("force_n", force_n, "N")
    not_negative("patch_m", patch_m, "m")
    positive("depth_m", depth_m, "m")
    return 1.5 * force_n / (math.pi * (patch_m**2 + depth_m**2))


def stress_pa(force_n: float, patch_m: float, offset_m: np.ndarray | float, depth_m: float) -> np.ndarray:
    """Normal stress in a half-space under the pressure p0 sqrt(1 - r^2/a^2) on a disc of radius ``patch_m``.

    Huber's closed form for any Poisson ratio, at ``offset_m`` r and ``depth_m`` z: p0 (z/sqrt u)^3 a^2 u / (u^2 + a^2
    z^2), 2 u = w + sqrt(w^2 + 4 a^2 z^2), w = r^2 + z^2 - a^2.
    """
    positive("patch_m", patch_m, "m")
    positive("depth_m", depth_m, "m")
    not_negative("force_n", force_n, "N")
    peak = 1.5 * force_n / (math.pi * patch_m**2)
    excess = numbers("offset_m", offset_m, "m") ** 2 + depth_m**2 - patch_m**2
    root = np.sqrt(excess**2 + (2 * patch_m * depth_m) ** 2)
    # The sum cancels inside the patch; the product of both roots is known.
    u = np.where(excess > 0, (root + excess) / 2, 2 * (patch_m * depth_m) ** 2 / (root + np.abs(excess)))
    return np.asarray(peak * (depth_m / np.sqrt(u)) ** 3 * patch_m**2 * u / (u**2 + (patch_m * depth_m) ** 2))
