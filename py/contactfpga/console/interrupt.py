"""How a command ends that fails or is interrupted: at once, with its status, and without a word that is no use.

The signal TERM, which stops services, does what Ctrl-C does.
"""

from __future__ import annotations

import contextlib
import errno
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator

from contactfpga.console import terminal
from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.files import told
from contactfpga.inputs.values import shortened, visible_lines

STATUS = 130
"""Of a command that Ctrl-C cut short: 128 and the number of the signal."""


SIGNALS = (signal.SIGINT, signal.SIGTERM)


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
            status = body() or 0
            sys.stdout.flush()
            return status
        except KeyboardInterrupt as interrupt:
            if str(interrupt):
                terminal.say(f"contactfpga: {interrupt}", sys.stderr, hang=2)
            return STATUS
        except ContactFPGAError as error:
            return failed(error)
        except BrokenPipeError:  # `contactfpga zones --json | head` closed its end, which is no error
            terminal.drop_unwritable()
            return 0
        except OSError as error:
            terminal.drop_unwritable()
            return failed(_told(error))


@contextlib.contextmanager
def usual_end() -> Iterator[None]:
    """Around what runs until Ctrl-C: that is no failure."""
    with contextlib.suppress(KeyboardInterrupt):
        yield


def _told(error: OSError) -> str:
    if error.errno == errno.ENOSPC and error.filename is None:  # of what is printed, the system names no file
        return f"there is no room where the output goes: {told(error)}"
    return told(error)


def failed(reason: object) -> int:
    """Say why a command failed; its status."""
    silence_amaranth()
    # Names from files and devices are part of it.
    terminal.say(f"contactfpga: {visible_lines(shortened(str(reason)))}", sys.stderr, hang=2)
    return 1


@contextlib.contextmanager
def _listening() -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield  # signals are the main thread's
        return
    before = {number: signal.signal(number, _interrupt) for number in SIGNALS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)


def _interrupt(*_: object) -> None:
    silence_amaranth()  # before anything is left half made
    raise KeyboardInterrupt


def silence_amaranth() -> None:
    """Not a word from Amaranth about components that were made and never used: the reason is known."""
    unused = sys.modules.get("amaranth._unused")
    if unused is not None:
        warnings.simplefilter("ignore", unused.UnusedMustUse)
