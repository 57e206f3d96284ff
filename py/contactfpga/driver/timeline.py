"""How many frames the board has sent and when each was scanned, from the few bits that frames carry and from hellos."""

from __future__ import annotations

import math

import numpy as np

from contactfpga.driver.stats import Stats
from contactfpga.skin.derived import EPOCH_BITS
from contactfpga.skin.widths import SEQUENCE_BITS, TIME_BITS, Widths
from contactfpga.wire.hello import Hello
from contactfpga.wire.protocol import Frame, may_number

_WRAP_US = 1 << TIME_BITS
_EPOCH_US = 1 << EPOCH_BITS
_SEQUENCES = 1 << SEQUENCE_BITS

MOST_US = _EPOCH_US
"""Hellos come twice per second, so that a frame is no later than this after the hello or the frame before it."""
MOST_S = 8.0
"""Half the time in which a frame's time wraps: after a longer pause nobody knows how often it did."""
SETTLED_S = 1.0
"""This long after a pause in which nobody read, all that waited meanwhile has been read."""
BEGUN_US = 1 << 21
"""A board may have been restarted this long ago without a hello that arrived."""


class Timeline:
    """Counts and times since the board's power-up.

    A frame whose time cannot be explained is not passed on before the next hello, so that no time is wrong.
    """

    def __init__(self, stats: Stats, live: bool):
        self.before: Frame | None = None
        """The last frame since power-up that was explained."""
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
        """Whether the next frame's time can be explained, as far as that is known by now."""
        return self._known

    def doubt(self, now: float) -> None:
        """Nobody has read for long: what is read now may have waited, with a break before what comes next."""
        self._known = False
        self._doubted = now

    def take_hello(self, hello: Hello, now: float, fresh: bool) -> None:
        """The board says how many frames it has sent, and roughly when this was. ``fresh``: it answers a request sent
        since :meth:`doubt`."""
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
        """The frame's time since power-up in us; None where it cannot be explained."""
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
        """The time since power-up in us of these bits of it, which are of about now; None where that is not known."""
        if not self._known or self._last_us < 0:
            return None
        return self._last_us + (time_us - self._last_us + _WRAP_US // 2) % _WRAP_US - _WRAP_US // 2

    def expects(self, heard: int, time_us: int, now: float) -> bool:
        """Whether a frame that carries these continues the one explained last."""
        if self.before is None or self._time_us is None or not self._known:
            return False
        soon = not self._live or now - self._now <= self._patience_s
        return soon and heard == self.before.heard and 0 < (time_us - self._time_us) % _WRAP_US <= MOST_US

    def take_run(self, packets: np.ndarray, widths: Widths, last: Frame, now: float) -> np.ndarray:
        """Times since power-up in us of frames of which :func:`continues` says that each follows from the one before;
        the first one is expected, or the one before it was explained.

        ``packets``: of :data:`contactfpga.wire.many.FIELDS`; ``last``: the last one of them.
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
            if self._gap(frame) and frame.time_us < BEGUN_US and frame.heard != before.heard:
                return None  # a frame was lost, or this is one of the first since a restart
        if self._time_us is None:  # from one epoch before the hello's to three after it
            first_us = (self._epoch - 1) * _EPOCH_US
            time_us = first_us + (frame.time_us - first_us) % _WRAP_US
            return time_us if time_us > self._last_us else None
        step_us = (frame.time_us - self._time_us) % _WRAP_US
        return self._time_us + step_us if 0 < step_us <= MOST_US else None


def continues(packets: np.ndarray) -> np.ndarray:
    """(n,) bool: whether each frame's time follows from the one before it, if that one's is known.

    ``packets``: of :data:`contactfpga.wire.many.FIELDS`, as they came one after the other.
    """
    valid, heard, time_us = packets["valid"], packets["heard"], packets["time_us"]
    found = np.zeros(len(packets), np.bool_)
    step_us = time_us[1:] - time_us[:-1] & _WRAP_US - 1
    found[1:] = valid[1:] & valid[:-1] & (heard[1:] == heard[:-1]) & (step_us > 0) & (step_us <= MOST_US)
    return found


def _steps(values: np.ndarray, before: int, modulus: int) -> np.ndarray:
    """From each value to the next, the first one from ``before``; ``modulus`` is a power of two."""
    steps = values.copy()
    steps[1:] -= values[:-1]
    steps[0] -= before
    return steps & modulus - 1
