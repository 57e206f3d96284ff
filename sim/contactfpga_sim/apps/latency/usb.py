"""The USB serial chip between UART and host: when bytes are delivered.

By FTDI's AN232B-04: A packet is closed when it is full, and at the event character unless that is its first byte. The
latency timer of 1 to 255 ms, by default 16 ms, runs from the last sent packet. When it ends, the open packet is sent,
even if empty.

By the USB 2.0 specification: frames of 1 ms and microframes of 125 us (5.3.3), the largest packets (5.8.3), and a
packet's time on the bus (tables 5-9 and 5-10).

Assumed: the host asks at the start of each frame or microframe, and if stated several times within it, evenly spaced;
the chip sends all closed packets in order. The EHCI specification suggests that a controller whose devices had nothing
to send asks them again after 10 us ("Restarting Asynchronous Schedule Before EOF"). The timer counts frames. The bus
is otherwise idle, without errors or bit stuffing, and a byte is in the chip when its stop bit ends.
"""

from __future__ import annotations

import collections
import dataclasses
import math
from typing import NamedTuple

import numpy as np

from contactfpga.boards.spec import Bridge
from contactfpga.driver.health import EVENT_CHAR, LATENCY_MS
from contactfpga_sim.apps.latency.spread import MixedTimes

STATUS_BYTES = 2
"""Status bytes at the start of each packet (AN232B-04)."""

OVERHEAD_BYTES = {False: 13, True: 55}
"""Bus bytes of a bulk packet besides data: full and high speed (USB 2.0, tables 5-9 and 5-10)."""

BITS_PER_US = {False: 12, True: 480}

DEFAULT_TIMER_MS = 16

LONGEST_TIMER_MS = 255

HOST_S = 0.1e-3
"""Assumed time through the host's program to the controller."""

_TICKS_PER_CLOCK = 16_000
"""Twice 8,000 microframes per second, so that midpoints are whole ticks."""

_NEVER = np.iinfo(np.int64).max // 2


@dataclasses.dataclass(frozen=True)
class BridgeSettings:
    """A bridge's settings, by default those of ``contactfpga doctor``."""

    chip: Bridge
    timer_ms: int = LATENCY_MS
    event: int | None = EVENT_CHAR & 0xFF
    """Event character; None: none."""
    asks: int = 1
    """Requests of the host per frame or microframe."""

    def __post_init__(self) -> None:
        if not 1 <= self.timer_ms <= LONGEST_TIMER_MS:
            raise ValueError(f"timer_ms is {self.timer_ms}; it must be from 1 to {LONGEST_TIMER_MS}")

    @property
    def period_us(self) -> int:
        """Period of the timer's packets without bytes."""
        return self.period_asks // self.asks * self.chip.frame_us

    @property
    def period_asks(self) -> int:
        """Period of the timer's packets, a whole number of frames or microframes, in requests of the host."""
        return math.ceil(1000 * self.timer_ms / self.chip.frame_us) * self.asks

    def packet_us(self, data_bytes: int) -> float:
        """Bus time of a packet with this many UART bytes."""
        high_speed = self.chip.high_speed
        return 8 * (OVERHEAD_BYTES[high_speed] + STATUS_BYTES + data_bytes) / BITS_PER_US[high_speed]


class BridgeChip:
    """The chip, byte by byte, in ``timer``'s time unit. ``sent``: time of the last packet."""

    def __init__(self, payload_bytes: int, timer: float, event: int | None = None, sent: float = 0.0):
        self._payload_bytes, self._timer, self._event = payload_bytes, timer, event
        self._coming: collections.deque[tuple[float, int]] = collections.deque()
        self._open = bytearray()
        self._closed: list[bytes] = []
        self._sent = sent

    def put(self, time: float, value: int) -> None:
        """Add a byte by the end of its stop bit, in order."""
        self._coming.append((time, value))

    def take(self, now: float) -> list[bytes]:
        """Packets that the host reads as it asks."""
        while self._coming and self._coming[0][0] <= now:
            self._receive(self._coming.popleft()[1])
        packets, self._closed = self._closed, []
        if now - self._sent >= self._timer - 1e-9:
            packets.append(bytes(self._open))
            self._open.clear()
        if packets:
            self._sent = now
        return packets

    def _receive(self, value: int) -> None:
        self._open.append(value)
        if len(self._open) == self._payload_bytes or (value == self._event and len(self._open) > 1):
            self._closed.append(bytes(self._open))
            self._open.clear()


