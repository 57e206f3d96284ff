"""Surfaces of links: point and outward normal of a place on the sheet, in mm."""

import functools

from contactfpga.skin.sheet import Sheet
from contactfpga.surfaces.mesh import Mesh
from contactfpga.surfaces.shapes import SurfaceError
from contactfpga.surfaces.surface import Cone, CylinderSurface, MirroredSurface, PlaneSurface

Surface = PlaneSurface | CylinderSurface | Cone | Mesh | MirroredSurface

__all__ = ["Cone", "CylinderSurface", "Mesh", "MirroredSurface", "PlaneSurface", "Surface", "SurfaceError", "of"]


def of(sheet: Sheet) -> PlaneSurface | CylinderSurface:
    """The surface of a sheet."""
    return _of(sheet.radius_mm)


@functools.lru_cache(maxsize=256)  # each frame asks, and all frames of a sheet have the same one
def _of(radius_mm: float | None) -> PlaneSurface | CylinderSurface:
    return PlaneSurface() if radius_mm is None else CylinderSurface(radius_mm)
