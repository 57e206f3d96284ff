"""The rest level of each resistive cell: the earliest sample at which it reads pressed without a touch.

Levels are in sixteenths of the ruler's time. A lighter touch needs a later sample, so the lowest rest level limits how
light a touch the sheet can feel. Levels drift with creep and warmth, and are renewed slowly while nothing is touched.
"""

from __future__ import annotations

import math

import numpy as np

from contactfpga.instruments.settling import Bisection
from contactfpga.skin.derived import MAX_RULER

NEVER = MAX_RULER + 1
"""Rest level of a cell that reads released at the latest sample."""
MARGIN = math.sqrt(2)
"""Ratio of the lowest rest level to the level that holds: half an octave of resistance."""
HIGH = 2.0
"""A rest level below this multiple of the Skin's ``ruler`` is reported: the cell nearly reads pressed untouched."""
STEP = 2 ** (1 / 16)
"""Most by which a frame changes a level."""
NEAR = 2 ** (1 / 8)
"""Ratio to its level at which a cell is looked at again."""
QUIET_US = 5_000_000
"""Time without a touch before levels are renewed: longer than a contact's rim takes to creep back."""


class Rest:
    """Rest levels from frames of an untouched sheet, each sampled at :meth:`next_level`.

    After that :meth:`renew` follows their drift, by at most :data:`STEP` per frame. It takes frames only after
    :data:`QUIET_US` in which no cell read pressed at the usual level, so that no lasting contact becomes a rest level,
    not even the rim that is too light to read pressed.
    """

    def __init__(self, shape: tuple[int, int]):
        self._search = Bisection(shape, 1, NEVER)
        self._drift = np.ones(shape)
        self._quiet_us: int | None = None
        self._probes = 0

    @property
    def levels(self) -> np.ndarray:
        """(rows, columns) rest levels; :data:`NEVER` where a cell reads released at any."""
        return np.asarray(np.minimum(self._search.enough * self._drift, NEVER))

    def next_level(self) -> int | None:
        """The level that most cells need in the next frame; None if all rest levels are known."""
        wanted = self._search.middle[self._search.open]
        return int(np.bincount(wanted).argmax()) if len(wanted) else None

    def take(self, level: int, cells: np.ndarray) -> None:
        """Add a frame of an untouched sheet: (rows, columns) bool ``cells``, sampled at ``level``."""
        self._search.vote(level, np.ones_like(cells), cells)

    @property
    def lightest(self) -> int | None:
        """The latest sample that holds with :data:`MARGIN`; None if no cell reads pressed at any."""
        lowest = float(self.levels.min())
        return None if lowest >= NEVER else max(1, math.floor(lowest / MARGIN))

    def high(self, level: int) -> list[tuple[int, int]]:
        """(row, column) of cells that rest near ``level``, or beyond it."""
        return [(int(row), int(column)) for row, column in np.argwhere(self.levels < HIGH * level)]

    def quiet(self, touched: bool, time_us: int) -> bool:
        """Add a frame at the usual level; whether the next one may :meth:`renew`. ``touched``: a cell reads pressed."""
        if touched or self._quiet_us is None or time_us < self._quiet_us:
            self._quiet_us = time_us
        return time_us - self._quiet_us >= QUIET_US

    def probe(self) -> int:
        """The level of the next frame that renews: :data:`NEAR` below and above each cell's in turn."""
        known = np.unique(np.rint(self.levels))
        self._probes += 1
        aside = NEAR if self._probes % 2 else 1 / NEAR
        return int(np.clip(np.rint(known[self._probes // 2 % len(known)] * aside), 1, MAX_RULER))

    def renew(self, level: int, cells: np.ndarray) -> None:
        """Add a frame at :meth:`probe` of a sheet that has been untouched for long."""
        levels = self.levels
        down, up = cells & (level < levels), ~cells & (level > levels)
        moved = np.where(down, np.maximum(levels / STEP, level), np.where(up, levels * STEP, levels))
        self._drift = moved / self._search.enough
