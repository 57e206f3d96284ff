"""A running fit of the board's clock to the host's, which knows that delays only add.

A frame arrives after it was sampled, never before: the least delayed arrivals, less what their bytes take on the wire,
bound the host's clock from above. A frame that answers a request was sampled after the request was sent, which bounds
it from below. The truth lies between the two, on a line whose slope is that of crystals.
"""

from __future__ import annotations

import collections
import itertools
import math
from typing import NamedTuple

import numpy as np

from contactfpga.zones.host_line import HostLine

MOST_PPM, USUAL_PPM = 200.0, 50.0
"""By how much the two clocks may differ at most, and usually do, in millionths."""
WINDOW_S = 60.0
"""Arrivals that are older do not count."""
PIECE_S = 0.25
"""The window is cut into pieces of this length, of which the least delayed arrival counts."""
UNKNOWN_S = 0.02
"""The least delay may be this long as long as no request was answered."""
STEP_S = 0.005
"""What contradicts the bounds by more than this is a step of one of the clocks."""
QUIET_S = 5.0
"""After so long without an answered request one is supposed."""
CAUTION = 1.25
"""So much more is stated than these lines alone say, as clocks do not keep to a straight line."""
MOST_ASKED = 64
"""Answered requests that count."""

_SLOPES = np.arange(-MOST_PPM, MOST_PPM + 1, 4.0) * 1e-6


class _Point(NamedTuple):
    device_s: float
    excess_s: float
    """By how much more the host's clock went on than the board's since the first frame, delays included."""


class ClockFit:
    """Device and host times in, lines from one to the other out; times of one board since its power-up."""

    def __init__(self) -> None:
        self._least_s = self._way_s = UNKNOWN_S  # what the least delay may be at most, now and when last asked
        self.forget()

    def forget(self) -> None:
        """The board was restarted, or a clock stepped: what was measured says nothing of what comes, but for the least
        delay, which is the way's."""
        self._pieces: collections.deque[_Point] = collections.deque()
        self._piece = -math.inf  # number of the last one
        self._asked: collections.deque[_Point] = collections.deque(maxlen=MOST_ASKED)
        self._newest = _Point(0.0, 0.0)
        self._base_us, self._base_s = 0, 0.0
        self._fitted_s = 0.0
        self._height_s = self._slope = self._variance = 0.0

    def arrived(self, time_us: int, arrived_s: float, wire_s: float) -> None:
        """A frame of this device time came, whose bytes alone take ``wire_s``; of several at once, the last one."""
        if not self._pieces:
            self._base_us, self._base_s = time_us, arrived_s - wire_s
        point = self._point(time_us, arrived_s - wire_s)
        below_s = self._bound(point.device_s) - point.excess_s
        if self._pieces and below_s > self._least_s + STEP_S:
            self.forget()
            self.arrived(time_us, arrived_s, wire_s)
            return
        self._newest = point
        piece = math.floor(point.device_s / PIECE_S)
        if piece > self._piece:
            self._piece = piece
            self._pieces.append(point)
            self._suppose()
            self._fit()
        elif below_s > 0:
            while self._pieces and _hides(point, self._pieces[-1]):
                self._pieces.pop()
            self._pieces.append(point)
            self._height_s -= below_s
            self._least_s = max(0.0, self._least_s - below_s)

    def answered(self, time_us: int, asked_s: float) -> None:
        """The frame that :meth:`arrived` was called for last was sampled after that moment of the host's clock."""
        asked = self._point(time_us, asked_s)
        if asked.excess_s > self._bound(asked.device_s) + STEP_S:  # arrivals from before a step
            self._pieces.clear()
            self._asked.clear()
            self._pieces.append(self._newest)
        self._asked.append(asked)
        self._fit()
        self._way_s = self._least_s

    def _suppose(self) -> None:
        """Where nobody has asked for long, that the least delay since then is at most twice what it was."""
        now_s = self._newest.device_s
        if now_s - (self._asked[-1].device_s if self._asked else 0.0) > QUIET_S:
            since = [point for point in self._pieces if point.device_s > now_s - QUIET_S]
            lowest = min(since, key=lambda point: point.excess_s)
            self._asked.append(_Point(now_s, lowest.excess_s - 2 * self._way_s))

    def _point(self, time_us: int, host_s: float) -> _Point:
        device_s = (time_us - self._base_us) / 1e6
        return _Point(device_s, host_s - self._base_s - device_s)

    def _bound(self, device_s: float) -> float:
        """What the excess is at most then."""
        return self._height_s + self._slope * (device_s - self._fitted_s)

    def _fit(self) -> None:
        """Every line between the bounds is as likely as any other, but for its slope: that of crystals, near that of
        the least delayed arrivals. The mean of all lines is taken."""
        for points in (self._pieces, self._asked):
            while points and points[0].device_s < self._newest.device_s - WINDOW_S:
                points.popleft()
        now_s = self._fitted_s = self._newest.device_s
        above = _least(self._pieces, now_s)  # now, of the lines of each slope
        if self._asked:
            gaps = above + _least([_Point(one.device_s, -one.excess_s) for one in self._asked], now_s, -1)
        else:
            gaps = np.full(len(_SLOPES), self._least_s)
        weights = np.maximum(gaps, 1e-9) * self._likely(int(gaps.argmax()), float(gaps.max()))
        if gaps.max() <= 0:  # by less than a step: no line keeps all bounds
            weights = np.exp(gaps * 1e9 - gaps.max() * 1e9)
        weights /= weights.sum()
        middles = above - np.maximum(gaps, 0.0) / 2
        middle = float(weights @ middles)
        self._slope = float(weights @ _SLOPES)
        self._least_s = max(0.0, float(weights @ gaps))
        self._height_s = middle + self._least_s / 2
        self._variance = float(weights @ ((middles - middle) ** 2 + gaps**2 / 12)) * CAUTION**2

    def _likely(self, widest: int, gap_s: float) -> np.ndarray:
        """Of each slope, from arrivals alone, of which delays hide as much as they vary and as the bounds leave open:
        where the times of frames and of the bus beat slowly, they go up and down for long. ``widest``: the slope that
        leaves the widest gap between the bounds."""
        device_s, excess_s = np.array(self._pieces).T
        heights = excess_s - _SLOPES[widest] * device_s
        hidden_s = max(gap_s, 0.0) / 4 + float(np.median(heights) - heights.min()) + 1e-6
        usual, sharp = USUAL_PPM * 1e-6, hidden_s / max(float(device_s[-1] - device_s[0]), PIECE_S)
        exponents = (_SLOPES / usual) ** 2 + ((_SLOPES - _middle_slope(list(self._pieces))) / sharp) ** 2
        likely: np.ndarray = np.exp((exponents.min() - exponents) / 2)
        return likely

    def line(self, arrived_s: float) -> HostLine | None:
        """For frames that arrived then; None before the first :meth:`arrived`."""
        if not self._pieces:
            return None
        now_s = self._newest.device_s
        base_s = self._base_s + now_s + self._bound(now_s) - self._least_s / 2
        base_us = self._base_us + round(now_s * 1e6)
        return HostLine(arrived_s, base_us, base_s, 1.0 + self._slope, math.sqrt(self._variance))


