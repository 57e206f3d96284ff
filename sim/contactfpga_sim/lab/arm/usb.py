"""The USB serial chip between the board and the host."""

from __future__ import annotations

import collections
import math

from contactfpga_sim.lab.arm.parts import Usb


class Chip:
    """Holds bytes until it has a packet full or its latency timer ran out, which runs also while it has none; the host
    takes them at its next frame."""

    def __init__(self, usb: Usb):
        self._usb = usb
        self._held: collections.deque[tuple[float, int]] = collections.deque()
        self._sent = 0.0

    def put(self, seconds: float, value: int) -> None:
        """A byte whose stop bit ended at this time."""
        self._held.append((seconds, value))

    def take(self, seconds: float) -> bytes:
        """What the host takes now; called once at each of its frames."""
        ready = sum(1 for at, _ in self._held if at <= seconds)
        if ready < self._usb.packet_bytes and seconds - self._sent < self._usb.timer_s - 1e-9:
            return b""
        self._sent = seconds
        return bytes(self._held.popleft()[1] for _ in range(min(ready, int(self._usb.packet_bytes))))

    def frame_at(self, seconds: float) -> int:
        """Number of the host's frame at a time."""
        return math.floor(seconds / self._usb.frame_s + 1e-9)
