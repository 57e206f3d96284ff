"""How far the units' zeros have drifted, watched while nothing touches."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from contactfpga.robot.haptics.answer import Floats, HapticsError
from contactfpga.robot.haptics.units import LoadCells


@dataclasses.dataclass(frozen=True)
class Drift:
    """How far zeros have drifted."""

    deviations_n: Floats
    """(n,): of each unit from its zero, averaged."""
    drifted: tuple[int, ...]
    """Numbers of the units that are off by more than the limit: read their zeros again."""
    since_s: float
    """Time in which nothing touched, averaged over."""


class DriftWatch:
    """Averages readings while no zone is pressed; a push that the sheet misses is short, a drift stays.

    Args:
        cells: the units.
        limit_n: deviation from which on a unit has drifted; None: four times its noise.
        over_s: time constant of the average, in s; nothing is said before it has passed without a touch.
    """

    def __init__(self, cells: LoadCells, limit_n: float | None = None, over_s: float = 10.0):
        if not over_s > 0:
            raise HapticsError(f"over_s is {over_s}; it must be above 0 s")
        self._cells = cells
        gains = np.array([unit.gain_n for unit in cells.units])
        self._gains = gains
        self._limits = np.array([4 * unit.sigma_n if limit_n is None else limit_n for unit in cells.units])
        self._over_s = over_s
        self._mean = np.zeros(len(gains))
        self._since_s = 0.0
        self._last_s: float | None = None

    def update(self, time_s: float, readings: Sequence[float] | Floats, zones: int) -> Drift:
        """Take one reading per unit, with the number of zones pressed; returns what is known by now."""
        last, self._last_s = self._last_s, time_s
        if zones or last is None or time_s <= last:
            return self._told()
        passed = time_s - last
        self._since_s += passed
        share = passed / min(self._over_s, self._since_s) if self._since_s else 1.0
        deviations = (np.asarray(readings, float) - self._cells.zeros) * self._gains
        self._mean += min(1.0, share) * (deviations - self._mean)
        return self._told()

    def _told(self) -> Drift:
        known = self._since_s >= self._over_s
        drifted = (np.abs(self._mean) > self._limits).nonzero()[0].tolist() if known else []
        return Drift(self._mean.copy(), tuple(drifted), self._since_s)
