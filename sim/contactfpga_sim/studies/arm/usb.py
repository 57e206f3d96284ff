"""The way of the bytes: a USB serial chip, and a transport for the real driver on which time is that of the plant."""

from __future__ import annotations

import collections
import math
from typing import TYPE_CHECKING

from contactfpga_sim.studies.arm.parts import Usb

if TYPE_CHECKING:
    from contactfpga_sim.studies.arm.world import World


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


class PlantTransport:
    """A :class:`contactfpga.driver.transport.Transport`: while the driver waits, arm and gateware go on."""

    live, threaded = True, False
    name = "arm://"

    def __init__(self, world: World):
        self._world = world

    def read(self, timeout_s: float) -> bytes:
        until = self._world.clock() + timeout_s
        while not (data := self._world.delivered()) and self._world.clock() < until:
            self._world.step()
        return data

    def write(self, data: bytes) -> None:
        self._world.send(data)

    def clock(self) -> float:
        return self._world.clock()

    def close(self) -> None:
        pass
