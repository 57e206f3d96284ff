"""Touches as physical objects: shape, place, force and motion. Lengths are in mm on the sheet laid flat.

x runs along the columns, y along the rows; cell (row 0, column 0) is at 0 mm; angles turn from x toward y.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np

from contactfpga.design.cover import Ball, Ellipse, Load, Part, Rectangle

Value = float | Callable[[float], float]
"""A number, or a function of time in s."""

Shape = tuple[Part, ...]
"""Convex parts around the origin in m, which may overlap or be separate."""

M = 1e-3
"""Meters per mm."""


@dataclasses.dataclass(frozen=True)
class Track:
    """A piecewise linear value, constant beyond its end points."""

    seconds: tuple[float, ...]
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.seconds) != len(self.values) or not self.seconds:
            raise ValueError(f"a track has {len(self.seconds)} times and {len(self.values)} values; it needs as many")
        if any(later <= earlier for earlier, later in zip(self.seconds, self.seconds[1:])):
            raise ValueError(f"the times of a track are {self.seconds}; each must be later than the one before")

    def __call__(self, seconds: float) -> float:
        return float(np.interp(seconds, self.seconds, self.values))


@dataclasses.dataclass(frozen=True)
class Swing:
    """A swinging value: middle + reach cos(2 pi hertz t + phase_rad)."""

    middle: float
    reach: float
    hertz: float
    phase_rad: float = 0.0

    def __call__(self, seconds: float) -> float:
        return self.middle + self.reach * math.cos(2 * math.pi * self.hertz * seconds + self.phase_rad)


@dataclasses.dataclass(frozen=True)
class Round:
    """A sawtooth from ``start`` over ``length``, ``hertz`` times per second."""

    start: float
    length: float
    hertz: float

    def __call__(self, seconds: float) -> float:
        return self.start + self.length * (self.hertz * seconds % 1.0)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Contact:
    """An object that touches the sheet while its force is above 0."""

    shape: Shape | Callable[[float], Shape]
    """Parts, or a function of time in s."""
    x_mm: Value
    """Origin of the shape along the columns."""
    y_mm: Value
    """Origin of the shape along the rows."""
    angle_deg: Value = 0.0
    """Rotation of the shape."""
    force_n: Value = 10.0
    """Normal force; at most 0: no contact."""
    drag_n: tuple[Value, Value] = (0.0, 0.0)
    """Force along the surface, toward rising columns and rows; felt by units, not by switches."""
    torsion_nm: Value = 0.0
    """Moment about the outward normal; felt by units."""

    @property
    def still(self) -> bool:
        """Whether the contact is constant over time."""
        values = (getattr(self, field.name) for field in dataclasses.fields(self) if field.name != "drag_n")
        return not any(map(callable, (*values, *self.drag_n)))

    def load(self, seconds: float) -> Load | None:
        """Load on the cover at a time; None without contact."""
        force = at(self.force_n, seconds)
        if not force > 0:
            return None
        parts = self.shape(seconds) if callable(self.shape) else self.shape
        x, y = at(self.x_mm, seconds) * M, at(self.y_mm, seconds) * M
        angle = math.radians(at(self.angle_deg, seconds))
        return Load(tuple(part.placed(x, y, angle) for part in parts), force)


def at(value: Value, seconds: float) -> float:
    """A value at a time."""
    return value(seconds) if callable(value) else value


def disc(radius_mm: float) -> Shape:
    """A round patch."""
    return ellipse(radius_mm, radius_mm)


def ellipse(half_x_mm: float, half_y_mm: float) -> Shape:
    """An elliptic patch, by its half axes."""
    return (Ellipse(half_x_mm * M, half_y_mm * M),)


def edge(length_mm: float, width_mm: float) -> Shape:
    """A flat bar on its narrow side."""
    return (Rectangle(length_mm * M / 2, width_mm * M / 2),)


def palm(scale: float = 1.0) -> Shape:
    """A hand laid flat, 84 mm wide and 92 mm long, fingers toward -y: one contact around a hollow."""
    return _scaled(scale, (-24, 16, 18, 34), (26, 16, 16, 34), (0, -24, 42, 14), (0, 42, 30, 12))


def sole(length_mm: float = 260.0) -> Shape:
    """A bare right foot, toes toward -y: sole and big toe as two contacts, 8 mm apart for a foot of 260 mm."""
    scale = length_mm / 260
    outer = Rectangle(16 * M * scale, 50 * M * scale, 22 * M * scale, 25 * M * scale)
    return (*_scaled(scale, (4, 98, 30, 32), (-2, -50, 46, 36), (-26, -112, 15, 18)), outer)


def _scaled(scale: float, *ellipses: tuple[float, float, float, float]) -> Shape:
    return tuple(
        Ellipse(half_x * M * scale, half_y * M * scale, x * M * scale, y * M * scale)
        for x, y, half_x, half_y in ellipses
    )


@dataclasses.dataclass(frozen=True)
class ChangingPatch:
    """A ball's patch under a changing force: a disc of Hertz's radius."""

    ball: Ball
    force_n: Value

    def __call__(self, seconds: float) -> Shape:
        radius = self.ball.patch_m(at(self.force_n, seconds))
        return (Ellipse(radius, radius),)


BODY_PA = 2e5
"""Effective modulus E* of a fingertip on soft foam: chosen, not measured."""


@dataclasses.dataclass(frozen=True)
class Rise:
    """A force that rises from 0 s on: force_n (t / seconds)^(3/2), as of a round body at constant speed (Hertz)."""

    force_n: float
    seconds: float

    def __call__(self, seconds: float) -> float:
        return self.force_n * min(1.0, max(0.0, seconds) / self.seconds) ** 1.5


@dataclasses.dataclass(frozen=True)
class GrowingPatch:
    """Shape of a contact whose force is a :class:`Rise`: round parts grow as the force's cube root (Hertz), flat ones
    are full at once."""

    shape: Shape
    seconds: float

    def __call__(self, seconds: float) -> Shape:
        share = math.sqrt(min(1.0, max(1e-6, seconds / self.seconds)))
        return tuple(_shrunk(part, share) if isinstance(part, Ellipse) else part for part in self.shape)


def _shrunk(part: Ellipse, share: float) -> Ellipse:
    return dataclasses.replace(part, half_x_m=part.half_x_m * share, half_y_m=part.half_y_m * share)


def approaching(contact: Contact, speed_mm_s: float) -> Contact:
    """The contact, of fixed shape and force, arriving at 0 s at this speed until it has its force.

    Its final indentation is 3 F / (4 E* sqrt(a b)) if round, F / (2 E* sqrt(A / pi)) if flat (Johnson 4.2, 3.5), with
    E* = :data:`BODY_PA`; the deepest part counts.
    """
    if callable(contact.shape) or callable(contact.force_n):
        raise ValueError("the contact has a force or a shape of its own over time; it cannot approach as well")
    shares = Load(contact.shape, contact.force_n).shares()
    seconds = max(_depth_m(part, force) for part, force in shares) / (speed_mm_s * M)
    return dataclasses.replace(
        contact, shape=GrowingPatch(contact.shape, seconds), force_n=Rise(contact.force_n, seconds)
    )


def _depth_m(part: Part, force_n: float) -> float:
    if isinstance(part, Ellipse):
        return 0.75 * force_n / (BODY_PA * math.sqrt(part.half_x_m * part.half_y_m))
    return force_n / (2 * BODY_PA * math.sqrt(part.area_m2 / math.pi))


def pressed_ball(ball: Ball, force_n: Value, x_mm: Value, y_mm: Value) -> Contact:
    """A ball whose patch grows with its force."""
    return Contact(shape=ChangingPatch(ball, force_n), force_n=force_n, x_mm=x_mm, y_mm=y_mm)


def pair(
    gap_mm: float, radius_mm: float, x_mm: float, y_mm: float, angle_deg: float = 0.0, force_n: Value = 10.0
) -> tuple[Contact, Contact]:
    """Two fingers around a place, with ``gap_mm`` between their rims, at most 0 if they meet."""
    apart = gap_mm / 2 + radius_mm
    if not apart > 0:
        raise ValueError(f"gap_mm is {gap_mm}; two discs of {radius_mm} mm need more than {-2 * radius_mm:g} mm")
    dx, dy = apart * math.cos(math.radians(angle_deg)), apart * math.sin(math.radians(angle_deg))
    places = ((x_mm - dx, y_mm - dy), (x_mm + dx, y_mm + dy))
    first, second = (Contact(shape=disc(radius_mm), x_mm=x, y_mm=y, force_n=force_n) for x, y in places)
    return first, second
