"""The sheet at the board's pins: switches with an ideal diode each, and columns that are stuck."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from contactfpga.skin import Skin


def words(cells: np.ndarray | None, rows: int) -> list[int]:
    """The rows of (R, C) bool cells as ints, bit c is column c; None stands for nothing pressed."""
    if cells is None:
        return [0] * rows
    return [int("".join("1" if cell else "0" for cell in row[::-1]), 2) for row in np.asarray(cells, bool)]


class Contention(AssertionError):
    """A driven column and a row that is driven to the selecting level meet in a pressed switch."""


class Matrix:
    """Levels of columns and rows for pressed cells and for what the board drives.

    A pressed switch passes its row's selecting level to its column and nothing else, as a diode in series
    makes it do. ``col2row``: a row selects by being low and a column that reads pressed is low, else pulled
    up; ``row2col``: both high, else pulled down. Masked cells may be pressed too: the board has to ignore them.
    Likewise a driven column passes its level, the released one, to rows that are let go; else these are pulled to the
    selecting level. A stuck column cannot be driven.
    """

    def __init__(self, skin: Skin):
        self.rows = skin.rows
        self.columns = skin.columns
        self._all_rows = (1 << skin.rows) - 1
        self._all_columns = (1 << skin.columns) - 1
        self._selects_low = skin.selects_low
        self._pressed = [0] * skin.rows
        self._stuck = 0

    def press(self, cells: np.ndarray | Sequence[int] | None, stuck: np.ndarray | None = None) -> None:
        """Press (R, C) bool cells (or R ints, bit c is column c) and make (C,) bool columns stuck."""
        if cells is None or isinstance(cells, np.ndarray):
            self._pressed = words(cells, self.rows)
        else:
            self._pressed = list(cells)
        self._stuck = 0 if stuck is None else words(np.asarray(stuck)[None], 1)[0]

    def levels(self, rows: int, rows_driven: int | None = None, columns_driven: int = 0) -> int:
        """Levels of the columns, bit c is column c, for the levels of the row pins, bit r is row r.

        ``rows_driven``: which rows are driven, by default all; ``columns_driven``: which columns are, to the released
        level. Raises :class:`Contention`.
        """
        selected = (rows ^ self._all_rows if self._selects_low else rows) & self._driven(rows_driven)
        pulled = 0
        for row, word in enumerate(self._pressed):
            if selected >> row & 1:
                pulled |= word
        if fights := pulled & columns_driven:
            raise Contention(f"columns {fights:#b} are driven against rows {selected:#b}")
        pressed = pulled | self._stuck
        return pressed ^ self._all_columns if self._selects_low else pressed

    def row_levels(self, rows: int, rows_driven: int, columns_driven: int) -> int:
        """Levels at the row pins: those of ``rows`` where they are driven, else what the columns make of them."""
        feeding = columns_driven & ~self._stuck
        touched = sum(1 << row for row, word in enumerate(self._pressed) if word & feeding)
        let_go = touched if self._selects_low else touched ^ self._all_rows
        return rows & rows_driven | let_go & ~rows_driven

    def _driven(self, rows_driven: int | None) -> int:
        return self._all_rows if rows_driven is None else rows_driven
