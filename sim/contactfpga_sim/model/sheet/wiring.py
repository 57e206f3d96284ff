"""Readings of a sheet with joined lines and faulty diodes, wires and switches.

In :class:`Wiring` only the pulls have a resistance; :func:`at_rest` uses :mod:`contactfpga.design.circuit`.
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
    """A board that drives one row at a time. Arrays are bool, (rows, columns) or one value for all.

    A row selects its columns through pressed switches; a column selects other rows through pressed switches without a
    diode. Unselected rows are held at the other level, or float. A broken line is cut at the board; its switches still
    join lines.
    """

    bare: np.ndarray = dataclasses.field(default_factory=_none)
    """Switches that conduct both ways: diode missing, bridged or shorted."""
    dead: np.ndarray = dataclasses.field(default_factory=_none)
    """Switches that never conduct."""
    closed: np.ndarray = dataclasses.field(default_factory=_none)
    """Switches that always conduct."""
    broken_rows: tuple[int, ...] = ()
    broken_columns: tuple[int, ...] = ()
    floating: bool = False
    """Whether unselected rows float."""

    def read(self, pressed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(rows, columns) bool each: cells that read pressed, and cells with undefined levels, where a selected row and
        a held one meet in their column or its joined lines."""
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
    """For (rows, columns) bool pressed cells: cells that read pressed, cells with undefined levels, and the largest
    current in A through an unselected row's pin."""
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
    """Cuts for :meth:`contactfpga_sim.model.board.compiled.CompiledBoard.cut`."""

    rows: dict[int, int]
    columns: dict[int, int]


def extended(cells: np.ndarray, guard: bool = True) -> np.ndarray:
    """(rows + 1, columns + 1) bool: the cells, ``guard`` at the guard switches, and an open corner."""
    found = np.full((cells.shape[0] + 1, cells.shape[1] + 1), guard)
    found[:-1, :-1] = cells
    found[-1, -1] = False
    return found


def missed(read: np.ndarray) -> LineCuts:
    """Lines of an extended sheet whose guard switch reads open, as cut right before that switch."""
    rows, columns = (number - 1 for number in read.shape)
    return LineCuts(
        dict.fromkeys(np.flatnonzero(~read[:rows, columns]).tolist(), columns),
        dict.fromkeys(np.flatnonzero(~read[rows, :columns]).tolist(), rows),
    )
