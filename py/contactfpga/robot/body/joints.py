"""Joint angles at a moment, from a short history of the robot's reports."""

from __future__ import annotations

import bisect
import math
import threading
from collections.abc import Callable, Collection, Mapping

from contactfpga.inputs.values import is_finite, shown
from contactfpga.robot.body.state import BodyError, NoJoints

Joints = Callable[[float], Mapping[str, float]]
"""From a time on the host's clock in s to angles in rad, or m for prismatic joints."""


class JointHistory:
    """The robot's joint angles of the last seconds, interpolated. Thread-safe.

    Call ``history.add(time.monotonic(), {"elbow": 0.3})`` for every report of the robot; pass it to
    ``body.open(history)``.
    """

    def __init__(self, kept_s: float = 2.0, gap_s: float = 0.1, ahead_s: float = 0.02, turning: Collection[str] = ()):
        """Limits of the history.

        Args:
            kept_s: time for which angles are stored.
            gap_s: largest gap of samples that is interpolated.
            ahead_s: how long the newest speed is extrapolated.
            turning: joints whose angle jumps by a whole turn.
        """
        for name, value in (("kept_s", kept_s), ("gap_s", gap_s)):
            if not is_finite(value) or value <= 0:
                raise BodyError(f"{name} is {shown(value)}; it must be a number of seconds above 0")
        if not is_finite(ahead_s) or ahead_s < 0:
            raise BodyError(f"ahead_s is {shown(ahead_s)}; it must be a number of seconds, 0 or above")
        self._kept_s, self._gap_s, self._ahead_s = kept_s, gap_s, ahead_s
        self._turning = frozenset(turning)
        self._times: list[float] = []
        self._angles: list[dict[str, float]] = []
        self._lock = threading.Lock()

    def add(self, host_time_s: float, angles: Mapping[str, float]) -> None:
        """Add the angles at a time later than all before."""
        for name, value in angles.items():
            if not is_finite(value):
                raise BodyError(f"the angle of joint {shown(name)} is {shown(value)}; it must be a finite number")
        with self._lock:
            if self._times and host_time_s <= self._times[-1]:
                raise BodyError(f"host_time_s is {host_time_s:.6f}; the last angles were of {self._times[-1]:.6f}")
            self._times.append(host_time_s)
            self._angles.append(dict(angles))
            old = bisect.bisect_left(self._times, host_time_s - self._kept_s)
            if old > len(self._times) // 2:
                del self._times[:old], self._angles[:old]

    def __call__(self, host_time_s: float) -> dict[str, float]:
        """The angles at a time. Raises :class:`NoJoints` if they are unknown."""
        with self._lock:
            times = self._times
            if not times:
                raise NoJoints("no joint angles have come yet")
            later = bisect.bisect_left(times, host_time_s)
            if later < len(times) and times[later] == host_time_s:
                return dict(self._angles[later])
            if later == 0:
                raise NoJoints(f"joint angles are known since {times[0]:.3f} s, and not at {host_time_s:.3f} s")
            if later == len(times):
                return self._ahead(host_time_s)
            return self._between(later - 1, host_time_s)

    def _ahead(self, host_time_s: float) -> dict[str, float]:
        late_s = host_time_s - self._times[-1]
        if late_s > self._ahead_s:
            raise NoJoints(
                f"the last joint angles are {late_s:.3f} s older than the frame; allowed are {self._ahead_s:g}"
            )
        if len(self._times) == 1 or self._times[-1] - self._times[-2] > self._gap_s:
            return dict(self._angles[-1])
        return self._between(len(self._times) - 2, host_time_s)

    def _between(self, first: int, host_time_s: float) -> dict[str, float]:
        start_s, end_s = self._times[first : first + 2]
        if end_s - start_s > self._gap_s:
            raise NoJoints(
                f"no joint angles came for {end_s - start_s:.3f} s around the frame; allowed are {self._gap_s:g}"
            )
        share = (host_time_s - start_s) / (end_s - start_s)
        before, after = self._angles[first : first + 2]
        return {name: self._mixed(name, before[name], after[name], share) for name in before if name in after}

    def _mixed(self, name: str, before: float, after: float, share: float) -> float:
        step = after - before
        if name in self._turning:
            step = math.remainder(step, math.tau)
        return before + share * step
