"""Inputs and outputs of a scan."""

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
    """(R, C) raw samples, masked switches removed: bool, or of a board with levels the number of samples, from 0, in
    which each cell read pressed."""
    offered: list[int]
    """Cycle in which each row is offered to the next stage."""
    stuck: int
    """Number of columns that read pressed with no row driven."""
    time_us: int
    """Device time of the first row's strobe, less the column shift, unbounded."""
    requested: bool
    """Whether a request arrived since the previous scan began."""
    heard: int
    """Lowest three bits of the last request's number; 0 without any."""
    reported: int
    """Cycle from which a hello reports the stuck columns."""
    faults: int = 0
    """:attr:`contactfpga_sim.model.golden.guard.FaultyLines.word` at the end."""

    motion: bool = False
    """Whether a row read touched at the frame's beginning, but empty when driven."""

    @property
    def fault(self) -> bool:
        """Whether the frame has the fault flag."""
        return self.stuck > 0 or self.faults > 0


Changes = list[tuple[int, int]]
"""(cycle, level) of every change."""


@dataclasses.dataclass(frozen=True)
class ScanOutput:
    """Pin changes of a scan."""

    contact: Changes
    driven: Changes
    """Changes of the driven rows; bit r is row r."""
    beginnings: list[int]
    """First cycles of frames, one beyond."""
    stuck: Changes = dataclasses.field(default_factory=list)
    """Changes of whether any column is known to be stuck, for a scan that waits."""


class Rows(Protocol):
    """Rows of a frame, for a scan that waits for each transfer."""

    def take(self, place: int, cells: np.ndarray, offered: int, alone: bool, last: bool) -> int:
        """Offer a row, (C,) debounced cells, from cycle ``offered`` on; ``alone``: whether the row was driven. Returns
        the cycle of the transfer."""

    def end(self, one: Scan, cells: np.ndarray) -> int:
        """Complete a frame of (R, C) ``cells``; returns the cycle from which the next one may begin."""


class Stages(Protocol):
    """Stages after the scan."""

    @property
    def due(self) -> int:
        """Cycle from which a frame is due, for a scan that waits."""

    def tell(self, cycle: int, faults: int) -> None:
        """Report faulty lines from a cycle on. Cycles rise, and no frame with bytes on the wire in that cycle came
        before."""

    def watch(self, cycle: int) -> None:
        """An untouched sheet was checked, for a scan that waits."""

    def slot(self, cycle: int, number: int, rows: int, columns: int) -> None:
        """Send a self-test slot from a cycle on; read lines are bits."""

    def slot_over(self, cycle: int) -> int | None:
        """Cycle in which the slot was sent, if not after ``cycle``. All earlier events must have been reported."""

    def frame(self, one: Scan, cells: np.ndarray) -> None:
        """Take all rows of a frame, (R, C) debounced ``cells``, at once."""

    def rows(self) -> Rows:
        """Next frame, row by row."""


@dataclasses.dataclass(frozen=True)
class Play:
    """Inputs of a scan, its cycles and the later stages."""

    facts: Facts
    timeline: Timeline
    requests: Sequence[Request]
    cycles: int
    stages: Stages


class ScanRule(ScanTiming, abc.ABC):
    """The golden rule of a scan."""

    @abc.abstractmethod
    def scan(self, play: Play) -> ScanOutput:
        """Run all cycles, or more, and pass each frame to the stages."""


def early_clocks(facts: Facts, requests: Sequence[Request], late: int) -> int:
    """Clocks by which a frame's samples precede the settle time's end, by commands before cycle ``late``."""
    moved = [one.command[1] for one in requests if one.cycle < late and one.command and one.command[0] == 2]
    fits = moved and facts.samples_early and facts.first_sample <= moved[-1] < facts.settle
    return facts.settle - moved[-1] if fits else 0


def last_number(requests: Sequence[Request], cycle: int) -> int:
    """Number of the last request before ``cycle``; 0 without any."""
    index = bisect.bisect_left(requests, cycle, key=lambda request: request.cycle)
    return requests[index - 1].number if index else 0
