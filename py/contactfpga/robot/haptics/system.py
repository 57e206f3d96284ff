"""The linear system of one frame: forces at known places, and the wrench that they exert, weighted by its noise."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np

from contactfpga.robot.haptics.answer import Floats, HapticsError, Vector
from contactfpga.robot.haptics.contact import Touch
from contactfpga.robot.haptics.vectors import turning
from contactfpga.robot.haptics.wrench import Wrench

SAME_M = 1e-9
"""Points nearer to each other than this are one."""


class System:
    """A wrench, where it is exerted, and how its parts are weighed.

    Without noise a newton counts as much as a newton times the contacts' mean distance, about their barycenter: then
    the answer hangs neither on the frame nor on the unit of length.
    """

    def __init__(self, wrench: Wrench, touches: Sequence[Touch]):
        self.touches = touches
        self.noise = wrench.noise
        self.given = wrench
        self.points: list[Vector] = [touch.point_m for touch in touches]
        if self.noise is None:
            self._about_barycenter()
        else:
            self.wrench = wrench.array
            self.weight = self.noise.information

    def _about_barycenter(self) -> None:
        count = len(self.points)
        x, y, z = (sum(axis) / count for axis in zip(*self.points))
        self.points = [(px - x, py - y, pz - z) for px, py, pz in self.points]
        (fx, fy, fz), (mx, my, mz) = self.given.force_n, self.given.moment_nm
        self.wrench = np.array((fx, fy, fz, mx - (y * fz - z * fy), my - (z * fx - x * fz), mz - (x * fy - y * fx)))
        square = sum(px * px + py * py + pz * pz for px, py, pz in self.points) / count
        per_moment = 1 / square if square > SAME_M**2 else 1.0
        self.weight = np.diag((1.0, 1.0, 1.0, per_moment, per_moment, per_moment))

    @functools.cached_property
    def root(self) -> Floats:
        """Root of the weight: its transpose times the root is the weight."""
        return np.sqrt(self.weight) if self.noise is None else self.noise.root

    def matrix(self) -> Floats:
        """The matrix (6, 3k) from k forces in N to the wrench in N and Nm."""
        rows: list[list[float]] = [[], [], [], [], [], []]
        for x, y, z in self.points:
            rows[0] += (1.0, 0.0, 0.0)
            rows[1] += (0.0, 1.0, 0.0)
            rows[2] += (0.0, 0.0, 1.0)
            rows[3] += (0.0, -z, y)
            rows[4] += (z, 0.0, -x)
            rows[5] += (-y, x, 0.0)
        return np.array(rows)

    def pushes(self) -> Floats:
        """The matrix (6, k) from k pushes in N along the normals to the wrench in N and Nm."""
        columns = []
        for (x, y, z), touch in zip(self.points, self.touches):
            nx, ny, nz = touch.normal
            columns.append((-nx, -ny, -nz, z * ny - y * nz, x * nz - z * nx, y * nx - x * ny))
        return np.array(columns).T

    @functools.cached_property
    def length_m(self) -> float:
        """The contacts' mean distance from their barycenter, or 1 where they are one."""
        points = np.array(self.points)
        length = math.sqrt(((points - points.mean(axis=0)) ** 2).sum() / len(points))
        return length if length > SAME_M else 1.0

    def centered(self, matrix: Floats) -> Floats:
        """A matrix to wrenches with moments about the contacts' barycenter and over their distance, for its rank."""
        x, y, z = np.mean(self.points, axis=0)
        moved = np.array(matrix)
        moved[3:] -= turning((x, y, z)) @ moved[:3]
        moved[3:] /= self.length_m
        return moved

    def places_widen(self, forces: Floats) -> bool:
        """Add to the noise what the contacts' uncertain places do to the moments; False where places are certain."""
        if self.noise is None or not any(touch.point_sigma_m for touch in self.touches):
            return False
        more = np.zeros((3, 3))
        for touch, force in zip(self.touches, forces.reshape(-1, 3)):
            more += touch.point_sigma_m**2 * (float(force @ force) * np.eye(3) - force[:, None] * force)
        if self.noise.rank == 6:
            covariance = np.array(self.noise.covariance)
            covariance[3:, 3:] += more
            self.weight = np.asarray(np.linalg.inv(covariance), float)
        else:
            self.noise = self.noise.widened(more)
            self.weight = self.noise.information
        self.__dict__.pop("root", None)
        return True

    def chi2(self, rest: Floats) -> float | None:
        """Chi-square of a residual (6,); None without noise."""
        return None if self.noise is None else float(rest @ self.weight @ rest)

    def freedom(self, rank: int) -> int:
        """How many components of the wrench are left to check forces of this rank."""
        return max(0, (6 if self.noise is None else self.noise.rank) - rank)


def distinct(touches: Sequence[Touch]) -> None:
    """Raises :class:`HapticsError` where two touches lie at one place: nothing tells their forces apart."""
    for last, one in enumerate(touches):
        for first in range(last):
            if math.dist(one.point_m, touches[first].point_m) < SAME_M:
                raise HapticsError(f"contacts {first} and {last} both lie at {one.point_m}; give one of them")
