"""How long each cell takes to read pressed, drawn with characters: a digit per cell, row 0 on top."""

from __future__ import annotations

import numpy as np

from contactfpga.tools.console.drawn_sheet import CELL, FREE, MASKED, STUCK, Drawing, Mask
from contactfpga.zones.settling import Settling

STEPS = 10


def draw(found: Settling, clocks_per_us: int, mask: Mask = (), wide: bool = True, unicode: bool = True) -> Drawing:
    """The digit d: a cell reads pressed after d to d + 1 tenths of the settle time. Slow ones have the kind STUCK.
    ``wide``: with a space between cells."""
    clocks, free = found.clocks, "·" if unicode else "."
    digits = np.array([str(digit) for digit in range(STEPS)])
    shown = np.where(clocks > 0, digits[np.maximum(clocks - 1, 0) * STEPS // found.settle], free)
    kinds = np.where(clocks > 0, CELL, FREE)
    for row, column in found.slow().cells:
        kinds[row, column] = STUCK
    for row, column in mask:
        shown[row, column], kinds[row, column] = " ", MASKED
    if wide:
        rows, columns = shown.shape
        spaced, of = np.full((rows, 2 * columns), " "), np.full((rows, 2 * columns), FREE)
        spaced[:, ::2], of[:, ::2] = shown, kinds
        shown, kinds = spaced, of
    legend = (
        f"d: reads pressed after d to d + 1 tenths of the settle time of {found.settle} clocks "
        f"({found.settle / clocks_per_us:g} us); {free} not measured"
    )
    return Drawing(shown, kinds, legend + ("; blank: no switch" if tuple(mask) else ""))
