"""Contact patches on the cover: convex parts, and their pressure.

Lengths are in m on the sheet laid flat, angles in rad from the x axis toward the y axis.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import ClassVar, Protocol, Self

import numpy as np

from contactfpga.design.cover.answer import finite, positive

Floats = np.ndarray


class Part(Protocol):
    """A convex piece of a patch."""

    @property
    def x_m(self) -> float:
        """Middle (barycenter) along the columns."""

    @property
    def y_m(self) -> float:
        """Middle along the rows."""

    @property
    def angle_rad(self) -> float:
        """Rotation of the part's own x axis."""

    @property
    def half_x_m(self) -> float:
        """Half the extent along the part's own x axis."""

    @property
    def half_y_m(self) -> float:
        """Half the extent along the part's own y axis."""

    @property
    def area_m2(self) -> float:
        """Area of the part."""

    @property
    def half_box_m(self) -> tuple[float, float]:
        """Half the width and half the height of the box around the part."""

    def reach_m(self, angle_rad: Floats) -> Floats:
        """Support function: reach from the middle in these directions."""

    def contains(self, x_m: Floats, y_m: Floats) -> Floats:
        """Bool: which points are in the part or on its boundary; the two broadcast."""

    def span(self, y_m: Floats) -> tuple[Floats, Floats]:
        """x where lines of constant y enter and leave the part; +inf and -inf if they miss it."""

    def kinks_m(self) -> tuple[float, ...]:
        """Heights y at which the span has a corner, without its ends."""

    def placed(self, x_m: float, y_m: float, angle_rad: float) -> Self:
        """The part turned about the origin, then moved."""

    def density(self, x_m: Floats, y_m: Floats) -> Floats:
        """Pressure in 1/m2 at these points, which broadcast, for a force of 1 N; 0 outside."""

    def pressure(self, fineness_m: float) -> tuple[Floats, Floats, Floats]:
        """Point forces for the pressure: x, y in m and force shares with sum 1.

        Valid ``fineness_m`` or more below the face, to 5e-4 of the peak stress if no half extent exceeds 12 times that.
        """


@functools.lru_cache(maxsize=64)
def _gauss(count: int) -> tuple[Floats, Floats]:
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return nodes, weights


