"""Lines of the sheet that are joined, and diodes that are bridged: which lines follow which."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable
from typing import NamedTuple


@dataclasses.dataclass(frozen=True)
class Shorts:
    """Joints of no resistance, in the sheet's rows and columns, a guard line as the last one."""

    rows: tuple[tuple[int, int], ...] = ()
    """Pairs of rows."""
    columns: tuple[tuple[int, int], ...] = ()
    """Pairs of columns."""
    crossed: tuple[tuple[int, int], ...] = ()
    """A row and a column."""
    bridged: tuple[tuple[int, int], ...] = ()
    """Row and column of switches whose diode is bridged; closed they conduct both ways."""
    supplied: tuple[int, ...] = ()
    """Rows that are joined with the supply of the released level."""
    pulled: tuple[int, ...] = ()
    """Columns whose pull lifts them at once."""

    def soldered(self, rows: tuple[int, ...], columns: tuple[int, ...]) -> Shorts:
        """The same in lines, for the line of each row and of each column."""
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
    """Lines that take the level of the ``sources``: the selecting one, which passes switches from row to column, or the
    released one, which passes them the other way. ``closed``: by row the columns that it reaches."""
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
