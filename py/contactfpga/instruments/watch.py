"""Detection of stuck, loose or dead switches from the changes of each cell or zone."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterable, Iterator
from typing import Literal

import numpy as np

from contactfpga.errors import SkinMismatch
from contactfpga.skin import Skin
from contactfpga.skin.sheet import Sheet
from contactfpga.zones import around, labels
from contactfpga.zones.zone import Zones

Cell = tuple[int, int]

FEW_CELLS = 3
"""Most cells in an unchanging group of stuck switches; a larger group is rather an object."""


@dataclasses.dataclass(frozen=True)
class Suspicion:
    """A real or apparent fault of the sheet.

    >>> contactfpga.Suspicion("stuck", "cell (3, 4) is stuck", cells=((3, 4),), time_us=0).cells
    ((3, 4),)
    """

    kind: Literal["stuck", "held", "flutter"]
    """``stuck``: one to three adjacent switches read pressed without a change while others came and went. ``held``: the
    same for more switches, on which something may lie. ``flutter``: a switch changes faster than a hand can."""
    sentence: str
    cells: tuple[Cell, ...]
    """(row, column) of the switches; () if the frames do not show them."""
    time_us: int
    """Device time of detection, in us."""


@dataclasses.dataclass(frozen=True)
class Limits:
    stuck_us: int
    others: int
    flutter_hz: float

    def needed(self, elsewhere: np.ndarray) -> int:
        """Number of the cells marked in ``elsewhere`` that must have come and gone: at most half of them."""
        return min(self.others, max(1, int(elsewhere.sum()) // 2))


def away_from(cells: Iterable[Cell], reach: int, sheet: Sheet) -> np.ndarray:
    """(rows, columns) bool: cells farther than ``reach`` from all ``cells``, so that no contact joins them."""
    away = np.ones((sheet.rows, sheet.columns), bool)
    for row, column in cells:
        columns = np.arange(column - reach, column + reach + 1)
        columns = columns % sheet.columns if sheet.closed else columns.clip(0, sheet.columns - 1)
        away[max(0, row - reach) : row + reach + 1, columns] = False
    return away


def unchanged(what: str, many: bool, seconds: float, others: str, from_the_start: bool) -> str:
    start = ", since the first frame," if from_the_start else ""
    cause = "something lies there, or they are stuck" if many else "stuck, or something small lies there"
    lasted = f"{seconds:.0f}" if seconds >= 10 else f"{seconds:.1f}"
    return f"{what} for {lasted} s{start} while {others}: {cause}"


def named(cells: Iterable[Cell], most: int = 12) -> str:
    """``cell (3, 4)``, ``cells (3, 4), (3, 5) and 7 more``."""
    places = [f"({row}, {column})" for row, column in cells]
    more = f" and {len(places) - most} more" if len(places) > most else ""
    return f"cell{'' if len(places) == 1 else 's'} {', '.join(places[:most])}{more}"


def reach_of(area: int) -> int:
    """Reach of a round zone of this area from its barycenter, plus one cell."""
    return math.ceil(math.sqrt(area / math.pi)) + 1


def places(cells: np.ndarray) -> tuple[Cell, ...]:
    return tuple((row, column) for row, column in np.argwhere(cells).tolist())


APART_US = 10_000
"""Interval within which changes of a cell count once, as a switch may bounce."""

QUIET = 10
"""Divisor of the stuck time: for this part nothing beside a stuck switch may have changed."""

SECOND_US = 1_000_000


class CellHistory:
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
        """Cells reported as stuck that have not changed since."""
        return set(places(self._stuck))

    @property
    def flutters(self) -> set[Cell]:
        return set(places(self._flutters))

    def take(self, zones: Zones) -> None:
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
                continue  # a contact whose rim comes to rest is not reported twice
            since_us = int(self._changed_us[group].max())
            elsewhere = away_from(places(group), 1, self._sheet) & self._present
            others = int((elsewhere & (self._pressed_us > since_us) & (self._released_us > since_us)).sum())
            if others >= self._limits.needed(elsewhere):
                yield self._report(group, few, since_us, others, time_us)

    def _alone(self, group: np.ndarray, time_us: int) -> bool:
        """Whether nothing is, or was recently, pressed beside the group; otherwise the group may belong to a
        contact."""
        beside = ~away_from(places(group), 1, self._sheet) & ~group
        quiet_us = time_us - self._limits.stuck_us // QUIET
        return not (beside & (self._cells | (self._changed_us > quiet_us))).any()

    def _report(self, group: np.ndarray, few: bool, since_us: int, others: int, time_us: int) -> Suspicion:
        reported = self._stuck if few else self._held
        reported |= group
        cells = places(group)
        what = f"{named(cells) if few else f'{len(cells)} cells about {self._middle(group)}'} pressed"
        changed = f"{others} other{'' if others == 1 else 's'} changed"
        seconds = (time_us - since_us) / SECOND_US
        sentence = unchanged(what, not few, seconds, changed, since_us == self._first_us)
        return Suspicion("stuck" if few else "held", sentence, cells, time_us)

    def _middle(self, group: np.ndarray) -> str:
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


Record = tuple[int, int, int]

Key = tuple[int, int, int, str]

_AROUND = {"ring": "a ring around the sheet", "wound": "wound around the sheet"}


class ZoneHistory:
    """Zones over time; an unchanged record is the same zone."""

    def __init__(self, first: Zones, limits: Limits, present: np.ndarray):
        self._limits = limits
        self._present = present
        self._sheet = first.sheet
        self._first_us = first.time_us
        self._since_us = dict.fromkeys(_keys(first), first.time_us)
        self._came_us, self._left_us = (np.full(present.shape, -1) for _ in range(2))
        self._reported: dict[Key, tuple[Cell, ...]] = {}

    @property
    def stuck(self) -> set[Cell]:
        """Cells reported as stuck, if known exactly, that have not changed since."""
        return {cell for cells in self._reported.values() for cell in cells}

    flutters: frozenset[Cell] = frozenset()
    """Always empty: zones do not show which cells change."""

    def take(self, zones: Zones) -> None:
        keys, time_us = _keys(zones), zones.time_us
        if keys == self._since_us.keys():
            return
        came, left = keys - self._since_us.keys(), self._since_us.keys() - keys
        for times, changed in ((self._came_us, came), (self._left_us, left)):
            for key in changed:
                if not key[3]:
                    times[self._cell(key)] = time_us
        self._since_us = {key: self._since_us.get(key, time_us) for key in keys}
        self._reported = {key: cells for key, cells in self._reported.items() if key in keys or self._may_join(key)}

    def suspicions(self, time_us: int) -> Iterator[Suspicion]:
        for key, since_us in self._since_us.items():
            if key in self._reported or since_us > time_us - self._limits.stuck_us:
                continue
            elsewhere = away_from(self._middles(key), reach_of(key[0]), self._sheet) & self._present
            others = int((elsewhere & (self._came_us > since_us) & (self._left_us > since_us)).sum())
            if others < self._limits.needed(elsewhere):
                continue
            few = key[0] <= FEW_CELLS
            cells = cells_of(key[:3], self._sheet) if few else ()
            self._reported[key] = cells
            seconds = (time_us - since_us) / 1e6
            came = "others came and went"
            sentence = unchanged(self._what(key, cells), not few, seconds, came, since_us == self._first_us)
            yield Suspicion("stuck" if few else "held", sentence, cells, time_us)

    def _may_join(self, gone: Key) -> bool:
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
        """Possible cells of the barycenter: all columns if the zone has no x."""
        row, column = self._cell(key)
        return [(row, each) for each in range(self._sheet.columns)] if key[3] else [(row, column)]

    def _cell(self, key: Key) -> Cell:
        x, y = self._place(key)
        column = round(x) % self._sheet.columns if self._sheet.closed else min(round(x), self._sheet.columns - 1)
        return min(round(y), self._sheet.rows - 1), column

    def _place(self, key: Key) -> tuple[float, float]:
        area, x, y, _ = key
        scale = (1 << self._sheet.barycenter_bits) if self._sheet.report == "barycenter" else area
        return x / scale, y / scale


def cells_of(record: Record, sheet: Sheet) -> tuple[Cell, ...]:
    """The (row, column) of a zone's cells if its record determines them: a single cell, or two adjacent ones."""
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
    windings = zones.windings or [""] * len(zones)
    return {(area, x, y, winding) for (area, x, y), winding in zip(zones.records.tolist(), windings) if area}


