"""Files that can be read to an end: a FIFO would be waited for, a device read forever."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO, TypeGuard


def open_regular(path: str | Path) -> BinaryIO:
    """The file, open for reading. Raises OSError, also for what is no regular file."""
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
    """All bytes of a file that has ``most`` of them at most; ``what``: the kind of file it is to be. Raises ``refused``
    for a longer one, OSError."""
    with open_regular(path) as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise refused(f"{path}: longer than {most:,} bytes; is it {what}?")
    return data


def names_robot(port: str | None) -> TypeGuard[str]:
    """Whether what stands for a port is the file of a robot's links, not a board as ``sim://?skin=FILE.toml``."""
    return port is not None and port.endswith(".toml") and "://" not in port


def told(error: OSError) -> str:
    """An OSError as a user reads it: the file and what is wrong with it, without the number."""
    reason = error.strerror or str(error) or type(error).__name__
    return reason if error.filename is None else f"{os.fsdecode(error.filename)}: {reason}"
