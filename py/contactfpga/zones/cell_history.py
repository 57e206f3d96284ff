"""When each cell changed, for frames that carry cells."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from contactfpga.zones import around, labels
from contactfpga.zones.suspicion import FEW_CELLS, Cell, Limits, Suspicion, away_from, named, places, unchanged
from contactfpga.zones.zone import Zones

APART_US = 10_000
"""Changes of a cell closer than this count once: a switch that bounces at a press does not flutter."""

QUIET = 10
"""For this part of the time nothing has changed beside a switch that is told as stuck."""

SECOND_US = 1_000_000


class CellHistory:
    """Pressed cells over time."""

    def __init__(self, first: Zones, limits: Limits, present: np.ndarray):
        """``present``: (rows, columns) bool, False where the Skin's mask has no switch."""
        assert first.cells is not None
        cells, time_us = first.cells, first.time_us
        self._sheet, self._limits = first.sheet, limits
        self._present = present
        self._cells = cells.copy()
        self._first_us = time_us
        self._changed_us = np.full(cells.shape, time_us)
        self._pressed_us, self._released_us, self._counted_us = (np.full(cells.shape, -1) for _ in range(3))
        self._counts = np.zeros(cells.shape, np.int64)
        self._count_from_us = time_us
        self._stuck, self._held, self._flutters = (np.zeros(cells.shape, bool) for _ in range(3))

    @property
    def stuck(self) -> set[Cell]:
        """Told as stuck, and not changed since."""
        return set(places(self._stuck))

    @property
    def flutters(self) -> set[Cell]:
        """Told to flutter."""
        return set(places(self._flutters))

    def take(self, zones: Zones) -> None:
        """One more frame."""
        assert zones.cells is not None
        cells, time_us = zones.cells, zones.time_us
        changed = cells != self._cells
        if not changed.any():
            return
        self._changed_us[changed] = time_us
        self._pressed_us[changed & cells] = time_us
        self._released_us[changed & self._cells] = time_us
        counted = changed & (self._counted_us <= time_us - APART_US)
        self._counted_us[counted] = time_us
        self._counts += counted
        self._held &= ~changed
        self._stuck &= ~changed
        self._cells = cells.copy()

    def suspicions(self, time_us: int) -> Iterator[Suspicion]:
        """Those that are new."""
        yield from self._unchanged(time_us)
        if time_us - self._count_from_us >= SECOND_US:
            yield from self._fluttering(time_us)

    def _unchanged(self, time_us: int) -> Iterator[Suspicion]:
        still = self._cells & self._present & (self._changed_us <= time_us - self._limits.stuck_us)
        if not (still & ~self._stuck).any():
            return
        groups = around.label(still, 8)[0] if self._sheet.closed else labels.label(still, 8)
        for number in range(1, int(groups.max()) + 1):
            group = groups == number
            few = int(group.sum()) <= FEW_CELLS
            if self._stuck[group].all() or (few and not self._alone(group, time_us)):
                continue
            if not few and (self._stuck | self._held)[group].any():
                continue  # a contact whose rim comes to rest is not told twice
            since_us = int(self._changed_us[group].max())
            elsewhere = away_from(places(group), 1, self._sheet) & self._present
            others = int((elsewhere & (self._pressed_us > since_us) & (self._released_us > since_us)).sum())
            if others >= self._limits.needed(elsewhere):
                yield self._told(group, few, since_us, others, time_us)

    def _alone(self, group: np.ndarray, time_us: int) -> bool:
        """Whether nothing is pressed beside it, and was not lately: else it may be what is left of a contact."""
        beside = ~away_from(places(group), 1, self._sheet) & ~group
        quiet_us = time_us - self._limits.stuck_us // QUIET
        return not (beside & (self._cells | (self._changed_us > quiet_us))).any()

    def _told(self, group: np.ndarray, few: bool, since_us: int, others: int, time_us: int) -> Suspicion:
        told = self._stuck if few else self._held
        told |= group
        cells = places(group)
        what = f"{named(cells) if few else f'{len(cells)} cells about {self._middle(group)}'} pressed"
        changed = f"{others} other{'' if others == 1 else 's'} changed"
        seconds = (time_us - since_us) / SECOND_US
        sentence = unchanged(what, not few, seconds, changed, since_us == self._first_us)
        return Suspicion("stuck" if few else "held", sentence, cells, time_us)

    def _middle(self, group: np.ndarray) -> str:
        """Row and column of the barycenter; of a group around a sheet whose ends meet the row alone."""
        if self._sheet.closed:
            records = around.label(group, 8)[1]
            area, x, y = around.flat(records, self._sheet.columns)[0].tolist()
            if around.windings(records)[0]:
                return f"row {round(y / area)}, around the sheet"
            return f"({round(y / area)}, {round(x / area) % self._sheet.columns})"
        row, column = np.mean(places(group), axis=0).round().astype(int).tolist()
        return f"({row}, {column})"

    def _fluttering(self, time_us: int) -> Iterator[Suspicion]:
        rates = self._counts * SECOND_US / (time_us - self._count_from_us)
        found = (rates > self._limits.flutter_hz) & ~self._flutters
        self._flutters |= found
        for row, column in places(found):
            sentence = (
                f"cell ({row}, {column}) changes at least {rates[row, column]:.0f} times per s, faster than a hand "
                "can: a loose contact, or the rim of something that vibrates"
            )
            yield Suspicion("flutter", sentence, ((row, column),), time_us)
        self._counts[:] = 0
        self._count_from_us = time_us
