"""How simulated or recorded time follows the computer's clock."""

from __future__ import annotations

import collections
import math
import time
from collections.abc import Callable

WINDOW_S, SHORTEST_S = 2.0, 0.2
"""Time over which :attr:`Pace.share` looks back, and least time that it needs."""
MOMENT_S, LEAST_S = 0.04, 0.0005
"""Real time that :attr:`Pace.most_s` may take, and its least value."""
SMOOTHING = 0.2


class Pace:
    """Rations a recorded or simulated time, so that ``factor`` seconds of it pass in one second; None: no limit.

    ``at_s``: that time now, in s. ``most_lag_s``: the largest lag in s that is caught up, beyond which time slips.
    ``factor`` may be changed, and is 0 for a pause.
    """

    def __init__(
        self,
        at_s: float = 0.0,
        factor: float | None = 1.0,
        most_lag_s: float = math.inf,
        clock: Callable[[], float] = time.monotonic,
    ):
        self.factor = factor
        self.slip_s = 0.0
        """Seconds of that time lost for good."""
        self._most_lag_s, self._clock = most_lag_s, clock
        self._speed = 1.0
        self.restart(at_s)

    def restart(self, at_s: float) -> None:
        """Continue from another time."""
        self._now_s, self._due_s = self._clock(), at_s  # a moment, and the time that is due at it
        self._seen = collections.deque([(self._now_s, at_s)])
        self._at_s = at_s

    def due(self, at_s: float) -> float:
        """Seconds due now of a time that has come to ``at_s``; below 0: none for that long."""
        if self.factor is None:
            return math.inf
        now_s = self._clock()
        self._due_s += (now_s - self._now_s) * self.factor
        self._now_s, self._at_s = now_s, at_s
        if now_s - self._seen[-1][0] > WINDOW_S / 100:
            self._seen.append((now_s, at_s))
        while now_s - self._seen[0][0] > WINDOW_S:
            self._seen.popleft()
        lost = max(0.0, self._due_s - at_s - self._most_lag_s)
        self.slip_s += lost
        self._due_s -= lost
        return self._due_s - at_s

    def wait_s(self, at_s: float) -> float:
        """Real seconds until that time is ``at_s``; 0 or less: it is due."""
        due = self.due(at_s)
        return -due / self.factor if self.factor else math.copysign(math.inf, -due)

    def ran(self, simulated_s: float, seconds: float) -> None:
        """Report the computing time of a simulated duration."""
        if seconds > 0:
            self._speed += SMOOTHING * (simulated_s / seconds - self._speed)

    @property
    def most_s(self) -> float:
        """Seconds that this machine simulates within :data:`MOMENT_S`: slow machines show shorter moments."""
        return max(MOMENT_S * self._speed, LEAST_S)

    @property
    def share(self) -> float:
        """Share of the asked pace over the last seconds; 1: it keeps up."""
        began_s, began_at_s = self._seen[0]
        passed_s = (self._now_s - began_s) * (self.factor or 1.0)
        return min(1.0, (self._at_s - began_at_s) / passed_s) if self._now_s - began_s > SHORTEST_S else 1.0


class DeviceClock:
    """Device times in us as seconds since the first, continued over restarts of a board."""

    def __init__(self) -> None:
        self._before_us: int | None = None
        self._passed_us = 0

    def take(self, time_us: int) -> float:
        if self._before_us is not None:
            self._passed_us += max(0, time_us - self._before_us)
        self._before_us = time_us
        return self._passed_us / 1e6
