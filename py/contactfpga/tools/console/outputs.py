"""Output places, checked before the work begins, so that no result is lost."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

from contactfpga.errors import ContactFPGAError


class OutputError(ContactFPGAError):
    """A result could not be written."""


_new: list[Path] = []
"""Folders that this command made, innermost first."""


@contextlib.contextmanager
def no_empty_folders() -> Iterator[None]:
    """Delete the folders that a command made and left empty, as when it is refused."""
    _new.clear()
    try:
        yield
    finally:
        for place in _new:
            with contextlib.suppress(OSError):
                place.rmdir()


def folder(path: str | Path, option: str = "--output") -> Path:
    """The folder, created if missing; raises :class:`OutputError` if it is not writable."""
    place = Path(path)
    _made(place, place, option)
    return place


def _made(place: Path, asked: Path, option: str) -> None:
    try:
        new = [one for one in (place, *place.parents) if not one.exists()]
        place.mkdir(parents=True, exist_ok=True)
        _new[:0] = new
        with tempfile.TemporaryFile(dir=place):
            pass
    except FileExistsError:
        what = "that" if place == asked else repr(str(place))
        raise OutputError(f"{option} is {str(asked)!r}; {what} is no folder") from None
    except (OSError, ValueError) as error:
        raise OutputError(_refused(option, asked, error)) from None


def file(path: str | Path, option: str = "--output") -> Path:
    """A writable file, with its folder; its content is unchanged."""
    place = Path(path)
    _made(place.parent, place, option)
    if place.is_dir():
        raise OutputError(f"{option} is {str(place)!r}; that is a folder, and a file is needed")
    try:
        os.lstat(place)  # which refuses what can be no name
        if place.exists():  # and is no link to what does not
            with open(place, "ab"):
                pass
    except FileNotFoundError:
        pass
    except (OSError, ValueError) as error:
        raise OutputError(_refused(option, place, error)) from None
    return place


def _refused(option: str, place: Path, error: Exception) -> str:
    reason = getattr(error, "strerror", None) or str(error)
    return f"{option} is {str(place)!r}, which cannot be written: {reason}"
