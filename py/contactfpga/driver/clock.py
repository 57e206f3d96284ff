"""Scan times of frames, on the board's clock and on the host's."""

from __future__ import annotations

import collections
import itertools
import math
from typing import NamedTuple

import numpy as np

from contactfpga.driver.stats import Stats
from contactfpga.skin.derived import EPOCH_BITS, SEQUENCE_BITS, TIME_BITS, Widths
from contactfpga.wire.hello import Hello
from contactfpga.wire.protocol import Frame, may_number
from contactfpga.zones.zone import HostLine, HostLines

_WRAP_US = 1 << TIME_BITS
_EPOCH_US = 1 << EPOCH_BITS
_SEQUENCES = 1 << SEQUENCE_BITS

MOST_US = _EPOCH_US
"""Longest time before a frame without another frame or hello, which come twice per second."""
MOST_S = 8.0
"""Longest pause after which a frame's time is unambiguous: half the period of its time field."""
SETTLED_S = 1.0
"""Time after a reading pause by which all waiting bytes have been read."""
BEGUN_US = 1 << 21
"""Longest time since a restart of which no hello has arrived."""


class Timeline:
    """Frame counts and times since the board's power-up, from the few bits in frames, and from hellos.

    A frame of unknown time is dropped, and so are all others until the next hello.
    """

    def __init__(self, stats: Stats, live: bool):
        self.before: Frame | None = None
        self._stats = stats
        self._live = live
        self._greeted = self._known = self._forgot = False
        self._next = 0  # frames sent before the next one
        self._waiting = 0  # unexplained frames since the last hello
        self._time_us: int | None = None  # of the last frame; None: a hello has come since
        self._last_us = -1
        self._epoch = 0
        self._now = 0.0
        self._doubted = -math.inf
        self._patience_s = MOST_S

    @property
    def known(self) -> bool:
        """Whether the next frame's time can be explained, as far as known."""
        return self._known

    def doubt(self, now: float) -> None:
        """Note a reading pause: bytes read now may have waited, and later ones may be missing."""
        self._known = False
        self._doubted = now

    def take_hello(self, hello: Hello, now: float, fresh: bool) -> None:
        """Take the board's frame count and approximate time. ``fresh``: the hello answers a request since
        :meth:`doubt`.
        """
        if self._greeted:
            self._compare(hello)
        self._greeted = True
        self._next, self._epoch, self._time_us = hello.sent, hello.epoch, None
        self._known = fresh or now >= self._doubted + SETTLED_S
        self._forgot, self._waiting = False, 0
        self._now = now
        longest = Widths(hello.sheet).max_frame_bytes
        self._patience_s = MOST_S + 2 * longest * 10 / hello.baud

    def _compare(self, hello: Hello) -> None:
        late_us = self._last_us - BEGUN_US  # the scanner's clock is at most a scan behind the frames
        first = self._next
        forgot = self._forgot and not may_number(hello.heard)
        if forgot or hello.sent < self._next or (hello.epoch + 1) * _EPOCH_US <= late_us:
            self._stats.restarts += 1
            self.before, self._last_us, first = None, -1, 0
        self._stats.lost += max(0, hello.sent - first - self._waiting)

    def take_frame(self, frame: Frame, widths: Widths, now: float) -> int | None:
        """The frame's time since power-up in us; None if it cannot be explained."""
        time_us = self._explain(frame, now)
        if time_us is None:
            self._known = False
            self._waiting += 1
            self._stats.unexplained += 1
            return None
        self._stats.frames += 1
        self._stats.lost += self._gap(frame)
        if self.before is not None:
            gap = frame.overwritten - self.before.overwritten
            self._stats.overwritten += gap % (1 << widths.overwritten_bits)
        self._next += self._gap(frame) + 1
        self._time_us = self._last_us = time_us
        self._now, self.before = now, frame
        return time_us

    def place(self, time_us: int) -> int | None:
        """The time since power-up in us from the low bits of a time close to now; None if unknown."""
        if not self._known or self._last_us < 0:
            return None
        return self._last_us + (time_us - self._last_us + _WRAP_US // 2) % _WRAP_US - _WRAP_US // 2

    def expects(self, heard: int, time_us: int, sequence: int, now: float) -> bool:
        """Whether a frame with this request number, time and number continues the last explained frame."""
        if self.before is None or self._time_us is None or not self._known:
            return False
        soon = not self._live or now - self._now <= self._patience_s
        if not heard and time_us < self.before.time_us and (sequence - self._next) % _SEQUENCES:
            return False
        return soon and heard == self.before.heard and 0 < (time_us - self._time_us) % _WRAP_US <= MOST_US

    @property
    def last(self) -> tuple[int, Frame, float] | None:
        """The last frame with its time since power-up in us and its arrival in s on the host's clock; None if no frame
        can continue it.
        """
        if self.before is None or self._time_us is None or not self._known:
            return None
        return self._time_us, self.before, self._now

    def take_run(self, packets: np.ndarray, widths: Widths, last: Frame, now: float) -> np.ndarray:
        """Times since power-up in us of frames that continue one another (:func:`continues`) and the last explained
        frame.

        ``packets``: of :data:`contactfpga.wire.many.FIELDS`; ``last``: their last frame.
        """
        assert self.before is not None
        assert self._time_us is not None
        before = self.before
        lost = int((_steps(packets["sequence"], before.sequence, _SEQUENCES) - 1 & _SEQUENCES - 1).sum())
        times_us = self._time_us + np.cumsum(_steps(packets["time_us"], before.time_us, _WRAP_US))
        self._stats.frames += len(packets)
        self._stats.lost += lost
        overwritten = _steps(packets["overwritten"], before.overwritten, 1 << widths.overwritten_bits)
        self._stats.overwritten += int(overwritten.sum())
        self._next += lost + len(packets)
        self._time_us = self._last_us = int(times_us[-1])
        self._now, self.before = now, last
        return times_us

    def _gap(self, frame: Frame) -> int:
        return (frame.sequence - self._next) % _SEQUENCES

    def _explain(self, frame: Frame, now: float) -> int | None:
        if not self._known or (self._live and now - self._now > self._patience_s):
            return None
        before = self.before
        if before is not None:
            if before.heard and not frame.heard:
                self._forgot = True
                return None
            # A board that has heard no request begins again at 0 in a restart, and when its time wraps.
            begins = frame.heard != before.heard or (not frame.heard and frame.time_us < before.time_us)
            if self._gap(frame) and frame.time_us < BEGUN_US and begins:
                return None  # a frame was lost, or this is one of the first since a restart
        if self._time_us is None:  # from one epoch before the hello's to three after it
            first_us = (self._epoch - 1) * _EPOCH_US
            time_us = first_us + (frame.time_us - first_us) % _WRAP_US
            return time_us if time_us > self._last_us else None
        step_us = (frame.time_us - self._time_us) % _WRAP_US
        return self._time_us + step_us if 0 < step_us <= MOST_US else None


def continues(packets: np.ndarray) -> np.ndarray:
    """(n,) bool: whether each frame's time follows from a known time of the one before.

    ``packets``: consecutive ones, of :data:`contactfpga.wire.many.FIELDS`.
    """
    valid, heard, time_us, sequence = (packets[name] for name in ("valid", "heard", "time_us", "sequence"))
    found = np.zeros(len(packets), np.bool_)
    step_us = time_us[1:] - time_us[:-1] & _WRAP_US - 1
    found[1:] = valid[1:] & valid[:-1] & (heard[1:] == heard[:-1]) & (step_us > 0) & (step_us <= MOST_US)
    found[1:] &= (heard[1:] > 0) | (time_us[1:] > time_us[:-1]) | (sequence[1:] - sequence[:-1] & _SEQUENCES - 1 == 1)
    return found


def _steps(values: np.ndarray, before: int, modulus: int) -> np.ndarray:
    steps = values.copy()
    steps[1:] -= values[:-1]
    steps[0] -= before
    return steps & modulus - 1


MOST_PPM, USUAL_PPM = 200.0, 50.0
WINDOW_S = 60.0
PIECE_S = 0.25
"""Length of a piece of the window, in which only the least delayed arrival counts."""
UNKNOWN_S = 0.02
"""Assumed bound of the least delay until a request is answered."""
STEP_S = 0.005
"""Contradiction of the bounds that indicates a step of a clock."""
QUIET_S = 5.0
"""Time without an answered request after which the fit assumes one."""
CAUTION = 1.25
"""Factor on the uncertainty, because clocks do not keep to straight lines."""
MOST_ASKED, MOST_POINTS = 64, 512

_SLOPES = np.arange(-MOST_PPM, MOST_PPM + 1, 4.0) * 1e-6


class _Point(NamedTuple):
    device_s: float
    excess_s: float


class ClockFit:
    """A running fit of the board's clock to the host's since one power-up.

    Delays only add, so the least delayed arrivals, less the wire time of their bytes, bound the host's clock from
    above. A frame that answers a request was sampled after the request was sent, which bounds it from below. The true
    line lies between, with the slope of a crystal.

    Sums are formed in order and exponentials one by one, so that the same fit in C (c/clockfit.h) rounds alike.
    """

    def __init__(self) -> None:
        self._least_s = self._way_s = UNKNOWN_S  # what the least delay may be at most, now and when last asked
        self.forget()

    def forget(self) -> None:
        """Drop all measurements after a restart or a clock step, except the transport's least delay."""
        self._pieces: collections.deque[_Point] = collections.deque(maxlen=MOST_POINTS)
        self._piece = -math.inf  # number of the last one
        self._asked: collections.deque[_Point] = collections.deque(maxlen=MOST_ASKED)
        self._newest = _Point(0.0, 0.0)
        self._base_us, self._base_s = 0, 0.0
        self._fitted_s = 0.0
        self._height_s = self._slope = self._variance = 0.0

    def arrived(self, time_us: int, arrived_s: float, wire_s: float) -> None:
        """Add the last frame of those that arrived together; ``wire_s`` is the wire time of its bytes."""
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
        """State that the last frame given to :meth:`arrived` was sampled after ``asked_s`` on the host's clock."""
        asked = self._point(time_us, asked_s)
        if asked.excess_s > self._bound(asked.device_s) + STEP_S:  # arrivals from before a step
            self._pieces.clear()
            self._asked.clear()
            self._pieces.append(self._newest)
        self._asked.append(asked)
        self._fit()
        self._way_s = self._least_s

    def _suppose(self) -> None:
        """Without requests for long, assume that the least delay has at most doubled."""
        now_s = self._newest.device_s
        if now_s - (self._asked[-1].device_s if self._asked else 0.0) > QUIET_S:
            since = [point for point in self._pieces if point.device_s > now_s - QUIET_S]
            lowest = min(since, key=lambda point: point.excess_s)
            self._asked.append(_Point(now_s, lowest.excess_s - 2 * self._way_s))

    def _point(self, time_us: int, host_s: float) -> _Point:
        device_s = (time_us - self._base_us) / 1e6
        return _Point(device_s, host_s - self._base_s - device_s)

    def _bound(self, device_s: float) -> float:
        return self._height_s + self._slope * (device_s - self._fitted_s)

    def _fit(self) -> None:
        """Take the mean of all lines between the bounds, weighted by how likely their slopes are for crystals and for
        the least delayed arrivals.
        """
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
            weights = _exponentials(gaps * 1e9 - gaps.max() * 1e9)
        weights /= _total(weights)
        middles = above - np.maximum(gaps, 0.0) / 2
        middle = _total(weights * middles)
        self._slope = _total(weights * _SLOPES)
        self._least_s = max(0.0, _total(weights * gaps))
        self._height_s = middle + self._least_s / 2
        self._variance = _total(weights * ((middles - middle) ** 2 + gaps**2 / 12)) * CAUTION**2

    def _likely(self, widest: int, gap_s: float) -> np.ndarray:
        """Likelihood of each slope from arrivals alone. They tell no more than their scatter and the bounds' gap allow,
        because frame and bus times can beat slowly. ``widest``: index of the slope with the widest gap.
        """
        device_s, excess_s = np.array(self._pieces).T
        heights = excess_s - _SLOPES[widest] * device_s
        hidden_s = max(gap_s, 0.0) / 4 + float(np.median(heights) - heights.min()) + 1e-6
        usual, sharp = USUAL_PPM * 1e-6, hidden_s / max(float(device_s[-1] - device_s[0]), PIECE_S)
        exponents = (_SLOPES / usual) ** 2 + ((_SLOPES - _middle_slope(list(self._pieces))) / sharp) ** 2
        return _exponentials((exponents.min() - exponents) / 2)

    def arrived_in_turn(
        self, times_us: np.ndarray, arrived_s: np.ndarray, wire_s: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Call :meth:`arrived` for many frames after the first one; returns, before each of them, all fields of
        :meth:`line` but the first. Frames that do not change the fit are handled together.
        """
        count, at = len(times_us), 0
        base_us, (base_s, rate, sigma_s) = np.empty(count, np.int64), np.empty((3, count))
        while at < count:
            devices_s = (times_us[at:] - self._base_us) / 1e6
            excess_s = arrived_s[at:] - wire_s[at:] - self._base_s - devices_s
            below_s = self._height_s + self._slope * (devices_s - self._fitted_s) - excess_s
            telling = (np.floor(devices_s / PIECE_S) > self._piece) | (below_s > 0)
            quiet = int(telling.argmax()) if telling.any() else count - at
            known = slice(at, min(at + quiet + 1, count))
            now_s = np.empty(known.stop - at)
            now_s[0], now_s[1:] = self._newest.device_s, devices_s[: len(now_s) - 1]
            bounds_s = self._height_s + self._slope * (now_s - self._fitted_s)
            base_s[known] = self._base_s + now_s + bounds_s - self._least_s / 2
            base_us[known] = self._base_us + np.rint(now_s * 1e6).astype(np.int64)
            rate[known], sigma_s[known] = 1.0 + self._slope, math.sqrt(self._variance)
            if quiet:
                self._newest = _Point(float(devices_s[quiet - 1]), float(excess_s[quiet - 1]))
            at += quiet
            if at < count:
                self.arrived(int(times_us[at]), float(arrived_s[at]), float(wire_s[at]))
                at += 1
        return base_us, base_s, rate, sigma_s

    @property
    def begun(self) -> bool:
        return bool(self._pieces)

    def line(self, arrived_s: float) -> HostLine | None:
        """The map for frames that arrive now; None before the first :meth:`arrived`."""
        if not self._pieces:
            return None
        now_s = self._newest.device_s
        base_s = self._base_s + now_s + self._bound(now_s) - self._least_s / 2
        base_us = self._base_us + round(now_s * 1e6)
        return HostLine(arrived_s, base_us, base_s, 1.0 + self._slope, math.sqrt(self._variance))


def _total(values: np.ndarray) -> float:
    return float(values.cumsum()[-1])


def _exponentials(values: np.ndarray) -> np.ndarray:
    return np.array([math.exp(value) for value in values.tolist()])


def _hides(point: _Point, earlier: _Point) -> bool:
    """Whether a later point of the same piece makes an earlier one redundant: a line below it is below both."""
    if math.floor(earlier.device_s / PIECE_S) < math.floor(point.device_s / PIECE_S):
        return False
    return earlier.excess_s - point.excess_s > MOST_PPM * 1e-6 * (point.device_s - earlier.device_s)


def _least(points: collections.deque[_Point] | list[_Point], now_s: float, sign: int = 1) -> np.ndarray:
    """For each slope (times ``sign``), height now of the highest line below the points."""
    device_s, excess_s = np.array(points).T
    least: np.ndarray = (excess_s - sign * _SLOPES[:, None] * (device_s - now_s)).min(axis=1)
    return least


def _middle_slope(points: list[_Point]) -> float:
    """Slope of the lower convex hull over the middle of the time span; points are in order of time."""
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


class HostClock:
    """The clock fit of one conversation; a recording has none."""

    def __init__(self, fit: ClockFit | None):
        self.byte_s = 0.0
        self.fit = fit
        self._line: HostLine | None = None  # for the frames that come now
        self._latest: tuple[int, int] | None = None  # time and bytes of the last of them

    def begin(self, now: float) -> None:
        """Begin to take the packets that arrived together now."""
        self._line = None if self.fit is None else self.fit.line(now)

    def take(self, time_us: int, size: int, now: float, asked_s: float | None) -> HostLine | None:
        """Take a frame of ``size`` bytes, or the last one of a run. ``asked_s``: time of the request that it answers
        first.
        """
        if self.fit is None:
            return None
        self._latest = time_us, size
        if self._line is None or asked_s is not None:  # else the last one of those that came at once says the most
            self.end(now)
            if asked_s is not None:
                self.fit.answered(time_us, asked_s)
            self._line = self.fit.line(now)
        return self._line

    def take_reads(
        self, times_us: np.ndarray, sizes: np.ndarray, arrived_s: np.ndarray, counts: np.ndarray
    ) -> HostLines | None:
        """The host's lines of successive reads that answer no request, after :attr:`begun`; None in a recording.
        ``arrived_s`` and ``counts``: arrival and number of frames of each read; ``times_us`` and ``sizes``: time and
        bytes of its last frame.
        """
        if self.fit is None:
            return None
        lines = self.fit.arrived_in_turn(times_us, arrived_s, sizes * self.byte_s)
        return HostLines(*(np.repeat(values, counts) for values in (arrived_s, *lines)))

    @property
    def begun(self) -> bool:
        return self.fit is None or self.fit.begun

    def end(self, now: float) -> None:
        """End the packets that arrived together."""
        if self.fit is not None and self._latest is not None:
            time_us, size = self._latest
            self.fit.arrived(time_us, now, size * self.byte_s)
        self._latest = None

    def forget(self) -> None:
        self._line = self._latest = None
        if self.fit is not None:
            self.fit.forget()
