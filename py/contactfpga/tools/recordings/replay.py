"""Recordings in place of a board: `replay://`."""

from __future__ import annotations

import re
import time
from collections.abc import Iterable, Iterator

from contactfpga.driver.address import REPLAY_FORM, Replay
from contactfpga.driver.conversation import Conversation
from contactfpga.driver.pace import DeviceClock, Pace
from contactfpga.errors import AddressError, ContactFPGAError, PortNotFound, ReplayEnded
from contactfpga.inputs.files import open_regular, reason_of
from contactfpga.skin.derived import LONGEST_PACKET
from contactfpga.tools.recordings.mcap import RecordingError, files_of
from contactfpga.tools.recordings.recording import CHUNK, Recording
from contactfpga.zones.run import Run

_UNKNOWN = re.compile(r"\?\w+=[^/?]*$")


class ReplayTransport:
    """A link of a :class:`Recording`, played by ``replay://FILE``, with ``?pace=1`` in its own time."""

    live = threaded = False

    def __init__(self, name: str):
        self.name = name
        asked = Replay.parse(name)
        data = _opened(name, asked)
        self._paced = asked.pace is not None
        self._pieces = _timed(name, data) if self._paced else _sliced(data)
        self._held, self._at_s = b"", 0.0
        self._pace = Pace(factor=asked.pace)

    def read(self, timeout_s: float) -> bytes:
        if not self._held:
            self._held, self._at_s = next(self._pieces, (b"", 0.0))
        if not self._held:
            raise ReplayEnded(f"{self.name} ends here")
        wait_s = self._pace.wait_s(self._at_s)
        if wait_s > 0:
            time.sleep(min(wait_s, max(0.0, timeout_s)))
            if wait_s > timeout_s:
                return b""
        data, self._held = self._held, b""
        return data

    def write(self, data: bytes) -> None:
        raise ContactFPGAError(f"{self.name} is a recording; it cannot be asked for anything")

    def clock(self) -> float:
        # A recording has no times of its own, and nothing in it is waited for unless it is paced.
        return time.monotonic() if self._paced else 0.0

    def close(self) -> None:
        self._held, self._pieces = b"", iter(())


def _opened(name: str, asked: Replay) -> Iterator[bytes]:
    """The bytes that ``name`` asks for. Raises :class:`AddressError`, :class:`PortNotFound`."""
    try:
        open_regular(files_of(asked.path)[0]).close()
    except OSError as error:
        hint = f"the options are {REPLAY_FORM}" if _UNKNOWN.search(name) else "is the path right?"
        raise PortNotFound(f"{name} cannot be opened: {error.strerror or reason_of(error)}; {hint}") from None
    except ValueError as error:  # a path with a zero byte
        raise AddressError(f"{name} cannot be opened: {error}") from None
    recording = Recording(asked.path)
    if not recording.timed and (asked.start_s or asked.link is not None):
        raise AddressError(
            f"{name}: this file holds bytes alone; only files of `contactfpga record` take start and link"
        )
    if not recording.timed:
        return (data for _, data in recording.pieces())
    link = recording.checked(asked.link)
    if asked.start_s > recording.duration_s:
        lasts_s = f"{asked.path} lasts {recording.duration_s:.3f} s"
        raise RecordingError(f"{lasts_s}; it cannot start at {asked.start_s:g} s")
    return (data for _, data in recording.pieces(link, asked.start_s))


def _sliced(pieces: Iterable[bytes]) -> Iterator[tuple[bytes, float]]:
    for data in pieces:
        for at in range(0, len(data), CHUNK):
            yield data[at : at + CHUNK], 0.0


def _timed(name: str, pieces: Iterable[bytes]) -> Iterator[tuple[bytes, float]]:
    """Each packet, with the seconds from the first frame to the last one so far."""
    conversation, clock, at_s = Conversation(name, live=False), DeviceClock(), 0.0
    held = b""
    for data, _ in _sliced(pieces):
        *packets, held = (held + data).split(b"\0")
        packets = [packet + b"\0" for packet in packets]
        if len(held) > LONGEST_PACKET:  # which is none
            packets, held = [*packets, held], b""
        for packet in packets:
            for event in conversation.receive(packet, 0.0):
                if isinstance(event, Run):
                    at_s = clock.take(int(event.times_us[-1]))
            yield packet, at_s
    if held:
        yield held, at_s
