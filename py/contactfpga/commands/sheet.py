"""A sheet drawn with characters: two columns of text a cell, row 0 on top."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from contactfpga.zone import Zones

FREE, PRESSED, CENTRE, MASKED = "· ", "██", "◎ ", "  "


def draw(zones: Zones, mask: Iterable[tuple[int, int]] = ()) -> str:
    """The sheet of one frame: the pressed cells where the board sends them, else each zone as a disc of its area.
    ``mask``: the Skin's, where that is known."""
    cells = zones.cells
    grid = np.full((zones.sheet.rows, zones.sheet.columns), FREE, dtype="<U2")
    grid[_discs(zones) if cells is None else cells] = PRESSED
    for row, column in mask:
        grid[row, column] = MASKED
    if cells is None:
        for row, column in _centres(zones):
            grid[row, column] = CENTRE
    return "\n".join("".join(line).rstrip() for line in grid)


def _centres(zones: Zones) -> list[tuple[int, int]]:
    sheet = zones.sheet
    return [(round(y_mm / sheet.pitch_y_mm), round(x_mm / sheet.pitch_x_mm)) for x_mm, y_mm, _ in _placed(zones)]


def _discs(zones: Zones) -> np.ndarray:
    """(rows, columns) bool: cells within the disc of each zone's area about its barycenter."""
    sheet = zones.sheet
    y, x = np.ogrid[: sheet.rows, : sheet.columns]
    covered = np.zeros((sheet.rows, sheet.columns), bool)
    for x_mm, y_mm, area_mm2 in _placed(zones):
        dx = x * sheet.pitch_x_mm - x_mm
        dy = y * sheet.pitch_y_mm - y_mm
        covered |= np.hypot(dx, dy) <= math.sqrt(area_mm2 / math.pi)
    return covered


def _placed(zones: Zones) -> list[tuple[float, float, float]]:
    """x and y in mm and area in mm2 of the zones that lie on the sheet: a frame flagged `mismatch` may hold others."""
    sheet = zones.sheet
    width_mm, height_mm = (sheet.columns - 1) * sheet.pitch_x_mm, (sheet.rows - 1) * sheet.pitch_y_mm
    return [
        (zone.x_mm, zone.y_mm, zone.area_mm2)
        for zone in zones
        if zone.x_mm is not None and zone.y_mm is not None and zone.x_mm <= width_mm and zone.y_mm <= height_mm
    ]
