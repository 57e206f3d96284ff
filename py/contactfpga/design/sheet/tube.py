"""A flexible sheet around a tube: how far it may be bent, and the clamps that hold the ends of a closed one.

A closed sheet has two tabs, which continue its upper and lower margin over the other end. A clamp at each is two bent
plates, one below the sheet and one above. Two screws M3 go through both and through the holes of the sheet.
"""

from __future__ import annotations

import numpy as np

from contactfpga.design.sheet.caps import SCREW_MM, turned
from contactfpga.design.sheet.drawing import BOARDS
from contactfpga.design.sheet.parts import SheetError
from contactfpga.skin import Skin

FLEX_MM = BOARDS["cylinder"][0]
BEND = 10
"""Least radius of a flex with two layers that is bent once, in thicknesses: IPC-2223 as cited by T. Plemel, 'With Flex,
Sometimes You Gotta Break the Rules', I-Connect007, 2021-04-05."""
ROOM_MM = 2.0
"""Distance between sheet and tube, for the parts on the back. Without the headers the highest is an SOIC-16 of 1.75 mm
(JEDEC MS-012)."""
PLATE_MM = 2.0
"""Thickness of a clamp's upper plate; the lower one fills :data:`ROOM_MM`."""
STEP_MM = 0.5
"""Length of the flat pieces of which a plate's bent faces consist."""
APART_MM = 12.0
"""Distance of the plates in their file. A plate reaches 1 rad to either side at most (:func:`check`)."""


def check(skin: Skin, tab_mm: float) -> None:
    """Raise :class:`SheetError` for a radius that is too small for a flexible board or for tabs of this length."""
    least, why = max(
        (BEND * FLEX_MM, f"{BEND} times the thickness of a flexible board (IPC-2223)"),
        (tab_mm, "the length of the tabs and clamps over the seam, which --edge-mm sets"),
    )
    if skin.radius_mm is not None and skin.radius_mm < least:
        raise SheetError(f"radius_mm is {skin.radius_mm:g}; it must be {least:g} or more, {why}")


def tube_mm(skin: Skin) -> float:
    """Outer diameter of a closed sheet's tube; the middle of the sheet's thickness is at ``radius_mm``."""
    return 2 * ((skin.radius_mm or 0.0) - FLEX_MM / 2 - ROOM_MM)


def note(skin: Skin) -> str:
    """What to know before ordering a sheet on a cylinder; "" for one on a plane."""
    if skin.radius_mm is None:
        return ""
    words = (
        f"an FR-4 board cannot be bent to a radius of {skin.radius_mm:g} mm: order a flex of {FLEX_MM:g} mm, for which "
        f"this is {skin.radius_mm / FLEX_MM:.0f} times its thickness (IPC-2223: at least {BEND})"
    )
    if skin.closed:
        words += (
            f"; the tube is {tube_mm(skin):.1f} mm wide and ends before the connectors, where the sheet stays flat; "
            "four screws M3 through sheet-clamp.stl hold the tabs"
        )
    return words


def clamps(skin: Skin, tab_mm: float) -> np.ndarray:
    """Both clamps as (triangles, 3 corners, 3) in mm with outward normals: x along the sheet from its seam toward its
    left end, y outward, z along the tube. A plate is five bars that overlap around its screws' holes. The plates lie
    :data:`APART_MM` apart in y, lower ones first and third."""
    radius, end, screw, half = skin.radius_mm or 0.0, tab_mm, tab_mm / 2, SCREW_MM / 2
    bars = [(-end, end, 0, screw - half), (-end, end, screw + half, end)]
    bars += [(a, b, 0, end) for a, b in ((-end, -screw - half), (half - screw, screw - half), (screw + half, end))]
    lower = tube_mm(skin) / 2, radius - FLEX_MM / 2
    upper = radius + 1.5 * FLEX_MM, radius + 1.5 * FLEX_MM + PLATE_MM
    plates = enumerate((lower, upper, lower, upper))
    return np.concatenate(
        [_bent(radius, *level, *bar) + (0, APART_MM * number, 0) for number, level in plates for bar in bars]
    )


def _bent(radius: float, low: float, high: float, start: float, end: float, z: float, top: float) -> np.ndarray:
    """A bar between the radii ``low`` and ``high``, from ``start`` to ``end`` along the sheet."""
    half = np.array([high - low, top - z]) / 2
    body = turned([(half, x) for x in np.linspace(start, end, 2 + int((end - start) / STEP_MM))])
    away, along, angle = body[..., 0] + (low + high) / 2, body[..., 1] + (z + top) / 2, body[..., 2] / radius
    return np.stack([away * np.sin(angle), away * np.cos(angle), along], axis=-1)
