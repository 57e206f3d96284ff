"""The smallest rectangle of cells around a zone."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contactfpga.skin.sheet import Sheet


class Box(NamedTuple):
    """First and last column and row of a zone's cells, counted from 0.

    >>> from contactfpga_sim import VirtualBoard
    >>> with contactfpga.open(VirtualBoard(contactfpga.Skin(extent=True), scene="two_fingers")) as board:
    ...     board.read()[0].box
    Box(left=5, right=6, top=7, bottom=8)

    Around a cylinder columns are counted on over the seam: from ``left`` to the last column and on from column 0 to
    ``right`` if ``left > right``. A zone that goes all the way around has all columns.
    """

    left: int
    right: int
    top: int
    bottom: int


class BoxMm(NamedTuple):
    """The outer edges of a :class:`Box`'s cells in mm, half a pitch beyond their centers; cell (0, 0) lies at 0.

    >>> from contactfpga_sim import VirtualBoard
    >>> with contactfpga.open(VirtualBoard(contactfpga.Skin(extent=True), scene="two_fingers")) as board:
    ...     board.read()[0].box_mm.width_mm
    20.0

    ``x_mm`` and ``y_mm`` are the edges at ``left`` and ``top``. Around a cylinder ``x_mm + width_mm`` may be beyond the
    seam.
    """

    x_mm: float
    y_mm: float
    width_mm: float
    height_mm: float


def box_mm(extents: np.ndarray, sheet: Sheet) -> np.ndarray:
    """(n, 4) float64 of :class:`BoxMm` from (n, 4) int64 of :class:`Box`."""
    left, right, top, bottom = extents.T
    x_mm, y_mm = (left - 0.5) * sheet.pitch_x_mm, (top - 0.5) * sheet.pitch_y_mm
    width_mm = ((right - left) % sheet.columns + 1) * sheet.pitch_x_mm
    return np.stack([x_mm, y_mm, width_mm, (bottom - top + 1) * sheet.pitch_y_mm], axis=1)
