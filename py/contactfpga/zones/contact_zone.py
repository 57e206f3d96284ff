"""One contact zone: its fields, their types in an array, and the order and the line in which a frame shows it."""

from __future__ import annotations

import dataclasses

import numpy as np

from contactfpga.surfaces.shapes import Vector

DTYPE = np.dtype(
    [
        ("area_cells", np.int64),
        ("sum_x", np.int64),
        ("sum_y", np.int64),
        ("area_mm2", np.float64),
        ("x_mm", np.float64),
        ("y_mm", np.float64),
        ("point_mm", np.float64, 3),
        ("normal", np.float64, 3),
        ("ghost", np.bool_),
        ("winding", np.dtype("U5")),
    ]
)
"""Fields of :attr:`Zones.array`, the same as those of :class:`Zone`."""

_UNSENT = ("sum_x", "sum_y")
DIVIDED_DTYPE = np.dtype([(name, DTYPE[name]) for name in DTYPE.names or () if name not in _UNSENT])
"""The same with ``report = "barycenter"``, whose boards send no sums."""


@dataclasses.dataclass(frozen=True, slots=True)
class Zone:
    """One contact zone."""

    area_cells: int
    """Pressed cells."""
    sum_x: int | None
    """Sum of the cells' columns, exact; None with ``report = "barycenter"``, which does not send it. Where the ends of
    the sheet meet, columns are counted on past the seam, so that the zone's x is this sum / area; not in a zone that is
    :attr:`winding`."""
    sum_y: int | None
    """Sum of the cells' rows, exact; None likewise."""
    area_mm2: float
    """Area of the cells in mm2, measured on the sheet."""
    x_mm: float | None
    """Barycenter along the columns in mm, on the sheet laid flat; column 0 lies at 0. It is off by at most
    :attr:`Zones.rounding_mm`. None for a zone without cells, which lies nowhere: only a frame that is flagged
    ``mismatch`` can hold one. Where the ends of the sheet meet it lies from 0 to the circumference; None for a zone
    that is :attr:`winding`, which has a y but no x, no point and no normal."""
    y_mm: float | None
    """Barycenter along the rows in mm; row 0 lies at 0. It is off by at most :attr:`Zones.rounding_mm`. None as
    ``x_mm``."""
    point_mm: Vector | None
    """Barycenter in the link's frame in mm; it lies on the surface. None as ``x_mm``."""
    normal: Vector | None
    """Outward unit normal at that point. None as ``x_mm``."""
    ghost: bool = False
    """On a sheet without diodes: other pressed switches may have made all of it, with nothing pressed here."""
    winding: str = ""
    """On a sheet whose ends meet: ``ring``, a way through the zone's cells leads round the cylinder and back to where
    it began, or ``wound``, it does not, but the cells lie on more than two turns. Else empty."""


def order(zone: Zone) -> tuple[bool, float, bool, float, int]:
    """Zones that lie nowhere come last."""
    return zone.y_mm is None, zone.y_mm or 0.0, zone.x_mm is None, zone.x_mm or 0.0, zone.area_cells


def line_of(zone: Zone) -> str:
    where = "nowhere" if zone.x_mm is None else f"at x {zone.x_mm:.2f} mm, y {zone.y_mm:.2f} mm"
    if zone.winding:
        where = f"{zone.winding} at y {zone.y_mm:.2f} mm"
    return f"  {zone.area_cells} cells, {zone.area_mm2:g} mm2 {where}"
