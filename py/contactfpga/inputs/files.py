"""Regular files, and atomic writes."""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import shutil
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, TypeGuard


def open_regular(path: str | Path) -> BinaryIO:
    """A file open for reading. Raises OSError, also for a file that is not regular."""
    # Not even opening a FIFO must wait for whoever writes to it.
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise OSError(errno.EINVAL, "not a regular file", os.fspath(path))
        return os.fdopen(descriptor, "rb")
    except BaseException:
        os.close(descriptor)
        raise


def read_small(path: str | Path, most: int, what: str, refused: type[Exception]) -> bytes:
    """All bytes of a file; ``what``: its kind in messages. Raises OSError, and ``refused`` for more than ``most``
    bytes."""
    with open_regular(path) as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise refused(f"{path}: longer than {most:,} bytes; is it {what}?")
    return data


@contextlib.contextmanager
def replaced(path: str | Path) -> Iterator[Path]:
    """A new, empty file in the folder of ``path``, which replaces ``path`` after the block, unless the block fails. An
    existing file that is not regular, such as /dev/stdout into a pipe, is written directly. Raises OSError with
    ``path``."""
    if Path(path).exists() and not Path(path).is_file():
        yield Path(path)
        return
    place = Path(os.path.realpath(path))  # a link that the user names is followed, as any program does
    new = place.with_name(f".contactfpga-{secrets.token_hex(8)}{Path(path).suffix}")
    try:
        os.close(os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
        yield new
        if place.exists():
            shutil.copymode(place, new)
        os.replace(new, place)
    except BaseException as error:
        with contextlib.suppress(OSError):
            new.unlink()
        if isinstance(error, OSError) and error.filename in (None, str(new), new):
            error.filename, error.filename2 = os.fspath(path), None
        raise


def write_text(path: str | Path, text: str) -> None:
    """Write a UTF-8 text file, whole or not at all. Raises OSError."""
    with replaced(path) as new:
        new.write_text(text, encoding="utf-8")


def names_robot(port: str | None) -> TypeGuard[str]:
    return port is not None and port.endswith(".toml") and "://" not in port


def reason_of(error: OSError) -> str:
    """An OSError for a user: file and problem, without the number."""
    reason = error.strerror or str(error) or type(error).__name__
    return reason if error.filename is None else f"{os.fsdecode(error.filename)}: {reason}"
