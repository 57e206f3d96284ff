"""The signals that end a command."""

import os
import signal

SIGNALS = (signal.SIGINT, signal.SIGTERM)
"""Ctrl-C, and what stops services."""


def status(number: int) -> int:
    """Of a command that a signal cut short, as shells count."""
    return 128 + number


def end_at_once(number: int, _: object = None) -> None:
    """A handler where there is nothing to put in order: a command that starts, or one that is told twice."""
    os._exit(status(number))


def end_all_at_once() -> None:
    """From now on the signals do."""
    for number in SIGNALS:
        signal.signal(number, end_at_once)
