"""How many frames a tracker takes on this machine, beside what it takes to decode them."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

from contactfpga.driver.conversation import Arrival, Conversation
from contactfpga.tracking.tracker import Tracker
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.speed.driver import frame, greeting

FRAMES = 8192


class Speed(NamedTuple):
    """Frames per second of processor time."""

    decoded: float
    """From bytes to zones with their places, frame by frame."""
    tracked: float
    """From zones to tracks."""

    @property
    def ratio(self) -> float:
        """Time that tracking takes, in times of decoding."""
        return self.decoded / self.tracked


def measure(contacts: int, frames: int = FRAMES) -> Speed:
    """With this many contacts that move; the best of some rounds."""
    chunks = [frame(number, 1, contacts) for number in range(frames)]
    rounds = [_round(chunks) for _ in range(4)]
    return Speed(*(max(found) for found in zip(*rounds)))


def _round(chunks: list[bytes]) -> Speed:
    host = Conversation("bytes")
    host.receive(greeting(), 0.0)
    arrived: list[Zones] = []

    def decode() -> None:
        for chunk in chunks:
            for event in host.receive(chunk, 0.0):
                if isinstance(event, Arrival):
                    event.zones[0]  # its places, which are computed when they are asked for
                    arrived.append(event.zones)

    tracker = Tracker()
    decoded = _rate(decode, len(chunks))
    tracked = _rate(lambda: [tracker.update(zones) for zones in arrived], len(arrived))
    assert len(arrived) == len(chunks)
    return Speed(decoded, tracked)


def _rate(work: Callable[[], object], count: int) -> float:
    started = time.process_time()
    work()
    return count / (time.process_time() - started)
