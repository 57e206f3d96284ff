"""Readings of pressure units over time, and what they were at the moment of a frame."""

from __future__ import annotations

import bisect
import dataclasses
import math
import threading
from collections.abc import Sequence

from contactfpga.wire.units import Sweep, UnitFacts

KEPT = 8192
"""Sweeps of which a frame's moment is looked up, about a second."""
_ROUNDING = 1 / math.sqrt(12)
"""Standard deviation of a reading that is rounded to whole steps."""


@dataclasses.dataclass(frozen=True, slots=True)
class UnitSamples:
    """What the pressure units read at one moment, or in one sweep.

    ``zones.units`` is one, or None for a board without units:

    >>> samples = contactfpga.UnitSamples(time_us=0, readings=(512.0,), sigma=(0.3,), saturated=(False,))
    >>> samples.readings[0]
    512.0
    """

    time_us: int
    """Device time since power-up: of a frame's first row, to which the readings are interpolated, or of a sweep's first
    sample."""
    readings: tuple[float, ...]
    """Of each unit, in steps of its converter."""
    sigma: tuple[float, ...]
    """Their standard deviations, from rounding and from what is not known between two sweeps; noise is not in it."""
    saturated: tuple[bool, ...]
    """A unit read 0 or full scale, so that its reading may be anything beyond."""


class UnitHistory:
    """The last sweeps of a board. Safe for several threads.

    >>> with contactfpga.open("sim://") as board:
    ...     print(board.unit_history)  # this board has no pressure units
    None
    """

    def __init__(self, facts: UnitFacts, clock_hz: int):
        self.facts = facts
        self.last: Sweep | None = None
        """The sweep that came last."""
        self.count = 0
        """Sweeps that came."""
        self.lows, self.highs = [1 << facts.bits] * facts.count, [-1] * facts.count
        """Least and largest reading of each unit."""
        self._full = (1 << facts.bits) - 1
        self._spacing_us = facts.spacing_clocks * 1e6 / clock_hz
        self._times_us: list[int] = []
        self._readings: list[tuple[int, ...]] = []
        self._lock = threading.Lock()

    def add(self, sweep: Sweep, time_us: int) -> UnitSamples | None:
        """A sweep whose first sample was then, after that of the one before; else it is left out."""
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
        """Each unit's reading at a moment, interpolated between its samples before and after it; None where one of
        them has not come, or is forgotten."""
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
    """All of the change may have happened at one moment between the two samples, and nobody knows at which: then the
    reading was the one before or the one after. Times are cut to whole microseconds."""
    timing = change / gap_us * _ROUNDING
    return math.sqrt(_ROUNDING**2 + share * (1 - share) * change**2 + timing**2)


def only(lows: Sequence[int], highs: Sequence[int], value: int) -> list[int]:
    """Units that never read anything but this."""
    return [unit for unit, (low, high) in enumerate(zip(lows, highs, strict=True)) if low == high == value]
