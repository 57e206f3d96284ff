"""A file that holds whole pieces only, whatever happens to the program or to the disk."""

from __future__ import annotations

import contextlib
import errno
import os
from pathlib import Path

from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.files import told


class RecordingFailed(ContactFPGAError):
    """A recording could not be written any further; what was written is whole. ``reason``: why."""

    def __init__(self, message: str, reason: str):
        super().__init__(message)
        self.reason = reason


class WholeFile:
    """A new file: writes the bytes up to each :meth:`flush` together; where that fails none of them are left."""

    def __init__(self, path: Path):
        self.path = path
        self._whole = 0
        self._waiting = bytearray()
        try:
            self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
        except FileExistsError:
            reason = "is there already; name a new file, or remove it first"
            raise RecordingFailed(f"{path} {reason}", reason) from None
        except OSError as error:
            reason = error.strerror or told(error)
            raise RecordingFailed(f"{path} cannot be written: {reason}", reason) from None

    def tell(self) -> int:
        """Bytes so far, also those that wait."""
        return self._whole + len(self._waiting)

    def write(self, data: bytes) -> int:
        """Add bytes to what waits."""
        self._waiting += data
        return len(data)

    def flush(self) -> None:
        """Hand everything that waits to the system, which keeps it if this program dies."""
        left = memoryview(bytes(self._waiting))
        self._waiting.clear()
        count = len(left)
        try:
            while left:
                left = left[os.write(self._descriptor, left) :]
        except OSError as error:
            raise self._failed(error) from None
        self._whole += count

    def close(self) -> None:
        """May be called twice; what still waits is left out."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1

    def _failed(self, error: OSError) -> RecordingFailed:
        with contextlib.suppress(OSError):
            os.ftruncate(self._descriptor, self._whole)
        full = error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
        reason = f"there is no room for more ({error.strerror})" if full else error.strerror or told(error)
        return RecordingFailed(
            f"{self.path}: {reason}; the {self._whole / 1e6:.1f} MB that are there are whole. "
            f"Make room, then close the file with: contactfpga record --recover {self.path}",
            reason,
        )
