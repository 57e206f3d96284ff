"""A surface of any shape: a table of point and normal at each cell."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any, overload

import numpy as np

from contactfpga.inputs import array_file
from contactfpga.inputs.array_file import ArrayFileError
from contactfpga.inputs.files import replaced
from contactfpga.skin.sheet import MAX_LINES
from contactfpga.surfaces.shapes import Floats, SurfaceError, Vector, is_one, length, vector

KEYS = ("points_mm", "normals", "pitch_mm", "closed")
MAX_BYTES = 8 * 3 * MAX_LINES**2
BEYOND = 1.0
"""Pitches beyond the outermost cells to which the surface is extrapolated."""
STEPS = 30
"""Most steps of the search for a point's place."""


@dataclasses.dataclass(frozen=True, eq=False)
class Mesh:
    """A surface with points and normals interpolated between cells."""

    points_mm: Floats
    """(R, C, 3) in the link's frame."""
    normals: Floats
    """(R, C, 3) outward unit normals."""
    pitch_x_mm: float
    pitch_y_mm: float
    closed: bool = False
    """Whether column 0 is a neighbor of the last column."""

    def __post_init__(self) -> None:
        points, normals = (np.array(one, float) for one in (self.points_mm, self.normals))
        shape = points.shape
        if len(shape) != 3 or shape[2] != 3 or not all(2 <= one <= MAX_LINES for one in shape[:2]):
            raise SurfaceError(
                f"points_mm has the shape {shape}; it must be (rows, columns, 3), 2 to {MAX_LINES} lines"
            )
        if normals.shape != shape:
            raise SurfaceError(f"normals has the shape {normals.shape}; it must be that of points_mm, {shape}")
        if not (np.isfinite(points).all() and np.isfinite(normals).all()):
            raise SurfaceError("points_mm and normals must be finite numbers")
        sizes = np.linalg.norm(normals, axis=2)
        if (sizes < 1e-9).any():
            row, column = np.argwhere(sizes < 1e-9)[0]
            raise SurfaceError(f"the normal at row {row}, column {column} has no direction")
        for name, value in (("points_mm", points), ("normals", normals / sizes[..., None])):
            value.flags.writeable = False
            object.__setattr__(self, name, value)
        length("pitch_x_mm", self.pitch_x_mm, 0)
        length("pitch_y_mm", self.pitch_y_mm, 0)

    @classmethod
    def load(cls, path: str | Path) -> Mesh:
        """Read a table of :meth:`save`. Raises :class:`SurfaceError`, OSError."""
        try:
            found = {key: one.astype(float) for key, one in array_file.read(path, KEYS, MAX_BYTES).items()}
            if missing := [key for key in KEYS if key not in found]:
                raise ArrayFileError(f"it has no {missing[0]}")
        except ArrayFileError as error:
            raise SurfaceError(f"{path}: not a table of `contactfpga body surface`: {error}") from None
        try:
            if found["pitch_mm"].shape != (2,) or found["closed"].shape != ():
                raise SurfaceError("pitch_mm must be two numbers, and closed one")
            x, y = found["pitch_mm"].tolist()
            return cls(found["points_mm"], found["normals"], x, y, bool(found["closed"]))
        except SurfaceError as error:
            raise SurfaceError(f"{path}: {error}") from None

    def save(self, path: str | Path) -> None:
        """Write the table as a .npz file."""
        pitch = np.array([self.pitch_x_mm, self.pitch_y_mm])
        with replaced(path) as new, open(new, "wb") as file:
            np.savez(file, points_mm=self.points_mm, normals=self.normals, pitch_mm=pitch, closed=np.array(self.closed))

    @property
    def lines(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.points_mm.shape[0], self.points_mm.shape[1]

    @overload
    def place(self, x_mm: float, y_mm: float) -> tuple[Vector, Vector]: ...

    @overload
    def place(self, x_mm: Floats, y_mm: Floats) -> tuple[Floats, Floats]: ...

    def place(self, x_mm: float | Floats, y_mm: float | Floats) -> tuple[Vector, Vector] | tuple[Floats, Floats]:
        """Point in mm and outward unit normal. Raises :class:`SurfaceError` for a place off the sheet."""
        x, y = np.broadcast_arrays(np.asarray(x_mm, float), np.asarray(y_mm, float))
        nowhere = np.isnan(x + y)
        u, v = np.where(nowhere, 0.0, x / self.pitch_x_mm), np.where(nowhere, 0.0, y / self.pitch_y_mm)
        self._check(u, v)
        points = self._mixed(self.points_mm, u, v)
        normals = self._mixed(self.normals, u, v)
        normals = normals / np.linalg.norm(normals, axis=-1)[..., None]
        points[nowhere] = normals[nowhere] = math.nan
        if is_one(x_mm, y_mm):
            return vector(points), vector(normals)
        return points, normals

    def flat(self, point_mm: Vector) -> tuple[float, float]:
        """Place in mm of the surface's nearest point, searched from the nearest cell."""
        target = np.array(point_mm, float)
        rows, columns = self.lines
        nearest = int(np.linalg.norm(self.points_mm - target, axis=2).argmin())
        place = np.array([nearest % columns, nearest // columns], float)
        best, least = place, math.inf
        for _ in range(STEPS):
            away = target - self._mixed(self.points_mm, place[0], place[1])
            if (distance := float(away @ away)) < least:
                best, least = place, distance
            along = np.stack(self._slopes(place[0], place[1]), axis=1)
            step = np.linalg.lstsq(along, away, rcond=None)[0]
            place = place + np.clip(step, -1, 1)
            place[1] = min(max(place[1], -0.5), rows - 0.5)
            if not self.closed:
                place[0] = min(max(place[0], -0.5), columns - 0.5)
            if np.abs(step).max() < 1e-12:
                break
        x = best[0] % columns if self.closed else best[0]
        return float(x * self.pitch_x_mm), float(best[1] * self.pitch_y_mm)

    def _check(self, u: Floats, v: Floats) -> None:
        rows, columns = self.lines
        for name, value, lines, pitch in (("x", u, columns, self.pitch_x_mm), ("y", v, rows, self.pitch_y_mm)):
            if name == "x" and self.closed:
                continue
            off = (value < -BEYOND) | (value > lines - 1 + BEYOND)
            if off.any():
                far = f"the table goes from 0 to {(lines - 1) * pitch:g} mm"
                raise SurfaceError(f"{name} is {float(value[off].flat[0]) * pitch:g} mm; {far}")

    def _around(self, u: Any, v: Any) -> tuple[Any, Any, Any, Any, Any, Any]:
        """Rows and columns of the four cells around a place, and the offset from the first."""
        rows, columns = self.lines
        row = np.clip(np.floor(v).astype(int), 0, rows - 2)
        if self.closed:
            column = np.floor(u).astype(int)
            return row, row + 1, column % columns, (column + 1) % columns, u - column, v - row
        column = np.clip(np.floor(u).astype(int), 0, columns - 2)
        return row, row + 1, column, column + 1, u - column, v - row

    def _mixed(self, table: Floats, u: Any, v: Any) -> Floats:
        low, high, left, right, across, up = self._around(u, v)
        across, up = np.asarray(across)[..., None], np.asarray(up)[..., None]
        bottom = (1 - across) * table[low, left] + across * table[low, right]
        top = (1 - across) * table[high, left] + across * table[high, right]
        return np.asarray((1 - up) * bottom + up * top)

    def _slopes(self, u: Any, v: Any) -> tuple[Floats, Floats]:
        low, high, left, right, across, up = self._around(u, v)
        p = self.points_mm
        along_u = (1 - up) * (p[low, right] - p[low, left]) + up * (p[high, right] - p[high, left])
        along_v = (1 - across) * (p[high, left] - p[low, left]) + across * (p[high, right] - p[low, right])
        return along_u, along_v

    @property
    def spacing_mm(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Least and largest distance of neighbors along a row, and along a column."""
        p = self.points_mm
        next_column = np.roll(p, -1, axis=1) if self.closed else p[:, 1:]
        along_x = np.linalg.norm(next_column - p[:, : next_column.shape[1]], axis=2)
        along_y = np.linalg.norm(p[1:] - p[:-1], axis=2)
        return (float(along_x.min()), float(along_x.max())), (float(along_y.min()), float(along_y.max()))
