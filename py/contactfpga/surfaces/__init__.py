"""Where places of a sheet lie on its link: point and outward normal, in mm."""

from contactfpga.skin.sheet import Sheet
from contactfpga.surfaces.answer import SurfaceError
from contactfpga.surfaces.mesh import Mesh
from contactfpga.surfaces.mirrored import Mirrored
from contactfpga.surfaces.surface import Cone, Cylinder, Plane

Surface = Plane | Cylinder | Cone | Mesh | Mirrored

__all__ = ["Cone", "Cylinder", "Mesh", "Mirrored", "Plane", "Surface", "SurfaceError", "of"]


def of(sheet: Sheet) -> Plane | Cylinder:
    """The surface that a Skin, or a board's hello, tells of."""
    return Plane() if sheet.radius_mm is None else Cylinder(sheet.radius_mm)
