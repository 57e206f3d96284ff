"""Guard lines in models that know rows and columns only: one more of each, and what they miss as cuts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


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
