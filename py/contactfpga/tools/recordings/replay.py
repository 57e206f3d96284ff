"""Recordings in place of a board: `replay://`."""

from __future__ import annotations

import re
import time
from typing import Protocol

from contactfpga.driver.address import REPLAY_FORM, Replay
from contactfpga.driver.conversation import Arrival, Conversation
from contactfpga.driver.pace import Pace
from contactfpga.errors import AddressError, ContactFPGAError, PortNotFound, ReplayEnded
from contactfpga.inputs.files import open_regular, told
from contactfpga.skin.derived import LONGEST_PACKET
from contactfpga.tools.recordings.mcap import MAGIC, McapStream, files_of

_UNKNOWN = re.compile(r"\?\w+=[^/?]*$")


class ByteFile(Protocol):
    """Recorded bytes."""

    def read(self, count: int, /) -> bytes:
        """At most ``count`` bytes; b"" at the end."""

    def close(self) -> None:
        """Close the file."""


def open_recorded(name: str) -> ByteFile:
    """The file named by ``replay://FILE``, open for reading. Raises :class:`AddressError`, :class:`PortNotFound`."""
    try:
        asked = Replay.parse(name)
        file = open_regular(files_of(asked.path)[0])
        if file.read(len(MAGIC)) == MAGIC:
            file.close()
            return McapStream(asked.path, asked.link, asked.start_s)
        file.seek(0)
    except OSError as error:
        reason = error.strerror or told(error)
        hint = f"the options are {REPLAY_FORM}" if _UNKNOWN.search(name) else "is the path right?"
        raise PortNotFound(f"{name} cannot be opened: {reason}; {hint}") from None
    except ValueError as error:  # a path with a zero byte
        raise AddressError(f"{name} cannot be opened: {error}") from None
    if asked.start_s or asked.link is not None:
        file.close()
        raise AddressError(
            f"{name}: this file holds bytes alone; only files of `contactfpga record` take start and link"
        )
    return file


class ReplayTransport:
    """A byte stream of ``open(port, record=FILE)`` or `contactfpga record`, played by ``replay://FILE``, with
    ``?pace=1`` in its own time.
    """

    live = threaded = False

    def __init__(self, name: str):
        self.name = name
        pace = Replay.parse(name).pace
        self._paced = None if pace is None else _PacedPackets(name, pace)
        self._file = open_recorded(name)

    def read(self, timeout_s: float) -> bytes:
        if self._paced is not None:
            return self._paced.read(self._file, timeout_s)
        return _more(self._file, 4096, self.name)

    def write(self, data: bytes) -> None:
        raise ContactFPGAError(f"{self.name} is a recording; it cannot be asked for anything")

    def clock(self) -> float:
        # A recording has no times of its own, and nothing in it is waited for unless it is paced.
        return 0.0 if self._paced is None else time.monotonic()

    def close(self) -> None:
        self._file.close()


class _PacedPackets:
    def __init__(self, name: str, factor: float):
        self._name = name
        self._factor = factor
        self._conversation = Conversation(name, live=False)
        self._held = b""
        self._pace: Pace | None = None  # before the first frame
        self._last_s = 0.0

    def read(self, file: ByteFile, timeout_s: float) -> bytes:
        if not self._held:
            packet = bytearray(_more(file, 1, self._name))
            while packet[-1] and len(packet) <= LONGEST_PACKET and (more := file.read(1)):
                packet += more
            self._held = bytes(packet)
            for event in self._conversation.receive(self._held, 0.0):
                if isinstance(event, Arrival):
                    self._schedule(event.zones.time_us / 1e6)
        wait_s = 0.0 if self._pace is None else self._pace.wait_s(self._last_s)
        if wait_s > 0:
            time.sleep(min(wait_s, max(0.0, timeout_s)))
        if wait_s > timeout_s:
            return b""
        data, self._held = self._held, b""
        return data

    def _schedule(self, at_s: float) -> None:
        if self._pace is None or at_s < self._last_s:  # a board that was restarted begins again
            self._pace = Pace(at_s, self._factor)
        self._last_s = at_s


def _more(file: ByteFile, count: int, name: str) -> bytes:
    data = file.read(count)
    if not data:
        raise ReplayEnded(f"{name} ends here")
    return data
