"""Scanner: which cells are sampled when, the contact pin, stuck columns, device time and requests."""

from __future__ import annotations

import abc
import bisect
import dataclasses
from collections.abc import Iterable, Sequence
from typing import Protocol

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


Changes = list[tuple[int, int]]
"""(cycle, level) of every change."""


@dataclasses.dataclass(frozen=True)
class Scanned:
    """What a scan does at the pins in the cycles it was asked for, and beyond."""

    contact: Changes
    """Of the contact pin."""
    driven: Changes
    """Of the rows that are driven; bit r is row r."""
    beginnings: list[int]
    """Cycles in which a frame begins, one of them beyond."""


class Rows(Protocol):
    """A frame's rows, for a scan that waits until each is taken."""

    def take(self, place: int, cells: np.ndarray, offered: int, alone: bool, last: bool) -> int:
        """A row of the sheet, its (C,) cells as they count, offered from a cycle on; ``alone``: it was driven. Returns
        the cycle in which it is taken."""

    def end(self, one: Scan, cells: np.ndarray) -> int:
        """All rows were taken, (R, C) ``cells`` in all; returns the cycle from which the next frame may begin."""


class Stages(Protocol):
    """What comes after the scan."""

    @property
    def due(self) -> int:
        """The cycle from which on a frame is due, for a scan that waits."""

    def frame(self, one: Scan, cells: np.ndarray) -> None:
        """All rows of a frame, ``cells`` (R, C) as they count; the scan waits for nothing."""

    def rows(self) -> Rows:
        """The next frame, row by row."""


@dataclasses.dataclass(frozen=True)
class Play:
    """What a scan goes through."""

    facts: Facts
    timeline: Timeline
    requests: Sequence[Request]
    """In the order of their coming."""
    cycles: int
    stages: Stages


class ScanRule(abc.ABC):
    """The golden rule of a scan."""

    even: bool
    """Every frame takes the same time, every row once."""
    waits: bool
    """It waits for the stages after it, and the link counts no frames but time."""

    @abc.abstractmethod
    def choice(self, facts: Facts) -> int:
        """Clocks that the scan takes to choose its next rows."""

    @abc.abstractmethod
    def frame_slots(self, facts: Facts) -> int:
        """The most row times that a frame takes."""

    @abc.abstractmethod
    def scan(self, play: Play) -> Scanned:
        """The frames of all its cycles, or more; each is handed to its stages."""


class Raster(ScanRule):
    """Row after row, each for the same time."""

    even = True
    waits = False

    def choice(self, facts: Facts) -> int:
        return 0

    def frame_slots(self, facts: Facts) -> int:
        return facts.rows

    def scan(self, play: Play) -> Scanned:
        facts, frames = play.facts, play.cycles // play.facts.scan_clocks + 1
        scanned = scans(facts, play.timeline, play.requests, frames)
        counted = debounced(
            np.array([one.cells for one in scanned]), facts.skin.debounce, facts.press_scans, facts.release_scans
        )
        for one, cells in zip(scanned, counted, strict=True):
            play.stages.frame(one, cells)
        driven = []
        for slot in range(frames * facts.rows):
            start = facts.row_shift + slot * facts.row_clocks
            driven += [(start, 1 << slot % facts.rows), (start + facts.settle, 0)]
        beginnings = [facts.row_shift + number * facts.scan_clocks for number in range(frames + 1)]
        return Scanned(contact(facts, scanned), driven, beginnings)


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
