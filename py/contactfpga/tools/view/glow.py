"""The light of closed cells, which shines through the foam."""

from __future__ import annotations

import dataclasses

import numpy as np

from contactfpga.tools.view import picture
from contactfpga.tools.view.tiles import Tiles

PARTS = ((0.30, 0.55, 0.8), (0.95, 0.0, 0.16))
"""Of each cell's light, from the middle out: its spread in pitches, how much whiter than the cell it is, its opacity."""


@dataclasses.dataclass(frozen=True)
class Glow:
    """Gaussian blobs."""

    centers_mm: np.ndarray
    """(n, 3)"""
    spreads_mm2: np.ndarray
    """(n, 3, 3) covariances."""
    colors: np.ndarray
    """(n, 3) uint8"""
    opacities: np.ndarray
    """(n, 1), 0 to 1."""


def glow(tiles: Tiles, colors: np.ndarray) -> Glow:
    """Of all cells whose color, (cells, 3) uint8, is not that of open ones: two blobs each, flat on the sheet."""
    lit = np.flatnonzero((colors != np.array(picture.OPEN, np.uint8)).any(-1))
    sheet = tiles.sheet
    axes = np.stack([tiles.along_x[lit], tiles.along_y[lit], tiles.normals[lit]], -1)
    size = np.array([sheet.pitch_x_mm, sheet.pitch_y_mm, 0.3 * min(sheet.pitch_x_mm, sheet.pitch_y_mm)])
    blobs = [(axes * (share * size) ** 2) @ axes.transpose(0, 2, 1) for share, _, _ in PARTS]
    tints = [colors[lit] + white * (255.0 - colors[lit]) for _, white, _ in PARTS]
    return Glow(
        np.tile(tiles.points_mm[lit], (len(PARTS), 1)),
        np.concatenate(blobs),
        np.concatenate(tints).astype(np.uint8),
        np.repeat([[opacity] for _, _, opacity in PARTS], len(lit), axis=0),
    )
