"""What every scan is given, what it hands to the stages after it, and what it leaves at the pins."""

from __future__ import annotations

import abc
import bisect
import dataclasses
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from contactfpga_sim.model.golden.facts import Facts, ScanTiming
from contactfpga_sim.model.golden.request import Request
from contactfpga_sim.model.golden.trace import Timeline


@dataclasses.dataclass(frozen=True)
class Scan:
    """One scan of the sheet, which becomes one frame."""

    cells: np.ndarray
    """(R, C) bool: raw samples, masked switches removed."""
    offered: list[int]
    """Cycle at which each row is offered to the next stage."""
    stuck: int
    """Columns that read pressed while no row was driven, without a guard column."""
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
    faults: int = 0
    """What was told of faulty lines when it ended: :attr:`contactfpga_sim.model.golden.guard.FaultyLines.word`."""

    motion: bool = False
    """A row read touched as the frame began, and empty when it was driven."""

    @property
    def fault(self) -> bool:
        """What its frame tells of faults."""
        return self.stuck > 0 or self.faults > 0


Changes = list[tuple[int, int]]
"""(cycle, level) of every change."""


@dataclasses.dataclass(frozen=True)
class ScanOutput:
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

    def tell(self, cycle: int, faults: int) -> None:
        """From a cycle on, no earlier than any before, this is told of faulty lines. It is said before a frame of which
        anything is on the wire in that cycle."""

    def watch(self, cycle: int) -> None:
        """In a cycle an untouched sheet was looked at, for a scan that waits."""

    def slot(self, cycle: int, number: int, rows: int, columns: int) -> None:
        """A slot of the self-test, which read these lines as bits, goes out, from a cycle on."""

    def slot_over(self, cycle: int) -> int | None:
        """The cycle in which it went out, if that is not after ``cycle``; all before must have been said."""

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


class ScanRule(ScanTiming):
    """The golden rule of a scan."""

    @abc.abstractmethod
    def scan(self, play: Play) -> ScanOutput:
        """The frames of all its cycles, or more; each is handed to its stages."""


def early_clocks(facts: Facts, requests: Sequence[Request], late: int) -> int:
    """By how many clocks the samples of a frame come before the end of the settle time: it takes the commands over that
    were received before cycle ``late``."""
    moved = [one.command[1] for one in requests if one.cycle < late and one.command and one.command[0] == 2]
    fits = moved and facts.samples_early and facts.first_sample <= moved[-1] < facts.settle
    return facts.settle - moved[-1] if fits else 0


def last_number(requests: Sequence[Request], cycle: int) -> int:
    """Of the last request that was received before ``cycle``; 0 if there was none."""
    index = bisect.bisect_left(requests, cycle, key=lambda request: request.cycle)
    return requests[index - 1].number if index else 0
