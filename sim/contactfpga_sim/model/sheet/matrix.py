"""The sheet at the board's pins: switches with ideal diodes, and faults."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from contactfpga.skin import Skin


@dataclasses.dataclass(frozen=True)
class Shorts:
    """Joints without resistance, in the sheet's rows and columns, guard lines last."""

    rows: tuple[tuple[int, int], ...] = ()
    """Pairs of joined rows."""
    columns: tuple[tuple[int, int], ...] = ()
    """Pairs of joined columns."""
    crossed: tuple[tuple[int, int], ...] = ()
    """Joined pairs of a row and a column."""
    bridged: tuple[tuple[int, int], ...] = ()
    """(row, column) of switches with bridged diodes, which conduct both ways when closed."""
    supplied: tuple[int, ...] = ()
    """Rows joined with the supply of the released level."""
    pulled: tuple[int, ...] = ()
    """Columns with a strong pull, which lifts them at once."""

    def soldered(self, rows: tuple[int, ...], columns: tuple[int, ...]) -> Shorts:
        """Joints in lines, given the line of each row and column."""
        return Shorts(
            tuple((rows[one], rows[other]) for one, other in self.rows),
            tuple((columns[one], columns[other]) for one, other in self.columns),
            tuple((rows[row], columns[column]) for row, column in self.crossed),
            tuple((rows[row], columns[column]) for row, column in self.bridged),
            tuple(rows[row] for row in self.supplied),
            tuple(columns[column] for column in self.pulled),
        )


class LineBits(NamedTuple):
    """Lines as bits."""

    rows: int
    columns: int


def followers(shorts: Shorts, closed: list[int], sources: LineBits, selecting: bool) -> LineBits:
    """Lines at the level of the ``sources``: the selecting level passes switches from row to column, the released one
    the other way. ``closed``: reached columns by row."""
    ties = [_both(1 << one, 1 << other) for one, other in shorts.rows]
    ties += [_both(1 << one, 1 << other, columns=True) for one, other in shorts.columns]
    crossed = [*shorts.crossed, *(place for place in shorts.bridged if closed[place[0]] >> place[1] & 1)]
    found = sources
    while True:
        wider = _widened(found, closed, selecting)
        for tie in ties:
            wider = tie(wider)
        for row, column in crossed:
            if wider.rows >> row & 1 or wider.columns >> column & 1:
                wider = LineBits(wider.rows | 1 << row, wider.columns | 1 << column)
        if wider == found:
            return found
        found = wider


def _widened(found: LineBits, closed: list[int], selecting: bool) -> LineBits:
    rows, columns = found
    for row, word in enumerate(closed):
        if selecting and rows >> row & 1:
            columns |= word
        if not selecting and word & columns:
            rows |= 1 << row
    return LineBits(rows, columns)


def _both(one: int, other: int, columns: bool = False) -> Callable[[LineBits], LineBits]:
    def tie(found: LineBits) -> LineBits:
        word = found[columns]
        word |= (one | other) if word & (one | other) else 0
        return LineBits(found.rows, word) if columns else LineBits(word, found.columns)

    return tie


def bits(lines: Iterable[int]) -> int:
    """Lines as bits."""
    return sum({1 << line for line in lines})


def words(cells: np.ndarray | None, rows: int) -> list[int]:
    """Rows of (R, C) bool cells as ints, bit c is column c; None: nothing pressed."""
    if cells is None:
        return [0] * rows
    return [int("".join("1" if cell else "0" for cell in row[::-1]), 2) for row in np.asarray(cells, bool)]


class Contention(AssertionError):
    """A driven column and a row driven to the selecting level meet in a pressed switch."""


