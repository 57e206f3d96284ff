"""The end of a command on failure or interruption: at once, with its status, without useless output.

The signal TERM, which stops services, acts like Ctrl-C, with its own status.
"""

from __future__ import annotations

import _thread
import atexit
import contextlib
import errno
import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from typing import Any, NoReturn

from contactfpga import terminal
from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.files import reason_of
from contactfpga.inputs.values import shortened, visible_lines
from contactfpga.shipped import with_pages
from contactfpga.tools.console import signals
from contactfpga.tools.console.signals import SIGNALS

AGAIN_S = 0.01
"""Delay of repeating a signal that was dropped."""

_came: int | None = None
"""The signal since the command began, unless it was the normal end."""
_run: object = None
"""Identity of the running command that a signal should end; None while no command runs."""


class Interruption(KeyboardInterrupt):
    """Ctrl-C after the results were saved; the message names their place."""


def guarded(body: Callable[[], int | None]) -> int:
    """The status of ``body``; neither Ctrl-C nor a user's error ends it with a traceback.

    Shells start background processes with Ctrl-C ignored, but the same signal ends them; this function handles it
    anyway.
    """
    global _came, _run
    _came, _run = None, object()
    terminal.prepare()
    try:
        with _listening():
            return _status(body)
    except KeyboardInterrupt:  # it came while listening began or ended
        return _cut_short()
    finally:
        _run = None
        # Where the signal came while Python ran a text, as it does to make a dataclass, it would end the process by
        # SIGINT, whatever the status, unless another text is run to its end.
        exec("")


def leave(status: int) -> NoReturn:
    """End the process with a status of :func:`guarded`.

    After a signal the process skips destructors of C++ libraries, because a library interrupted while loading may crash
    in them, as matplotlib 3.10 does. Functions of :mod:`atexit` still run.
    """
    if status in map(signals.status, SIGNALS):
        atexit._run_exitfuncs()
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError):  # nobody reads it any more, or it is closed
                stream.flush()
        os._exit(status)
    sys.exit(status)


def _status(body: Callable[[], int | None]) -> int:
    try:
        status = body() or 0
        sys.stdout.flush()
        return status if _came is None else _cut_short()  # whoever kept the signal to himself
    except KeyboardInterrupt as interrupt:
        return _cut_short(str(interrupt))
    except ContactFPGAError as error:
        return failed(error)
    except BrokenPipeError:  # `contactfpga zones --json | head` closed its end, which is no error
        terminal.drop_unwritable()
        return 0
    except OSError as error:
        terminal.drop_unwritable()
        return failed(_reason_of(error))
    except Exception:
        if _came is None:
            raise
        return _cut_short()  # whatever was made of it, as by a module that it kept from being imported


def _cut_short(said: str = "") -> int:
    global _run
    _run = None
    number = signal.SIGINT if _came is None else _came
    if threading.current_thread() is threading.main_thread():
        signals.end_all_at_once()  # should it be asked twice
    if said:
        terminal.say(f"contactfpga: {said}", sys.stderr, hang=2)
    return signals.status(number)


@contextlib.contextmanager
def usual_end() -> Iterator[None]:
    """Context of code that normally runs until Ctrl-C, which is no failure."""
    global _came
    try:
        yield
    except KeyboardInterrupt:
        _came = None


def _reason_of(error: OSError) -> str:
    if error.errno == errno.ENOSPC and error.filename is None:  # of what is printed, the system names no file
        return f"there is no room where the output goes: {reason_of(error)}"
    return reason_of(error)


def failed(reason: object) -> int:
    """Print why a command failed; returns its status. Failures due to a signal are not printed."""
    if _came is not None:
        return _cut_short()
    silence_amaranth()
    # Names from files and devices are part of it.
    terminal.say(f"contactfpga: {visible_lines(shortened(with_pages(str(reason))))}", sys.stderr, hang=2)
    return 1


@contextlib.contextmanager
def _listening() -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield  # signals are the main thread's
        return
    before = {number: signal.signal(number, _interrupt) for number in SIGNALS}
    hook, sys.unraisablehook = sys.unraisablehook, _unreported
    try:
        yield
    finally:
        sys.unraisablehook = hook
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)


def _interrupt(number: int, _: object) -> None:
    global _came
    _came = number
    silence_amaranth()  # before anything is left half made
    # No object of `threading`, whose locks the interrupted code may hold.
    _thread.start_new_thread(_repeat, (number, _run))
    raise KeyboardInterrupt


def _repeat(number: int, run: object) -> None:
    """Send a signal again if the command goes on: destructors drop its exception, and so do libraries in C, as numpy
    does while it looks at a type.
    """
    time.sleep(AGAIN_S)
    while run is not None and _run is run and _came is not None:
        if not _ending():
            _send(number)  # which starts another thread like this one
            return
        time.sleep(AGAIN_S)


def _ending() -> bool:
    """Whether the main thread handles the exception of a signal, as while it cleans up."""
    handled: Any = sys._current_exceptions().get(threading.main_thread().ident or 0)
    error = handled[1] if isinstance(handled, tuple) else handled  # a tuple before Python 3.12
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__context__
    return error is not None


def _unreported(what: sys.UnraisableHookArgs) -> None:
    """Python's report of an error that cannot be raised, unless it is a signal, which is repeated."""
    if _came is None or not issubclass(what.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(what)


def _send(number: int) -> None:
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, number)
    else:  # Windows
        _thread.interrupt_main(signal.Signals(number))


def silence_amaranth() -> None:
    """Silence Amaranth's warnings about unused components."""
    unused = sys.modules.get("amaranth._unused")
    if unused is not None:
        warnings.simplefilter("ignore", unused.UnusedMustUse)
