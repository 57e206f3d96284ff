"""A fault at one place, as the simulated sheet has it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np

from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.sheet import guards
from contactfpga_sim.model.sheet.line import ColumnLine
from contactfpga_sim.model.sheet.wiring import Wiring

Cell = tuple[int, int]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Hurt:
    """What is wrong. Rows and columns are those of the sheet; cells are (row, column)."""

    rows: Mapping[int, int] = dataclasses.field(default_factory=dict)
    """Cut rows: the column from which on their switches no longer reach the pin; 0 is also a driver that never
    selects."""
    columns: Mapping[int, int] = dataclasses.field(default_factory=dict)
    """Cut columns, likewise; 0 is also an input that always reads released."""
    selected: tuple[int, ...] = ()
    """Rows that are at the selecting level all the time."""
    stuck: tuple[int, ...] = ()
    """Columns that read pressed all the time."""
    closed: tuple[Cell, ...] = ()
    """Switches that always conduct."""
    dead: tuple[Cell, ...] = ()
    """Switches that never do."""
    bare: tuple[Cell, ...] = ()
    """Switches whose diode is shorted."""
    joined_rows: tuple[Cell, ...] = ()
    """Pairs of rows that are shorted to each other."""
    joined_columns: tuple[Cell, ...] = ()
    """Pairs of columns."""
    pulls_win: bool = False
    """How undefined levels read, where two pins drive against each other: as released."""
    line: ColumnLine | None = None
    """The columns' time; None: none."""
    running: bool = True
    """The board has its supply, its clock and its configuration."""
    connected: bool = True
    """Its bytes reach the host."""
    contact_connected: bool = True
    """Its pin `contact` reaches the robot."""

    def middle(self, rows: int, columns: int) -> Cell:
        """A cell that it is at, of a sheet of this size."""
        for row, column in (*self.closed, *self.dead, *self.bare, *self.rows.items()):
            return row, min(column, columns - 1)
        for column, row in self.columns.items():
            return min(row, rows - 1), column
        for row in (*self.selected, *(one for one, _ in self.joined_rows)):
            return row, columns // 2
        for column in (*self.stuck, *(one for one, _ in self.joined_columns)):
            return rows // 2, column
        return rows // 2, columns // 2

    def press(self, board: CompiledBoard, touched: np.ndarray) -> None:
        """The sheet of a running board from the next cycle on, touched so."""
        read = self._read(guards.extended(touched))
        cuts = guards.missed(read)
        board.cut(cuts.rows | dict(self.rows), cuts.columns | dict(self.columns))
        stuck = np.zeros(board.skin.column_lines, bool)
        stuck[list(self.stuck)] = True
        for row in self.selected:  # its columns read pressed whatever row is driven, its guard column too
            stuck |= read[row, : len(stuck)]
        board.stick(stuck)
        if self.line is not None:
            board.settle(self.line)
        board.press(read[:-1, :-1])

    def _read(self, closed: np.ndarray) -> np.ndarray:
        """The switches that read pressed, each in its row's time, of those of an extended sheet that are closed."""
        cells = closed.copy()
        for cell in self.closed:
            cells[cell] = True
        for cell in self.dead:
            cells[cell] = False
        if self.bare:
            bare = np.zeros_like(cells)
            bare[tuple(zip(*self.bare, strict=True))] = True
            read, undefined = Wiring(bare=bare).read(cells)
            cells = read if self.pulls_win else read | undefined
        for one, other in self.joined_rows:
            cells[[one, other]] = False if self.pulls_win else cells[one] | cells[other]
        for one, other in self.joined_columns:
            cells[:, one] = cells[:, other] = cells[:, one] | cells[:, other]
        return cells
