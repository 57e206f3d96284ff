"""Boards at full speed that cost next to nothing: frames made beforehand, handed over when they are due."""

from __future__ import annotations

import functools
import threading
import time

from contactfpga.skin.derived import EPOCH_BITS, HEARD_BITS
from contactfpga.wire.hello import EPOCH_DIGITS, HEARD_DIGITS, SENT_DIGITS
from contactfpga_sim.lab.speed.driver import FRAMES, STEP_US, frame
from contactfpga_sim.lab.speed.driver import SKIN as SKIN
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.hello import hello
from contactfpga_sim.model.golden.request import heard

HELLO_S = 0.5
GREETED_HZ = 20.0
"""Frames per second until it is told to go."""


@functools.cache
def frames(low: int) -> list[bytes]:
    """All frames of a board that last heard a number with these lowest bits."""
    return [frame(number, low) for number in range(FRAMES)]


def said(sent: int, number: int) -> bytes:
    """The hello of a board that has sent so many frames and heard this request."""
    counters = ((sent, SENT_DIGITS), (sent * STEP_US >> EPOCH_BITS, EPOCH_DIGITS), (number, HEARD_DIGITS), (0, 2))
    return hello(facts(SKIN), [value >> 7 * place & 127 for value, count in counters for place in range(count)])


class Steady:
    """A transport with a board that sends ``rate_hz`` frames per second after :meth:`go`."""

    threaded = True

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._asked, self._taken, self._low, self._number = b"", 0, 0, 0
        self._answers = b""
        self._sent = self._first = 0
        self._hello_s = 0.0
        self._begun_s, self._rate_hz = time.monotonic(), GREETED_HZ

    def go(self, begun_s: float, rate_hz: float) -> int:
        """From that moment on, so many per second; returns the number of the first of these frames."""
        with self._lock:
            self._begun_s, self._rate_hz, self._first = begun_s, rate_hz, self._sent
            return self._sent

    def read(self, timeout_s: float) -> bytes:
        """The frames that are due, waiting for the first one."""
        until = time.monotonic() + timeout_s
        while True:
            with self._lock:
                data = self._answers + self._due(time.monotonic())
                self._answers = b""
                next_s = self._begun_s + (self._sent - self._first + 1) / self._rate_hz
            now_s = time.monotonic()
            if data or now_s >= until:
                return data
            time.sleep(max(0.0, min(next_s, until, now_s + 0.05) - now_s))

    def _due(self, now_s: float) -> bytes:
        count = int((now_s - self._begun_s) * self._rate_hz) - (self._sent - self._first)
        if count <= 0:
            return b""
        made = frames(self._low)
        data = b""
        if now_s > self._hello_s:
            data, self._hello_s = said(self._sent, self._number), now_s + HELLO_S
        data += b"".join(made[number % FRAMES] for number in range(self._sent, self._sent + count))
        self._sent += count
        return data

    def write(self, data: bytes) -> None:
        """Hear requests."""
        with self._lock:
            self._asked += data
            for one in heard([(0, self._asked)], facts(SKIN).bit_clocks).requests[self._taken :]:
                self._taken, self._low = self._taken + 1, one.number % (1 << HEARD_BITS)
                self._number = one.number
                if one.hello:
                    self._answers += said(self._sent, one.number)

    def clock(self) -> float:
        """Of this machine."""
        return time.monotonic()


def number_of(time_us: int) -> int:
    """Of the frame with this time since power-up."""
    return time_us // STEP_US
