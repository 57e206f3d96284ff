"""The light of closed cells through the foam."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from contactfpga.tools.view import picture
from contactfpga.tools.view.tiles import MM, Tiles

if TYPE_CHECKING:
    import viser

PARTS = ((0.30, 0.5, 0.75), (0.85, 0.0, 0.2))
"""Parts of each cell's light, from the middle out: spread in pitches, whitening, opacity."""


@dataclasses.dataclass(frozen=True)
class Blobs:
    """Gaussian blobs, two for each cell, flat on the sheet."""

    centers_mm: np.ndarray
    """(n, 3)"""
    spreads_mm2: np.ndarray
    """(n, 3, 3) covariances."""


def blobs(tiles: Tiles, lift_mm: float) -> Blobs:
    """Blobs of all cells, ``lift_mm`` above the sheet."""
    sheet = tiles.sheet
    axes = np.stack([tiles.along_x, tiles.along_y, tiles.normals], -1)
    size = np.array([sheet.pitch_x_mm, sheet.pitch_y_mm, 0.3 * min(sheet.pitch_x_mm, sheet.pitch_y_mm)])
    spreads = [(axes * (share * size) ** 2) @ axes.transpose(0, 2, 1) for share, _, _ in PARTS]
    return Blobs(np.tile(tiles.points_mm + lift_mm * tiles.normals, (len(PARTS), 1)), np.concatenate(spreads))


def shine(colors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Colors, (n, 3) uint8, and opacities, (n, 1) from 0 to 1, of the blobs of cells with these (cells, 3) uint8
    colors; only closed ones shine.
    """
    tints = [colors + white * (255.0 - colors) for _, white, _ in PARTS]
    lit = picture.lit(colors)[:, None]
    return np.concatenate(tints).astype(np.uint8), np.concatenate([opacity * lit for _, _, opacity in PARTS])


class Glow:
    """Draws the light. All blobs exist from the beginning, as the page draws new ones before it knows their place."""

    def __init__(self, server: viser.ViserServer, name: str, tiles: Tiles, lift_mm: float):
        self._blobs = found = blobs(tiles, lift_mm)
        dark = shine(np.tile(np.array(picture.OPEN, np.uint8), (len(tiles.points_mm), 1)))
        self._handle = server.scene.add_gaussian_splats(name, found.centers_mm, found.spreads_mm2, *dark, scale=MM)

    def show(self, colors: np.ndarray) -> None:
        self._handle.set_gaussians(self._blobs.centers_mm, self._blobs.spreads_mm2, *shine(colors))
