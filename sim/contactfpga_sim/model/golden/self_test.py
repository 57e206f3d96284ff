"""The self-test of a scan by line reversal: when its slots are, what they read, and what that tells."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contactfpga_sim.model.golden.facts import Facts
from contactfpga_sim.model.golden.guard import closed, stuck
from contactfpga_sim.model.golden.request import Request
from contactfpga_sim.model.golden.scan import Stages
from contactfpga_sim.model.golden.trace import Timeline

COMMAND = 1


class SelfTest:
    """Slot after slot: no line, each row, each column. After power-up at once, after a command as they go out."""

    def __init__(self, facts: Facts, timeline: Timeline, requests: Sequence[Request], stages: Stages):
        self.discharged: list[tuple[int, int]] = []
        """(cycle, rows) of every change of the rows that are driven to the selecting level."""
        self.joined = False
        """What is told from three cycles after a slot's sample on."""
        self._facts = facts
        self._timeline = timeline
        self._stages = stages
        self._commands = [one.cycle for one in requests if one.command is not None and one.command[0] == COMMAND]
        self._number = 0
        self._asked: int | None = 0  # the cycle from which on a slot is wanted
        self._idle = 0  # none is from this cycle on, or only later
        self._tells = False
        self._waits = False  # a slot goes out
        self._found = False
        self._rises = np.zeros(facts.rows + facts.columns, bool)

    def asked(self, until: int) -> int | None:
        """The cycle from which on a slot is wanted, if that is not after ``until``."""
        if self._waits:
            over = self._stages.slot_over(until)
            if over is None:
                return None
            self._waits = False
            self._go_on(over)
        if self._asked is None and self._commands and max(self._commands[0] + 1, self._idle) < until:
            self._start(max(self._commands[0] + 1, self._idle))
        return self._asked if self._asked is not None and self._asked <= until else None

    def slot(self, cycle: int) -> int:
        """One begins in this cycle; returns that of its sample."""
        facts = self._facts
        let_go = cycle + 3 + facts.project
        sample = let_go + facts.settle
        rows = np.append(~facts.mask.all(axis=1), [True] * (facts.row_lines - facts.rows))
        self.discharged += [(cycle + 3, _bits(rows)), (let_go, 0)]
        found = self._read(sample)
        self._judge(found)
        rows = found[: facts.rows] & ~facts.mask.all(axis=1)
        if self._tells:
            self._waits, self._asked = True, None
            self._stages.slot(sample + 3, self._number, _bits(rows), _bits(found[facts.rows :]))
        else:
            self._go_on(sample + 2)
        return sample

    def _go_on(self, cycle: int) -> None:
        """A slot is over in this cycle."""
        last = self._number == self._facts.rows + self._facts.columns
        self._number += 1
        self._asked, self._idle = (None if last else cycle + 1), cycle + 1
        if self._commands and self._commands[0] < cycle:
            self._start(cycle)

    def _start(self, cycle: int) -> None:
        """Commands before this cycle start a test in it."""
        self._commands = [one for one in self._commands if one >= cycle]
        self._number, self._tells, self._asked = 0, True, cycle + 1

    def _read(self, sample: int) -> np.ndarray:
        """(R + C,) bool: lines at the released level."""
        facts, line = self._facts, self._number - 1
        found = np.zeros(facts.rows + facts.columns, bool)
        whole = ~np.concatenate([facts.mask.all(axis=1), facts.mask.all(axis=0)])
        if line < 0 or not whole[line]:
            return found
        column = line - facts.rows
        if column >= 0 and stuck(facts, self._timeline, sample)[column]:
            return found
        found[line] = True
        if column >= 0:
            found[: facts.rows] = closed(facts, self._timeline, sample)[: facts.rows, column]
        return found

    def _judge(self, found: np.ndarray) -> None:
        facts, line = self._facts, self._number - 1
        counts = found & ~np.concatenate([facts.mask.all(axis=1), facts.mask.all(axis=0)])
        if line < 0:
            bad = bool(counts[: facts.rows].any() and not counts[facts.rows :].any())
            self._rises, self._found = counts, False
        else:
            follows = counts & ~self._rises & (np.arange(len(counts)) != line)
            bad = bool(follows[0 if line < facts.rows else facts.rows :].any())
        self._found |= bad
        self.joined |= bad
        if line == len(counts) - 1:
            self.joined = self._found


def _bits(lines: np.ndarray) -> int:
    return sum(1 << int(line) for line in np.flatnonzero(lines))
