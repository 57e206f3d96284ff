"""The folder of compiled gateware and cached results. Only files that the user or root alone can write are used, as
they are executed."""

from __future__ import annotations

import contextlib
import hashlib
import os
import shlex
import shutil
import stat
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from contactfpga.errors import ContactFPGAError

with contextlib.suppress(ImportError):  # on Windows, where nothing is compiled
    import fcntl

FOLDER_MODE, FILE_MODE = 0o700, 0o600
OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
_LOCK, _TAKEN = "lock", "taken"
_FRESH_S = 60.0
"""Grace period of a folder without a lock."""


class CacheError(ContactFPGAError):
    """The cache cannot be used, or another user could have written it."""


def cache_folder() -> Path:
    """``CONTACTFPGA_CACHE``, or a folder in the user's cache folder."""
    if chosen := os.environ.get("CONTACTFPGA_CACHE"):
        return Path(chosen).absolute()
    try:
        if sys.platform == "darwin":
            return Path.home() / "Library" / "Caches" / "contactfpga"
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache").absolute() / "contactfpga"
    except RuntimeError as error:
        raise CacheError(f"there is no place for the cache ({error}); name one with CONTACTFPGA_CACHE") from None


def ready(folder: Path) -> Path:
    """The folder, created if missing, without links in its path. Raises :class:`CacheError`."""
    try:
        _make(folder)
        folder = folder.resolve(strict=True)
        if not folder.is_dir():
            raise CacheError(f"the cache {folder} is not a folder; {_another()}")
        # What a user has named may hold anything, so nobody is told to delete it.
        _check(folder, folder.stat(), _another() if os.environ.get("CONTACTFPGA_CACHE") else _remove(folder))
        for above in folder.parents:
            if who := _replaces(above.stat()):
                raise CacheError(f"the cache {folder} lies in {above}, where {who} can replace it; {_another()}")
    except OSError as error:
        raise CacheError(f"the cache {folder} cannot be used: {error.strerror}; {_another()}") from None
    return folder


def trusted(file: Path) -> bool:
    """Whether the file exists. Raises :class:`CacheError` if another user could have written it."""
    try:
        found = file.lstat()
    except FileNotFoundError:
        return False
    if not stat.S_ISREG(found.st_mode):
        raise CacheError(f"{file} in the cache is not a regular file; {_remove(file)}")
    _check(file, found, _remove(file))
    return True


def whole(file: Path, tell: bool = False) -> bool:
    """Whether the file matches its checksum; ``tell`` reports a damaged file on stderr. Raises :class:`CacheError` like
    :func:`trusted`."""
    if not trusted(file):
        return False
    total = _sum(file)
    if trusted(total) and total.read_bytes() == _sum_of(file):
        return True
    if tell:
        print(f"contactfpga: {file} in the cache is damaged; it is made again", file=sys.stderr)
    return False


def put(made: Path, file: Path) -> None:
    """Move a file from a :func:`scratch` folder to its place, atomically, with its checksum."""
    total = made.with_name(f"{made.name}.sum")
    total.write_bytes(_sum_of(made))
    # The sum goes first: a file without its own is never taken.
    for new, place in ((total, _sum(file)), (made, file)):
        new.chmod(FILE_MODE)
        os.replace(new, place)


def _sum(file: Path) -> Path:
    return file.with_name(f"{file.name}.sum")


def _sum_of(file: Path) -> bytes:
    return hashlib.sha256(file.read_bytes()).hexdigest().encode()


@contextlib.contextmanager
def locked(file: Path) -> Iterator[None]:
    """Hold a lock between processes. The lock's file stays."""
    with _opened(file) as descriptor:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield


@contextlib.contextmanager
def scratch(folder: Path, kind: str) -> Iterator[Path]:
    """A temporary folder in the cache. Leftovers of killed processes are removed first."""
    _sweep(folder, kind)
    with tempfile.TemporaryDirectory(dir=folder, prefix=f"{kind}-") as name:
        # Held for as long as the process lives, however it ends.
        with locked(Path(name) / _TAKEN):
            (Path(name) / _TAKEN).rename(Path(name) / _LOCK)  # where it is seen, it is held
            yield Path(name)


def _sweep(folder: Path, kind: str) -> None:
    for left in folder.glob(f"{kind}-*"):
        with contextlib.suppress(OSError, CacheError):  # its owner removed it meanwhile, or still works in it
            fresh = time.time() - left.lstat().st_mtime < _FRESH_S
            if not (left / _LOCK).exists():
                if not fresh:
                    shutil.rmtree(left)
                continue
            with _opened(left / _LOCK, os.O_RDWR) as descriptor:  # none is made: its owner may be removing the folder
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(left)


def _make(folder: Path) -> None:
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    for path in reversed(missing):
        with contextlib.suppress(FileExistsError):  # another process made it
            path.mkdir(FOLDER_MODE)
            path.chmod(FOLDER_MODE)  # whatever the umask took away


def _check(path: Path, found: os.stat_result, advice: str) -> None:
    if found.st_uid not in (os.geteuid(), 0):
        raise CacheError(f"{path} in the cache belongs to user {found.st_uid}, not to you or root; {advice}")
    if found.st_mode & OTHERS_WRITE:
        mode = stat.S_IMODE(found.st_mode)
        raise CacheError(f"{path} in the cache can be written by others (mode {mode:o}); {advice}")


def _replaces(above: os.stat_result) -> str:
    if above.st_mode & stat.S_ISVTX:
        return ""
    if above.st_mode & stat.S_IWOTH:
        return "anybody"
    # Who owns the root folder owns all. In a sandbox that need not be user 0.
    others = above.st_uid not in (os.geteuid(), 0, os.stat("/").st_uid)
    return f"user {above.st_uid}" if others else ""


@contextlib.contextmanager
def _opened(file: Path, mode: int = os.O_RDWR | os.O_CREAT) -> Iterator[int]:
    """A descriptor of the file; links are not followed."""
    try:
        flags = mode | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
        descriptor = os.open(file, flags, FILE_MODE)
    except OSError as error:
        raise CacheError(f"{file} in the cache cannot be opened: {error.strerror}; {_remove(file)}") from None
    try:
        yield descriptor
    finally:
        os.close(descriptor)


def _remove(path: Path) -> str:
    return f"what lies there cannot be trusted: delete it (rm -r {shlex.quote(str(path))}), or {_another()}"


def _another() -> str:
    return "name another folder with CONTACTFPGA_CACHE"
