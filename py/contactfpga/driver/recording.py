"""Files of recorded bytes: which path `replay://` means, and which may be written by `record=`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import BinaryIO, Protocol

from contactfpga.errors import ContactFPGAError, PortNotFound
from contactfpga.inputs.files import open_regular, told

SCHEME = "replay://"
PACE = "?pace="
"""Comes after the path in a name, with how fast it is to be played."""


class Tap(Protocol):
    """Gets every byte that is read from a port."""

    def take(self, data: bytes, clock_s: float) -> None:
        """Bytes that came then, on the port's clock; b"" where none came."""

    def close(self) -> None:
        """No more will come; may be called twice."""


class FileTap:
    """Writes the bytes to a file."""

    def __init__(self, path: str | Path, port: str):
        self._file = create(path, port)

    def take(self, data: bytes, clock_s: float) -> None:
        """Append them."""
        self._file.write(data)

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def open_recorded(name: str) -> BinaryIO:
    """The file that ``replay://FILE`` names, open for reading. Raises :class:`PortNotFound`."""
    try:
        return open_regular(_path(name))
    except OSError as error:
        reason = error.strerror or told(error)
        raise PortNotFound(f"{name} cannot be opened: {reason}; is the path right?") from None
    except (RuntimeError, ValueError) as error:  # ~nobody, a path with a zero byte
        raise PortNotFound(f"{name} cannot be opened: {error}") from None


def create(path: str | Path, port: str) -> BinaryIO:
    """The file that gets every byte from ``port``, empty; never the one that is being replayed."""
    try:
        if port.startswith(SCHEME) and os.path.exists(path) and os.path.samefile(path, _path(port)):
            raise ContactFPGAError(f"{path} is what {port} reads; record to another file")
        return open(path, "wb")
    except OSError as error:
        raise ContactFPGAError(f"{path} cannot be written: {error.strerror or told(error)}") from None


def _path(name: str) -> Path:
    return Path(name.removeprefix(SCHEME).partition(PACE)[0]).expanduser()
