"""Checks of a bumper's numbers, and vectors of three numbers in plain Python, faster than numpy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.values import is_finite, shown
from contactfpga.surfaces.shapes import Floats, Vector

LARGEST = 1e9
"""Largest SI value in a file, whose powers are finite."""


SMALLEST = 1e-9
"""Smallest positive value, whose inverse is finite."""


class HapticsError(ContactFPGAError, ValueError):
    """An impossible value of a bumper, unit or contact."""


def number(name: str, value: Any, low: float = -LARGEST, high: float = LARGEST, unit: str = "") -> float:
    """Check a number from ``low`` to ``high``; raises :class:`HapticsError`."""
    if not is_finite(value) or not low <= value <= high:
        raise HapticsError(f"{name} is {shown(value)}; it must be a number from {low:g} to {high:g} {unit}".rstrip())
    return float(value)


def positive(name: str, value: Any, unit: str) -> float:
    """Check a number above 0; raises :class:`HapticsError`."""
    if not is_finite(value) or not 0 < value <= LARGEST:
        raise HapticsError(f"{name} is {shown(value)}; it must be a number above 0 and at most {LARGEST:g} {unit}")
    if value < SMALLEST:
        raise HapticsError(f"{name} is {shown(value)}; it must be at least {SMALLEST:g} {unit}")
    return float(value)


def within(name: str, values: Sequence[float], unit: str) -> None:
    """Raise :class:`HapticsError` unless all values are finite numbers."""
    for value in values:
        if not -LARGEST <= value <= LARGEST:
            raise HapticsError(
                f"{name} has a value of {shown(value)}; each must be a number from {-LARGEST:g} to {LARGEST:g} {unit}"
            )


def array(name: str, values: Any) -> Floats:
    """An array of finite numbers, of any shape; raises :class:`HapticsError`."""
    try:
        found = np.asarray(values, float)
    except OverflowError:  # one of Python's whole numbers
        found = np.asarray(np.inf)
    if not (np.abs(found) <= LARGEST).all():
        raise HapticsError(f"{name} have a value that is no finite number; all must be at most {LARGEST:g} in size")
    return found


def vector(name: str, value: Any, unit: str) -> Vector:
    """Three numbers; raises :class:`HapticsError`."""
    if not _is_list(value) or len(value) != 3:
        raise HapticsError(f"{name} is {shown(value)}; it must be a list of three numbers, x, y and z {unit}".rstrip())
    x, y, z = (number(f"{name}[{index}]", one, unit=unit) for index, one in enumerate(value))
    return x, y, z


def direction(name: str, value: Any) -> Vector:
    """Three numbers as a unit vector; raises :class:`HapticsError` if they are all 0."""
    x, y, z = vector(name, value, "")
    length = math.hypot(x, y, z)
    if length < 1e-9:
        raise HapticsError(f"{name} is {shown(value)}; it must point somewhere, and its length is 0")
    return x / length, y / length, z / length


def matrix(name: str, value: Any, rows: int, columns: int) -> Floats:
    """``rows`` lists of ``columns`` numbers; raises :class:`HapticsError`."""
    shape = f"{rows} lists of {columns} numbers each"
    if not _is_list(value) or len(value) != rows or not all(_is_list(row) and len(row) == columns for row in value):
        raise HapticsError(f"{name} is {shown(value)}; it must be {shape}")
    read = [[number(f"{name}[{r}][{c}]", one) for c, one in enumerate(row)] for r, row in enumerate(value)]
    return np.array(read, float).reshape(rows, columns)


def _is_list(value: Any) -> bool:
    return isinstance(value, (Sequence, np.ndarray)) and not isinstance(value, (str, bytes))


def dot(first: Sequence[float], second: Sequence[float]) -> float:
    return first[0] * second[0] + first[1] * second[1] + first[2] * second[2]


def cross(first: Sequence[float], second: Sequence[float]) -> Vector:
    ax, ay, az = first
    bx, by, bz = second
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def minus(vector: Vector) -> Vector:
    return -vector[0], -vector[1], -vector[2]


def skew(point: Sequence[float]) -> Floats:
    """(3, 3) matrix from a force at the point to its moment about the origin."""
    x, y, z = point
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
