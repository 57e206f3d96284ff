"""Guard lines: effect on the sheet, and reports of faulty lines."""

from __future__ import annotations

from typing import Literal

import numpy as np

from contactfpga_sim.model.golden.facts import Facts
from contactfpga_sim.model.golden.trace import Timeline

RETRY_US = 2**16
"""The first whole round of checks after the clock passes a multiple of this time renews the reports."""


def closed(facts: Facts, timeline: Timeline, cycle: int) -> np.ndarray:
    """(row lines, column lines) bool: closed switches with whole lines to both pins. Guard lines are last, with an open
    corner."""
    cells, _ = timeline.at(cycle)
    shut = np.ones((facts.row_lines, facts.column_lines), bool)
    shut[-1, -1] = not facts.skin.guard
    shut[: facts.rows, : facts.columns] = False if cells is None else cells
    cuts = timeline.cuts_at(cycle)
    for row, end in cuts.rows.items():
        shut[row, end:] = False
    for column, end in cuts.columns.items():
        shut[end:, column] = False
    return shut


def stuck(facts: Facts, timeline: Timeline, cycle: int) -> np.ndarray:
    """(column lines,) bool: columns that read pressed whatever is driven; a guard column is last."""
    _, columns = timeline.at(cycle)
    lines = np.zeros(facts.column_lines, bool)
    if columns is not None:
        lines[: len(columns)] = columns
    return lines


class FaultyLines:
    """Faulty lines as the board reports them."""

    def __init__(self, facts: Facts):
        rows, columns = np.asarray(facts.mask.all(axis=1)), np.asarray(facts.mask.all(axis=0))
        stuck = np.append(columns, [False] * (facts.column_lines - facts.columns))
        self._masked = {"rows": rows, "columns": columns, "stuck": stuck}
        self._reported = {name: np.zeros_like(masked) for name, masked in self._masked.items()}

    def check(
        self, lines: Literal["rows", "columns", "stuck"], found: np.ndarray, renews: bool, only: int | None = None
    ) -> None:
        """Apply a check that found these of all rows, columns or stuck columns faulty, or that checked ``only`` one
        row. If it ``renews``, lines found good are no longer reported."""
        place = slice(None) if only is None else slice(only, only + 1)
        reported = self._reported[lines]
        kept = np.zeros_like(reported) if renews else reported
        reported[place] = ((found | kept) & ~self._masked[lines])[place]

    @property
    def open_columns(self) -> np.ndarray:
        """(columns,) bool: columns reported open."""
        return self._reported["columns"]

    @property
    def word(self) -> int:
        """Report word, from the lowest bit: rows, columns, stuck columns, guard column."""
        bits = np.concatenate([self._reported[name] for name in ("rows", "columns", "stuck")])
        return sum(1 << int(place) for place in np.flatnonzero(bits))
