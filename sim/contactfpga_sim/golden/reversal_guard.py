"""Line reversal with guard lines: when rows and columns are checked, and which are told."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from contactfpga_sim.golden.facts import Facts
from contactfpga_sim.golden.trace import Timeline

CHECK_US = 2**8
"""A sheet at rest is checked when the clock passes a multiple of this."""

Held = Callable[[int], np.ndarray]
"""(C + 1,) bool: columns that are not driven in a cycle as they read stuck."""


class Guard:
    """Checks in turn, the columns first; what they tell, in ``told``."""

    def __init__(self, facts: Facts, timeline: Timeline, retry_us: int, undriven: Held):
        self.told: list[tuple[int, int]] = [(0, 0)]
        """(cycle, word) of every change: a bit per row, per column and per column that is stuck, rows lowest."""
        self.slots: list[tuple[int, int]] = []
        """First and last cycle of each slot of the guard row."""
        self._facts = facts
        self._timeline = timeline
        self._undriven = undriven
        self._retry = retry_us * facts.clocks_per_us
        self._retries = 0  # that columns were sampled after
        self._renews = {"rows": False, "columns": False}
        self._of_rows = False
        self._last = 0  # the cycle in which the last check started
        self._rows = np.zeros(facts.rows, bool)
        self._columns = np.zeros(facts.columns, bool)
        self._stuck = np.zeros(facts.columns + 1, bool)

    @property
    def asked(self) -> int:
        """The cycle from which on a sheet at rest is checked."""
        turn = CHECK_US * self._facts.clocks_per_us
        return (self._last // turn + 1) * turn + 1

    def after(self, sample: int) -> int:
        """The last row of a frame was sampled; returns the cycle of the check's sample."""
        facts = self._facts
        at = sample + 1 + max(facts.project, facts.settle) if self._of_rows else sample + facts.row_clocks
        return self._check(sample, at)

    def at_rest(self, cycle: int) -> int:
        """The sheet rests in this cycle, the last one before the check; returns the cycle of its sample."""
        return self._check(cycle, cycle + self._facts.settle + (1 if self._of_rows else 2))

    def sampled(self, cycle: int) -> None:
        """In this cycle columns that read pressed counted as stuck."""
        retries = (cycle - 1) // self._retry
        if retries > self._retries:
            self._retries = retries
            self._renews = {"rows": True, "columns": True}

    def hold(self, cycle: int, held: np.ndarray) -> None:
        """Columns that are held as of what was read in this cycle."""
        self._tell(cycle + 2, stuck=self._stuck | held)

    def _check(self, start: int, sample: int) -> int:
        self._last = start
        if self._of_rows:
            self._check_rows(sample)
        else:
            self.slots.append((sample - self._facts.settle + 1, sample))
            self._check_columns(sample)
        self._of_rows = not self._of_rows
        return sample

    def _check_rows(self, sample: int) -> None:
        facts, cuts = self._facts, self._timeline.cuts_at(sample)
        driven = not self._undriven(sample)[-1]
        answers = np.array([driven and cuts.reach(row, facts.columns) for row in range(facts.rows)])
        blind = self._stuck[-1] or stuck_at(facts, self._timeline, sample)[-1]
        stuck = self._stuck
        if self._renews["rows"]:
            stuck = self._undriven(sample + 3)
        rows = self._rows
        if not blind:
            rows = ~answers & ~facts.mask.all(axis=1) | (rows & (not self._renews["rows"]))
            self._renews["rows"] = False
        self._tell(sample + 3, rows=rows, stuck=stuck | stuck_at(facts, self._timeline, sample) & self._guard_alone)

    @property
    def _guard_alone(self) -> np.ndarray:
        return np.arange(self._facts.columns + 1) == self._facts.columns

    def _check_columns(self, sample: int) -> None:
        facts, cuts = self._facts, self._timeline.cuts_at(sample)
        stuck = stuck_at(facts, self._timeline, sample)[:-1]
        answers = np.array([cuts.reach(facts.rows, column) for column in range(facts.columns)]) | stuck
        kept = self._columns & (not self._renews["columns"])
        self._tell(sample + 3, columns=~answers & ~facts.mask.all(axis=0) | kept)
        self._renews["columns"] = False

    def _tell(self, cycle: int, **words: np.ndarray) -> None:
        for name, word in words.items():
            setattr(self, f"_{name}", word)
        bits = np.concatenate([self._rows, self._columns, self._stuck])
        word = int(np.sum(1 << np.nonzero(bits)[0].astype(object)))
        if word != self.told[-1][1]:
            self.told.append((cycle, word))


def stuck_at(facts: Facts, timeline: Timeline, cycle: int) -> np.ndarray:
    """(column lines,) bool: columns that read pressed in a cycle whatever is driven."""
    lines = np.zeros(facts.column_lines, bool)
    stuck = timeline.at(cycle)[1]
    if stuck is not None:
        lines[: len(stuck)] = stuck
    return lines
