"""Scanner: which cells are sampled when, the contact pin, stuck columns, device time and requests."""

from __future__ import annotations

import abc
import bisect
import dataclasses
from collections.abc import Iterable, Sequence

import numpy as np

from contactfpga_sim.golden.debounce import debounced
from contactfpga_sim.golden.facts import Facts
from contactfpga_sim.golden.request import Request
from contactfpga_sim.golden.trace import Timeline


@dataclasses.dataclass(frozen=True)
class Scan:
    """One scan of the sheet, which becomes one frame."""

    cells: np.ndarray
    """(R, C) bool: raw samples, masked switches removed."""
    offered: list[int]
    """Cycle at which each row is offered to the next stage."""
    stuck: int
    """Columns that read pressed while no row was driven."""
    time_us: int
    """Device time of the first row's strobe, less what the columns were shifted; unbounded."""
    requested: bool
    """A request came in since the scan before began."""
    heard: int
    """The lowest three bits of the last request's number before it began; 0 before the first one."""
    told: int
    """From this cycle on a hello tells its stuck columns."""
    slots: int
    """Row times it took."""
    alone: frozenset[int]
    """Rows that were driven alone."""


Scanned = tuple[list[Scan], Iterable[np.ndarray], list[tuple[int, int]]]
"""Frames, their cells as they count once debounced, and changes of the contact pin."""


class ScanRule(abc.ABC):
    """The golden rule of a scan."""

    even: bool
    """Every frame takes the same time, every row once."""

    @abc.abstractmethod
    def choice(self, facts: Facts) -> int:
        """Clocks that the scan takes to choose its next rows."""

    @abc.abstractmethod
    def frame_slots(self, facts: Facts) -> int:
        """The most row times that a frame takes."""

    @abc.abstractmethod
    def scanned(self, facts: Facts, timeline: Timeline, requests: Sequence[Request], cycles: int) -> Scanned:
        """The frames of cycles 0 to ``cycles`` - 1, or more, with the requests in the order of their coming."""

    @abc.abstractmethod
    def driven(self, facts: Facts, timeline: Timeline, cycles: int) -> list[tuple[int, int]]:
        """(cycle, rows) of every change of the rows that are driven, up to ``cycles`` and beyond; bit r is row r."""

    @abc.abstractmethod
    def beginnings(self, facts: Facts, timeline: Timeline, cycles: int) -> list[int]:
        """Cycles in which the first row time of a frame begins, up to ``cycles`` and one beyond."""


class Raster(ScanRule):
    """Row after row, each for the same time."""

    even = True

    def choice(self, facts: Facts) -> int:
        return 0

    def frame_slots(self, facts: Facts) -> int:
        return facts.rows

    def scanned(self, facts: Facts, timeline: Timeline, requests: Sequence[Request], cycles: int) -> Scanned:
        scanned = scans(facts, timeline, requests, cycles // facts.scan_clocks + 1)
        counted = debounced(
            np.array([one.cells for one in scanned]), facts.skin.debounce, facts.press_scans, facts.release_scans
        )
        return scanned, counted, contact(facts, scanned)

    def driven(self, facts: Facts, timeline: Timeline, cycles: int) -> list[tuple[int, int]]:
        changes = []
        for slot in range(cycles // facts.row_clocks + 1):
            start = facts.row_shift + slot * facts.row_clocks
            changes += [(start, 1 << slot % facts.rows), (start + facts.settle, 0)]
        return changes

    def beginnings(self, facts: Facts, timeline: Timeline, cycles: int) -> list[int]:
        return [facts.row_shift + number * facts.scan_clocks for number in range(cycles // facts.scan_clocks + 2)]


RASTER = Raster()


def strobe(facts: Facts, slot: int) -> int:
    """The cycle in which the sample of a row slot has come through shift registers and synchronizers."""
    return sampled(facts, slot) + 2 + facts.column_shift


def sampled(facts: Facts, slot: int) -> int:
    """The cycle whose column levels count for the row of a slot."""
    return facts.row_shift + slot * facts.row_clocks + facts.settle - 1


def _asked_before(facts: Facts, slot: int) -> int:
    """The cycle from which on a request comes too late for a frame that begins with this slot."""
    return sampled(facts, slot) - facts.load if facts.load else strobe(facts, slot)


def scans(facts: Facts, timeline: Timeline, requests: Sequence[Request], count: int) -> list[Scan]:
    """The first ``count`` scans, with the requests in the order in which they were received."""
    result = []
    for index in range(count):
        slots = range(index * facts.rows, (index + 1) * facts.rows)
        begin = strobe(facts, slots[0])
        late = _asked_before(facts, slots[0])
        early = _asked_before(facts, slots[0] - facts.rows) if index else 0
        result.append(
            Scan(
                cells=np.array([_sample(facts, timeline, slot) for slot in slots]),
                offered=[strobe(facts, slot) + 1 for slot in slots],
                stuck=_stuck(facts, timeline, slots),
                time_us=(begin - facts.column_shift) // facts.clocks_per_us,
                requested=any(early <= request.cycle < late for request in requests),
                heard=last_number(requests, late) % 8,
                told=strobe(facts, slots[-1]) + 2,
                slots=facts.rows,
                alone=frozenset(range(facts.rows)),
            )
        )
    return result


def last_number(requests: Sequence[Request], cycle: int) -> int:
    """Of the last request that was received before ``cycle``; 0 if there was none."""
    index = bisect.bisect_left(requests, cycle, key=lambda request: request.cycle)
    return requests[index - 1].number if index else 0


def contact(facts: Facts, scanned: Iterable[Scan]) -> list[tuple[int, int]]:
    """(cycle, level) of every change of the contact pin."""
    changes = []
    level = 0
    for scan in scanned:
        for row, cycle in enumerate(scan.offered):
            last = row == facts.rows - 1
            if scan.cells[row].any():
                new = 1
            elif last and not scan.cells.any():
                new = 0
            else:
                new = level
            if new != level:
                changes.append((cycle, new))
            level = new
    return changes


def _sample(facts: Facts, timeline: Timeline, slot: int) -> np.ndarray:
    row = slot % facts.rows
    cells, stuck = timeline.at(sampled(facts, slot))
    columns = np.zeros(facts.columns, bool)
    if cells is not None:
        columns |= np.asarray(cells[row], bool)
    if stuck is not None:
        columns |= np.asarray(stuck, bool)
    return columns & ~facts.mask[row]


def _stuck(facts: Facts, timeline: Timeline, slots: range) -> int:
    columns = np.zeros(facts.columns, bool)
    for slot in range(slots[0] - 1, slots[-1]):
        if slot < 0:
            continue
        _, stuck = timeline.at(facts.row_shift + (slot + 1) * facts.row_clocks - 1)
        if stuck is not None:
            columns |= np.asarray(stuck, bool)
    return int(np.sum(columns & ~facts.mask.all(axis=0)))
