"""Line reversal: which columns are stuck, and so not driven."""

from __future__ import annotations

import bisect
import dataclasses

import numpy as np

from contactfpga_sim.model.golden import guard
from contactfpga_sim.model.golden.facts import Facts
from contactfpga_sim.model.golden.trace import Timeline

LOOKS = 4
"""Of a window, each ``apart`` cycles after the one before or later."""


@dataclasses.dataclass(frozen=True)
class _State:
    """After a cycle."""

    cycle: int
    count: int
    """Of the window, each cycle; but it stands still before each of the :data:`LOOKS` until this comes."""
    low: np.ndarray
    """(C,) bool: columns that read pressed at each look of the window."""
    stuck: np.ndarray
    """(C,) bool."""
    asked: bool = False
    """In the next window stuck columns are driven."""
    tries: bool = False
    """They are in this one."""

    @property
    def let_go(self) -> np.ndarray:
        return self.stuck & (not self.tries)


class Held:
    """Goes through a timeline with the scan, which tells when it looks at the columns; cycles rise."""

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
        self._guard: list[int] = []

    def rests(self, begin: int, end: int) -> None:
        """Each of these cycles is a look."""
        if begin <= end:
            self._go_to(self._passed(begin - 1))
            self._rest(end)

    def cut(self, cycle: int) -> None:
        """The last rest ends with this cycle of it."""
        while self._states[-1].cycle > cycle:
            self._states.pop()
        while self._moved and self._moved[-1] > cycle:
            self._moved.pop()
        self._rest(cycle)

    def look(self, cycle: int) -> None:
        """One; nothing if it was one of a rest."""
        if self._states[-1].cycle < cycle:
            self._go_to(self._passed(cycle - 1))
            self._go_to(self._looked(self._states[-1]))

    def guard_found(self, cycle: int) -> None:
        """The guard column reads pressed in a check, as the gateware sees in this cycle."""
        self._guard.append(cycle)

    def at(self, cycle: int) -> np.ndarray:
        """(column lines,) bool: columns that are stuck in this cycle."""
        return self._with_guard(self._after(cycle - 1).stuck, cycle - 1)

    def undriven(self, cycle: int) -> np.ndarray:
        """(column lines,) bool: those that are not driven at the pins."""
        return self._with_guard(self._after(cycle - 2).let_go, cycle - 2)

    def driven_anew(self, begin: int, end: int) -> list[int]:
        """Cycles from ``begin`` to ``end`` in which the pins drive other columns than before."""
        first = bisect.bisect_left(self._moved, begin - 2)
        return [cycle + 2 for cycle in self._moved[first:] if cycle + 2 <= end]

    def _go_to(self, state: _State) -> None:
        if (state.let_go != self._states[-1].let_go).any():
            self._moved.append(state.cycle)
        self._states.append(state)

    def _after(self, cycle: int) -> _State:
        index = bisect.bisect_right(self._states, cycle, key=lambda state: state.cycle)
        return self._states[max(index - 1, 0)]

    def _with_guard(self, columns: np.ndarray, cycle: int) -> np.ndarray:
        """What is known after this cycle; a guard column is let go until the next retry."""
        found = bisect.bisect_right(self._guard, cycle) - 1
        last = self._guard[found] if found >= 0 else 0
        held = found >= 0 and last // self._retry == cycle // self._retry and last % self._retry != 0
        return np.append(columns, np.full(self._facts.column_lines - self._facts.columns, held))

    def _passed(self, cycle: int) -> _State:
        """No look up to this cycle."""
        state = self._states[-1]
        waits = state.count // self._apart * self._apart + self._apart - 1
        count = min(state.count + cycle - state.cycle, waits)
        asked = state.asked or (state.cycle // self._retry != cycle // self._retry and cycle >= self._retry)
        return dataclasses.replace(state, cycle=cycle, count=count, asked=asked)

    def _rest(self, end: int) -> None:
        while self._states[-1].cycle < end:
            self._go_to(self._alike(self._states[-1], end))

    def _alike(self, state: _State, end: int) -> _State:
        """After all looks from the next one on that find the same, in the same window or in windows without news."""
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
        turns = cycle % self._retry == 0 and cycle > 0
        if state.count < LOOKS * self._apart - 1:
            asked = state.asked or turns
            return dataclasses.replace(state, cycle=cycle, count=state.count + 1, low=low, asked=asked)
        found = (low | state.stuck & (not state.tries)) & self._present
        return _State(cycle, 0, np.ones_like(low), found, asked=turns, tries=state.asked)

    def _reads(self, cycle: int) -> np.ndarray:
        """(C,) bool: columns that read pressed, as the synchronizer shows them: those that are stuck, and those that
        are not driven and that a pressed switch leads to a row that no other column lifts."""
        facts, cycle = self._facts, cycle - 2
        held = guard.stuck(facts, self._timeline, cycle)[: facts.columns]
        undriven = self.undriven(cycle)[: facts.columns] | ~self._present
        shut = guard.closed(facts, self._timeline, cycle)[: facts.rows, : facts.columns]
        lifted = (shut & ~undriven & ~held).any(axis=1)
        return np.asarray(held | undriven & shut[~lifted].any(axis=0))
