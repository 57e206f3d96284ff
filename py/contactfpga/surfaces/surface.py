"""Surfaces of a sheet on its link: plane, cylinder and cone.

``place`` maps a place of the flat sheet, in mm, to point and outward unit normal in the link's frame; ``flat`` maps the
nearest point back. ``place`` of arrays returns arrays with one more axis. A NaN place, of a zone without cells, has a
NaN point.
"""

from __future__ import annotations

import dataclasses
import math
from typing import overload

import numpy as np

from contactfpga.surfaces import shapes
from contactfpga.surfaces.mesh import Mesh
from contactfpga.surfaces.shapes import Floats, SurfaceError, Vector, is_one, length


@dataclasses.dataclass(frozen=True)
class PlaneSurface:
    """The plane z = ``height_mm`` with outside toward larger z; x and y are the sheet's."""

    height_mm: float = 0.0

    def __post_init__(self) -> None:
        length("height_mm", self.height_mm)

    @overload
    def place(self, x_mm: float, y_mm: float) -> tuple[Vector, Vector]: ...

    @overload
    def place(self, x_mm: Floats, y_mm: Floats) -> tuple[Floats, Floats]: ...

    def place(self, x_mm: float | Floats, y_mm: float | Floats) -> tuple[Vector, Vector] | tuple[Floats, Floats]:
        """Point in mm and outward unit normal."""
        if is_one(x_mm, y_mm):
            return shapes.on_plane(x_mm, y_mm, self.height_mm)  # type: ignore[arg-type]
        x, y = np.broadcast_arrays(np.asarray(x_mm, float), np.asarray(y_mm, float))
        points = np.stack([x, y, np.full(x.shape, self.height_mm)], axis=-1)
        nowhere = np.isnan(x + y)[..., None]
        return np.where(nowhere, math.nan, points), np.where(nowhere, math.nan, shapes.UP)

    def flat(self, point_mm: Vector) -> tuple[float, float]:
        """Place in mm of the surface's nearest point."""
        return point_mm[0], point_mm[1]


@dataclasses.dataclass(frozen=True)
class CylinderSurface:
    """A cylinder about z; x goes around, from the x axis toward the y axis, y along z."""

    radius_mm: float

    def __post_init__(self) -> None:
        length("radius_mm", self.radius_mm, 0)

    @overload
    def place(self, x_mm: float, y_mm: float) -> tuple[Vector, Vector]: ...

    @overload
    def place(self, x_mm: Floats, y_mm: Floats) -> tuple[Floats, Floats]: ...

    def place(self, x_mm: float | Floats, y_mm: float | Floats) -> tuple[Vector, Vector] | tuple[Floats, Floats]:
        """Point in mm and outward unit normal."""
        if is_one(x_mm, y_mm):
            return shapes.on_cylinder(x_mm, y_mm, self.radius_mm)  # type: ignore[arg-type]
        x, y = np.broadcast_arrays(np.asarray(x_mm, float), np.asarray(y_mm, float))
        nowhere = np.isnan(x + y)
        cosine, sine = shapes.angles_of(np.where(nowhere, math.nan, x), self.radius_mm)
        points = np.stack([self.radius_mm * cosine, self.radius_mm * sine, np.where(nowhere, math.nan, y)], axis=-1)
        return points, np.stack([cosine, sine, np.where(nowhere, math.nan, 0.0)], axis=-1)

    def flat(self, point_mm: Vector) -> tuple[float, float]:
        """Place in mm of the surface's nearest point; x is within half a turn of 0."""
        return shapes.off_cylinder(point_mm, self.radius_mm)


@dataclasses.dataclass(frozen=True)
class Cone:
    """A cone about z, for instance a forearm, with a sheet bent around it without stretching.

    Distances on the sheet are distances on the cone. Column 0 is on a straight line from (``radius_mm``, 0, 0) toward
    larger z; row 0 is perpendicular to it there and climbs away from it.
    """

    radius_mm: float
    """Radius at z = 0."""
    slope: float
    """Growth of the radius per mm along z; below 0: it shrinks."""

    def __post_init__(self) -> None:
        length("radius_mm", self.radius_mm, 0)
        length("slope", self.slope, -100, "")
        if abs(self.slope) < 1e-9:
            raise SurfaceError(f"slope is {self.slope:g}; a cone without a slope is a cylinder: use that")

    @property
    def _sine(self) -> float:
        return self.slope / math.hypot(1, self.slope)

    @property
    def _cosine(self) -> float:
        return 1 / math.hypot(1, self.slope)

    @overload
    def place(self, x_mm: float, y_mm: float) -> tuple[Vector, Vector]: ...

    @overload
    def place(self, x_mm: Floats, y_mm: Floats) -> tuple[Floats, Floats]: ...

    def place(self, x_mm: float | Floats, y_mm: float | Floats) -> tuple[Vector, Vector] | tuple[Floats, Floats]:
        """Point in mm and outward unit normal. Raises :class:`SurfaceError` for a place beyond the tip."""
        sine, cosine = self._sine, self._cosine
        tip = self.radius_mm / sine  # the way from the tip to row 0 along column 0, with the slope's sign
        x, y = np.broadcast_arrays(np.asarray(x_mm, float), np.asarray(y_mm, float))
        along = tip + y
        if np.any(along * self.slope <= 0):
            raise SurfaceError(f"y is {float(y[along * self.slope <= 0][0]):g} mm; the cone's tip is at {-tip:g} mm")
        way = np.copysign(np.hypot(x, along), tip)
        angle = np.arctan2(x, np.abs(along)) / abs(sine)
        around, aside = np.cos(angle), np.sin(angle)
        radius = way * sine
        points = np.stack([radius * around, radius * aside, (way - tip) * cosine], axis=-1)
        normals = np.stack([cosine * around, cosine * aside, np.where(np.isnan(way), math.nan, -sine)], axis=-1)
        return (shapes.vector(points), shapes.vector(normals)) if is_one(x_mm, y_mm) else (points, normals)

    def flat(self, point_mm: Vector) -> tuple[float, float]:
        """Place in mm of the surface's nearest point, within half a turn of column 0."""
        sine, cosine = self._sine, self._cosine
        tip = self.radius_mm / sine
        out = math.hypot(point_mm[0], point_mm[1]) - self.radius_mm
        way = tip + out * sine + point_mm[2] * cosine
        angle = math.atan2(point_mm[1], point_mm[0]) * abs(sine)
        return abs(way) * math.sin(angle), way * math.cos(angle) - tip


@dataclasses.dataclass(frozen=True)
class MirroredSurface:
    """A surface whose x counts from the last column."""

    surface: PlaneSurface | CylinderSurface | Cone | Mesh
    width_mm: float
    """Distance from the first to the last column."""

    @overload
    def place(self, x_mm: float, y_mm: float) -> tuple[Vector, Vector]: ...

    @overload
    def place(self, x_mm: Floats, y_mm: Floats) -> tuple[Floats, Floats]: ...

    def place(self, x_mm: float | Floats, y_mm: float | Floats) -> tuple[Vector, Vector] | tuple[Floats, Floats]:
        """Point in mm and outward unit normal."""
        return self.surface.place(self.width_mm - x_mm, y_mm)  # type: ignore[arg-type]

    def flat(self, point_mm: Vector) -> tuple[float, float]:
        """Place in mm of the surface's nearest point."""
        x_mm, y_mm = self.surface.flat(point_mm)
        return self.width_mm - x_mm, y_mm
