"""How many clocks after its row is selected each cell reads pressed, of frames that were sampled at different ones.

A frame that is sampled early lies between two that are not. A cell tells something only where it was pressed in both,
and in those before: then it is no press that has just begun, and none that bounces.
"""

from __future__ import annotations

import dataclasses

import numpy as np

AGREE = 3
"""Frames of one kind after which a clock is known to be enough for a cell, or not."""

STEADY = 4
"""Frames at the full settle time, up to the one after, in which a cell must have been pressed."""

SLOW = 2.0
"""A cell that takes more than this many times the median is slow; so is one whose time is near the settle time."""
NEAR = 0.75
"""Of the settle time."""

LINE_CELLS = 3
"""Cells of a line from which on it can be slow itself, if most of them are."""


class _Search:
    """For each place the least clocks that are enough, by halving; all places see the same frames."""

    def __init__(self, shape: tuple[int, ...], first: int, settle: int):
        self.too_few = np.full(shape, first - 1)
        self.enough = np.full(shape, settle)
        self._votes = np.zeros((2, *shape), int)

    @property
    def open(self) -> np.ndarray:
        """Places whose time is not known yet."""
        return np.asarray(self.enough - self.too_few > 1)

    @property
    def middle(self) -> np.ndarray:
        """What is to be tried next at each place."""
        return np.asarray((self.enough + self.too_few) // 2)

    def vote(self, clocks: int, counts: np.ndarray, enough: np.ndarray) -> None:
        """A frame sampled at ``clocks``, which was ``enough`` or not at the places where it ``counts``."""
        asked = counts & self.open & (self.middle == clocks)
        self._votes += np.array([asked & ~enough, asked & enough])
        no, yes = self._votes >= AGREE
        self.too_few[no], self.enough[yes] = clocks, clocks
        self._votes[:, no | yes] = 0


@dataclasses.dataclass(frozen=True)
class Slow:
    """What takes longer than the rest, or nearly the whole settle time."""

    cells: list[tuple[int, int]]
    rows: list[int]
    columns: list[int]


class Settling:
    """Made of frames in turn: one at the full settle time, one at :meth:`next_clocks`, one at the full settle time, ...

    first, settle: least and most clocks that a sample can be moved to; skips: the scan drives touched rows only; guard:
    a guard row is driven before row 0.
    """

    def __init__(self, shape: tuple[int, int], first: int, settle: int, *, skips: bool = False, guard: bool = False):
        self.first, self.settle = first, settle
        self._skips, self._guard = skips, guard
        self._press = _Search(shape, first, settle)
        self._back = _Search(shape[1:], first, settle)
        self._steady = np.zeros(shape, int)
        self._full = np.zeros(shape, bool)

    # ---- frames

    def start(self, full: np.ndarray) -> None:
        """A frame at the full settle time, (rows, columns) bool."""
        self._steady = np.where(full, self._steady + 1, 0)
        self._full = full

    def next_clocks(self) -> int | None:
        """Where to sample next: where most places that can tell want it; None: nothing that is pressed is unknown."""
        columns = (self._after_pressed(self._full) & ~self._full).any(axis=0)
        wanted = [
            search.middle[search.open & now] for search, now in ((self._press, self._full), (self._back, columns))
        ]
        counts = np.bincount(np.concatenate(wanted))
        return int(counts.argmax()) if len(counts) else None

    def take(self, clocks: int, early: np.ndarray, full: np.ndarray) -> None:
        """A frame that was sampled at ``clocks``, and the next one at the full settle time."""
        before = self._full
        self.start(full)
        held = self._steady >= STEADY
        self._press.vote(clocks, held, early)
        ghosts = self._after_pressed(before & held) & ~before & ~full
        self._back.vote(clocks, ghosts.any(axis=0), ~(early & ghosts).any(axis=0))

    def _after_pressed(self, cells: np.ndarray) -> np.ndarray:
        """(rows, columns) bool: places whose column the row that is driven before pulls."""
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
        """(rows, columns) of the least clocks at which a cell reads pressed; :attr:`first` also where fewer would do, 0
        where it is not known."""
        return np.where(self._press.open, 0, self._press.enough)

    @property
    def back_clocks(self) -> np.ndarray:
        """(columns,) of the least clocks after the next row is selected at which a column reads released again;
        :attr:`first` also where it does before, 0 where it is not known."""
        return np.where(self._back.open, 0, self._back.enough)

    @property
    def median(self) -> float:
        """Of the clocks of all cells that are known; NaN where none is."""
        known = self.clocks[self.clocks > 0]
        return float(np.median(known)) if len(known) else float("nan")

    def slow(self) -> Slow:
        """Of what is known."""
        known = self.clocks > 0
        slow = known & ((self.clocks > SLOW * self.median) | (self.clocks > NEAR * self.settle))
        rows, columns = (
            np.flatnonzero((known.sum(axis) >= LINE_CELLS) & (2 * slow.sum(axis) > known.sum(axis))).tolist()
            for axis in (1, 0)
        )
        cells = [(int(row), int(column)) for row, column in zip(*slow.nonzero(), strict=True)]
        return Slow(cells, rows, columns)