class ByteStream(NamedTuple):
    """Bytes on a UART's line, in clocks from any origin."""

    times: np.ndarray
    """End of each byte's stop bit, rising."""
    values: np.ndarray
    since: int
    """Time after which all bytes are known."""
    until: int
    """Time up to which all bytes are known."""


def delivered(settings: BridgeSettings, clock_hz: int, stream: ByteStream, byte: int) -> MixedTimes:
    """Delivery time of a byte, in us from the stream's origin, over all equally likely phases of chip and board.

    In each phase the chip is empty once in its first period (:attr:`BridgeSettings.period_us`) from ``since``: the byte
    must be later than that period; on a line without rests, by another one. Raises ValueError if the stream is too
    short.
    """
    phases = _Phases(settings, clock_hz, stream)
    sent, bus_us = phases.sent(byte)
    us_per_tick = 1e6 / (clock_hz * _TICKS_PER_CLOCK)
    middles, half = sent * us_per_tick + bus_us, phases.widths * us_per_tick / 2
    return MixedTimes(middles - half, middles + half, phases.widths / phases.widths.sum())


class _Phases:
    """The chip in all phases at once, in ticks. A phase stands for its neighborhood with each byte between the same
    frames."""

    def __init__(self, settings: BridgeSettings, clock_hz: int, stream: ByteStream):
        self._settings = settings
        self._times = np.asarray(stream.times, np.int64) * _TICKS_PER_CLOCK
        self._ends = np.append(self._times, _NEVER)
        self._until = stream.until * _TICKS_PER_CLOCK
        self._ask = 2 * clock_hz * settings.chip.frame_us // (125 * settings.asks)
        self._closing = self._closings(np.asarray(stream.values))
        edges = np.unique(np.append(self._times % self._ask, 0))
        ends = np.append(edges[1:], self._ask)
        since = stream.since * _TICKS_PER_CLOCK
        frames = since - since % self._ask + np.arange(settings.period_asks) * self._ask
        self._first = (frames[:, None] + (edges + ends) // 2).ravel()
        self.widths = np.tile(ends - edges, settings.period_asks)

    def _closings(self, values: np.ndarray) -> np.ndarray:
        """Last byte of a packet by its first, unless the timer ends it; the number of bytes if open."""
        count = len(values)
        found = np.arange(count + 1) + self._settings.chip.payload_bytes - 1
        if self._settings.event is not None:
            events = np.append(np.flatnonzero(values == self._settings.event), count)
            after = events[np.minimum(np.searchsorted(events, np.arange(count + 1), "right"), len(events) - 1)]
            found = np.minimum(found, after)
        return np.minimum(found, count)

    def sent(self, byte: int) -> tuple[np.ndarray, np.ndarray]:
        """Tick of the frame that sends a byte, and bus time in us to its packet's end, by phase."""
        opened = np.searchsorted(self._times, self._first, "right")
        if (opened > byte).any():
            raise ValueError(f"byte {byte} comes before the chip has sent once; give more of what was sent before it")
        frames = np.zeros(len(opened), np.int64)  # in which something was sent last, from the first on
        found, bus_us = np.zeros(len(opened), np.int64), np.zeros(len(opened))
        left = np.arange(len(opened))
        while len(left):
            start = opened[left]
            by_timer = frames[left] + self._settings.period_asks
            closed = -((self._first[left] - self._ends[self._closing[start]]) // self._ask)
            now = np.minimum(by_timer, closed)
            at = self._first[left] + now * self._ask
            if (at > self._until).any():
                raise ValueError(f"byte {byte} is not delivered before the stream ends; give more of what comes after")
            start, us = self._send(start, at, now == by_timer, byte)
            opened[left], frames[left] = start, now
            found[left], bus_us[left] = at, us
            left = left[start <= byte]
        return found, bus_us

    def _send(
        self, start: np.ndarray, at: np.ndarray, by_timer: np.ndarray, byte: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """First unsent byte after a frame, up to the byte's packet, and bus time in us."""
        start, us = start.copy(), np.zeros(len(start))
        while True:
            closing = self._closing[start]
            more = (self._ends[closing] <= at) & (start <= byte)
            if not more.any():
                break
            us[more] += self._packet_us(closing[more] + 1 - start[more])
            start[more] = closing[more] + 1
        last = by_timer & (start <= byte)
        held = np.searchsorted(self._times, at[last], "right")
        us[last] += self._packet_us(held - start[last])
        start[last] = held
        return start, us

    def _packet_us(self, data_bytes: np.ndarray) -> np.ndarray:
        empty = self._settings.packet_us(0)
        found: np.ndarray = empty + data_bytes * (self._settings.packet_us(1) - empty)
        return found
