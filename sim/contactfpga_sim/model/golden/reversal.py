"""The scan by line reversal."""

from __future__ import annotations

import dataclasses

import numpy as np

from contactfpga_sim.model.golden import debounce, reversal_lines
from contactfpga_sim.model.golden.facts import Facts
from contactfpga_sim.model.golden.faults import FaultHistory
from contactfpga_sim.model.golden.guard import closed, stuck
from contactfpga_sim.model.golden.request import Request
from contactfpga_sim.model.golden.reversal_lines import GuardChecks, SelfTestModel, StuckColumns
from contactfpga_sim.model.golden.scan import Changes, Play, Rows, Scan, ScanOutput, ScanRule, early_clocks, last_number


@dataclasses.dataclass(frozen=True)
class Slot:
    """A row driven from cycle ``begin`` to ``end``, whose columns are sampled in the last one or earlier."""

    row: int
    begin: int
    end: int
    sample: int

    @property
    def strobe(self) -> int:
        """Cycle in which the sample has passed the synchronizer."""
        return self.sample + 2


class RowOffers:
    """Offered rows of a frame: with zones the driven ones, each followed by an empty one unless its next neighbor is
    driven; otherwise all."""

    def __init__(self, facts: Facts, rows: Rows):
        self.taken = 0
        """The cycle in which the last row was taken."""
        self._facts = facts
        self._rows = rows
        self._place = 0
        self._nothing = np.zeros(facts.columns, bool)

    def driven(self, row: int, cells: np.ndarray, offered: int, following: int | None) -> None:
        if self._facts.zones:
            self._offer(row, cells, offered, True, following is None)
            if following is not None and following != row + 1:
                self._offer(row + 1, self._nothing, self.taken + 1, False, False)
            return
        self._all_until(row, offered)
        self._offer(row, cells, max(offered, self.taken + 1), True, row == self._facts.rows - 1)
        if following is None:
            self._all_until(self._facts.rows, offered)

    def nothing(self, offered: int) -> None:
        if self._facts.zones:
            self._offer(0, self._nothing, offered, False, True)
        else:
            self._all_until(self._facts.rows, offered)

    def _all_until(self, end: int, offered: int) -> None:
        while self._place < end:
            last = self._place == self._facts.rows - 1
            self._offer(self._place, self._nothing, max(offered, self.taken + 1), False, last)

    def _offer(self, place: int, cells: np.ndarray, offered: int, alone: bool, last: bool) -> None:
        self.taken = self._rows.take(place, cells, offered, alone, last)
        self._place = place + 1


