"""Scan times of frames, on the board's clock and on the host's."""

from __future__ import annotations

import collections
import itertools
import math
from collections.abc import Sequence
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

    def take(self, packets: np.ndarray, widths: Widths, last: Frame, came_s: tuple[float, float]) -> np.ndarray | None:
        """Times since power-up in us of frames that continue the first one (:func:`run_ends`); None if it cannot be
        explained.

        ``packets``: of :data:`contactfpga.wire.table.FIELDS`, at least one; ``last``: their last frame; ``came_s``:
        arrival of the first and the last one.
        """
        _, time_us, sequence, heard, _, _, overwritten, *_ = packets[0].item()
        first_us = self._explain(heard, time_us, sequence, came_s[0])
        if first_us is None:
            self._known = False
            self._waiting += len(packets)
            self._stats.unexplained += len(packets)
            return None
        lost = (sequence - self._next) % _SEQUENCES
        modulus = 1 << widths.overwritten_bits
        replaced = 0 if self.before is None else (overwritten - self.before.overwritten) % modulus
        times_us = np.array([first_us])
        if len(packets) > 1:  # one alone is what comes most often
            lost += int((np.diff(packets["sequence"]) - 1 & _SEQUENCES - 1).sum())
            replaced += int((np.diff(packets["overwritten"]) & modulus - 1).sum())
            times_us = np.append(times_us, np.diff(packets["time_us"]) & _WRAP_US - 1).cumsum()
        self._stats.frames += len(packets)
        self._stats.lost += lost
        self._stats.overwritten += replaced
        self._next += lost + len(packets)
        self._time_us = self._last_us = int(times_us[-1])
        self._now, self.before = came_s[1], last
        return times_us

    def place(self, time_us: int) -> int | None:
        """The time since power-up in us from the low bits of a time close to now; None if unknown."""
        if not self._known or self._last_us < 0:
            return None
        return self._last_us + (time_us - self._last_us + _WRAP_US // 2) % _WRAP_US - _WRAP_US // 2

    @property
    def last(self) -> tuple[int, Frame, float] | None:
        """The last frame with its time since power-up in us and its arrival in s on the host's clock; None if no frame
        can continue it.
        """
        if self.before is None or self._time_us is None or not self._known:
            return None
        return self._time_us, self.before, self._now

    def _explain(self, heard: int, low_us: int, sequence: int, now: float) -> int | None:
        """A frame's time since power-up in us, from its low bits."""
        if not self._known or (self._live and now - self._now > self._patience_s):
            return None
        before = self.before
        if before is not None:
            if before.heard and not heard:
                self._forgot = True
                return None
            # A board that has heard no request begins again at 0 in a restart, and when its time wraps.
            begins = heard != before.heard or (not heard and low_us < before.time_us)
            if (sequence - self._next) % _SEQUENCES and low_us < BEGUN_US and begins:
                return None  # a frame was lost, or this is one of the first since a restart
        if self._time_us is None:  # from one epoch before the hello's to three after it
            first_us = (self._epoch - 1) * _EPOCH_US
            time_us = first_us + (low_us - first_us) % _WRAP_US
            return time_us if time_us > self._last_us else None
        step_us = (low_us - self._time_us) % _WRAP_US
        return self._time_us + step_us if 0 < step_us <= MOST_US else None


def run_ends(packets: np.ndarray) -> list[int]:
    """For each packet, the end of the run of frames that begins with it; its own index if it is no frame. In a run each
    frame's time follows from that of the one before.

    ``packets``: consecutive ones, of :data:`contactfpga.wire.table.FIELDS`.
    """
    if len(packets) == 1:
        return [int(packets["valid"][0])]
    valid, heard, time_us, sequence = (packets[name] for name in ("valid", "heard", "time_us", "sequence"))
    step_us = time_us[1:] - time_us[:-1] & _WRAP_US - 1
    found = valid[1:] & valid[:-1] & (heard[1:] == heard[:-1]) & (step_us > 0) & (step_us <= MOST_US)
    found &= (heard[1:] > 0) | (time_us[1:] > time_us[:-1]) | (sequence[1:] - sequence[:-1] & _SEQUENCES - 1 == 1)
    after = np.arange(1, len(packets) + 1)
    after[:-1][found] = len(packets)
    ends: list[int] = np.where(valid, np.minimum.accumulate(after[::-1])[::-1], after - 1).tolist()
    return ends


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
        :meth:`line` but the first.
        """
        lines = []
        for time_us, came_s, sent_s in zip(times_us.tolist(), arrived_s.tolist(), wire_s.tolist(), strict=True):
            line = self.line(came_s)
            assert line is not None
            lines.append(line[1:])
            self.arrived(time_us, came_s, sent_s)
        base_us, base_s, rate, sigma_s = map(np.array, zip(*lines, strict=True))
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

    def take(self, sizes: Sequence[int], now: float, times_us: np.ndarray, asked_s: float | None) -> HostLine | None:
        """Take successive frames of these sizes in bytes and times; ``asked_s``: time of the request that the first one
        answers.
        """
        if self.fit is None:
            return None
        self._latest = int(times_us[0]), sizes[0]
        if self._line is None or asked_s is not None:  # else the last one of those that came at once says the most
            self.end(now)
            if asked_s is not None:
                self.fit.answered(int(times_us[0]), asked_s)
            self._line = self.fit.line(now)
        if len(sizes) > 1:
            self._latest = int(times_us[-1]), sizes[-1]
        return self._line

    def take_reads(
        self, times_us: np.ndarray, sizes: np.ndarray, arrived_s: np.ndarray, counts: np.ndarray
    ) -> HostLines | None:
        """The host's lines of successive reads that answer no request, after a frame; None in a recording.
        ``arrived_s`` and ``counts``: arrival and number of frames of each read; ``times_us`` and ``sizes``: time and
        bytes of its last frame.
        """
        if self.fit is None:
            return None
        lines = self.fit.arrived_in_turn(times_us, arrived_s, sizes * self.byte_s)
        return HostLines(*(np.repeat(values, counts) for values in (arrived_s, *lines)))

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
