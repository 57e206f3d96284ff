"""Clocks from a row's selection until each cell reads pressed, from frames sampled at different clocks.

An early frame is between two usual ones. A cell counts only if it was pressed in both and in those before, so that its
press is neither new nor bouncing.
"""

from __future__ import annotations

import dataclasses

import numpy as np

AGREE = 3
"""Consistent frames after which a clock is known to suffice for a cell, or not."""

STEADY = 4
"""Consecutive frames at the full settle time in which a cell must have been pressed."""

SLOW = 2.0
"""Ratio to the median time from which a cell is slow."""
NEAR = 0.75
"""Share of the settle time from which a cell is slow, too."""

LINE_CELLS = 3
"""Least cells of a slow line, most of which are slow."""


class Bisection:
    """The least sufficient clocks of each place by bisection; all places see the same frames."""

    def __init__(self, shape: tuple[int, ...], first: int, settle: int):
        self.too_few = np.full(shape, first - 1)
        self.enough = np.full(shape, settle)
        self._votes = np.zeros((2, *shape), int)

    @property
    def open(self) -> np.ndarray:
        return np.asarray(self.enough - self.too_few > 1)

    @property
    def middle(self) -> np.ndarray:
        return np.asarray((self.enough + self.too_few) // 2)

    def vote(self, clocks: int, counts: np.ndarray, enough: np.ndarray) -> None:
        asked = counts & self.open & (self.middle == clocks)
        self._votes += np.array([asked & ~enough, asked & enough])
        no, yes = self._votes >= AGREE
        self.too_few[no], self.enough[yes] = clocks, clocks
        self._votes[:, no | yes] = 0


@dataclasses.dataclass(frozen=True)
class Slow:
    """Outliers, and times near the settle time."""

    cells: list[tuple[int, int]]
    """(row, column)."""
    rows: list[int]
    columns: list[int]


class Settling:
    """Least sampling clocks from frames: one at the full settle time, one at :meth:`next_clocks`, one at the full
    settle time, and so on.

    first, settle: least and most sampling clocks; skips: the scan drives only touched rows; guard: a guard row is
    driven before row 0.
    """

    def __init__(self, shape: tuple[int, int], first: int, settle: int, *, skips: bool = False, guard: bool = False):
        self.first, self.settle = first, settle
        self._skips, self._guard = skips, guard
        self._press = Bisection(shape, first, settle)
        self._back = Bisection(shape[1:], first, settle)
        self._steady = np.zeros(shape, int)
        self._full = np.zeros(shape, bool)

    # ---- frames

    def start(self, full: np.ndarray) -> None:
        """Begin with a frame at the full settle time, (rows, columns) bool."""
        self._steady = np.where(full, self._steady + 1, 0)
        self._full = full

    def next_clocks(self) -> int | None:
        """The next sampling clock, the one that most places need; None if everything pressed is known."""
        columns = (self._after_pressed(self._full) & ~self._full).any(axis=0)
        wanted = [
            search.middle[search.open & now] for search, now in ((self._press, self._full), (self._back, columns))
        ]
        counts = np.bincount(np.concatenate(wanted))
        return int(counts.argmax()) if len(counts) else None

    def take(self, clocks: int, early: np.ndarray, full: np.ndarray) -> None:
        """Add a frame sampled at ``clocks``, and the next one at the full settle time."""
        before = self._full
        self.start(full)
        held = self._steady >= STEADY
        self._press.vote(clocks, held, early)
        ghosts = self._after_pressed(before & held) & ~before & ~full
        self._back.vote(clocks, ghosts.any(axis=0), ~(early & ghosts).any(axis=0))

    def _after_pressed(self, cells: np.ndarray) -> np.ndarray:
        """(rows, columns) bool: places whose column is pulled by the row driven before."""
        if not self._skips:
            before = np.roll(cells, 1, axis=0)
            before[0] |= self._guard
            return before
        before = np.zeros_like(cells)
        touched = np.flatnonzero(self._full.any(axis=1))
        before[touched[1:]] = cells[touched[:-1]]
        return before

    # ---- what they tell

    @property
    def clocks(self) -> np.ndarray:
        """(rows, columns) least clocks at which a cell reads pressed; at least :attr:`first`, 0 if unknown."""
        return np.where(self._press.open, 0, self._press.enough)

    @property
    def back_clocks(self) -> np.ndarray:
        """(columns,) least clocks from the next row's selection until a column reads released; at least :attr:`first`,
        0 if unknown."""
        return np.where(self._back.open, 0, self._back.enough)

    @property
    def median(self) -> float:
        """Median clocks of all known cells; NaN without any."""
        known = self.clocks[self.clocks > 0]
        return float(np.median(known)) if len(known) else float("nan")

    def slow(self) -> Slow:
        """Outliers so far."""
        known = self.clocks > 0
        slow = known & ((self.clocks > SLOW * self.median) | (self.clocks > NEAR * self.settle))
        rows, columns = (
            np.flatnonzero((known.sum(axis) >= LINE_CELLS) & (2 * slow.sum(axis) > known.sum(axis))).tolist()
            for axis in (1, 0)
        )
        cells = [(int(row), int(column)) for row, column in zip(*slow.nonzero(), strict=True)]
        return Slow(cells, rows, columns)
