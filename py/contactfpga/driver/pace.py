"""Real time for time that would pass at any speed: of recordings and of simulated boards."""

from __future__ import annotations

import math
import time
from collections.abc import Callable


class Pace:
    """Rations a time that is recorded or simulated, so that ``factor`` seconds of it pass in one second.

    at_s: that time now, in s; most_lag_s: the largest lag in s that is caught up, beyond which time slips.
    """

    def __init__(
        self,
        at_s: float,
        factor: float = 1.0,
        most_lag_s: float = math.inf,
        clock: Callable[[], float] = time.monotonic,
    ):
        self.slip_s = 0.0
        """Seconds of that time lost for good."""
        self._factor, self._most_lag_s, self._clock = factor, most_lag_s, clock
        self._begun_s, self._at_s = clock(), at_s  # a moment, and the time that belongs to it

    def due(self, at_s: float) -> float:
        """Seconds due now of a time that has come to ``at_s``; below 0: none for that long."""
        due = (self._clock() - self._begun_s) * self._factor - (at_s - self._at_s)
        lost = max(0.0, due - self._most_lag_s)
        self.slip_s += lost
        self._at_s -= lost
        return due - lost

    def wait_s(self, at_s: float) -> float:
        """Real seconds until that time is ``at_s``; 0 or less: it is due."""
        return -self.due(at_s) / self._factor
