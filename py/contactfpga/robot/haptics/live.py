"""Frames with the force at each of their zones, and the switches that one contact has closed."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Iterator
from typing import Protocol

import numpy as np

from contactfpga.errors import ReadTimeout, ReplayEnded
from contactfpga.robot.haptics.contact import AloneWatch, Contacts
from contactfpga.robot.haptics.locate import Closing, closed
from contactfpga.robot.haptics.solve import contacts
from contactfpga.robot.haptics.units import LoadCells
from contactfpga.robot.haptics.values import HapticsError
from contactfpga.robot.haptics.wrench import Motion
from contactfpga.skin.sheet import Sheet
from contactfpga.tracking.tracks import Tracks
from contactfpga.zones.around import across
from contactfpga.zones.zone import Zones

WAIT_US = 20_000
"""Longest wait of a frame for later readings, in device time."""


def felt(
    cells: LoadCells,
    zones: Zones,
    friction: float = 0.5,
    *,
    motion: Motion | None = None,
    tracks: Tracks | None = None,
    alone: AloneWatch | None = None,
) -> Contacts | None:
    """The force at each zone of a frame, from the units' readings at its moment.

    None if the readings are not known (yet), or if a zone winds around the sheet (:attr:`Zone.winding
    <contactfpga.Zone.winding>`). Raises :class:`HapticsError` if the cells have no surface, or differ in number from
    the board's units.
    """
    if cells.surface is None:
        raise HapticsError("surface is missing; give units.toml a table [surface] with the bumper's outside")
    if zones.units is None or any(zones.windings):
        return None
    wrench = cells.wrench(zones.units.readings, motion)
    return contacts(wrench, zones, cells.surface, friction, sheet_m=cells.sheet_m, tracks=tracks, alone=alone)


class FrameSource(Protocol):
    """A board, or another source of frames in order."""

    def next(self, timeout: float = 1.0) -> Zones: ...


class WithReadings:
    """The frames of a board in order, each once its ``units`` are known: ``for zones in WithReadings(board)``.

    Each frame is delayed by a sweep or two; one whose readings were lost comes without them after ``wait_us`` of device
    time.
    """

    def __init__(self, source: FrameSource, wait_us: int = WAIT_US):
        self._source, self._wait_us = source, wait_us
        self._waiting: deque[Zones] = deque()
        self._ended = False

    def next(self, timeout: float = 1.0) -> Zones:
        """The next frame, waiting ones first. Raises the source's errors."""
        while not (self._waiting and (self._ended or self._due(self._waiting[0]))):
            try:
                self._waiting.append(self._source.next(timeout))
            except (ReplayEnded, ReadTimeout) as error:
                if not self._waiting:
                    raise
                if isinstance(error, ReadTimeout):
                    break
                self._ended = True
        return self._waiting.popleft()

    def _due(self, zones: Zones) -> bool:
        return zones.units is not None or self._waiting[-1].time_us - zones.time_us > self._wait_us

    def __iter__(self) -> Iterator[Zones]:
        try:
            while True:
                yield self.next()
        except ReplayEnded:
            return


Cell = tuple[int, int]

MOST = 3
"""Most simultaneous closings that are resolved."""