class Matrix:
    """Levels of columns and rows for pressed cells and the board's drives.

    A pressed switch passes its row's selecting level to its column, by a series diode: low with ``col2row``, where
    columns are otherwise pulled up; high with ``row2col``. A driven column passes the released level to released rows,
    which are otherwise pulled to the selecting level, as are undriven columns on them. A stuck column cannot be driven.
    After a self-test's discharge, released columns stay at the selecting level for a slot. The board must ignore masked
    cells.

    Switches and faults are in the sheet's rows and columns, guard lines last; levels are those of the lines that these
    are soldered to.
    """

    def __init__(self, skin: Skin):
        self.row_lines = skin.row_lines
        self.column_lines = skin.column_lines
        self._rows = skin.rows
        self._row_line, self._column_line = skin.line_of_row, skin.line_of_column
        self._all_rows = (1 << skin.row_lines) - 1
        self._all_columns = (1 << skin.column_lines) - 1
        self._selects_low = skin.selects_low
        self._guarded = int(skin.guard)
        self._guards = [1 << skin.columns] * skin.rows + [(1 << skin.columns) - 1] if skin.guard else [0] * skin.rows
        self._pressed = [0] * skin.rows
        self._reaches = [self._all_columns] * skin.row_lines
        self.stuck = 0
        self._shorts: Shorts | None = None
        self._released = LineBits(0, 0)  # let go, and lifted to the released level
        self._keeps = skin.derived.settle_clocks + 1 if skin.self_test else 0  # clocks
        self._kept, self._left = 0, 0  # columns, and clocks for which they are
        self.closed = [0] * skin.row_lines
        """By row line the column lines reached through closed switches."""
        self._solder()

    def press(self, cells: np.ndarray | Sequence[int] | None, stuck: np.ndarray | None = None) -> None:
        """Press (R, C) bool cells (or R ints, bit c is column c) and make (C,) bool columns stuck, or (C + 1,) with the
        guard column."""
        if cells is None or isinstance(cells, np.ndarray):
            self._pressed = words(cells, self._rows)
        else:
            self._pressed = list(cells)
        self.stuck = 0 if stuck is None else self._on_lines(words(np.asarray(stuck)[None], 1)[0])
        self._solder()

    def cut(self, rows: Mapping[int, int], columns: Mapping[int, int]) -> None:
        """Set the cut lines, as in :class:`contactfpga_sim.model.golden.trace.Cuts`."""
        self._reaches = [(1 << rows.get(row, self.column_lines)) - 1 for row in range(self.row_lines)]
        for column, end in columns.items():
            for row in range(end, self.row_lines):
                self._reaches[row] &= ~(1 << column)
        self._solder()

    def join(self, shorts: Shorts | None) -> None:
        """Set the joined lines and bridged diodes."""
        self._shorts = shorts and shorts.soldered(self._row_line, self._column_line)

    def _solder(self) -> None:
        for row, guard in enumerate(self._guards):
            pressed = self._pressed[row] if row < self._rows else 0
            self.closed[self._row_line[row]] = self._on_lines((pressed | guard) & self._reaches[row])

    def _on_lines(self, columns: int) -> int:
        return sum(1 << line for column, line in enumerate(self._column_line) if columns >> column & 1)

    def feeding(self, driven: int, level: int | None) -> tuple[int, int]:
        """Driven columns at the released level, and at the selecting one. ``level``: of all but a guard column, which
        has the other; None if columns have one drive level."""
        if level is None:
            return driven, 0
        plain = self._all_columns >> self._guarded
        released = driven & (plain if level == self._selects_low else ~plain)
        return released, driven & ~released

    def levels(self, rows: int, rows_driven: int | None = None, columns_driven: int = 0, columns_held: int = 0) -> int:
        """Column levels, bit c is column c, for row pin levels, bit r is row r.

        ``rows_driven``: driven rows, by default all; ``columns_driven``: columns driven to the released level;
        ``columns_held``: to the selecting one. Call it once per clock. Raises :class:`Contention`.
        """
        driven = self._driven(rows_driven)
        selected = (rows ^ self._all_rows if self._selects_low else rows) & driven
        if self._shorts is None:
            pulled, lifted = self._pulled(selected), columns_driven
        else:
            pulled, lifted = self._follow(
                LineBits(selected, columns_held), LineBits(driven & ~selected, columns_driven)
            )
        if fights := pulled & columns_driven:
            raise Contention(f"columns {fights:#b} are driven against rows {selected:#b}")
        pressed = pulled | self.stuck | columns_held | self._keep(columns_held, lifted)
        pressed |= self._drained(driven, columns_driven)
        return pressed ^ self._all_columns if self._selects_low else pressed

    def _pulled(self, selected: int) -> int:
        pulled = 0
        for row, word in enumerate(self.closed):
            if selected >> row & 1:
                pulled |= word
        return pulled

    def _drained(self, rows_driven: int, columns_driven: int) -> int:
        drained, lifted = 0, self._lifted(columns_driven)
        for row, word in enumerate(self.closed):
            if not (rows_driven | lifted.rows) >> row & 1:
                drained |= word
        return drained & ~(columns_driven | lifted.columns)

    def _lifted(self, columns_driven: int) -> LineBits:
        if self._shorts is not None:
            return LineBits(self._released.rows, self._released.columns | bits(self._shorts.pulled))
        feeding = columns_driven & ~self.stuck
        return LineBits(sum(1 << row for row, word in enumerate(self.closed) if word & feeding), feeding)

    def _keep(self, held: int, lifted: int) -> int:
        if held:
            self._kept, self._left = held, self._keeps
        elif self._left:
            self._left -= 1
            self._kept &= ~lifted
            return self._kept
        return 0

    def _follow(self, selecting: LineBits, releasing: LineBits) -> tuple[int, int]:
        """Columns that with shorts follow the selecting and the released level. Pins may oppose the supply, not each
        other."""
        assert self._shorts is not None
        feeding = LineBits(releasing.rows, releasing.columns & ~self.stuck)
        low = followers(self._shorts, self.closed, selecting, selecting=True)
        if low.rows & feeding.rows | low.columns & feeding.columns:
            raise Contention(f"lines {feeding} are driven against {selecting}, which shorts join")
        supplied = LineBits(feeding.rows | bits(self._shorts.supplied), feeding.columns)
        self._released = followers(self._shorts, self.closed, supplied, selecting=False)
        return low.columns, self._released.columns | bits(self._shorts.pulled)

    def row_levels(self, rows: int, rows_driven: int, columns_driven: int) -> int:
        """Levels at the row pins: ``rows`` if driven, else by the columns."""
        touched = self._lifted(columns_driven).rows
        let_go = touched if self._selects_low else touched ^ self._all_rows
        return rows & rows_driven | let_go & ~rows_driven

    def _driven(self, rows_driven: int | None) -> int:
        return self._all_rows if rows_driven is None else rows_driven
