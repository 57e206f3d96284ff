"""Simulated time beside real time."""

from __future__ import annotations

import collections
import time
from collections.abc import Callable

MAX_LAG_S = 0.1
"""A board that is later than this does not catch up any more: its time has slipped."""

MOMENT_S = 0.04
"""What one moment may take to simulate."""
LEAST_S = 0.0005
SMOOTHING = 0.2

WINDOW_S = 2.0
"""Over which the share of real time is told."""


class Pace:
    """Says how much simulated time may pass, so that a board runs in real time, or as near to it as the machine can."""

    def __init__(self, simulated_s: float, clock: Callable[[], float] = time.monotonic):
        self._clock = clock
        self._begin = clock() - simulated_s  # when simulated time was 0, slip taken out
        self.slip_s = 0.0
        """Seconds by which simulated time has fallen behind for good."""
        self._speed = 1.0
        self._seen: collections.deque[tuple[float, float]] = collections.deque([(clock(), simulated_s)])

    def due(self, simulated_s: float) -> float:
        """Seconds of simulated time that are to pass now; below 0: so long nothing is to."""
        now = self._clock()
        behind = now - self._begin - simulated_s
        if behind > MAX_LAG_S:
            self.slip_s += behind - MAX_LAG_S
            self._begin += behind - MAX_LAG_S
            behind = MAX_LAG_S
        self._seen.append((now, simulated_s))
        while now - self._seen[0][0] > WINDOW_S:
            self._seen.popleft()
        return behind

    def ran(self, simulated_s: float, seconds: float) -> None:
        """So long it took to simulate so much."""
        if seconds > 0:
            self._speed += SMOOTHING * (simulated_s / seconds - self._speed)

    @property
    def most_s(self) -> float:
        """Seconds of simulated time that this machine simulates within :data:`MOMENT_S`. Where it is slow a moment
        holds less, so that it is shown as soon."""
        return max(MOMENT_S * self._speed, LEAST_S)

    @property
    def share(self) -> float:
        """Of real time that the board reached over the last seconds; 1: it keeps up."""
        (first, began), (last, ended) = self._seen[0], self._seen[-1]
        return min(1.0, (ended - began) / (last - first)) if last - first > 0.2 else 1.0
