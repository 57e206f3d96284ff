"""Electrical faults of docs/safety.md; study and page follow :data:`FAULTS`."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

import numpy as np

from contactfpga.design.circuit import Circuit
from contactfpga.skin import Skin
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.sheet import wiring
from contactfpga_sim.model.sheet.line import ColumnLine
from contactfpga_sim.model.sheet.wiring import Wiring

Cell = tuple[int, int]


@dataclasses.dataclass(frozen=True, kw_only=True)
class SheetFault:
    """A fault of the sheet; cells are (row, column)."""

    rows: Mapping[int, int] = dataclasses.field(default_factory=dict)
    """Cut rows: first column that no longer reaches the pin; 0 also for a driver that never selects."""
    columns: Mapping[int, int] = dataclasses.field(default_factory=dict)
    """Cut columns: first row that no longer reaches the pin; 0 also for an input that always reads released."""
    selected: tuple[int, ...] = ()
    """Rows constantly at the selecting level."""
    stuck: tuple[int, ...] = ()
    """Columns that always read pressed."""
    closed: tuple[Cell, ...] = ()
    """Switches that always conduct."""
    dead: tuple[Cell, ...] = ()
    """Switches that never conduct."""
    bare: tuple[Cell, ...] = ()
    """Switches with shorted diodes."""
    joined_rows: tuple[Cell, ...] = ()
    joined_columns: tuple[Cell, ...] = ()
    pulls_win: bool = False
    """Whether undefined levels, of two opposing pins, read as released."""
    line: ColumnLine | None = None
    """Settling of the columns; None: instant."""
    running: bool = True
    """Whether the board has supply, clock and configuration."""
    connected: bool = True
    contact_connected: bool = True

    def middle(self, rows: int, columns: int) -> Cell:
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
        """Touch a running board's sheet from the next cycle on."""
        read = self._read(wiring.extended(touched))
        cuts = wiring.missed(read)
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


Places = Callable[[Skin], Mapping[str, SheetFault]]


@dataclasses.dataclass(frozen=True)
class Fault:
    title: str
    effect: str
    """The error if unnoticed."""
    places: Places
    left: str
    """The user's remedy; for an unreported fault the reason."""
    host: str = ""
    """``self_test`` at power-up, or the host's ``Watch``, which is not run here."""


def _ends(length: int) -> tuple[int, ...]:
    return 0, length // 2, length - 1


def _cut_rows(skin: Skin) -> Mapping[str, SheetFault]:
    ends = _ends(skin.columns)
    return {f"row {row} at column {end}": SheetFault(rows={row: end}) for row in range(skin.rows) for end in ends}


def _cut_columns(skin: Skin) -> Mapping[str, SheetFault]:
    ends = _ends(skin.rows)
    return {
        f"column {line} at row {end}": SheetFault(columns={line: end}) for line in range(skin.columns) for end in ends
    }


def _row_chips(skin: Skin) -> Mapping[str, SheetFault]:
    firsts = range(0, skin.rows, 8)
    alone = {f"rows {first} on, 8": _rows(range(first, min(first + 8, skin.rows))) for first in firsts}
    return alone | {f"rows {first} on, all": _rows(range(first, skin.row_lines)) for first in firsts}


def _rows(numbers: range) -> SheetFault:
    return SheetFault(rows=dict.fromkeys(numbers, 0))


def _column_chips(skin: Skin) -> Mapping[str, SheetFault]:
    firsts = range(0, skin.columns, 8)
    alone = {f"columns {first} on, 8": _columns(range(first, min(first + 8, skin.columns))) for first in firsts}
    return alone | {f"columns {first} on, all": _columns(range(first, skin.column_lines)) for first in firsts}


def _columns(numbers: range) -> SheetFault:
    return SheetFault(columns=dict.fromkeys(numbers, 0))


def _selected(skin: Skin) -> Mapping[str, SheetFault]:
    return {f"row {row}": SheetFault(selected=(row,)) for row in range(skin.rows)}


def _stuck_columns(skin: Skin) -> Mapping[str, SheetFault]:
    return {f"column {column}": SheetFault(stuck=(column,)) for column in range(skin.columns)}


