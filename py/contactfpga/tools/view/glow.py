"""The light of closed cells, which shines through the foam."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from contactfpga.tools.view import picture
from contactfpga.tools.view.tiles import MM, Tiles

if TYPE_CHECKING:
    import viser

PARTS = ((0.30, 0.5, 0.75), (0.85, 0.0, 0.2))
"""Of each cell's light, from the middle out: spread in pitches, how much whiter than the cell it is, opacity."""


@dataclasses.dataclass(frozen=True)
class Blobs:
    """Gaussian blobs."""

    centers_mm: np.ndarray
    """(n, 3)"""
    spreads_mm2: np.ndarray
    """(n, 3, 3) covariances."""
    colors: np.ndarray
    """(n, 3) uint8"""
    opacities: np.ndarray
    """(n, 1), 0 to 1."""


def blobs(tiles: Tiles, colors: np.ndarray, lift_mm: float) -> Blobs:
    """Of all cells that are closed by their colors, (cells, 3) uint8: two blobs each, flat, over
    the sheet by ``lift_mm``."""
    lit = np.flatnonzero(picture.lit(colors))
    sheet = tiles.sheet
    axes = np.stack([tiles.along_x[lit], tiles.along_y[lit], tiles.normals[lit]], -1)
    size = np.array([sheet.pitch_x_mm, sheet.pitch_y_mm, 0.3 * min(sheet.pitch_x_mm, sheet.pitch_y_mm)])
    spreads = [(axes * (share * size) ** 2) @ axes.transpose(0, 2, 1) for share, _, _ in PARTS]
    tints = [colors[lit] + white * (255.0 - colors[lit]) for _, white, _ in PARTS]
    return Blobs(
        np.tile((tiles.points_mm + lift_mm * tiles.normals)[lit], (len(PARTS), 1)),
        np.concatenate(spreads),
        np.concatenate(tints).astype(np.uint8),
        np.repeat([[opacity] for _, _, opacity in PARTS], len(lit), axis=0),
    )


class Glow:
    """Draws it."""

    def __init__(self, server: viser.ViserServer, name: str, tiles: Tiles, lift_mm: float):
        self._server, self._name, self._tiles, self._lift_mm = server, name, tiles, lift_mm
        self._handle: Any = None

    def show(self, colors: np.ndarray) -> None:
        """Of cells with these colors."""
        found = blobs(self._tiles, colors, self._lift_mm)
        if len(found.centers_mm):
            parts = found.centers_mm, found.spreads_mm2, found.colors, found.opacities
            self._handle = self._server.scene.add_gaussian_splats(self._name, *parts, scale=MM)
        elif self._handle is not None:
            self._handle.visible = False
