"""The printed parts of a sheet, as STL files: a cap on each switch, the frame that guides the caps, and feet.

A cap is a square plate on a square stem, which slides in a tube of the frame and ends in a plunger on the switch. Webs
join the plates until the foam is glued to them and cut. Bodies that overlap are one to a printer.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from contactfpga.design.sheet.parts import SheetError, SwitchPart
from contactfpga.skin import Skin

PLATE_MM = 1.2
GAP_MM = 0.6
LEAST_GAP_MM = 0.3
"""Least gap for a printer with lines of 0.4 mm."""
BELOW_MM = 0.3
"""Gap below the plate at a fully pressed switch, for tilt."""
STEM_MM = 2.0
GUIDE_MM = 6.0
"""Height of the frame's tubes."""
PLAY_MM = 0.05
"""Gap around a stem in its tube."""
WALL_MM = 0.6
"""Thickness of the frame's tubes, ribs and posts."""
RIB_MM = 1.5
"""Height of the frame's ribs."""
RIM_MM = 2.0
"""Width of the frame's rim around the switches, which is glued to the board."""
WEB_MM = 1.0, 0.5
"""Width and thickness of a web between two plates."""
OVERLAP_MM = 0.1
FOOT_MM, SCREW_MM, HEAD_MM, SUNK_MM = 4.0, 3.4, 6.4, 2.8
"""Height of a foot, its square hole for a screw M3, and width and depth of the hole for the screw's head."""


@dataclasses.dataclass(frozen=True)
class Caps:
    """Bodies are (triangles, 3 corners, 3) in mm: x, y up, and z from the plungers' ends, with outward normals."""

    skin: Skin
    switch: SwitchPart
    side_mm: float

    @property
    def gap_mm(self) -> float:
        """The smaller gap between neighbors."""
        return min(self.skin.pitch_x_mm, self.skin.pitch_y_mm) - self.side_mm

    @property
    def foot_mm(self) -> float:
        """Height of a plunger, and of the tubes' lower ends above the switches."""
        return self.switch.travel_mm + BELOW_MM

    @property
    def under_mm(self) -> float:
        """Height of a plate's underside."""
        return self.foot_mm + GUIDE_MM + self.switch.travel_mm + BELOW_MM

    @property
    def sinks_mm(self) -> float:
        """How far a plate's edge drops when its stem tilts in the tube."""
        return self.side_mm * PLAY_MM / GUIDE_MM

    def caps(self) -> np.ndarray:
        inner, stem, half = self.switch.closed_by / 2, STEM_MM / 2, self.side_mm / 2
        low, high, (wide, thick) = self.under_mm, self.under_mm + PLATE_MM, WEB_MM
        outline = ((inner, 0), (inner, self.foot_mm), (stem, self.foot_mm), (stem, low), (half, low), (half, high))
        cells = [cell for cell in np.ndindex(self.skin.rows, self.skin.columns) if cell not in set(self.skin.mask)]
        webs = self._between(cells, half - OVERLAP_MM, wide, high - thick, high)
        return np.concatenate([*self._at(turned(outline), cells), *webs])

    def frame(self) -> np.ndarray | None:
        """Tubes around the stems, joined by ribs, which stand on posts between the switches, and by a rim. None if no
        post fits between two switches."""
        skin, hole = self.skin, STEM_MM / 2 + PLAY_MM
        pitch, tube = np.array([skin.pitch_x_mm, skin.pitch_y_mm]), hole + WALL_MM
        if skin.surface != "plane" or min(pitch) < self.switch.part.width + WALL_MM:
            return None
        board, low, high = -self.switch.height_mm, self.foot_mm, self.foot_mm + GUIDE_MM
        cells, rib = list(np.ndindex(skin.rows, skin.columns)), low + RIB_MM
        to_last = pitch * (skin.columns - 1, skin.rows - 1) / 2
        edge = to_last + pitch / 2
        outer, inner = edge + RIM_MM, to_last + tube - OVERLAP_MM
        rim = turned(
            ((outer, board), (outer, rib), (inner, rib), (inner, low), (edge, low), (edge, board)), closed=True
        )
        return np.concatenate(
            [
                *self._at(turned(((tube, low), (tube, high), (hole, high), (hole, low)), closed=True), cells),
                *self._between(cells, tube - OVERLAP_MM, WALL_MM, low, rib),
                *self._between(cells, (min(pitch) - WALL_MM) / 2, WALL_MM, board, low + OVERLAP_MM),
                rim + (to_last[0], -to_last[1], 0),
            ]
        )

    def _at(self, body: np.ndarray, cells: Sequence[tuple[int, ...]]) -> Iterator[np.ndarray]:
        for row, column in cells:
            yield body + (column * self.skin.pitch_x_mm, -row * self.skin.pitch_y_mm, 0)

    def _between(
        self, cells: Sequence[tuple[int, ...]], start: float, wide: float, low: float, high: float
    ) -> Iterator[np.ndarray]:
        """Bars between neighbors, from ``start`` beside the middle of each."""
        for turn, pitch in enumerate((self.skin.pitch_x_mm, self.skin.pitch_y_mm)):
            half = np.roll((pitch / 2 - start, wide / 2), turn)
            first = [(row, column) for row, column in cells if (row + turn, column + 1 - turn) in set(cells)]
            bar = turned(((half, low), (half, high)))
            yield from self._at(bar + (*np.roll((pitch / 2, 0), turn) * (1, -1), 0), first)


