"""Plane and cylinder as functions in any unit of length; errors of surfaces."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.values import is_finite, shown

Floats = NDArray[np.float64]
Vector = tuple[float, float, float]
UP: Vector = (0.0, 0.0, 1.0)


def on_plane(x: float, y: float, height: float) -> tuple[Vector, Vector]:
    """Point and outward normal of a place on the plane z = ``height``."""
    return (x, y, height), UP


def on_cylinder(x: float, y: float, radius: float) -> tuple[Vector, Vector]:
    """Point and outward normal of a place on a cylinder about z: ``x``: arc length from the x axis toward the y axis,
    ``y``: along z."""
    angle = x / radius
    cosine, sine = math.cos(angle), math.sin(angle)
    return (radius * cosine, radius * sine, y), (cosine, sine, 0.0)


def off_cylinder(point: Vector, radius: float) -> tuple[float, float]:
    """Place of the cylinder's nearest point, with an arc within half a turn of 0."""
    return radius * math.atan2(point[1], point[0]), point[2]


def angles_of(x: Floats, radius: float) -> tuple[Floats, Floats]:
    """Cosines and sines of arc lengths by the scalar functions; numpy's may differ in the last bit."""
    return _each(math.cos, x / radius), _each(math.sin, x / radius)


def _each(function: Callable[[float], float], values: Floats) -> Floats:
    return np.array([function(value) for value in values.ravel().tolist()], float).reshape(values.shape)


def vector(values: Floats) -> Vector:
    x, y, z = values.tolist()
    return x, y, z


def is_one(*values: Any) -> bool:
    return all(isinstance(value, (float, int)) for value in values)


LONGEST_MM = 1e6


class SurfaceError(ContactFPGAError, ValueError):
    """An impossible surface or place."""


def length(name: str, value: Any, low: float = -LONGEST_MM, unit: str = "mm") -> float:
    """``value`` as a float if it is a number above ``low``. Raises :class:`SurfaceError`."""
    if not is_finite(value) or not low < value <= LONGEST_MM:
        what = f"a number above {low:g} and at most {LONGEST_MM:g} {unit}".rstrip()
        raise SurfaceError(f"{name} is {shown(value)}; it must be {what}")
    return float(value)
