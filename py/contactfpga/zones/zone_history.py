"""Since when each zone is as it is, for frames that carry zones and not cells."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from contactfpga.skin.sheet import Sheet
from contactfpga.zones.suspicion import FEW_CELLS, Cell, Limits, Suspicion, away_from, named, reach_of, unchanged
from contactfpga.zones.zone import Zones

Record = tuple[int, int, int]
"""Area and sums of a zone, or area and barycenter, as the board sent them."""

Key = tuple[int, int, int, str]
"""The same with :attr:`Zone.winding`, by which a zone has no x."""

_AROUND = {"ring": "a ring around the sheet", "wound": "wound around the sheet"}


class ZoneHistory:
    """Zones over time. One is the same for as long as nothing of its record changes."""

    def __init__(self, first: Zones, limits: Limits, present: np.ndarray):
        """``present``: as for :class:`~contactfpga.zones.cell_history.CellHistory`."""
        self._limits = limits
        self._present = present
        self._sheet = first.sheet
        self._first_us = first.time_us
        self._since_us = dict.fromkeys(_keys(first), first.time_us)
        self._came_us, self._left_us = (np.full(present.shape, -1) for _ in range(2))
        self._told: dict[Key, tuple[Cell, ...]] = {}

    @property
    def stuck(self) -> set[Cell]:
        """Told as stuck where that is known to the cell, and not changed since."""
        return {cell for cells in self._told.values() for cell in cells}

    flutters: frozenset[Cell] = frozenset()
    """Zones do not tell which cells change."""

    def take(self, zones: Zones) -> None:
        """One more frame."""
        keys, time_us = _keys(zones), zones.time_us
        if keys == self._since_us.keys():
            return
        came, left = keys - self._since_us.keys(), self._since_us.keys() - keys
        for times, changed in ((self._came_us, came), (self._left_us, left)):
            for key in changed:
                if not key[3]:
                    times[self._cell(key)] = time_us
        self._since_us = {key: self._since_us.get(key, time_us) for key in keys}
        self._told = {key: cells for key, cells in self._told.items() if key in keys or self._may_have_joined(key)}

    def suspicions(self, time_us: int) -> Iterator[Suspicion]:
        """Those that are new."""
        for key, since_us in self._since_us.items():
            if key in self._told or since_us > time_us - self._limits.stuck_us:
                continue
            elsewhere = away_from(self._middles(key), reach_of(key[0]), self._sheet) & self._present
            others = int((elsewhere & (self._came_us > since_us) & (self._left_us > since_us)).sum())
            if others < self._limits.needed(elsewhere):
                continue
            few = key[0] <= FEW_CELLS
            cells = cells_of(key[:3], self._sheet) if few else ()
            self._told[key] = cells
            seconds = (time_us - since_us) / 1e6
            came = "others came and went"
            sentence = unchanged(self._what(key, cells), not few, seconds, came, since_us == self._first_us)
            yield Suspicion("stuck" if few else "held", sentence, cells, time_us)

    def _may_have_joined(self, gone: Key) -> bool:
        """Whether a zone lies so near that this one may be part of it now."""
        middles = self._middles(gone)
        for key in self._since_us:
            away = away_from(middles, reach_of(gone[0]) + reach_of(key[0]), self._sheet)
            if not all(away[cell] for cell in self._middles(key)):
                return True
        return False

    def _what(self, key: Key, cells: tuple[Cell, ...]) -> str:
        if cells:
            return f"{named(cells)} pressed"
        x, y = self._place(key)
        where = f"x {x * self._sheet.pitch_x_mm:.1f} mm, y {y * self._sheet.pitch_y_mm:.1f} mm"
        if key[3]:
            where = f"y {y * self._sheet.pitch_y_mm:.1f} mm, {_AROUND[key[3]]}"
        return f'a zone of {key[0]} cells at {where} (report = "cells" would tell which) pressed'

    def _middles(self, key: Key) -> list[Cell]:
        """Where the barycenter may lie: all the way round where it has no x."""
        row, column = self._cell(key)
        return [(row, each) for each in range(self._sheet.columns)] if key[3] else [(row, column)]

    def _cell(self, key: Key) -> Cell:
        """The one in which the barycenter lies; without an x only the row counts."""
        x, y = self._place(key)
        column = round(x) % self._sheet.columns if self._sheet.closed else min(round(x), self._sheet.columns - 1)
        return min(round(y), self._sheet.rows - 1), column

    def _place(self, key: Key) -> tuple[float, float]:
        """x and y in cells."""
        area, x, y, _ = key
        scale = (1 << self._sheet.barycenter_bits) if self._sheet.report == "barycenter" else area
        return x / scale, y / scale


def cells_of(record: Record, sheet: Sheet) -> tuple[Cell, ...]:
    """The (row, column) of a zone's cells where its record leaves one choice: a single cell, or two side by side."""
    area, x, y = record
    if area not in (1, 2):
        return ()
    if sheet.report == "barycenter":
        steps = 1 << sheet.barycenter_bits
        if area == 2 and steps == 1:
            return ()  # rounded to whole cells
        x, y = area * x // steps, area * y // steps
    if area == 1:
        return ((y, x),)
    if x % 2 and y % 2:
        return ()  # one of two diagonals
    return (y // 2, x // 2 % sheet.columns), (-(-y // 2), -(-x // 2) % sheet.columns)


def _keys(zones: Zones) -> set[Key]:
    """Of the zones that lie somewhere: a frame flagged ``mismatch`` may hold one without cells."""
    windings = zones.windings or [""] * len(zones)
    return {(area, x, y, winding) for (area, x, y), winding in zip(zones.records.tolist(), windings) if area}