def _cells(skin: Skin) -> list[tuple[int, int]]:
    rows, columns = skin.rows - 1, skin.columns - 1
    corners = [(0, 0), (0, columns), (rows, 0), (rows, columns)]
    return corners + [(rows * step // 4, columns * step // 4) for step in (1, 2, 3)]


def _closed(skin: Skin) -> Mapping[str, SheetFault]:
    return {f"switch {cell}": SheetFault(closed=(cell,)) for cell in _cells(skin)}


def _dead(skin: Skin) -> Mapping[str, SheetFault]:
    return {f"switch {cell}": SheetFault(dead=(cell,)) for cell in _cells(skin)}


def _bare(skin: Skin) -> Mapping[str, SheetFault]:
    return {
        f"switch {cell}, {'released' if released else 'pressed'} wins": SheetFault(bare=(cell,), pulls_win=released)
        for cell in _cells(skin)
        for released in (False, True)
    }


def _joined_rows(skin: Skin) -> Mapping[str, SheetFault]:
    return {
        f"rows {row} and {row + 1}, {'released' if released else 'pressed'} wins": SheetFault(
            joined_rows=((row, row + 1),), pulls_win=released
        )
        for row in range(skin.rows - 1)
        for released in (False, True)
    }


def _joined_columns(skin: Skin) -> Mapping[str, SheetFault]:
    return {
        f"columns {line} and {line + 1}": SheetFault(joined_columns=((line, line + 1),))
        for line in range(skin.columns - 1)
    }


def _slow(skin: Skin) -> Mapping[str, SheetFault]:
    found = {}
    for picofarad in (464, 1000, 2154, 4642):
        for name, circuit in (
            ("40 kΩ pull-up", Circuit(column_pull_ohm=40_000.0)),
            ("22 kΩ pull-up", Circuit(column_pull_ohm=22_000.0)),
        ):
            line = ColumnLine.of(
                circuit.replace(line_pf=float(picofarad)), skin.row_lines, skin.column_lines, skin.diodes, most=4
            )
            found[f"{picofarad} pF, {name}"] = SheetFault(line=line)
    return found


def _once(**what: bool) -> Places:
    return lambda skin: {"the board": SheetFault(**what)}  # type: ignore[arg-type]


METER = "check with a meter before the first power-up"

FAULTS: Mapping[str, Fault] = {
    "broken row": Fault(
        "A row is broken, or its driver never selects it",
        "its switches past the break are dead",
        _cut_rows,
        "strain relief",
    ),
    "broken column": Fault(
        "A column is broken, or its input reads released",
        "its switches past the break are dead",
        _cut_columns,
        "strain relief",
    ),
    "row connector": Fault(
        "A connector or 74HC595 of rows is dead, or all after it",
        "eight rows or more are dead",
        _row_chips,
        "locked connectors",
    ),
    "column connector": Fault(
        "A connector or 74HC165 of columns is dead, or all after it",
        "eight columns or more are dead",
        _column_chips,
        "locked connectors",
    ),
    "selected row": Fault(
        "A row is shorted to its selecting level, or its driver is",
        "pressed switches of it show in all rows",
        _selected,
        METER,
    ),
    "stuck column": Fault(
        "A column is shorted to its pressed level, or its input is", "the column reads as empty", _stuck_columns, METER
    ),
    "closed switch": Fault(
        "A switch is stuck closed",
        "a zone that nobody makes; touches beside it are joined to it",
        _closed,
        "list it in `mask`",
        "Watch",
    ),
    "dead switch": Fault(
        "A switch does not close, or its diode is open or missing",
        "touches of it alone are not seen",
        _dead,
        "press every switch once (`contactfpga doctor --watch`); only a press can tell it from one that nobody presses",
    ),
    "shorted diode": Fault(
        "A diode is shorted", "pressed cells of its column are undefined", _bare, METER, "self_test"
    ),
    "shorted rows": Fault(
        "Two rows are shorted to each other", "touches show in both rows", _joined_rows, METER, "self_test"
    ),
    "shorted columns": Fault(
        "Two columns are shorted to each other", "touches show in both columns", _joined_columns, METER, "self_test"
    ),
    "slow columns": Fault(
        "Columns are slower than the Skin's times",
        "pressed switches are missed, or show in the next row",
        _slow,
        "`contactfpga settle`",
    ),
    "dead board": Fault(
        "The board has no supply, no clock or no configuration",
        "nothing is reported",
        _once(running=False),
        "a deadline for each read, a watchdog at `alive`",
    ),
    "broken link": Fault(
        "USB, its bridge or the UART is broken",
        "nothing is reported",
        _once(connected=False),
        "a deadline for each read; `contact` still works",
    ),
    "broken contact": Fault(
        "The wire of `contact` is broken",
        "the robot is not stopped by it",
        _once(contact_connected=False),
        "take zones as the second way to a stop; test the stop at every start",
    ),
}