def caps(skin: Skin, switch: SwitchPart, side_mm: float | None = None) -> Caps:
    """The caps of a Skin, :data:`GAP_MM` apart for a ``side_mm`` of None. Raises :class:`SheetError` if caps would
    touch or are smaller than their stems."""
    pitch = min(skin.pitch_x_mm, skin.pitch_y_mm)
    side = pitch - GAP_MM if side_mm is None else side_mm
    if pitch - side < LEAST_GAP_MM - 1e-9:
        raise SheetError(
            f"side_m in [cover.cap] is {side / 1e3:g}; at a pitch of {pitch:g} mm the caps are {pitch - side:.3g} mm "
            f"apart, and a printer needs {LEAST_GAP_MM} mm: take caps of {(pitch - LEAST_GAP_MM) / 1e3:g} m at most"
        )
    if side <= STEM_MM:
        raise SheetError(f"side_m in [cover.cap] is {side / 1e3:g}; it must be more than {STEM_MM / 1e3:g}, the stem's")
    return Caps(skin, switch, side)


def feet(pad_mm: float) -> np.ndarray:
    """Four feet of this side, each for a pad of the cover's bed, with a hole for the screw of a spacer."""
    half, hole, head = pad_mm / 2, SCREW_MM / 2, HEAD_MM / 2
    outline = ((half, 0), (half, FOOT_MM), (hole, FOOT_MM), (hole, SUNK_MM), (head, SUNK_MM), (head, 0))
    return np.concatenate([turned(outline, closed=True) + (number * (pad_mm + 2), 0, 0) for number in range(4)])


def stl(corners: np.ndarray) -> bytes:
    """The file of a body."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    record = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    record["normal"], record["corners"] = normals, corners
    count: bytes = np.array(len(corners), "<u4").tobytes()
    return b"contactfpga sheet".ljust(80) + count + bytes(record.tobytes())


_SQUARE = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float)


def turned(outline: Sequence[tuple[float | np.ndarray, float]], closed: bool = False) -> np.ndarray:
    """A closed body around the z axis of rectangles with these half sides at these heights, from below; ``closed``: a
    ring, whose last rectangle joins the first."""
    levels = [np.column_stack([half * _SQUARE, np.full(4, z)]) for half, z in outline]
    quads = [
        (low[k], low[(k + 1) % 4], high[(k + 1) % 4], high[k])
        for low, high in itertools.pairwise(levels + levels[:1] * closed)
        for k in range(4)
    ]
    if not closed:
        quads += [tuple(levels[0][::-1]), tuple(levels[-1])]
    return np.array([corners for a, b, c, d in quads for corners in ((a, b, c), (a, c, d))])
