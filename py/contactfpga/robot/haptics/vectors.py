"""Three numbers at a time in plain Python: for these numpy takes several times as long."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contactfpga.robot.haptics.answer import Floats, Vector


def dot(first: Sequence[float], second: Sequence[float]) -> float:
    """The inner product."""
    return first[0] * second[0] + first[1] * second[1] + first[2] * second[2]


def cross(first: Sequence[float], second: Sequence[float]) -> Vector:
    """The vector product."""
    ax, ay, az = first
    bx, by, bz = second
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def minus(vector: Vector) -> Vector:
    """The opposite."""
    return -vector[0], -vector[1], -vector[2]


def turning(point: Sequence[float]) -> Floats:
    """The matrix (3, 3) from a force in N at the point in m to its moment in Nm about the origin."""
    x, y, z = point
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def solve_symmetric(matrix: Sequence[Sequence[float]], wanted: Vector) -> Vector:
    """The x with ``matrix`` x = ``wanted``. The (3, 3) matrix must be symmetric and positive definite."""
    (a, b, c), (_, d, e), (_, _, f) = matrix
    low = b / a
    lower = c / a
    second = d - low * b
    mixed = e - low * c
    third = f - lower * c - mixed * mixed / second
    x, y, z = wanted
    y -= low * x
    z -= lower * x + mixed / second * y
    z /= third
    y = (y - mixed * z) / second
    return (x - b * y - c * z) / a, y, z
