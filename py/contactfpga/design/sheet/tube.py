"""A flexible sheet around a tube: how far it may be bent, and the clamps that hold the ends of a closed one.

A closed sheet has two tabs, which continue its upper and lower margin over the other end. A clamp at each is two bent
plates, one below the sheet and one above. Two screws M3 go through both and through the holes of the sheet.
"""

from __future__ import annotations

import numpy as np

from contactfpga.design.sheet.caps import SCREW_MM
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
APART_MM = 12.0
"""Distance of the plates in their file."""


def check(skin: Skin) -> None:
    """Raise :class:`SheetError` for a radius that is too small for a flexible board."""
    if skin.radius_mm is not None and skin.radius_mm < BEND * FLEX_MM:
        raise SheetError(
            f"radius_mm is {skin.radius_mm:g}; a flexible board of {FLEX_MM:g} mm with two layers takes "
            f"{BEND * FLEX_MM:g} mm at least, {BEND} times its thickness (IPC-2223): set a larger radius_mm"
        )


def check_tabs(skin: Skin, tab_mm: float) -> None:
    """Raise :class:`SheetError` for tabs so long that a clamp would reach around its tube."""
    if skin.radius_mm is not None and tab_mm > skin.radius_mm:
        raise SheetError(
            f"radius_mm is {skin.radius_mm:g}; the tabs and clamps of a closed sheet are {tab_mm:g} mm long, as its "
            "margin is wide, and need a radius of as much: set a larger radius_mm or a smaller --edge-mm"
        )


def tube_mm(skin: Skin) -> float:
    """Outer diameter of the tube of a closed sheet, whose middle is at ``radius_mm``."""
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
    left end, y outward, z along the tube. The plates lie :data:`APART_MM` apart in y, lower ones first and third."""
    radius, half = skin.radius_mm or 0.0, SCREW_MM / 2
    screws = np.array([-tab_mm, tab_mm]) / 2
    steps = np.arange(-tab_mm, tab_mm, STEP_MM)
    around = np.unique(np.round([*steps, tab_mm, *(screws - half), *(screws + half)], 6))
    along = np.array([0.0, tab_mm / 2 - half, tab_mm / 2 + half, tab_mm])
    middles = (around[1:] + around[:-1]) / 2
    hole = (np.abs(middles[:, None] - screws) < half).any(axis=1)
    solid = {(i, j) for i, j in np.ndindex(len(hole), 3) if not (hole[i] and j == 1)}
    lower = tube_mm(skin) / 2, radius - FLEX_MM / 2
    upper = radius + 1.5 * FLEX_MM, radius + 1.5 * FLEX_MM + PLATE_MM
    angles = around / radius
    found = []
    for number, levels in enumerate((lower, upper, lower, upper)):
        places = [np.column_stack([level * np.sin(angles), level * np.cos(angles)]) for level in levels]
        quads = np.array(
            [[(*places[k][i], along[j]) for i, j, k in quad] for cell in sorted(solid) for quad in _faces(cell, solid)]
        )
        found.append(np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]) + (0, number * APART_MM, 0))
    return np.concatenate(found)


def _faces(cell: tuple[int, int], solid: set[tuple[int, int]]) -> list[list[tuple[int, int, int]]]:
    """Both faces of a plate's cell and its sides without a neighbor, as corners with their level, 0 or 1."""
    i, j = cell
    corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
    beside = [(i, j - 1), (i + 1, j), (i, j + 1), (i - 1, j)]
    faces = [[(*one, 0) for one in corners], [(*one, 1) for one in corners[::-1]]]
    for a, b, other in zip(corners, corners[1:] + corners[:1], beside, strict=True):
        if other not in solid:
            faces.append([(*a, 0), (*a, 1), (*b, 1), (*b, 0)])
    return faces
