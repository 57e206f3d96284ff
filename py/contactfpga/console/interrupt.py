"""How a command ends that fails or is interrupted: at once, with its status, and without a word that is no use."""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator

from contactfpga.console import terminal
from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.files import told
from contactfpga.inputs.values import visible_lines

STATUS = 130
"""Of a command that Ctrl-C ended: 128 and the number of the signal."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C, once what was found so far is in safety; says where that is."""


def guarded(body: Callable[[], int | None]) -> int:
    """The status of ``body``; neither Ctrl-C nor what a user can mend ends it with a traceback.

    A shell starts what runs in its background with Ctrl-C ignored, and so does everything below it. A command is
    ended by the same signal, so it listens all the same.
    """
    terminal.prepare()
    with _listening():
        try:
            return body() or 0
        except KeyboardInterrupt as interrupt:
            if str(interrupt):
                terminal.say(f"contactfpga: {interrupt}", sys.stderr, hang=2)
            return STATUS
        except ContactFPGAError as error:
            return failed(error)
        except OSError as error:
            return failed(told(error))


def failed(reason: object) -> int:
    """Say why a command failed; its status."""
    silence_amaranth()
    # Names from files and devices are part of it.
    terminal.say(f"contactfpga: {visible_lines(str(reason))}", sys.stderr, hang=2)
    return 1


@contextlib.contextmanager
def _listening() -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield  # signals are the main thread's
        return
    before = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, _interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)


def _interrupt(*_: object) -> None:
    silence_amaranth()  # before anything is left half made
    raise KeyboardInterrupt


def silence_amaranth() -> None:
    """Not a word from Amaranth about components that were made and never used: the reason is known."""
    unused = sys.modules.get("amaranth._unused")
    if unused is not None:
        warnings.simplefilter("ignore", unused.UnusedMustUse)
