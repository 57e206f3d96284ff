"""Line reversal with guard lines: when rows and columns are checked, and what these checks tell."""

from __future__ import annotations

import numpy as np

from contactfpga_sim.model.golden import guard
from contactfpga_sim.model.golden.facts import Facts
from contactfpga_sim.model.golden.guard import Told, closed, stuck
from contactfpga_sim.model.golden.held import Held
from contactfpga_sim.model.golden.trace import Timeline

CHECK_US = 2**8
"""A sheet at rest is checked when the clock passes a multiple of this."""


class Checks:
    """Of columns and rows in turn."""

    def __init__(self, facts: Facts, timeline: Timeline, held: Held):
        self.slots: list[tuple[int, int]] = []
        """First and last cycle of each slot of the guard row."""
        self._facts = facts
        self._timeline = timeline
        self._held = held
        self._retry = guard.RETRY_US * facts.clocks_per_us
        self._retries = 0  # up to the last check of rows
        self._renews = False
        self._told = Told(facts)
        self._of_rows = False
        self._last = 0  # the cycle in which the last check started

    @property
    def word(self) -> int:
        """What is told, from three cycles after the last check's sample on."""
        return self._told.word

    @property
    def asked(self) -> int:
        """The cycle from which on a sheet at rest is checked."""
        turn = CHECK_US * self._facts.clocks_per_us
        return (self._last // turn + 1) * turn + 1

    def after(self, sample: int) -> tuple[int, bool]:
        """The last row of a frame was sampled; returns the cycle of the check's sample, and whether it finds the guard
        column stuck."""
        facts = self._facts
        wait = 1 + max(facts.project, facts.settle) if self._of_rows else facts.row_clocks
        return self._check(sample, sample + wait)

    def at_rest(self, cycle: int) -> tuple[int, bool]:
        """The same for a sheet that rests in this cycle, the last one before the check."""
        return self._check(cycle, cycle + self._facts.settle + (1 if self._of_rows else 2))

    def _check(self, start: int, sample: int) -> tuple[int, bool]:
        self._last = start
        self._of_rows = not self._of_rows
        if self._of_rows:
            self.slots.append((sample - self._facts.settle + 1, sample))
            self._check_columns(sample)
        else:
            self._check_rows(sample)
        return sample, not self._of_rows and self._guard_reads(sample)

    def _check_rows(self, sample: int) -> None:
        facts = self._facts
        answers = closed(facts, self._timeline, sample)[: facts.rows, -1] & ~self._held.undriven(sample)[-1]
        pressed = (np.arange(facts.column_lines) == facts.columns) & self._guard_reads(sample)
        if not pressed[-1] and not self._guard_told:
            self._told.check("rows", ~answers, self._renews)
        self._told.check("stuck", pressed | self._held.at(sample + 2), self._renews)
        retries = (sample + 2) // self._retry
        self._renews, self._retries = retries != self._retries, retries

    def _check_columns(self, sample: int) -> None:
        facts = self._facts
        answers = (closed(facts, self._timeline, sample)[-1] | self._stuck(sample))[: facts.columns]
        self._told.check("columns", ~answers, self._renews)

    @property
    def _guard_told(self) -> bool:
        return bool(self.word >> self._facts.rows + 2 * self._facts.columns)

    def _guard_reads(self, sample: int) -> bool:
        """In a check of rows the guard column reads pressed: it is stuck, or not driven, and any row pulls it."""
        pulled = closed(self._facts, self._timeline, sample)[: self._facts.rows, -1].any()
        return bool(self._stuck(sample)[-1] or (pulled and self._held.undriven(sample)[-1]))

    def _stuck(self, cycle: int) -> np.ndarray:
        return stuck(self._facts, self._timeline, cycle)
