"""Every exception that this package raises on purpose. Each message names the problem and the next step."""

from __future__ import annotations

import os
import shlex
import sys
from typing import Any

UNSOLVED = 3
"""Exit status of a command that finds no solution."""


class ContactFPGAError(Exception):
    """Base class of every error of this package.

    >>> try:
    ...     contactfpga.open("sim://?scene=elbow")
    ... except contactfpga.ContactFPGAError as error:
    ...     type(error).__name__
    'AddressError'
    """


class SkinError(ContactFPGAError, ValueError):
    """A Skin that cannot work. The message names the field, its value and the limit."""


class AddressError(ContactFPGAError):
    """A port name that is invalid, for example because an option or a scene does not exist."""


class PortNotFound(ContactFPGAError):
    """No port, or no single one, could be chosen or opened."""


class PortBusy(ContactFPGAError):
    """The port exists but is already open, in this program or another one."""


class PortLost(ContactFPGAError):
    """The open port is gone: it was unplugged, or its other end closed it."""


class BoardClosed(ContactFPGAError):
    """A board was used after it was closed."""


class ReadTimeout(ContactFPGAError, TimeoutError):
    """The board answered, but no complete frame arrived in time."""


class NoData(ReadTimeout):
    """No frame arrived for longer than the reader allows."""

    def __init__(self, message: str, silence: Any):
        super().__init__(message)
        self.silence = silence
        """A :class:`~contactfpga.Silence`: its duration, and the last frame."""


class BoardSilent(ReadTimeout):
    """No byte arrived in time."""


class OnlyNoise(ReadTimeout):
    """Bytes arrived in time, but no valid packet."""


class NoSuchCommand(ContactFPGAError):
    """The board does not take this command."""


class ReplayEnded(ContactFPGAError, EOFError):
    """A recording holds no further frame."""


class SkinMismatch(ContactFPGAError):
    """The board was built from a different Skin than the given one or its previous one."""


class VersionMismatch(ContactFPGAError):
    """The board uses another version of the protocol."""


class MissingExtra(ContactFPGAError, ImportError):
    """A command needs an optional part of contactfpga that is not installed."""

    def __init__(self, what: str, extra: str):
        self.what, self.extra = what, extra
        """The command or function that needs the extra, and the extra; several with commas."""
        super().__init__(f"{what} needs more than is installed; install it with: {pip_install(extra)}")


def pip_install(extra: str) -> str:
    """The command that adds an extra to this Python's installation, from a wheel or from a source tree."""
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
