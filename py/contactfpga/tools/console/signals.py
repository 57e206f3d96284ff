"""The signals that end a command."""

import os
import signal

SIGNALS = (signal.SIGINT, signal.SIGTERM)
"""Ctrl-C, and what stops services."""


def status(number: int) -> int:
    """Exit status of a command that this signal ended, as shells count it."""
    return 128 + number


def end_at_once(number: int, _: object = None) -> None:
    """Signal handler that ends the process at once: nothing is to be put in order while a command starts, or at the
    second signal."""
    os._exit(status(number))


def end_all_at_once() -> None:
    """Make :func:`end_at_once` the handler of all :data:`SIGNALS`."""
    for number in SIGNALS:
        signal.signal(number, end_at_once)
