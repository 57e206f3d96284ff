"""The signals that end a command."""

import os
import signal

SIGNALS = (signal.SIGINT, signal.SIGTERM)
"""Ctrl-C, and the signal that stops services."""


def status(number: int) -> int:
    """Exit status of a command ended by this signal, as in shells."""
    return 128 + number


def end_at_once(number: int, _: object = None) -> None:
    """Signal handler that ends the process at once, for a starting command and for a second signal."""
    os._exit(status(number))


def end_all_at_once() -> None:
    for number in SIGNALS:
        signal.signal(number, end_at_once)
