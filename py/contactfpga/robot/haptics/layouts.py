"""Where pressure units may stand under a bumper: the arrangements at hand."""

from __future__ import annotations

import dataclasses
import math

from contactfpga.robot.haptics.answer import Vector
from contactfpga.robot.haptics.unit import Unit
from contactfpga.robot.haptics.units import LoadCells


@dataclasses.dataclass(frozen=True)
class Layout:
    """Units with a name."""

    name: str
    cells: LoadCells


def _unit(radius_m: float, degrees: float, z_m: float, tilt: float, sign: float) -> Unit:
    angle = math.radians(degrees)
    x, y = math.cos(angle), math.sin(angle)
    across = sign * math.cos(tilt)
    axis: Vector = (-across * y, across * x, math.sin(tilt))
    return Unit((radius_m * x, radius_m * y, z_m), axis)


def hexapod(radius_m: float, tilt: float, z_m: float = 0.0) -> LoadCells:
    """Six units on a ring about z, one every 60 degrees. Each is tilted by ``tilt`` rad from the ring toward z,
    in turn to one side and to the other."""
    return LoadCells([_unit(radius_m, 60 * i, z_m, tilt, (-1) ** i) for i in range(6)])


def two_rings(radius_m: float, tilt: float, low_m: float, high_m: float) -> LoadCells:
    """The same six units, those tilted to one side on a ring at ``low_m``, the others on one at ``high_m``."""
    return LoadCells([_unit(radius_m, 60 * i, high_m if i % 2 else low_m, tilt, (-1) ** i) for i in range(6)])


def tripod(radius_m: float, z_m: float = 0.0) -> LoadCells:
    """Three units along z at 90, 210 and 330 degrees: the force on a plane, and where it acts, but no friction."""
    return LoadCells([_unit(radius_m, 90 + 120 * i, z_m, math.pi / 2, 1) for i in range(3)])


TILTS = tuple(range(30, 80, 5))
"""Degrees that :func:`on_cylinder` scans."""


def on_cylinder(radius_m: float, low_m: float, high_m: float) -> list[Layout]:
    """Arrangements on rings of this radius, in m, in a cylinder that is touched from z = ``low_m`` to ``high_m``."""
    middle, quarter = (low_m + high_m) / 2, (high_m - low_m) / 4
    found = []
    for degrees in TILTS:
        tilt = math.radians(degrees)
        found += [
            Layout(f"hexapod at mid-length, {degrees} degrees", hexapod(radius_m, tilt, middle)),
            Layout(f"hexapod at one end, {degrees} degrees", hexapod(radius_m, tilt, low_m)),
            Layout(
                f"two rings at the quarters, {degrees} degrees",
                two_rings(radius_m, tilt, middle - quarter, middle + quarter),
            ),
            Layout(f"two rings at the ends, {degrees} degrees", two_rings(radius_m, tilt, low_m, high_m)),
        ]
    return found


def on_plane(radius_m: float, height_m: float) -> list[Layout]:
    """Arrangements on a ring of this radius, in m, under a flat bumper whose outside is at z = ``height_m``."""
    tilts = [Layout(f"hexapod, {degrees} degrees", hexapod(radius_m, math.radians(degrees))) for degrees in TILTS]
    return [Layout("3 on a plane", tripod(radius_m)), *tilts]
