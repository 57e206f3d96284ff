"""A sheet mounted with its columns the other way."""

from __future__ import annotations

import dataclasses
from typing import overload

from contactfpga.surfaces.mesh import Mesh
from contactfpga.surfaces.shapes import Floats, Vector
from contactfpga.surfaces.surface import Cone, Cylinder, Plane


@dataclasses.dataclass(frozen=True)
class Mirrored:
    """A surface on which x counts from the last column."""

    surface: Plane | Cylinder | Cone | Mesh
    width_mm: float
    """From the first to the last column."""

    @overload
    def place(self, x_mm: float, y_mm: float) -> tuple[Vector, Vector]: ...

    @overload
    def place(self, x_mm: Floats, y_mm: Floats) -> tuple[Floats, Floats]: ...

    def place(self, x_mm: float | Floats, y_mm: float | Floats) -> tuple[Vector, Vector] | tuple[Floats, Floats]:
        """Point in mm and outward unit normal."""
        return self.surface.place(self.width_mm - x_mm, y_mm)  # type: ignore[arg-type]

    def flat(self, point_mm: Vector) -> tuple[float, float]:
        """The place, in mm, of the surface's point nearest to this one."""
        x_mm, y_mm = self.surface.flat(point_mm)
        return self.width_mm - x_mm, y_mm
