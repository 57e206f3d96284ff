"""The adaptive scan."""

from __future__ import annotations

import bisect
import dataclasses
from collections.abc import Generator, Iterable, Sequence

import numpy as np

from contactfpga_sim.model.golden import debounce
from contactfpga_sim.model.golden.facts import Facts
from contactfpga_sim.model.golden.request import Request
from contactfpga_sim.model.golden.scan import Play, Scan, ScanOutput, ScanRule, last_number
from contactfpga_sim.model.golden.trace import Timeline

Choice = tuple[frozenset[int], bool]
"""(rows of a slot, whether the slot is one row alone, not a probe)."""

Choices = Generator[Choice, bool, None]
"""Yields each slot's choice; receives whether any column read pressed."""


def row_choices(rows: int, listed: frozenset[int]) -> Choices:
    """Slots of a frame, with these rows on the list at its beginning."""
    return _RowSearch(rows, listed).slots()


class _RowSearch:
    def __init__(self, rows: int, listed: frozenset[int]):
        self._rows = rows
        self._alone = set(listed)
        self._unknown = set(range(rows)) - listed
        self._spare = len(self._unknown) - 1
        self._suspects: set[int] = set()
        self._searches = 0

    def slots(self) -> Choices:
        yield from self._look_at_the_rest()
        while self._alone:
            row = min(self._alone)
            self._alone.remove(row)
            pressed = yield frozenset([row]), True
            if row in self._suspects:
                self._suspects.remove(row)
                if pressed and row + 1 in self._alone | self._unknown:
                    self._drive_alone({row + 1})
                    self._suspects.add(row + 1)
                if not self._suspects:
                    yield from self._look_at_the_rest()

    def _drive_alone(self, found: set[int]) -> None:
        self._alone |= found
        self._unknown -= found

    def _look_at_the_rest(self) -> Choices:
        if not self._unknown:
            return
        if self._spare < 1:
            self._drive_alone(set(self._unknown))
            return
        self._spare -= 1
        hit = yield frozenset(self._unknown), False
        if not hit:
            self._unknown.clear()
        elif self._searches == 2:
            self._drive_alone(set(self._unknown))
        else:
            self._searches += 1
            yield from self._search()

    def _search(self) -> Choices:
        suspects = set(self._unknown)
        half = 1 << (self._rows - 1).bit_length() >> 1
        while half > 1:
            low = {row for row in suspects if not row & half}
            high = suspects - low
            half //= 2
            if not low or not high:
                continue
            if self._spare < 1:
                self._drive_alone(set(self._unknown))
                return
            self._spare -= 1
            if (yield frozenset(low), False):
                suspects = low
            else:
                self._unknown -= low
                suspects = high
        self._suspects = suspects
        self._drive_alone(set(suspects))


@dataclasses.dataclass(frozen=True)
class RowSlot:
    """A row time with its driven rows."""

    begin: int
    rows: frozenset[int]
    strobe: int
    """Cycle in which the columns have passed the synchronizers."""
    released: int
    """First cycle without a driven row; the slot's end if the rows stay driven."""
    end: int


