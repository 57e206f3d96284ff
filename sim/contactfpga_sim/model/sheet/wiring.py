"""What a faulty sheet reads: which lines pressed switches join, where diodes, wires and switches have faults.

Levels, currents and times are :mod:`contactfpga.design.circuit`'s; this is what they come to where switches and pins
have no resistance beside the pulls.
"""

from __future__ import annotations

import dataclasses

import numpy as np


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
