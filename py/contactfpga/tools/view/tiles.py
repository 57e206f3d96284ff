"""Places of a sheet's cells in space, and the place that a mouse ray meets."""

from __future__ import annotations

import math

import numpy as np

from contactfpga import surfaces
from contactfpga.skin.sheet import Sheet

MM = 1e-3


class Tiles:
    """A tile for each cell, row by row."""

    def __init__(self, sheet: Sheet, surface: surfaces.Surface | None = None):
        self.sheet = sheet
        self.surface = surface or surfaces.of(sheet)
        rows, columns = np.divmod(np.arange(sheet.rows * sheet.columns), sheet.columns)
        self.x_mm, self.y_mm = columns * sheet.pitch_x_mm, rows * sheet.pitch_y_mm
        """(n,) positions on the sheet laid flat."""
        self.points_mm, self.normals = self.surface.place(self.x_mm, self.y_mm)
        """(n, 3) points in mm, and outward normals."""
        self.along_x = self._along(0.5 * sheet.pitch_x_mm, 0.0)
        """(n, 3) unit vectors of growing x."""
        self.along_y = np.cross(self.normals, self.along_x)
        sense = np.sign((self.along_y * self._along(0.0, 0.5 * sheet.pitch_y_mm)).sum(-1, keepdims=True))
        self.along_y = self.along_y * np.where(sense == 0, 1, sense)

    def _along(self, dx_mm: float, dy_mm: float) -> np.ndarray:
        after, _ = self.surface.place(self.x_mm + dx_mm, self.y_mm + dy_mm)
        before, _ = self.surface.place(self.x_mm - dx_mm, self.y_mm - dy_mm)
        step = after - before
        step -= (step * self.normals).sum(-1, keepdims=True) * self.normals
        unit: np.ndarray = step / np.linalg.norm(step, axis=-1, keepdims=True)
        return unit

    @property
    def wxyzs(self) -> np.ndarray:
        """(n, 4) quaternions that turn z into each tile's normal and x into the direction of growing x."""
        across = np.cross(self.normals, self.along_x)
        return quaternions(np.stack([self.along_x, across, self.normals], -1))

    @property
    def middle_mm(self) -> np.ndarray:
        """(3,) middle of the box around the sheet."""
        middle: np.ndarray = (self.points_mm.min(0) + self.points_mm.max(0)) / 2
        return middle

    @property
    def size_mm(self) -> float:
        """Diagonal of the box around the sheet."""
        reach = self.points_mm.max(0) - self.points_mm.min(0)
        return float(np.linalg.norm(reach)) + max(self.sheet.pitch_x_mm, self.sheet.pitch_y_mm)

    def met(self, origin_mm: np.ndarray, direction: np.ndarray) -> tuple[float, float] | None:
        """The place, x and y in mm, where a ray meets the sheet from outside; None: it misses.

        The tile nearest to the ray counts as flat, so that this works on any surface.
        """
        direction = direction / np.linalg.norm(direction)
        facing = self.normals @ direction < -1e-6
        ahead = (self.points_mm - origin_mm) @ direction
        aside = np.linalg.norm(self.points_mm - origin_mm - ahead[:, None] * direction, axis=-1)
        aside[~facing | (ahead <= 0)] = math.inf
        tile = int(aside.argmin())
        pitch_x_mm, pitch_y_mm = self.sheet.pitch_x_mm, self.sheet.pitch_y_mm
        if aside[tile] > math.hypot(pitch_x_mm, pitch_y_mm):
            return None
        normal = self.normals[tile]
        far = ((self.points_mm[tile] - origin_mm) @ normal) / (direction @ normal)
        off = origin_mm + far * direction - self.points_mm[tile]
        dx, dy = float(off @ self.along_x[tile]), float(off @ self.along_y[tile])
        half_x, half_y = pitch_x_mm / 2, pitch_y_mm / 2
        return (
            float(self.x_mm[tile]) + min(max(dx, -half_x), half_x),
            float(self.y_mm[tile]) + min(max(dy, -half_y), half_y),
        )


def quaternions(rotations: np.ndarray) -> np.ndarray:
    """(n, 4) w, x, y, z of (n, 3, 3) rotations."""
    found = np.empty((len(rotations), 4))
    for index, m in enumerate(rotations):
        # The largest of the four is taken from the diagonal, the others from it: no division by what may be 0.
        squares = np.array([1 + m[0, 0] + m[1, 1] + m[2, 2], 1 + m[0, 0] - m[1, 1] - m[2, 2]])
        squares = np.append(squares, [1 - m[0, 0] + m[1, 1] - m[2, 2], 1 - m[0, 0] - m[1, 1] + m[2, 2]])
        best = int(squares.argmax())
        s = 2 * math.sqrt(squares[best])
        differences = (m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1])
        sums = {(0, 1): m[0, 1] + m[1, 0], (0, 2): m[0, 2] + m[2, 0], (1, 2): m[1, 2] + m[2, 1]}
        if best == 0:
            found[index] = (s / 4, *(value / s for value in differences))
            continue
        axis = best - 1
        vector = [s / 4 if other == axis else sums[min(axis, other), max(axis, other)] / s for other in range(3)]
        found[index] = (differences[axis] / s, *vector)
    return found
