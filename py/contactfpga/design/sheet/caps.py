"""The cap layer of a sheet: a printed cap on each switch, as one STL file.

A cap is a square plate with a square plunger on the switch. Foam glued to the plates holds the separate caps together.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from contactfpga.design.sheet.parts import SheetError, SwitchPart
from contactfpga.skin import Skin

PLATE_MM = 1.2
GAP_MM = 0.6
LEAST_GAP_MM = 0.3
"""Least gap for a printer with lines of 0.4 mm."""
BELOW_MM = 0.3
"""Gap below the plate at a fully pressed switch, for tilt."""


@dataclasses.dataclass(frozen=True)
class Caps:
    centers: np.ndarray
    """(caps, 2): x and y of each cap, y down."""
    side_mm: float
    plunger_mm: float
    plunger_height_mm: float
    gap_mm: float
    """The smaller gap between neighbors."""
    below_mm: float = BELOW_MM

    def triangles(self) -> np.ndarray:
        """(triangles, 3 corners, 3) in mm: x, y up, and z from the plungers' feet; caps are closed bodies with outward
        normals."""
        one = _cap(self.side_mm / 2, self.plunger_mm / 2, self.plunger_height_mm)
        moved = np.column_stack([self.centers[:, 0], -self.centers[:, 1], np.zeros(len(self.centers))])
        return np.asarray(one[None] + moved[:, None, None]).reshape(-1, 3, 3)

    def stl(self) -> bytes:
        corners = self.triangles()
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        record = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
        record["normal"], record["corners"] = normals, corners
        count: bytes = np.array(len(corners), "<u4").tobytes()
        return b"contactfpga cap layer".ljust(80) + count + bytes(record.tobytes())


def caps(skin: Skin, switch: SwitchPart, side_mm: float | None = None) -> Caps:
    """The caps of a Skin, :data:`GAP_MM` apart for a ``side_mm`` of None. Raises :class:`SheetError` if caps would
    touch or are smaller than their plungers."""
    pitch = min(skin.pitch_x_mm, skin.pitch_y_mm)
    side = pitch - GAP_MM if side_mm is None else side_mm
    gap = pitch - side
    if gap < LEAST_GAP_MM - 1e-9:
        raise SheetError(
            f"side_m in [cover.cap] is {side / 1e3:g}; at a pitch of {pitch:g} mm the caps are {gap:.3g} mm apart, and "
            f"a printer needs {LEAST_GAP_MM} mm: take caps of {(pitch - LEAST_GAP_MM) / 1e3:g} m at most"
        )
    if side <= switch.closed_by:
        raise SheetError(
            f"side_m in [cover.cap] is {side / 1e3:g}; it must be more than {switch.closed_by / 1e3:g}, the plunger's"
        )
    masked = set(skin.mask)
    cells = [(row, column) for row in range(skin.rows) for column in range(skin.columns) if (row, column) not in masked]
    centers = np.array([(column * skin.pitch_x_mm, row * skin.pitch_y_mm) for row, column in cells], float)
    return Caps(centers.reshape(-1, 2), side, switch.closed_by, switch.travel_mm + BELOW_MM, gap)


def _cap(half: float, inner: float, height: float) -> np.ndarray:
    """(28, 3, 3): a closed plate on a plunger, around the z axis."""
    square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float)
    foot, neck = _level(inner * square, 0.0), _level(inner * square, height)
    rim, top = _level(half * square, height), _level(half * square, height + PLATE_MM)
    faces = [*_ends(foot)[::-1], *_ends(top)]
    found = [
        np.array(face) if upward else np.array(face)[::-1] for face, upward in zip(faces, (False, False, True, True))
    ]
    for low, high in ((foot, neck), (rim, top)):
        found += _band(low, high)
    found += _band(neck, rim)  # the underside of the plate
    return np.array(found)


def _level(square: np.ndarray, z: float) -> np.ndarray:
    return np.column_stack([square, np.full(4, z)])


def _ends(square: np.ndarray) -> list[list[np.ndarray]]:
    a, b, c, d = square
    return [[a, b, c], [a, c, d]]


def _band(low: np.ndarray, high: np.ndarray) -> list[np.ndarray]:
    found = []
    for k in range(4):
        a, b, c, d = low[k], low[(k + 1) % 4], high[(k + 1) % 4], high[k]
        found += [np.array([a, b, c]), np.array([a, c, d])]
    return found
