"""Result of a board's self-test of lines and diodes (docs/faults.md)."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator
from typing import Literal, NamedTuple

from contactfpga.wire.faults import SelfTestSlot


class LineFinding(NamedTuple):
    kind: Literal["fault", "untested"]
    sentence: str


@dataclasses.dataclass(frozen=True)
class SelfTest:
    """A self-test of ``rows`` and ``columns`` from ``board.self_test()``: each line is driven alone, and all lines are
    read.

    Here row 1 rises where row 0 is driven, and the other way round:

    >>> rows_rose = (), (0, 1), (0, 1), ()
    >>> columns_rose = (), (), (), (0,)
    >>> slots = map(contactfpga.SelfTestSlot, range(4), rows_rose, columns_rose)
    >>> contactfpga.SelfTest(tuple(slots), rows=2, columns=1).faults
    ('rows 0 and 1 joined',)
    """

    slots: tuple[SelfTestSlot, ...] = dataclasses.field(repr=False)
    """Slots as sent: one with no line driven, one per row, one per column."""
    rows: int
    columns: int
    guard: bool = False
    """Whether there are guard lines."""
    mask: frozenset[tuple[int, int]] | None = None
    """(row, column) of masked switches; None if unknown."""

    @property
    def faults(self) -> tuple[str, ...]:
        """Joined lines, bridged diodes, and lines that do not rise, in words."""
        return tuple(finding.sentence for finding in self.findings if finding.kind == "fault")

    @property
    def untested(self) -> tuple[str, ...]:
        """Lines that rise by themselves and so cannot be tested, in words."""
        return tuple(finding.sentence for finding in self.findings if finding.kind == "untested")

    @property
    def pressed(self) -> frozenset[tuple[int, int]]:
        """(row, column) of switches that conducted in their diode's direction; only their diodes were tested."""
        return frozenset((row, column) for column in range(self.columns) for row in self._of_column(column).rows)

    @property
    def findings(self) -> tuple[LineFinding, ...]:
        """All findings, faults first."""
        return tuple(sorted({*self._still(), *self._joined(), *self._crossed(), *self._at_guards(), *self._rest()}))

    # ---- what rose where

    def _of_row(self, row: int) -> SelfTestSlot:
        return self.slots[1 + row]

    def _of_column(self, column: int) -> SelfTestSlot:
        return self.slots[1 + self.rows + column]

    def _rows_after(self, row: int) -> set[int]:
        return set(self._of_row(row).rows) - {row, *self.slots[0].rows}

    def _columns_after_row(self, row: int) -> set[int]:
        return set(self._of_row(row).columns) - set(self.slots[0].columns)

    def _columns_after(self, column: int) -> set[int]:
        return set(self._of_column(column).columns) - {column, *self.slots[0].columns}

    def _tested(self, column: bool) -> set[int]:
        masked = self.mask or frozenset()
        lines, others = (self.columns, self.rows) if column else (self.rows, self.columns)
        return {
            line
            for line in range(lines)
            if any(((other, line) if column else (line, other)) not in masked for other in range(others))
        }

    # ---- findings

    def _still(self) -> Iterator[LineFinding]:
        """Lines that rise with none driven, and those that do not rise when driven."""
        first = self.slots[0]
        for column in first.columns:
            cause = "its pull is too strong, or it is held at the released level"
            yield LineFinding("untested", f"column {column} cannot be tested: {cause}")
        for row in first.rows:
            held = LineFinding("fault", f"row {row} is held at the released level")
            lifted = LineFinding("untested", f"row {row} cannot be tested: a column lifts it")
            yield lifted if first.columns else held
        if self.mask is None:
            return
        for row in self._tested(column=False) - set(first.rows):
            if row not in self._of_row(row).rows:
                yield LineFinding("fault", f"row {row} is held at the selecting level")
        for column in self._tested(column=True) - set(first.columns):
            if column not in self._of_column(column).columns:
                yield LineFinding("fault", f"column {column} is held at the selecting level")

    def _joined(self) -> Iterator[LineFinding]:
        """Lines that rise with each other, whichever is driven."""
        for name, after, lines in (
            ("rows", self._rows_after, self.rows),
            ("columns", self._columns_after, self.columns),
        ):
            for group in _groups(after, lines):
                yield LineFinding("fault", f"{name} {_listed(group)} joined")

    def _crossed(self) -> Iterator[LineFinding]:
        """Columns that rise with a row, against the diode."""
        for row in range(self.rows):
            for column in self._columns_after_row(row):
                either = f"row {row} and column {column} joined"
                yield LineFinding("fault", f"{either}, or the diode at ({row}, {column}) is bridged")

    def _at_guards(self) -> Iterator[LineFinding]:
        """A line that reaches all others through a guard line, and is reached by none."""
        for row in self._reach_all(self._rows_after, self._tested(column=False)):
            yield LineFinding("fault", f"row {row} and the guard column joined, or the diode between them is bridged")
        for column in self._reached_by_all():
            cause = "joined, or the diode between them is bridged"
            yield LineFinding("fault", f"column {column} and the guard row {cause}")

    def _reach_all(self, after: Callable[[int], set[int]], lines: set[int]) -> list[int]:
        if not self.guard or len(lines) < 3:
            return []
        return [line for line in lines if lines - {line} <= after(line) and not self._columns_after_row(line)]

    def _reached_by_all(self) -> list[int]:
        lines = self._tested(column=True) - set(self.slots[0].columns)
        if not self.guard or len(lines) < 3:
            return []
        return [
            line
            for line in lines
            if all(line in self._columns_after(other) for other in lines - {line}) and not self._columns_after(line)
        ]

    def _rest(self) -> Iterator[LineFinding]:
        """Lines that follow another line, not explained by other findings."""
        through_guard = set(self._reach_all(self._rows_after, self._tested(column=False)))
        for row in range(self.rows):
            fed = {below for column in self._columns_after_row(row) for below in self._of_column(column).rows}
            for other in self._rows_after(row) - fed if row not in through_guard else ():
                if row not in self._rows_after(other):
                    yield LineFinding("fault", f"row {other} follows row {row}")
        reached = set(self._reached_by_all())
        for column in range(self.columns):
            fed = {beside for row in self._of_column(column).rows for beside in self._columns_after_row(row)}
            for other in self._columns_after(column) - fed - reached:
                if column not in self._columns_after(other):
                    yield LineFinding("fault", f"column {other} follows column {column}")


def _groups(after: Callable[[int], set[int]], lines: int) -> list[list[int]]:
    groups: list[set[int]] = []
    for line in range(lines):
        both = {line} | {other for other in after(line) if line in after(other)}
        if len(both) < 2:
            continue
        touching = [group for group in groups if group & both]
        groups = [group for group in groups if group not in touching] + [both.union(*touching)]
    return [sorted(group) for group in groups]


def _listed(lines: list[int]) -> str:
    return f"{', '.join(map(str, lines[:-1]))} and {lines[-1]}"


def merged(tests: Iterable[SelfTest]) -> tuple[LineFinding, ...]:
    return tuple(sorted({finding for test in tests for finding in test.findings}))


def untried(test: SelfTest, pressed: frozenset[tuple[int, int]]) -> int:
    """Number of unmasked switches that are not among the ``pressed``."""
    return test.rows * test.columns - len(pressed | (test.mask or frozenset()))
