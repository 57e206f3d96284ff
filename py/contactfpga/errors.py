"""Errors of this package; each message names the cause and the next step."""

from __future__ import annotations

import os
import shlex
import sys
from typing import Any

UNSOLVED = 3
"""Exit status of a command that finds no solution."""


class ContactFPGAError(Exception):
    """Base of every error of this package.

    >>> try:
    ...     contactfpga.open("sim://?scene=elbow")
    ... except contactfpga.ContactFPGAError as error:
    ...     type(error).__name__
    'AddressError'
    """


class SkinError(ContactFPGAError, ValueError):
    """A Skin that cannot work; the message names the field, its value and the limit."""


class AddressError(ContactFPGAError):
    """A port's name is invalid, for instance by an unknown option or scene."""


class PortNotFound(ContactFPGAError):
    """No port, or more than one, fits; or the port cannot be opened."""


class PortBusy(ContactFPGAError):
    """The port is open already, in this program or another one."""


class PortLost(ContactFPGAError):
    """An open port is gone: unplugged, or closed by its other end."""


class BoardClosed(ContactFPGAError):
    """A board was used after it was closed."""


class ReadTimeout(ContactFPGAError, TimeoutError):
    """The board answered, but no complete frame came in time."""


class NoData(ReadTimeout):
    """No frame came for longer than the reader allows."""

    def __init__(self, message: str, silence: Any):
        super().__init__(message)
        self.silence = silence
        """Duration and last data, a :class:`~contactfpga.Silence`."""


class BoardSilent(ReadTimeout):
    """No byte came in time."""


class OnlyNoise(ReadTimeout):
    """Bytes came in time, but no valid packet."""


class NoSuchCommand(ContactFPGAError):
    """The board does not accept this command."""


class ReplayEnded(ContactFPGAError, EOFError):
    """A recording has no further frame."""


class SkinMismatch(ContactFPGAError):
    """The board was built from another Skin than expected."""


class VersionMismatch(ContactFPGAError):
    """The board uses another version of the protocol."""


class MissingExtra(ContactFPGAError, ImportError):
    """An optional part of contactfpga is not installed."""

    def __init__(self, what: str, extra: str):
        self.what = what
        """The function or command that needs the part."""
        super().__init__(f"{what} needs more than is installed; install it with: {pip_install(extra)}")


def pip_install(extra: str) -> str:
    """The command line that installs an extra for this Python, from a wheel or a source tree."""
    quote = '"' if sys.platform == "win32" else "'"
    python = sys.executable or "python"
    if os.sep in (inside := python.removeprefix(os.getcwd() + os.sep)):
        python = inside
    package, where = ("contactfpga", "") if _installed() else (".", ", in the folder of contactfpga's sources")
    return f"{shlex.quote(python)} -m pip install {quote}{package}[{extra}]{quote}{where}"


def _installed() -> bool:
    from importlib.metadata import PackageNotFoundError, version

    try:
        version("contactfpga")
    except PackageNotFoundError:
        return False
    return True


class MissingTool(ContactFPGAError):
    """A program outside Python is missing."""

    def __init__(self, what: str, tool: str, command: str):
        super().__init__(f"{what} needs {tool}, which is not on the PATH; install it with: {command}")
