"""Touches as physical objects: shape, place, force and motion. Lengths are in mm on the sheet laid flat.

x runs along the columns, y along the rows; cell (row 0, column 0) is at 0 mm; angles turn from x toward y.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable

import numpy as np

from contactfpga.design.cover import BODIES, Body, Cover, Ellipse, Indentation, Indenter, Load, Part, Rectangle
from contactfpga.design.cover.layers import Layer

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
    """Parts: of a body as they are at its depth, else as they are pressed; or a function of time in s."""
    body: str | Body | None = "finger"
    """What presses, or its name in :data:`contactfpga.design.cover.BODIES`; None: the shape is as it is pressed."""
    speed_mm_s: float | None = None
    """Speed at which a body comes, from its first touch at 0 s until it has its force; None: it has it at once."""
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

    def on(self, cover: Cover | None, pitch_x_mm: float, pitch_y_mm: float) -> Contact:
        """The contact as it is pressed on a cover over switches of this pitch.

        On a bare sheet a body has its shape at any force, and comes like one with a finger's flesh.
        """
        if self.body is None or callable(self.shape):
            return self
        body = BODIES[self.body] if isinstance(self.body, str) else self.body
        pitch = (pitch_x_mm * M, pitch_y_mm * M)
        bare = cover is None or cover.model == "patch"
        if bare and self.speed_mm_s is None:
            return dataclasses.replace(self, body=None)
        indentation = _indentation(None if bare else cover, self.shape, body, *pitch)
        full_m: Value = body.depth_m if bare else PressedDepth(indentation, self.force_n)
        if not bare and not callable(self.force_n):
            full_m = indentation.depth_m(self.force_n)
        if self.speed_mm_s is None:
            shape = PressedParts(indentation, full_m)
            return dataclasses.replace(self, body=None, shape=shape if callable(full_m) else shape(0.0))
        if callable(full_m):
            raise ValueError("the contact has speed_mm_s and a force over time; leave one of them out")
        depth_m = Approach(full_m, self.speed_mm_s * M)
        force = PressedForce(indentation, depth_m, at(self.force_n, 0.0) / max(indentation.force_n(full_m), 1e-300))
        return dataclasses.replace(self, body=None, shape=PressedParts(indentation, depth_m), force_n=force)

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


@functools.lru_cache(maxsize=4096)
def _indentation(cover: Cover | None, parts: Shape, body: Body, pitch_x_m: float, pitch_y_m: float) -> Indenter:
    if cover is not None:
        return cover.indentation(parts, body, pitch_x_m, pitch_y_m)
    flesh = body.flesh or BODIES["finger"].flesh
    assert flesh is not None
    return Indentation(parts, body.depth_m, [Layer(2 * body.depth_m, flesh.modulus_pa)])


@dataclasses.dataclass(frozen=True)
class Approach:
    """Depth in m of a body that comes at constant speed from 0 s on."""

    full_m: float
    speed_m_s: float

    @property
    def seconds(self) -> float:
        """Time until it has come."""
        return self.full_m / self.speed_m_s

    def __call__(self, seconds: float) -> float:
        return min(self.full_m, self.speed_m_s * seconds)


@dataclasses.dataclass(frozen=True)
class PressedDepth:
    """Depth in m of a body under a changing force."""

    indentation: Indenter
    force_n: Value

    def __call__(self, seconds: float) -> float:
        return self.indentation.depth_m(at(self.force_n, seconds))


@dataclasses.dataclass(frozen=True)
class PressedForce:
    """Force of a body at a changing depth, times ``scale``."""

    indentation: Indenter
    depth_m: Value
    scale: float

    def __call__(self, seconds: float) -> float:
        return self.scale * self.indentation.force_n(at(self.depth_m, seconds))


@dataclasses.dataclass(frozen=True)
class PressedParts:
    """Parts of a body at a depth, which may change."""

    indentation: Indenter
    depth_m: Value

    def __call__(self, seconds: float) -> Shape:
        return self.indentation.parts_at(max(SHALLOWEST_M, at(self.depth_m, seconds)))


SHALLOWEST_M = 1e-9


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
