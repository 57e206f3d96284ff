"""Recorded bytes in the place of a board: ``replay://FILE``."""

from __future__ import annotations

import math
import time

from contactfpga.driver import recording
from contactfpga.driver.address import Replay
from contactfpga.driver.conversation import Arrival, Conversation
from contactfpga.errors import ContactFPGAError, ReplayEnded
from contactfpga.skin.widths import LONGEST_PACKET


class ReplayTransport:
    """A recorded byte stream, as ``open(port, record=FILE)`` and `contactfpga record` write it: ``replay://FILE``, as
    fast as it is read, or ``replay://FILE?pace=1`` in the time in which it was recorded."""

    live = threaded = False

    def __init__(self, name: str):
        self.name = name
        pace = Replay.parse(name).pace
        self._pace = None if pace is None else _Pace(name, pace)
        self._file = recording.open_recorded(name)

    def read(self, timeout_s: float) -> bytes:
        if self._pace is not None:
            return self._pace.read(self._file, timeout_s)
        return _more(self._file, 4096, self.name)

    def write(self, data: bytes) -> None:
        raise ContactFPGAError(f"{self.name} is a recording; it cannot be asked for anything")

    def clock(self) -> float:
        # A recording has no times of its own, and nothing in it is waited for unless it is paced.
        return 0.0 if self._pace is None else time.monotonic()

    def close(self) -> None:
        self._file.close()


class _Pace:
    """Holds back the packets of a recording until their time has come."""

    def __init__(self, name: str, factor: float):
        self._name = name
        self._factor = factor
        self._conversation = Conversation(name, live=False)
        self._held = b""
        self._due_s = -math.inf
        self._begun: tuple[float, int] | None = None  # a moment, and the frame's time that belongs to it
        self._last_us = 0

    def read(self, file: recording.Recorded, timeout_s: float) -> bytes:
        if not self._held:
            packet = bytearray(_more(file, 1, self._name))
            while packet[-1] and len(packet) <= LONGEST_PACKET and (more := file.read(1)):
                packet += more
            self._held = bytes(packet)
            for event in self._conversation.receive(self._held, 0.0):
                if isinstance(event, Arrival):
                    self._schedule(event.zones.time_us)
        wait_s = self._due_s - time.monotonic()
        if wait_s > 0:
            time.sleep(min(wait_s, max(0.0, timeout_s)))
        if wait_s > timeout_s:
            return b""
        data, self._held = self._held, b""
        return data

    def _schedule(self, time_us: int) -> None:
        if self._begun is None or time_us < self._last_us:  # a board that was restarted begins again
            self._begun = time.monotonic(), time_us
        moment_s, begun_us = self._begun
        self._due_s = moment_s + (time_us - begun_us) / 1e6 / self._factor
        self._last_us = time_us


def _more(file: recording.Recorded, count: int, name: str) -> bytes:
    data = file.read(count)
    if not data:
        raise ReplayEnded(f"{name} ends here")
    return data
