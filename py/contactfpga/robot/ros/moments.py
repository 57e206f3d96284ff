"""Moments of frames on the clock of the messages."""

from __future__ import annotations

from collections.abc import Callable

from contactfpga.zones.zone import Zones

KEPT_S = 1.0
"""The difference of the clocks is measured as often: they drift apart, and a clock may be set."""
_TRIES = 5


class Moments:
    """From the board's clock to that of the messages."""

    def __init__(self, now_ns: Callable[[], int], clock: Callable[[], float]):
        self._now_ns = now_ns
        self._clock = clock
        self._until = -1e300
        self._offset_ns = 0

    def now(self) -> int:
        """In ns."""
        return self._now_ns()

    def of(self, zones: Zones) -> int:
        """When a frame was sampled, in ns; of a recording, which does not say so, now."""
        return self._now_ns() if zones.host_time_s is None else self._shifted(zones.host_time_s)

    def _shifted(self, seconds: float) -> int:
        now = self._clock()
        if not self._until - KEPT_S <= now < self._until:
            self._offset_ns = self._measured()
            self._until = now + KEPT_S
        return round(seconds * 1e9) + self._offset_ns

    def _measured(self) -> int:
        """The difference of the clocks, by the reading that was interrupted for the shortest time."""
        found = []
        for _ in range(_TRIES):
            before, now_ns, after = self._clock(), self._now_ns(), self._clock()
            found.append((after - before, now_ns - round((before + after) / 2 * 1e9)))
        return min(found)[1]
