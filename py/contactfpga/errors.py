"""Everything this package raises on purpose. Each message names what was met and the next step."""

from __future__ import annotations

import os
import shlex
import sys
from typing import Any

UNSOLVED = 3
"""Exit status of a command whose answer is that there is no solution."""


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
    """A port's name that names no port, such as one with an option or a scene that does not exist."""


class PortNotFound(ContactFPGAError):
    """No port, or no single one, could be chosen or opened."""


class PortBusy(ContactFPGAError):
    """The port is there, and open in this program or another one."""


class PortLost(ContactFPGAError):
    """The port was there and is gone: unplugged, or its other end closed it."""


class BoardClosed(ContactFPGAError):
    """A board was used after it was closed."""


class ReadTimeout(ContactFPGAError, TimeoutError):
    """The board answered, but no complete frame came in time."""


class NoData(ReadTimeout):
    """No frame came for longer than the reader allows; ``silence`` says how long, and what came last."""

    def __init__(self, message: str, silence: Any):
        super().__init__(message)
        self.silence = silence
        """A :class:`~contactfpga.Silence`."""


class BoardSilent(ReadTimeout):
    """Not one byte came in time."""


class OnlyNoise(ReadTimeout):
    """Bytes came, and not one valid packet among them."""


class NoSuchCommand(ContactFPGAError):
    """The board does not take this command."""


class ReplayEnded(ContactFPGAError, EOFError):
    """A recording holds no further frame."""


class SkinMismatch(ContactFPGAError):
    """The board was built from another Skin than the one given or the one it had before."""


class VersionMismatch(ContactFPGAError):
    """The board speaks another version of the protocol."""


class MissingExtra(ContactFPGAError, ImportError):
    """A command needs a part of contactfpga that is not installed."""

    def __init__(self, what: str, extra: str):
        self.what = what
        """What needs it."""
        super().__init__(f"{what} needs more than is installed; install it with: {pip_install(extra)}")


def pip_install(extra: str) -> str:
    """The command that adds an extra to what is installed for this Python, from a wheel or from a source tree."""
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
