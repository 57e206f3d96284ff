"""Line reversal's knowledge of faults: stuck columns, guard checks, and the self-test."""

from __future__ import annotations

import bisect
import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from contactfpga_sim.model.golden import guard
from contactfpga_sim.model.golden.facts import Facts
from contactfpga_sim.model.golden.guard import FaultyLines, closed, stuck
from contactfpga_sim.model.golden.request import Request
from contactfpga_sim.model.golden.scan import Stages
from contactfpga_sim.model.golden.trace import Timeline

LOOKS = 4
"""Samples of a window, each at least ``apart`` cycles after the one before."""


@dataclasses.dataclass(frozen=True)
class _State:
    cycle: int
    count: int
    """Cycles of the window; the count stops before each of the :data:`LOOKS` until that happens."""
    low: np.ndarray
    """(C,) bool: columns that read pressed at each sample of the window so far."""
    stuck: np.ndarray
    """(C,) bool: columns found stuck."""
    asked: bool = False
    """Whether stuck columns are driven in the next window."""
    tries: bool = False
    """Whether stuck columns are driven in this window."""

    @property
    def let_go(self) -> np.ndarray:
        return self.stuck & (not self.tries)


class StuckColumns:
    """Runs through a timeline with the scan, which reports its samples of the columns in order of cycles."""

    def __init__(self, facts: Facts, timeline: Timeline):
        self._facts = facts
        self._timeline = timeline
        self._changes = sorted({*(piece[0] for piece in timeline.pieces), *(cut[0] for cut in timeline.cuts)})
        self._retry = guard.RETRY_US * facts.clocks_per_us
        self._apart = 2 ** max(4, max(facts.precharge, facts.project).bit_length())
        self._present = ~facts.mask.all(axis=0)
        everything = np.ones(facts.columns, bool)
        self._states = [_State(-1, 0, everything, ~everything)]
        self._moved: list[int] = []  # cycles after which other columns are let go
        self._found: list[int] = []  # cycles after which there are stuck columns, and after which there are none
        self._guard: list[int] = []

    def rests(self, begin: int, end: int) -> None:
        """Sample in each of these cycles of a rest."""
        if begin <= end:
            self._go_to(self._passed(begin - 1))
            self._rest(end)

    def cut(self, cycle: int) -> None:
        """The last rest ends with this cycle."""
        while self._states[-1].cycle > cycle:
            self._states.pop()
        for cycles in (self._moved, self._found):
            while cycles and cycles[-1] > cycle:
                cycles.pop()
        self._rest(cycle)

    def look(self, cycle: int) -> None:
        """Sample in this cycle, unless it belongs to a rest."""
        if self._states[-1].cycle < cycle:
            self._go_to(self._passed(cycle - 1))
            self._go_to(self._looked(self._states[-1]))

    def guard_found(self, cycle: int) -> None:
        """The guard column reads pressed in a check, as seen in this cycle."""
        self._guard.append(cycle)

    def at(self, cycle: int) -> np.ndarray:
        """(column lines,) bool: columns stuck in this cycle."""
        return self._with_guard(self._after(cycle - 1).stuck, cycle - 1)

    def undriven(self, cycle: int) -> np.ndarray:
        """(column lines,) bool: columns not driven at the pins."""
        return self._with_guard(self._after(cycle - 2).let_go, cycle - 2)

    def driven_anew(self, begin: int, end: int) -> list[int]:
        """Cycles from ``begin`` to ``end`` in which the driven columns change."""
        first = bisect.bisect_left(self._moved, begin - 2)
        return [cycle + 2 for cycle in self._moved[first:] if cycle + 2 <= end]

    def known(self, begin: int = 0, end: float = math.inf) -> list[tuple[int, int]]:
        """(cycle, level) of every change, from ``begin`` to before ``end``, of whether any column is stuck."""
        first = bisect.bisect_left(self._found, begin - 1)
        changes = [(cycle + 1, 1 - place % 2) for place, cycle in enumerate(self._found[first:], first)]
        return [change for change in changes if change[0] < end]

    def _go_to(self, state: _State) -> None:
        if state.stuck.any() != self._states[-1].stuck.any():
            self._found.append(state.cycle)
        if (state.let_go != self._states[-1].let_go).any():
            self._moved.append(state.cycle)
        self._states.append(state)

    def _after(self, cycle: int) -> _State:
        index = bisect.bisect_right(self._states, cycle, key=lambda state: state.cycle)
        return self._states[max(index - 1, 0)]

    def _with_guard(self, columns: np.ndarray, cycle: int) -> np.ndarray:
        """Columns as known after this cycle; a stuck guard column is released until the next retry."""
        found = bisect.bisect_right(self._guard, cycle) - 1
        last = self._guard[found] if found >= 0 else 0
        held = found >= 0 and last // self._retry == cycle // self._retry and last % self._retry != 0
        return np.append(columns, np.full(self._facts.column_lines - self._facts.columns, held))

    def _passed(self, cycle: int) -> _State:
        state = self._states[-1]
        waits = state.count // self._apart * self._apart + self._apart - 1
        count = min(state.count + cycle - state.cycle, waits)
        asked = state.asked or (state.cycle // self._retry != cycle // self._retry and cycle >= self._retry)
        return dataclasses.replace(state, cycle=cycle, count=count, asked=asked)

    def _rest(self, end: int) -> None:
        while self._states[-1].cycle < end:
            self._go_to(self._alike(self._states[-1], end))

    def _alike(self, state: _State, end: int) -> _State:
        first = state.cycle + 1
        later = [cycle + 2 for cycle in self._changes[bisect.bisect_right(self._changes, first - 2) :][:1]]
        later += [cycle + 4 for cycle in self._moved[-4:] if cycle + 4 > first]
        last = min(end, (first // self._retry + 1) * self._retry - 1, *(cycle - 1 for cycle in later))
        window = LOOKS * self._apart
        left = window - 1 - state.count
        if not left or first % self._retry == 0:
            return self._looked(state)
        pressed = self._reads(first)
        news = state.asked or state.tries or not state.low.all() or (pressed & self._present & ~state.stuck).any()
        if not state.count and not news and last - state.cycle >= window:
            return dataclasses.replace(state, cycle=state.cycle + (last - state.cycle) // window * window)
        count = min(left, last - state.cycle)
        return dataclasses.replace(state, cycle=state.cycle + count, count=state.count + count, low=state.low & pressed)

    def _looked(self, state: _State) -> _State:
        cycle = state.cycle + 1
        low = state.low & self._reads(cycle)
        wraps = cycle % self._retry == 0 and cycle > 0
        if state.count < LOOKS * self._apart - 1:
            asked = state.asked or wraps
            return dataclasses.replace(state, cycle=cycle, count=state.count + 1, low=low, asked=asked)
        found = (low | state.stuck & (not state.tries)) & self._present
        return _State(cycle, 0, np.ones_like(low), found, asked=wraps, tries=state.asked)

    def _reads(self, cycle: int) -> np.ndarray:
        """(C,) bool: columns that read pressed after the synchronizer: stuck ones, and undriven ones on a row that no
        other column lifts."""
        facts, cycle = self._facts, cycle - 2
        held = stuck(facts, self._timeline, cycle)[: facts.columns]
        undriven = self.undriven(cycle)[: facts.columns] | ~self._present
        shut = closed(facts, self._timeline, cycle)[: facts.rows, : facts.columns]
        lifted = (shut & ~undriven & ~held).any(axis=1)
        return np.asarray(held | undriven & shut[~lifted].any(axis=0))


CHECK_US = 2**8
"""Interval of checks of a resting sheet, by multiples of the clock."""


class GuardChecks:
    """Guard checks of columns and rows, in turn."""

    def __init__(self, facts: Facts, timeline: Timeline, held: StuckColumns):
        self.slots: list[tuple[int, int]] = []
        """First and last cycle of each slot of the guard row."""
        self._facts = facts
        self._timeline = timeline
        self._held = held
        self._retry = guard.RETRY_US * facts.clocks_per_us
        self._retries = 0  # up to the last check of rows
        self._renews = False
        self._faulty = FaultyLines(facts)
        self._of_rows = False
        self._last = 0  # the cycle in which the last check started

    @property
    def word(self) -> int:
        """Fault word from three cycles after the last check's sample on."""
        return self._faulty.word

    @property
    def asked(self) -> int:
        """Cycle from which a resting sheet is checked."""
        period = CHECK_US * self._facts.clocks_per_us
        return (self._last // period + 1) * period + 1

    def after(self, sample: int) -> tuple[int, bool]:
        """Check after the last row of a frame was sampled; returns the cycle of the sample, and whether the guard
        column reads stuck."""
        facts = self._facts
        wait = 1 + max(facts.project, facts.settle) if self._of_rows else facts.row_clocks
        return self._check(sample, sample + wait)

    def at_rest(self, cycle: int) -> tuple[int, bool]:
        """Check a resting sheet after this cycle; returns as :meth:`after`."""
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
        if not pressed[-1] and not self._guard_reported:
            self._faulty.check("rows", ~answers, self._renews)
        self._faulty.check("stuck", pressed | self._held.at(sample + 2), self._renews)
        retries = (sample + 2) // self._retry
        self._renews, self._retries = retries != self._retries, retries

    def _check_columns(self, sample: int) -> None:
        facts = self._facts
        answers = (closed(facts, self._timeline, sample)[-1] | self._stuck(sample))[: facts.columns]
        self._faulty.check("columns", ~answers, self._renews)

    @property
    def _guard_reported(self) -> bool:
        return bool(self.word >> self._facts.rows + 2 * self._facts.columns)

    def _guard_reads(self, sample: int) -> bool:
        pulled = closed(self._facts, self._timeline, sample)[: self._facts.rows, -1].any()
        return bool(self._stuck(sample)[-1] or (pulled and self._held.undriven(sample)[-1]))

    def _stuck(self, cycle: int) -> np.ndarray:
        return stuck(self._facts, self._timeline, cycle)


COMMAND = 1


class SelfTestModel:
    """Self-test slots: no line, each row, each column; at once after power-up, after a command as they are sent."""

    def __init__(self, facts: Facts, timeline: Timeline, requests: Sequence[Request], stages: Stages):
        self.discharged: list[tuple[int, int]] = []
        """(cycle, rows) of every change of the rows driven to the selecting level."""
        self.joined = False
        """Joined lines, from three cycles after a slot's sample on."""
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
        """Cycle from which a slot is wanted, if not after ``until``."""
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
        """Begin a slot in this cycle; returns the cycle of its sample."""
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
        last = self._number == self._facts.rows + self._facts.columns
        self._number += 1
        self._asked, self._idle = (None if last else cycle + 1), cycle + 1
        if self._commands and self._commands[0] < cycle:
            self._start(cycle)

    def _start(self, cycle: int) -> None:
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
