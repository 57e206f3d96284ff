"""Files of recorded bytes: written by `record=`, and read by `replay://` in place of a board."""

from __future__ import annotations

import contextlib
import os
import re
import stat
import time
from pathlib import Path
from typing import BinaryIO, Protocol

from contactfpga.driver import forks
from contactfpga.driver.address import REPLAY_FORM, Replay
from contactfpga.driver.conversation import Conversation
from contactfpga.driver.mcap import MAGIC, McapStream, files_of
from contactfpga.driver.pace import Pace
from contactfpga.driver.transport import Transport, counters_of, skins_of
from contactfpga.errors import AddressError, ContactFPGAError, PortNotFound, ReplayEnded
from contactfpga.inputs.files import open_regular, told
from contactfpga.skin.derived import LONGEST_PACKET
from contactfpga.zones.run import Run

_UNKNOWN = re.compile(r"\?\w+=[^/?]*$")


class ByteFile(Protocol):
    """Recorded bytes."""

    def read(self, count: int, /) -> bytes:
        """At most ``count`` bytes; b"" at the end."""

    def close(self) -> None:
        """Close the file."""


class Tap(Protocol):
    """Receives every byte read from a port."""

    def take(self, data: bytes, clock_s: float) -> None:
        """Bytes with their arrival on the port's clock; b"" if none came."""

    def close(self) -> None:
        """No more bytes will come; may be called twice."""


class FileTap:
    """Tap that writes the bytes to a file."""

    def __init__(self, path: str | Path):
        self._path = path
        self._file = create(path)
        forks.watch(self)

    def take(self, data: bytes, clock_s: float) -> None:
        """Append bytes. Raises :class:`ContactFPGAError`."""
        try:
            self._file.write(data)
        except OSError as error:
            raise self._failed(error) from None

    def close(self) -> None:
        """Close the file. Raises :class:`ContactFPGAError`."""
        try:
            self._file.close()
        except OSError as error:
            raise self._failed(error) from None

    def forked(self) -> None:
        """Leave the buffered bytes to the parent."""
        if not self._file.closed:
            forks.discard(self._file)

    def _failed(self, error: OSError) -> ContactFPGAError:
        reason = error.strerror or told(error)
        return ContactFPGAError(f"{self._path} cannot be written: {reason}; make room, then record again")


class RecordingTransport:
    """Transport that copies each byte read to a tap."""

    def __init__(self, transport: Transport, tap: Tap):
        self._transport = transport
        self.name = transport.name
        self.live, self.threaded = transport.live, transport.threaded
        self.counters, self.skins = counters_of(transport), skins_of(transport)
        self.write = transport.write
        self.clock = transport.clock
        self.take = tap.take
        self._tap = tap

    def read(self, timeout_s: float) -> bytes:
        data = self._transport.read(timeout_s)
        self.take(data, self._transport.clock())
        return data

    def close(self) -> None:
        try:
            self._tap.close()
        finally:
            self._transport.close()


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


def check(path: str | Path) -> None:
    """Refuse a nonempty or impossible output file before a board is opened or built."""
    place = Path(path)
    if place.is_file():
        _check_empty(path, place.stat())
    if place.is_dir():
        raise ContactFPGAError(f"{path} cannot be written: it is a folder; name a file")
    if not place.parent.is_dir():
        raise ContactFPGAError(f"{path} cannot be written: there is no folder {place.parent}")


def create(path: str | Path) -> BinaryIO:
    """A new or empty file for every byte from a port."""
    check(path)
    try:
        # Not cut short where there came to be one after the look.
        file = os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o666), "wb")
        with contextlib.ExitStack() as refused:
            refused.callback(file.close)
            _check_empty(path, os.fstat(file.fileno()))
            refused.pop_all()
        return file
    except OSError as error:
        raise ContactFPGAError(f"{path} cannot be written: {error.strerror or told(error)}") from None


def _check_empty(path: str | Path, found: os.stat_result) -> None:
    if stat.S_ISREG(found.st_mode) and found.st_size:
        raise ContactFPGAError(f"{path} is there already; name a new file, or remove it first")


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
                if isinstance(event, Run):
                    self._schedule(event.times_us[-1] / 1e6)
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
