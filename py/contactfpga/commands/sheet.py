"""A sheet drawn with characters: two columns of text a cell, row 0 on top."""

from __future__ import annotations

import math

import numpy as np

from contactfpga.zone import Zone, Zones

FREE, PRESSED, CENTRE, MASKED = "· ", "██", "◎ ", "  "


def draw(zones: Zones) -> str:
    """The sheet of one frame: the pressed cells where the board sends them, else each zone as a disc of its area."""
    cells = zones.cells
    grid = np.full((zones.skin.rows, zones.skin.columns), FREE, dtype="<U2")
    grid[_discs(zones) if cells is None else cells] = PRESSED
    for row, column in zones.skin.mask:
        grid[row, column] = MASKED
    if cells is None:
        for row, column in _centres(zones):
            grid[row, column] = CENTRE
    return "\n".join("".join(line).rstrip() for line in grid)


def _centres(zones: Zones) -> list[tuple[int, int]]:
    skin = zones.skin
    return [(round(zone.y_mm / skin.pitch_y_mm), round(zone.x_mm / skin.pitch_x_mm)) for zone in _real(zones)]


def _discs(zones: Zones) -> np.ndarray:
    """(rows, columns) bool: cells within the disc of each zone's area about its barycenter."""
    skin = zones.skin
    y, x = np.ogrid[: skin.rows, : skin.columns]
    covered = np.zeros((skin.rows, skin.columns), bool)
    for zone in _real(zones):
        dx = x * skin.pitch_x_mm - zone.x_mm
        dy = y * skin.pitch_y_mm - zone.y_mm
        covered |= np.hypot(dx, dy) <= math.sqrt(zone.area_mm2 / math.pi)
    return covered


def _real(zones: Zones) -> list[Zone]:
    """The zones that lie somewhere: a frame flagged `mismatch` may hold others."""
    return [zone for zone in zones if zone.area_cells]