@dataclasses.dataclass(frozen=True)
class _Shape:
    half_x_m: float
    half_y_m: float
    x_m: float = 0.0
    y_m: float = 0.0
    angle_rad: float = 0.0

    def __post_init__(self) -> None:
        for name in ("half_x_m", "half_y_m"):
            positive(name, getattr(self, name), "m")
        for name in ("x_m", "y_m", "angle_rad"):
            finite(name, getattr(self, name))

    def placed(self, x_m: float, y_m: float, angle_rad: float) -> Self:
        cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
        return dataclasses.replace(
            self,
            x_m=x_m + cosine * self.x_m - sine * self.y_m,
            y_m=y_m + sine * self.x_m + cosine * self.y_m,
            angle_rad=self.angle_rad + angle_rad,
        )

    def _own(self, x_m: Floats, y_m: Floats) -> tuple[Floats, Floats]:
        """Points in units of the half extents, along the part's own axes."""
        cosine, sine = math.cos(self.angle_rad), math.sin(self.angle_rad)
        x, y = np.asarray(x_m, float) - self.x_m, np.asarray(y_m, float) - self.y_m
        return (cosine * x + sine * y) / self.half_x_m, (cosine * y - sine * x) / self.half_y_m

    def _sheet(self, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Inverse of :meth:`_own`."""
        cosine, sine = math.cos(self.angle_rad), math.sin(self.angle_rad)
        x, y = u * self.half_x_m, v * self.half_y_m
        return self.x_m + cosine * x - sine * y, self.y_m + sine * x + cosine * y


@dataclasses.dataclass(frozen=True)
class Ellipse(_Shape):
    """A rounded body's patch: the pressure is Hertz's, p0 sqrt(1 - (x/a)^2 - (y/b)^2) (Johnson 3.5)."""

    @property
    def area_m2(self) -> float:
        return math.pi * self.half_x_m * self.half_y_m

    @property
    def half_box_m(self) -> tuple[float, float]:
        cosine, sine = math.cos(self.angle_rad), math.sin(self.angle_rad)
        return math.hypot(self.half_x_m * cosine, self.half_y_m * sine), math.hypot(
            self.half_x_m * sine, self.half_y_m * cosine
        )

    def reach_m(self, angle_rad: Floats) -> Floats:
        own = np.asarray(angle_rad, float) - self.angle_rad
        return np.hypot(self.half_x_m * np.cos(own), self.half_y_m * np.sin(own))

    def contains(self, x_m: Floats, y_m: Floats) -> Floats:
        u, v = self._own(x_m, y_m)
        return np.asarray(u * u + v * v <= 1)

    def span(self, y_m: Floats) -> tuple[Floats, Floats]:
        height = self.half_box_m[1]
        share = (np.asarray(y_m, float) - self.y_m) / height
        cosine, sine = math.cos(self.angle_rad), math.sin(self.angle_rad)
        # The chord's middle moves in proportion to y; at the top it is where the ellipse is highest.
        shift = (self.half_x_m**2 - self.half_y_m**2) * sine * cosine / height
        half = self.half_x_m * self.half_y_m / height * np.sqrt(np.maximum(0, 1 - share * share))
        hit = np.abs(share) <= 1
        middle = self.x_m + shift * share
        return np.where(hit, middle - half, np.inf), np.where(hit, middle + half, -np.inf)

    def kinks_m(self) -> tuple[float, ...]:
        return ()

    def density(self, x_m: Floats, y_m: Floats) -> Floats:
        u, v = self._own(x_m, y_m)
        return self._profile(np.maximum(0.0, 1 - u * u - v * v)) / self.area_m2

    def _profile(self, share: Floats) -> Floats:
        """Pressure over its mean, by 1 - (x/a)^2 - (y/b)^2."""
        return np.asarray(1.5 * np.sqrt(share))

    def pressure(self, fineness_m: float) -> tuple[Floats, Floats, Floats]:
        ratio = max(self.half_x_m, self.half_y_m) / fineness_m
        nodes, weights = _gauss(4 + math.ceil(4 * ratio))
        # With q = sqrt(1 - r^2) the pressure times the ring's area is smooth, for Hertz's q^2 dq.
        q = (nodes + 1) / 2
        radius = np.sqrt(1 - q * q)
        counts = 8 + np.ceil(12 * ratio * radius).astype(int)
        ring = np.repeat(np.arange(len(q)), counts)
        angles = 2 * math.pi * (np.arange(len(ring)) - np.repeat(counts.cumsum() - counts, counts)) / counts[ring]
        x, y = self._sheet(radius[ring] * np.cos(angles), radius[ring] * np.sin(angles))
        return x, y, (weights * q * self._profile(q * q) / counts)[ring]


@dataclasses.dataclass(frozen=True)
class Pad(Ellipse):
    """A rounded body's patch under the pressure of layers (:mod:`contactfpga.design.cover.layers`)."""

    SHARES: ClassVar[Floats] = np.linspace(0, 1, 33)
    """1 - (x/a)^2 - (y/b)^2 at which the pressure is stated."""

    pressures: tuple[float, ...] = tuple(2 * np.linspace(0, 1, 33))
    """Pressure over its mean at :data:`SHARES`."""

    @classmethod
    def of(cls, part: Ellipse, grown: float, pressures: Floats) -> Self:
        """A part whose half axes have ``grown``, under these pressures in any unit."""
        mean = float((pressures[1:] + pressures[:-1]).mean() / 2)  # as the share is even over the area
        values = tuple((pressures / mean).tolist())
        return cls(part.half_x_m * grown, part.half_y_m * grown, part.x_m, part.y_m, part.angle_rad, values)

    def _profile(self, share: Floats) -> Floats:
        return np.asarray(np.interp(share, self.SHARES, self.pressures))


@dataclasses.dataclass(frozen=True)
class Rectangle(_Shape):
    """A flat body's patch, with uniform pressure."""

    @property
    def area_m2(self) -> float:
        return 4 * self.half_x_m * self.half_y_m

    @property
    def half_box_m(self) -> tuple[float, float]:
        cosine, sine = abs(math.cos(self.angle_rad)), abs(math.sin(self.angle_rad))
        return self.half_x_m * cosine + self.half_y_m * sine, self.half_x_m * sine + self.half_y_m * cosine

    def reach_m(self, angle_rad: Floats) -> Floats:
        own = np.asarray(angle_rad, float) - self.angle_rad
        reach: Floats = self.half_x_m * np.abs(np.cos(own)) + self.half_y_m * np.abs(np.sin(own))
        return reach

    def contains(self, x_m: Floats, y_m: Floats) -> Floats:
        u, v = self._own(x_m, y_m)
        return np.asarray((np.abs(u) <= 1) & (np.abs(v) <= 1))

    def span(self, y_m: Floats) -> tuple[Floats, Floats]:
        y = np.asarray(y_m, float) - self.y_m
        cosine, sine = math.cos(self.angle_rad), math.sin(self.angle_rad)
        left, right = np.full(y.shape, -np.inf), np.full(y.shape, np.inf)
        for along, across, half in ((cosine, sine, self.half_x_m), (-sine, cosine, self.half_y_m)):
            if abs(along) < 1e-12:  # the strip runs along x
                hit = np.abs(across * y) <= half
                left, right = np.where(hit, left, np.inf), np.where(hit, right, -np.inf)
                continue
            middle, reach = -across * y / along, half / abs(along)
            left, right = np.maximum(left, middle - reach), np.minimum(right, middle + reach)
        hit = left <= right
        return np.where(hit, self.x_m + left, np.inf), np.where(hit, self.x_m + right, -np.inf)

    def kinks_m(self) -> tuple[float, ...]:
        corners = self._sheet(np.array([1.0, 1, -1, -1]), np.array([1.0, -1, 1, -1]))[1]
        return tuple(float(corner) for corner in np.sort(corners)[1:3])

    def density(self, x_m: Floats, y_m: Floats) -> Floats:
        return np.where(self.contains(x_m, y_m), 1 / self.area_m2, 0.0)

    def pressure(self, fineness_m: float) -> tuple[Floats, Floats, Floats]:
        u, u_weights = _gauss(6 + math.ceil(7 * self.half_x_m / fineness_m))
        v, v_weights = _gauss(6 + math.ceil(7 * self.half_y_m / fineness_m))
        x, y = self._sheet(np.repeat(u, len(v)), np.tile(v, len(u)))
        return x, y, np.outer(u_weights, v_weights).ravel() / 4
