"""Where places of a sheet lie on its link: point and outward normal, in mm."""

import functools

from contactfpga.skin.sheet import Sheet
from contactfpga.surfaces.mesh import Mesh
from contactfpga.surfaces.shapes import SurfaceError
from contactfpga.surfaces.surface import Cone, Cylinder, Mirrored, Plane

Surface = Plane | Cylinder | Cone | Mesh | Mirrored

__all__ = ["Cone", "Cylinder", "Mesh", "Mirrored", "Plane", "Surface", "SurfaceError", "of"]


def of(sheet: Sheet) -> Plane | Cylinder:
    """The surface that a Skin, or a board's hello, tells of."""
    return _of(sheet.radius_mm)


@functools.lru_cache(maxsize=256)  # each frame asks, and all frames of a sheet have the same one
def _of(radius_mm: float | None) -> Plane | Cylinder:
    return Plane() if radius_mm is None else Cylinder(radius_mm)
