"""Readings of pressure units, interpolated to a frame's time."""

from __future__ import annotations

import bisect
import dataclasses
import math
import threading
from collections.abc import Sequence

from contactfpga.wire.units import Sweep, UnitFacts

KEPT = 8192
_ROUNDING = 1 / math.sqrt(12)


@dataclasses.dataclass(frozen=True, slots=True)
class UnitSamples:
    """Readings of the pressure units at one moment, or in one sweep.

    >>> samples = contactfpga.UnitSamples(time_us=0, readings=(512.0,), sigma=(0.3,), saturated=(False,))
    >>> samples.readings[0]
    512.0
    """

    time_us: int
    """Device time since power-up: of the frame's first row, to which the readings are interpolated, or of the sweep's
    first sample."""
    readings: tuple[float, ...]
    """Reading of each unit in steps of its converter."""
    sigma: tuple[float, ...]
    """Standard deviation of each reading, from rounding and from changes between two sweeps, without noise."""
    saturated: tuple[bool, ...]
    """Whether a unit read 0 or full scale, so that its true reading is unknown."""


class UnitHistory:
    """The last sweeps of a board. Safe for several threads.

    >>> with contactfpga.open("sim://") as board:
    ...     print(board.unit_history)  # this board has no pressure units
    None
    """

    def __init__(self, facts: UnitFacts, clock_hz: int):
        self.facts = facts
        self.last: Sweep | None = None
        """The last sweep."""
        self.count = 0
        """Number of sweeps."""
        self.lows, self.highs = [1 << facts.bits] * facts.count, [-1] * facts.count
        """Least and largest reading of each unit."""
        self._full = (1 << facts.bits) - 1
        self._spacing_us = facts.spacing_clocks * 1e6 / clock_hz
        self._times_us: list[int] = []
        self._readings: list[tuple[int, ...]] = []
        self._lock = threading.Lock()

    def add(self, sweep: Sweep, time_us: int) -> UnitSamples | None:
        """Add a sweep with the time of its first sample; a sweep that is not later than the last is ignored."""
        with self._lock:
            if self._times_us and time_us <= self._times_us[-1]:
                return None
            if len(self._times_us) >= 2 * KEPT:
                del self._times_us[:KEPT], self._readings[:KEPT]
            self._times_us.append(time_us)
            self._readings.append(sweep.readings)
            self.last, self.count = sweep, self.count + 1
            self.lows = list(map(min, self.lows, sweep.readings))
            self.highs = list(map(max, self.highs, sweep.readings))
        saturated = tuple(reading in (0, self._full) for reading in sweep.readings)
        return UnitSamples(time_us, sweep.readings, (_ROUNDING,) * len(saturated), saturated)

    def at(self, time_us: int) -> UnitSamples | None:
        """Each unit's reading at a time, interpolated between two samples; None if a sample has not come, or is
        forgotten."""
        with self._lock:
            found = [self._unit_at(time_us - unit * self._spacing_us, unit) for unit in range(self.facts.count)]
        if None in found:
            return None
        readings, sigma, saturated = zip(*(one for one in found if one is not None), strict=True)
        return UnitSamples(time_us, readings, sigma, saturated)

    def _unit_at(self, time_us: float, unit: int) -> tuple[float, float, bool] | None:
        after = bisect.bisect_right(self._times_us, time_us)
        if not 0 < after < len(self._times_us):
            return None
        begin, end = self._times_us[after - 1], self._times_us[after]
        before, then = self._readings[after - 1][unit], self._readings[after][unit]
        share, change = (time_us - begin) / (end - begin), then - before
        reading = before + share * change
        return reading, _spread(share, change, end - begin), bool({before, then} & {0, self._full})


def _spread(share: float, change: float, gap_us: float) -> float:
    """Standard deviation of an interpolated reading whose change may be a step; times are truncated to us."""
    timing = change / gap_us * _ROUNDING
    return math.sqrt(_ROUNDING**2 + share * (1 - share) * change**2 + timing**2)


def only(lows: Sequence[int], highs: Sequence[int], value: int) -> list[int]:
    return [unit for unit, (low, high) in enumerate(zip(lows, highs, strict=True)) if low == high == value]