class ReversalScanModel:
    """Runs through a timeline frame by frame; the stages decide when rows and frames are taken."""

    def __init__(self, play: Play):
        facts = play.facts
        self.slots: list[Slot] = []
        self.begun: list[int] = []
        """By frame the cycle in which the rows count, after the synchronizer."""
        self.contact: Changes = []
        self._facts = facts
        self._timeline = play.timeline
        self._changes = [*(piece[0] for piece in play.timeline.pieces), *(cut[0] for cut in play.timeline.cuts)]
        self._requests = play.requests
        self._stages = play.stages
        self._debounce = debounce.TimedDebounce(facts.skin.debounce, facts.press_ticks, facts.release_ticks)
        self._busy: frozenset[int] = frozenset()
        self._listens = 1  # the first cycle in which all columns are driven and rows let go
        self._packed = 0  # the cycle from which on a frame may begin
        self._rests = False
        self._faults = FaultHistory()
        self._flag = False  # the last frame's for faults
        self._held = StuckColumns(facts, play.timeline)
        self.checks = GuardChecks(facts, play.timeline, self._held) if facts.skin.guard else None
        self.test = SelfTestModel(facts, play.timeline, play.requests, play.stages) if facts.skin.self_test else None

    @property
    def stuck(self) -> Changes:
        """Changes of whether any column is known to be stuck."""
        return self._held.known()

    def frame(self) -> None:
        """Run the next frame."""
        begun = self._begin()
        self._held.look(begun)
        touched = self._touched(begun - 2)
        todo = sorted(touched | self._busy)
        scan = Scan(
            cells=np.zeros((self._facts.rows, self._facts.columns), bool),
            offered=[],
            stuck=int(np.sum(self._held.at(begun + 1)[: self._facts.columns])),
            time_us=begun // self._facts.clocks_per_us,
            requested=any(one.cycle < begun for one in self._waiting()),
            heard=last_number(self._requests, begun) % 8,
            reported=begun + 3,
            faults=self._word,
        )
        self.begun.append(begun)
        self._rests, self._flag = not todo, scan.fault
        rows = self._stages.rows()
        counted = self._drive(begun, todo, rows, scan.cells)
        if not scan.cells.any():
            self._set_contact(self.slots[-1].strobe + 1 if todo else begun + 1, 0)
        motion = any(not scan.cells[row].any() for row in touched & self._clean_rows())
        self._packed = rows.end(dataclasses.replace(scan, motion=motion), counted)

    # ---- when a frame begins

    def _begin(self) -> int:
        project = self._facts.project
        if not self._rests:
            return self._after_tests(max(self._listens + project + 1, self._packed))
        begin = self.begun[-1] + 1
        while True:
            wanted = max(self._wanted(), self._packed, begin)
            check = max(self.checks.asked, begin) if self.checks else wanted + 1
            until = min(wanted, check)
            self._held.rests(begin, until)
            if (changed := self._fault_change(max(self._packed, begin), until)) < until:
                wanted = until = changed
                self._held.cut(until)
            touched = self._first_touched(begin - 2, until - 2)
            test = self._test_asked(begin, until if touched is None else touched + 1)
            if test is not None:
                until, touched = test, None
                self._held.cut(until)
            self._watch(begin, until if touched is None else touched + 2)
            if touched is not None:
                return self._after_tests(max(self._wake(touched) + project, self._packed))
            if test is not None:
                self._test_at(test)
            elif not self.checks or wanted < check:
                return wanted
            else:
                self._listen_after(*self.checks.at_rest(check))
                self._stages.watch(self._listens)
            self._watch(until + 1, self._listens + project)
            begin = self._listens + project + 1

    def _after_tests(self, begin: int) -> int:
        while self._test_asked(begin, begin) is not None:
            self._test_at(begin)
            begin = self._listens + self._facts.project + 1
        return begin

    def _test_asked(self, begin: int, until: int) -> int | None:
        begin = max(begin, self._packed)
        asked = self.test.asked(until) if self.test and begin <= until else None
        return None if asked is None else max(asked, begin)

    def _test_at(self, cycle: int) -> None:
        assert self.test is not None
        sample = self.test.slot(cycle)
        self._listens = sample + 4
        self._tell(sample + 3)

    def _tell(self, cycle: int) -> None:
        self._faults.change(cycle, self._word)
        self._stages.tell(cycle, self._word)

    def _fault_change(self, begin: int, end: int) -> int:
        """First cycle from ``begin`` on after one in which what is known of faults differs from the last flag, or
        ``end``; reported lines do not change later than in ``begin``."""
        if self._facts.skin.send == "always":
            return end
        changes = {begin, begin + 1, *(cycle + 1 for cycle, _ in self._held.known(begin, end))}
        return next((cycle for cycle in sorted(changes) if cycle < end and self._known(cycle - 1) != self._flag), end)

    def _known(self, cycle: int) -> bool:
        return bool(self._held.at(cycle)[: self._facts.columns].any() or self._faults.at(cycle))

    @property
    def _word(self) -> int:
        joined = self.test is not None and self.test.joined
        checked = self._facts.fault_bits - 1 if joined else 0
        return (self.checks.word if self.checks else 0) | joined << checked

    def _watch(self, begin: int, end: int) -> None:
        period = reversal_lines.CHECK_US * self._facts.clocks_per_us
        if not self.checks:
            for cycle in range(-(-begin // period) * period, end + 1, period):
                self._stages.watch(cycle)

    def _wake(self, touched: int) -> int:
        seen = touched + 2
        self._held.cut(seen)
        if self._touched(touched) & self._clean_rows():
            self._set_contact(seen + 1, 1)
        return seen

    def _listen_after(self, checked: int, guard_is_stuck: bool) -> None:
        if guard_is_stuck:
            self._held.guard_found(checked + 2)
        self._listens = checked + 2
        self._tell(checked + 3)

    def _wanted(self) -> int:
        before = self.begun[-1]
        if self._facts.skin.send == "always":
            return before + 1
        return max(before + 1, min([*(one.cycle + 1 for one in self._waiting()), self._stages.due]))

    def _waiting(self) -> list[Request]:
        before = self.begun[-1] if self.begun else 0
        return [one for one in self._requests if one.cycle >= before]

    # ---- what the sheet shows while the board listens

    def _touched(self, cycle: int) -> frozenset[int]:
        facts = self._facts
        driven = ~self._held.undriven(cycle) & ~stuck(facts, self._timeline, cycle)
        lines = closed(facts, self._timeline, cycle)[: facts.rows] & driven
        rows = (lines[:, : facts.columns] & ~facts.mask.all(axis=0)).any(axis=1) & ~facts.mask.all(axis=1)
        return frozenset(np.flatnonzero(rows).tolist())

    def _clean_rows(self) -> set[int]:
        return set(np.flatnonzero(~self._facts.mask.any(axis=1)).tolist())

    def _first_touched(self, begin: int, end: int) -> int | None:
        changes = {begin, *self._changes, *self._held.driven_anew(begin, end)}
        return next((cycle for cycle in sorted(changes) if begin <= cycle <= end and self._touched(cycle)), None)

    # ---- rows that are driven

    def _drive(self, begun: int, todo: list[int], rows: Rows, cells: np.ndarray) -> np.ndarray:
        facts = self._facts
        counted = np.zeros_like(cells)
        offers = RowOffers(facts, rows)
        begin = begun + max(4, facts.precharge - facts.project)
        ahead = early_clocks(facts, self._requests, begun)
        for row in todo:
            end = begin + facts.settle - 1
            slot = Slot(row, begin, end, end - ahead)
            self.slots.append(slot)
            cells[row] = self._read(slot)
            if cells[row].any():
                self._set_contact(slot.strobe + 1, 1)
            counts, busy = self._debounce.take(cells, {row: slot.strobe // facts.clocks_per_us})
            self._busy = busy if facts.debounced else frozenset()
            counted[row] = counts[row]
            following = min((other for other in todo if other > row), default=None)
            offers.driven(row, counted[row], slot.strobe + 1, following)
            begin = max(slot.begin + facts.row_clocks, offers.taken + 4)
        if not todo:
            offers.nothing(begun + 1)
        else:
            self._listens = self.slots[-1].end + 2
            if self.checks:
                self._listen_after(*self.checks.after(self.slots[-1].end))
        return counted

    def _read(self, slot: Slot) -> np.ndarray:
        facts = self._facts
        lines = closed(facts, self._timeline, slot.sample)[slot.row] | stuck(facts, self._timeline, slot.sample)
        return np.asarray(lines[: facts.columns] & ~facts.mask[slot.row])

    def _set_contact(self, cycle: int, level: int) -> None:
        if level != (self.contact[-1][1] if self.contact else 0):
            self.contact.append((cycle, level))


class Reversal(ScanRule):
    """Line reversal: the touched rows, one by one."""

    waits = True

    def scan(self, play: Play) -> ScanOutput:
        scanner, facts = ReversalScanModel(play), play.facts
        while not scanner.begun or scanner.begun[-1] <= play.cycles:
            scanner.frame()
        slots = [(slot.begin, slot.end, slot.row) for slot in scanner.slots]
        if scanner.checks:
            slots = sorted(slots + [(*slot, facts.rows) for slot in scanner.checks.slots])
        driven = [change for begin, end, row in slots for change in ((begin, 1 << row), (end + 1, 0))]
        if scanner.test:
            driven = sorted(driven + scanner.test.discharged)
        return ScanOutput(scanner.contact, driven, scanner.begun, scanner.stuck)


REVERSAL = Reversal()
