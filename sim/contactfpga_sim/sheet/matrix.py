"""The sheet at the board's pins: switches with an ideal diode each, guard lines, and lines that are stuck or cut."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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

    Switches and faults are told in the sheet's rows and columns, guard lines last; levels are those of the lines that
    these are soldered to.
    """

    def __init__(self, skin: Skin):
        self.row_lines = skin.row_lines
        self.column_lines = skin.column_lines
        self._rows = skin.rows
        self._row_line, self._column_line = skin.line_of_row, skin.line_of_column
        self._all_rows = (1 << skin.row_lines) - 1
        self._all_columns = (1 << skin.column_lines) - 1
        self._selects_low = skin.selects_low
        self._guards = [1 << skin.columns] * skin.rows + [(1 << skin.columns) - 1] if skin.guard else [0] * skin.rows
        self._pressed = [0] * skin.rows
        self._reaches = [self._all_columns] * skin.row_lines
        self.stuck = 0
        """Lines of the columns that are stuck."""
        self.closed = [0] * skin.row_lines
        """By a row's line, the lines of the columns that it reaches through closed switches."""
        self._solder()

    def press(self, cells: np.ndarray | Sequence[int] | None, stuck: np.ndarray | None = None) -> None:
        """Press (R, C) bool cells (or R ints, bit c is column c) and make (C,) bool columns stuck, or with the guard
        column (C + 1,)."""
        if cells is None or isinstance(cells, np.ndarray):
            self._pressed = words(cells, self._rows)
        else:
            self._pressed = list(cells)
        self.stuck = 0 if stuck is None else self._on_lines(words(np.asarray(stuck)[None], 1)[0])
        self._solder()

    def cut(self, rows: Mapping[int, int], columns: Mapping[int, int]) -> None:
        """Cut lines, and mend all others: a row's switches from a column on no longer reach its pin, and a column's
        from a row on. ``rows`` gives that column by row, ``columns`` that row by column."""
        self._reaches = [(1 << rows.get(row, self.column_lines)) - 1 for row in range(self.row_lines)]
        for column, end in columns.items():
            for row in range(end, self.row_lines):
                self._reaches[row] &= ~(1 << column)
        self._solder()

    def _solder(self) -> None:
        """What is closed and whole, on the lines."""
        for row, guard in enumerate(self._guards):
            pressed = self._pressed[row] if row < self._rows else 0
            self.closed[self._row_line[row]] = self._on_lines((pressed | guard) & self._reaches[row])

    def _on_lines(self, columns: int) -> int:
        return sum(1 << line for column, line in enumerate(self._column_line) if columns >> column & 1)

    def levels(self, rows: int, rows_driven: int | None = None, columns_driven: int = 0) -> int:
        """Levels of the columns, bit c is column c, for the levels of the row pins, bit r is row r.

        ``rows_driven``: which rows are driven, by default all; ``columns_driven``: which columns are, to the released
        level. Raises :class:`Contention`.
        """
        selected = (rows ^ self._all_rows if self._selects_low else rows) & self._driven(rows_driven)
        pulled = 0
        for row, word in enumerate(self.closed):
            if selected >> row & 1:
                pulled |= word
        if fights := pulled & columns_driven:
            raise Contention(f"columns {fights:#b} are driven against rows {selected:#b}")
        pressed = pulled | self.stuck
        return pressed ^ self._all_columns if self._selects_low else pressed

    def row_levels(self, rows: int, rows_driven: int, columns_driven: int) -> int:
        """Levels at the row pins: those of ``rows`` where they are driven, else what the columns make of them."""
        feeding = columns_driven & ~self.stuck
        touched = sum(1 << row for row, word in enumerate(self.closed) if word & feeding)
        let_go = touched if self._selects_low else touched ^ self._all_rows
        return rows & rows_driven | let_go & ~rows_driven

    def _driven(self, rows_driven: int | None) -> int:
        return self._all_rows if rows_driven is None else rows_driven