LOOKS = 100


class Watch:
    """Finds switches that are stuck, loose or dead in a history of frames.

    >>> watch = contactfpga.Watch(stuck_s=5.0)
    >>> with contactfpga.open("sim://") as board:
    ...     watch.update(board.next())
    ()

    A cell, or a zone if the board sends zones, is suspected once it has been pressed without a change for ``stuck_s``
    seconds of the frames' time while at least ``others`` cells elsewhere came and went. Without changes elsewhere
    nothing is suspected: an arm may rest on a table. A cell is loose if it changes more than ``flutter_hz`` times per
    second; changes within 10 ms count once. Cells of ``skin.mask`` are left out.

    Raises ValueError for limits that are not positive, and :class:`SkinMismatch` for frames of another Skin's sheet.
    """

    def __init__(
        self, skin: Skin | None = None, *, stuck_s: float = 10.0, others: int = 8, flutter_hz: float = 40.0
    ) -> None:
        for name, value in (("stuck_s", stuck_s), ("others", others), ("flutter_hz", flutter_hz)):
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name} is {value!r}; it must be above 0")
        self._skin = skin
        self._mask = set(skin.mask) if skin else set()
        self._limits = Limits(round(stuck_s * 1e6), others, flutter_hz)
        self._sheet: Sheet | None = None
        self._present = self._seen = np.zeros((0, 0), bool)
        self._history: CellHistory | ZoneHistory
        self._last_us = self._look_us = -1

    def update(self, zones: Zones) -> tuple[Suspicion, ...]:
        """Add the next frame; returns new suspicions, each once. A restarted board, or another sheet, begins a new
        history."""
        time_us = zones.time_us
        if zones.sheet != self._sheet:
            self._meet(zones.sheet)
            self._begin(zones)
        elif time_us < self._last_us:
            self._begin(zones)
        self._last_us = time_us
        self._history.take(zones)
        if zones.cells is not None:
            real = ~zones.ghost_cells if zones.sheet.ghosts and zones.ghost_cells is not None else True
            self._seen |= zones.cells & real
        if time_us < self._look_us:
            return ()
        self._look_us = time_us + self._limits.stuck_us // LOOKS
        return tuple(self._history.suspicions(time_us))

    def _meet(self, sheet: Sheet) -> None:
        if self._skin is not None and self._skin.sheet != sheet:
            raise SkinMismatch("the frames are of another Skin than the one whose mask is watched; give their own Skin")
        self._sheet = sheet
        self._present = np.ones((sheet.rows, sheet.columns), bool)
        for row, column in self._mask:
            self._present[row, column] = False
        self._seen = np.zeros_like(self._present)

    def _begin(self, zones: Zones) -> None:
        make = ZoneHistory if zones.cells is None else CellHistory
        self._history = make(zones, self._limits, self._present)
        self._look_us = zones.time_us

    @property
    def seen(self) -> np.ndarray | None:
        """(rows, columns) bool: cells that read pressed at least once; None if the board sends no cells, or before the
        first frame."""
        return self._seen.copy() if self._sheet is not None and self._sheet.report == "cells" else None

    @property
    def never(self) -> tuple[Cell, ...]:
        """(row, column) of switches that never read pressed, untouched or dead; () if the board sends no cells."""
        return () if self.seen is None else places(self._present & ~self._seen)

    @property
    def stuck(self) -> tuple[Cell, ...]:
        """(row, column) of switches reported as ``stuck`` that have not changed since."""
        return () if self._sheet is None else tuple(sorted(self._history.stuck))

    @property
    def fluttering(self) -> tuple[Cell, ...]:
        """(row, column) of switches reported to ``flutter``."""
        return () if self._sheet is None else tuple(sorted(self._history.flutters))

    @property
    def mask(self) -> tuple[Cell, ...]:
        """The Skin's mask with the stuck switches, for ``skin.replace(mask=watch.mask)``."""
        return tuple(sorted(self._mask.union(self.stuck)))

    @property
    def mask_line(self) -> str:
        """The mask as a line of a Skin's TOML file; "" if no switch is stuck."""
        return f"mask = {json.dumps(self.mask)}" if self.stuck else ""