class ClosingWatch:
    """Reads every frame with its readings, and knows the cells and closings of a single contact, for
    :meth:`~contactfpga.robot.haptics.Locator.locate`.

    Exact sums show one switch that opened or closed, and two or three that closed if one choice is the most compact;
    else :attr:`complete` is False until the contact ends. ``report = "cells"`` shows all.
    """

    def __init__(self, cells: LoadCells):
        """Raises :class:`HapticsError` if the cells have no surface."""
        if cells.surface is None:
            raise HapticsError("surface is missing; give units.toml a table [surface] with the bumper's outside")
        self._cells, self._surface = cells, cells.surface
        self._before: Zones | None = None
        self._pushes: dict[Cell, float] = {}
        self.push_n: float | None = None
        """Push at the last frame; None without readings or push."""
        self._push_before: float | None = None
        self.complete = False
        """Whether all of the contact's cells are known; False before the first frame without a contact."""

    @property
    def cells(self) -> list[Cell]:
        """(row, column) of the closed switches."""
        return sorted(self._pushes)

    @property
    def closings(self) -> list[Closing]:
        """The closed switches, each with the push at its closing."""
        return [Closing(*cell, push) for cell, push in sorted(self._pushes.items())]

    def take(self, zones: Zones) -> None:
        """Add the next frame, with its readings (:class:`~contactfpga.robot.haptics.WithReadings`)."""
        before, self._before = self._before, zones
        self._push_before, self.push_n = self.push_n, self._push(zones)
        if not zones.pressed:
            self._pushes, self.complete = {}, True
        elif before is not None and self.complete:
            self._compare(before, zones)

    def _push(self, zones: Zones) -> float | None:
        if zones.units is None:
            return None
        center = self._surface.center(self._cells.wrench(zones.units.readings))
        return None if center is None else center.normal_n

    def _compare(self, before: Zones, after: Zones) -> None:
        if before.cells is not None and after.cells is not None:
            new = [(int(row), int(column)) for row, column in np.argwhere(after.cells & ~before.cells)]
            gone = [(int(row), int(column)) for row, column in np.argwhere(before.cells & ~after.cells)]
        else:
            new, gone = self._changed(before, after)
        for cell in gone:
            self._pushes.pop(cell, None)
        for cell in new:
            push = self._at(before, after, cell[0])
            if push is not None:
                self._pushes[cell] = push
        self.complete = len(self._pushes) == after.pressed

    def _changed(self, before: Zones, after: Zones) -> tuple[list[Cell], list[Cell]]:
        count = after.pressed - before.pressed
        if count == 0:
            return [], []
        if count < 0:
            one = closed(after, before)
            return [], [one] if one else []
        if count == 1 or count > MOST:
            one = closed(before, after)
            return [one] if one else [], []
        _, x, y = (int(number) for number in after.records.sum(axis=0) - before.records.sum(axis=0))
        around = _around(after.sheet)
        fits = sorted(
            (_spread([*self._pushes, *some], around), list(some))
            for some in itertools.combinations(self._beside(after), count)
            if sum(row for row, _ in some) == y and across(sum(column for _, column in some) - x, around) == 0
        )
        alone = len(fits) == 1 or (len(fits) > 1 and fits[0][0] < fits[1][0])
        return fits[0][1] if alone else [], []

    def _beside(self, zones: Zones) -> list[Cell]:
        rows, columns = zones.sheet.rows, zones.sheet.columns
        area, x, y = (int(number) for number in zones.records.sum(axis=0))
        known = list(self._pushes) or [(round(y / area), round(x / area))]
        near = {
            (row + down, (column + right) % columns if zones.sheet.closed else column + right)
            for row, column in known
            for down in (-1, 0, 1)
            for right in (-1, 0, 1)
        }
        inside = {(row, column) for row, column in near if 0 <= row < rows and 0 <= column < columns}
        return sorted(inside - self._pushes.keys())

    def _at(self, before: Zones, after: Zones, row: int) -> float | None:
        if self.push_n is None:
            return None
        if self._push_before is None:
            return self.push_n
        adjacent = after.overwritten == before.overwritten and (after.sequence - before.sequence) % 256 == 1
        share = 0.5 + (row / after.sheet.rows if adjacent else 0.0)
        return max(0.0, self._push_before + share * (self.push_n - self._push_before))


def _around(sheet: Sheet) -> int | None:
    return sheet.columns if sheet.closed else None


def _spread(cells: list[Cell], around: int | None) -> float:
    return sum((r - row) ** 2 + across(c - column, around) ** 2 for r, c in cells for row, column in cells)
