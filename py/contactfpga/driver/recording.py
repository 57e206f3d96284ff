"""Files of recorded bytes: which path `replay://` means, and which may be written by `record=`."""

from __future__ import annotations

import contextlib
import os
import re
import stat
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Protocol, runtime_checkable

from contactfpga.driver import forks
from contactfpga.driver.address import REPLAY_FORM, Replay
from contactfpga.driver.mcap_bytes import McapStream
from contactfpga.driver.mcap_part import files_of
from contactfpga.driver.mcap_records import MAGIC
from contactfpga.errors import ContactFPGAError, PortNotFound
from contactfpga.inputs.files import open_regular, told

if TYPE_CHECKING:
    from contactfpga.driver.board import Board

_UNKNOWN = re.compile(r"\?\w+=[^/?]*$")
"""What looks like options that there are not."""


class Recorded(Protocol):
    """Recorded bytes."""

    def read(self, count: int, /) -> bytes:
        """At most ``count``; b"" at the end."""

    def close(self) -> None:
        """Let the file go."""


class Tap(Protocol):
    """Gets every byte that is read from a port."""

    def take(self, data: bytes, clock_s: float) -> None:
        """Bytes that came then, on the port's clock; b"" where none came."""

    def close(self) -> None:
        """No more will come; may be called twice."""


@runtime_checkable
class Opening(Protocol):
    """A tap that wants to know whose bytes these are."""

    def opened(self, board: Board) -> None:
        """Called before the first byte comes."""


class FileTap:
    """Writes the bytes to a file."""

    def __init__(self, path: str | Path):
        self._path = path
        self._file = create(path)
        forks.watch(self)

    def take(self, data: bytes, clock_s: float) -> None:
        """Append them. Raises :class:`ContactFPGAError`."""
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
        """The parent writes what waits."""
        if not self._file.closed:
            forks.discard(self._file)

    def _failed(self, error: OSError) -> ContactFPGAError:
        reason = error.strerror or told(error)
        return ContactFPGAError(f"{self._path} cannot be written: {reason}; make room, then record again")


def open_recorded(name: str) -> Recorded:
    """The file that ``replay://FILE`` names, open for reading. Raises :class:`PortNotFound`."""
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
        raise PortNotFound(f"{name} cannot be opened: {error}") from None
    if asked.start_s or asked.link is not None:
        file.close()
        raise PortNotFound(
            f"{name}: this file holds bytes alone; only files of `contactfpga record` take start and link"
        )
    return file


def check(path: str | Path) -> None:
    """Refuse a file that cannot be made or holds something, before a board is opened or built for it."""
    place = Path(path)
    if place.is_file():
        _check_empty(path, place.stat())
    if place.is_dir():
        raise ContactFPGAError(f"{path} cannot be written: it is a folder; name a file")
    if not place.parent.is_dir():
        raise ContactFPGAError(f"{path} cannot be written: there is no folder {place.parent}")


def create(path: str | Path) -> BinaryIO:
    """A file for every byte from a port; never one that holds something."""
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
