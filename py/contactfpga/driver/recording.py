"""Files of a port's bytes, written by `record=`."""

from __future__ import annotations

import contextlib
import os
import stat
from pathlib import Path
from typing import BinaryIO, Protocol

from contactfpga.driver import forks
from contactfpga.driver.transport import Transport, counters_of, skins_of
from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.files import reason_of


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
        reason = error.strerror or reason_of(error)
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
        raise ContactFPGAError(f"{path} cannot be written: {error.strerror or reason_of(error)}") from None


def _check_empty(path: str | Path, found: os.stat_result) -> None:
    if stat.S_ISREG(found.st_mode) and found.st_size:
        raise ContactFPGAError(f"{path} is there already; name a new file, or remove it first")