class AdaptiveScanModel:
    """Runs through a timeline frame by frame; requests are in order."""

    def __init__(self, facts: Facts, timeline: Timeline, requests: Sequence[Request]):
        self.slots: list[RowSlot] = []
        self.contact: list[tuple[int, int]] = []
        """(cycle, level) of every change of the contact pin."""
        self._facts = facts
        self._timeline = timeline
        self._changes = [piece[0] for piece in timeline.pieces]
        self._requests = requests
        self._answered = 0
        self._listed: frozenset[int] = frozenset()
        self._busy: frozenset[int] = frozenset()
        self._debounce = debounce.TimedDebounce(facts.skin.debounce, facts.press_ticks, facts.release_ticks)
        self._present: np.ndarray = ~np.all(facts.mask, axis=0)
        self._clean: np.ndarray = ~np.any(facts.mask, axis=0)

    def frame(self) -> tuple[Scan, np.ndarray]:
        """Next frame, and its debounced cells."""
        facts = self._facts
        cells = np.zeros((facts.rows, facts.columns), bool)
        offered = [0] * facts.rows
        hits = set()
        alone_in: dict[int, int] = {}
        stuck = np.zeros(facts.columns, bool)
        first = len(self.slots)
        choices = row_choices(facts.rows, self._listed)
        choice = next(choices)
        while choice:
            rows, alone = choice
            begin = self.slots[-1].end if self.slots else facts.row_shift
            strobe = self._strobe(begin, rows)
            stuck |= self._released_before()
            columns = self._columns(strobe - 2, rows)
            hit = bool((columns & self._present).any())
            if alone:
                (row,) = rows
                cells[row] = columns & ~facts.mask[row]
                hits |= {row} if hit else set()
                alone_in[row] = len(self.slots)
                self._rise(strobe + 1, bool(cells[row].any()))
            else:
                self._watch(rows, strobe)
                self._rise(strobe + 1, bool((columns & self._clean).any()))
            if alone or not hit:
                for row in rows:
                    offered[row] = strobe + 1
            self._drive(min(begin, strobe), strobe, rows, hit)
            try:
                choice = choices.send(hit)
            except StopIteration:
                break
        self._end(strobe + 2, bool(cells.any()))
        self._listed = self._busy | hits
        counted, busy = self._debounce.take(cells, alone_in)
        self._busy = busy if facts.debounced else frozenset(hits)
        begun = self.slots[first].strobe
        scan = Scan(
            cells=cells,
            offered=offered,
            stuck=int(np.sum(stuck & self._present)),
            time_us=begun // facts.clocks_per_us,
            requested=self._asked_before(begun),
            heard=last_number(self._requests, begun) % 8,
            told=self.slots[-1].strobe + 3,
            slots=len(self.slots) - first,
            alone=frozenset(alone_in),
        )
        return scan, counted

    def _strobe(self, begin: int, rows: frozenset[int]) -> int:
        """Cycle of the slot's sample: after its settle time; for idle rows, when a touch is seen."""
        regular = begin + self._facts.settle + 1
        if not self._watched():
            return regular
        awake = self._first_seen(self.slots[-1].strobe + 1, regular - 2, rows, self._present)
        return regular if awake is None else awake + 2

    def _drive(self, begin: int, strobe: int, rows: frozenset[int], hit: bool) -> None:
        facts = self._facts
        end = begin + facts.row_clocks
        if not self._idle(rows):
            self.slots.append(RowSlot(begin, rows, strobe, begin + facts.settle, end))
        elif hit:
            self.slots.append(RowSlot(begin, rows, strobe, strobe + 1, strobe + 1 + facts.release))
        else:
            self.slots.append(RowSlot(begin, rows, strobe, end, end))

    def _idle(self, rows: frozenset[int]) -> bool:
        return len(rows) == self._facts.rows

    def _columns(self, cycle: int, rows: frozenset[int]) -> np.ndarray:
        cells, stuck = self._timeline.at(cycle)
        columns = np.zeros(self._facts.columns, bool)
        if cells is not None:
            columns |= np.asarray(cells, bool)[sorted(rows)].any(axis=0)
        if stuck is not None:
            columns |= np.asarray(stuck, bool)
        return columns

    def _released_before(self) -> np.ndarray:
        if not self.slots or self.slots[-1].released == self.slots[-1].end:
            return np.zeros(self._facts.columns, bool)
        return self._columns(self.slots[-1].end - 1, frozenset())

    def _watched(self) -> bool:
        return bool(self.slots) and self.slots[-1].released == self.slots[-1].end

    def _watch(self, rows: frozenset[int], strobe: int) -> None:
        if self._watched():
            seen = self._first_seen(self.slots[-1].strobe, strobe - 2, rows, self._clean)
            if seen is not None:
                self._rise(seen + 3, True)

    def _first_seen(self, begin: int, end: int, rows: frozenset[int], counts: np.ndarray) -> int | None:
        inside = self._changes[bisect.bisect_right(self._changes, begin) : bisect.bisect_right(self._changes, end)]
        for cycle in (begin, *inside):
            if cycle <= end and (self._columns(cycle, rows) & counts).any():
                return cycle
        return None

    def _rise(self, cycle: int, pressed: bool) -> None:
        if pressed and (not self.contact or not self.contact[-1][1]):
            self.contact.append((cycle, 1))

    def _end(self, cycle: int, pressed: bool) -> None:
        """If idle rows stay driven, readings count a clock earlier."""
        slot = self.slots[-1]
        if self._watched() and (self._columns(cycle - 3, slot.rows) & self._clean).any():
            self._rise(cycle, True)
        elif not pressed and self.contact and self.contact[-1][1]:
            self.contact.append((cycle, 0))

    def _asked_before(self, cycle: int) -> bool:
        before, self._answered = self._answered, sum(request.cycle < cycle for request in self._requests)
        return self._answered > before


def driven(facts: Facts, slots: Iterable[RowSlot]) -> list[tuple[int, int]]:
    """(cycle, rows) of every change of the driven rows; bit r is row r."""
    changes: list[tuple[int, int]] = []
    for slot in slots:
        word = sum(1 << row for row in slot.rows)
        if not changes or changes[-1][1] != word:
            changes.append((slot.begin, word))
        if slot.released < slot.end:
            changes.append((slot.released, 0))
    return changes


class Adaptive(ScanRule):
    """Probes of several rows while untouched, single rows where touched."""

    even = False
    waits = False

    def choice(self, facts: Facts) -> int:
        return 4 + max(2, facts.halvings)

    def frame_slots(self, facts: Facts) -> int:
        return facts.rows + 2 * facts.halvings + 2

    def scan(self, play: Play) -> ScanOutput:
        scanner, beginnings = AdaptiveScanModel(play.facts, play.timeline, play.requests), [play.facts.row_shift]
        while beginnings[-1] <= play.cycles:
            play.stages.frame(*scanner.frame())
            beginnings.append(scanner.slots[-1].end)
        return ScanOutput(scanner.contact, driven(play.facts, scanner.slots), beginnings)


ADAPTIVE = Adaptive()