def _hides(point: _Point, earlier: _Point) -> bool:
    """Whether a later point of the same piece makes an earlier one redundant: a line below it is below both."""
    if math.floor(earlier.device_s / PIECE_S) < math.floor(point.device_s / PIECE_S):
        return False
    return earlier.excess_s - point.excess_s > MOST_PPM * 1e-6 * (point.device_s - earlier.device_s)


def _least(points: collections.deque[_Point] | list[_Point], now_s: float, sign: int = 1) -> np.ndarray:
    """By slope (times ``sign``), the height now of the highest line below the points."""
    device_s, excess_s = np.array(points).T
    least: np.ndarray = (excess_s - sign * _SLOPES[:, None] * (device_s - now_s)).min(axis=1)
    return least


def _middle_slope(points: list[_Point]) -> float:
    """Of the lower convex hull's edge over the middle of the time that the points span; they are in order of time."""
    hull: list[_Point] = []
    for point in points:
        while len(hull) > 1 and _turns_down(hull[-2], hull[-1], point):
            hull.pop()
        hull.append(point)
    middle_s = (points[0].device_s + points[-1].device_s) / 2
    for before, after in itertools.pairwise(hull):
        if after.device_s >= middle_s and after.device_s > before.device_s:
            return (after.excess_s - before.excess_s) / (after.device_s - before.device_s)
    return 0.0


def _turns_down(first: _Point, second: _Point, third: _Point) -> bool:
    run, rise = second.device_s - first.device_s, second.excess_s - first.excess_s
    return rise * (third.device_s - first.device_s) >= run * (third.excess_s - first.excess_s)
