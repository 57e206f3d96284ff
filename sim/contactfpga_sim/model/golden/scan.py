"""A scan's inputs, its outputs to the later stages, and its effect on the pins."""

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
    """Cycle in which each row is offered to the next stage."""
    stuck: int
    """Number of columns, without a guard column, that read pressed while no row was driven."""
    time_us: int
    """Device time of the first row's strobe, less the column shift; unbounded."""
    requested: bool
    """Whether a request arrived since the previous scan began."""
    heard: int
    """The lowest three bits of the last request's number before it began; 0 without any."""
    told: int
    """Cycle from which a hello reports its stuck columns."""
    slots: int
    """Its duration in row times."""
    alone: frozenset[int]
    """Rows driven alone."""
    faults: int = 0
    """Reported faults at its end: :attr:`contactfpga_sim.model.golden.guard.FaultyLines.word`."""

    motion: bool = False
    """A row read touched at the frame's beginning, but empty when driven."""

    @property
    def fault(self) -> bool:
        """Whether its frame has the fault flag."""
        return self.stuck > 0 or self.faults > 0


Changes = list[tuple[int, int]]
"""(cycle, level) of every change."""


@dataclasses.dataclass(frozen=True)
class ScanOutput:
    """A scan's pin changes in the cycles requested, and beyond."""

    contact: Changes
    """Changes of the contact pin."""
    driven: Changes
    """Changes of the driven rows; bit r is row r."""
    beginnings: list[int]
    """First cycles of frames, one of them beyond."""


class Rows(Protocol):
    """A frame's rows, for a scan that waits for each transfer."""

    def take(self, place: int, cells: np.ndarray, offered: int, alone: bool, last: bool) -> int:
        """Offer a row of the sheet, (C,) debounced cells, from a cycle on; ``alone``: it was driven. Returns the cycle
        of the transfer."""

    def end(self, one: Scan, cells: np.ndarray) -> int:
        """All rows were taken, (R, C) ``cells``; returns the cycle from which the next frame may begin."""


class Stages(Protocol):
    """The stages after the scan."""

    @property
    def due(self) -> int:
        """The cycle from which a frame is due, for a scan that waits."""

    def tell(self, cycle: int, faults: int) -> None:
        """Report these faulty lines from a cycle on, no earlier than before. Call it before any frame with bytes on the
        wire in that cycle."""

    def watch(self, cycle: int) -> None:
        """An untouched sheet was checked in a cycle, for a scan that waits."""

    def slot(self, cycle: int, number: int, rows: int, columns: int) -> None:
        """Send a self-test slot, with read lines as bits, from a cycle on."""

    def slot_over(self, cycle: int) -> int | None:
        """The cycle in which the slot was sent, if not after ``cycle``; everything earlier must have been reported."""

    def frame(self, one: Scan, cells: np.ndarray) -> None:
        """All rows of a frame, ``cells`` (R, C) debounced; the scan does not wait."""

    def rows(self) -> Rows:
        """The next frame, row by row."""


@dataclasses.dataclass(frozen=True)
class Play:
    """Inputs of a scan."""

    facts: Facts
    timeline: Timeline
    requests: Sequence[Request]
    """Requests in order of arrival."""
    cycles: int
    stages: Stages


class ScanRule(ScanTiming):
    """The golden rule of a scan."""

    @abc.abstractmethod
    def scan(self, play: Play) -> ScanOutput:
        """The frames of all its cycles, or more; each is passed to its stages."""


def early_clocks(facts: Facts, requests: Sequence[Request], late: int) -> int:
    """Clocks by which a frame's samples precede the end of the settle time, by the commands received before cycle
    ``late``."""
    moved = [one.command[1] for one in requests if one.cycle < late and one.command and one.command[0] == 2]
    fits = moved and facts.samples_early and facts.first_sample <= moved[-1] < facts.settle
    return facts.settle - moved[-1] if fits else 0


def last_number(requests: Sequence[Request], cycle: int) -> int:
    """Number of the last request before ``cycle``; 0 without any."""
    index = bisect.bisect_left(requests, cycle, key=lambda request: request.cycle)
    return requests[index - 1].number if index else 0
