"""What a faulty sheet reads: which lines pressed switches join, where diodes, wires and switches have faults.

In :class:`Wiring` nothing but the pulls has a resistance; :func:`at_rest` asks :mod:`contactfpga.design.circuit` for
levels and currents once the columns have settled. Guard lines are one more row and one more column; what they miss is
a cut.
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np

from contactfpga.design.circuit import Circuit, phases
from contactfpga.design.circuit.network import Network
from contactfpga.design.circuit.phases import Levels


def _none() -> np.ndarray:
    return np.zeros((1, 1), bool)


@dataclasses.dataclass(frozen=True, eq=False)
class Wiring:
    """What a board reads that drives one row at a time. Arrays are bool, (rows, columns) or as one value for all.

    A row selects its columns through pressed switches, a column other rows through pressed switches without a diode.
    Rows that are not selected are held at the other level, as gateware for a sheet with diodes does, or they float.
    A broken line is cut off at the board; its switches still join what they join.
    """

    bare: np.ndarray = dataclasses.field(default_factory=_none)
    """Switches that conduct both ways: their diode is missing, bridged or shorted."""
    dead: np.ndarray = dataclasses.field(default_factory=_none)
    """Switches that never conduct."""
    closed: np.ndarray = dataclasses.field(default_factory=_none)
    """Switches that always do."""
    broken_rows: tuple[int, ...] = ()
    broken_columns: tuple[int, ...] = ()
    floating: bool = False
    """Rows float while they are not selected."""

    def read(self, pressed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(rows, columns) bool for pressed switches: cells that read pressed, and cells whose level is undefined, as a
        selected row and one that is held meet in their column, or in the lines that it is joined with."""
        conducts = (pressed | self.closed) & ~self.dead
        read, undefined = np.zeros_like(conducts), np.zeros_like(conducts)
        for row in range(len(conducts)):
            if row in self.broken_rows:
                continue
            rows, columns = self._joined(conducts, row)
            meets = not self.floating and any(other != row and other not in self.broken_rows for other in rows)
            (undefined if meets else read)[row] = columns
        for column in self.broken_columns:
            read[:, column] = undefined[:, column] = False
        return read, undefined

    def _joined(self, conducts: np.ndarray, row: int) -> tuple[list[int], np.ndarray]:
        """The rows and the (columns,) bool that a selected row reaches, whatever else drives them."""
        back = conducts & self.bare
        reached = np.zeros(len(conducts), bool)
        reached[row] = True
        while True:
            columns = np.asarray(conducts[reached].any(axis=0))
            wider = reached | back[:, columns].any(axis=1)
            if (wider == reached).all():
                return np.flatnonzero(reached).tolist(), columns
            reached = wider


def at_rest(circuit: Circuit, cells: np.ndarray, bare: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Of (rows, columns) bool pressed cells, scanned row by row: those that read pressed, those whose level is neither
    low nor high, and the most that a pin of a row that is not selected carries, in A."""
    levels, network = Levels.of(circuit), Network(circuit, cells, bare)
    read, undefined, most = np.zeros_like(cells), np.zeros_like(cells), 0.0
    for row in range(len(cells)):
        phase = phases.settle(network, levels, row)
        volts, drive = phases.rest_volts(phase), phase.drives[-1]
        columns = volts[: network.columns]
        read[row] = columns <= levels.low
        undefined[row] = (columns > levels.low) & (columns < levels.high)
        most = max(most, float(np.delete(network.pin_amperes(volts, drive), network.columns + row).max()))
    return read, undefined, most


class LineCuts(NamedTuple):
    """As :meth:`contactfpga_sim.model.board.compiled.CompiledBoard.cut` takes them."""

    rows: dict[int, int]
    columns: dict[int, int]


def extended(cells: np.ndarray, guard: bool = True) -> np.ndarray:
    """(rows + 1, columns + 1) bool: the cells, and as guard switches ``guard``; the corner is open."""
    found = np.full((cells.shape[0] + 1, cells.shape[1] + 1), guard)
    found[:-1, :-1] = cells
    found[-1, -1] = False
    return found


def missed(read: np.ndarray) -> LineCuts:
    """Of what an extended sheet reads: lines whose guard switch reads open, as lines that are cut right before it."""
    rows, columns = (number - 1 for number in read.shape)
    return LineCuts(
        dict.fromkeys(np.flatnonzero(~read[:rows, columns]).tolist(), columns),
        dict.fromkeys(np.flatnonzero(~read[rows, :columns]).tolist(), rows),
    )
