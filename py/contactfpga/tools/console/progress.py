"""Progress of reading a long file, on standard error."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator

from contactfpga import terminal

SOON_S = 1.0
"""What takes no longer says nothing."""
LIVE_S, LINES_S = 0.2, 10.0
"""How often it is said: on a terminal that can be rewritten, and in lines."""


@contextlib.contextmanager
def reading(name: str) -> Iterator[Callable[[int, int], None]]:
    """To be called now and then with the bytes that have been read of a file, and those in it."""
    live = terminal.of(sys.stderr).live
    due_s, said = time.monotonic() + SOON_S, False

    def tell(done: int, of: int) -> None:
        nonlocal due_s, said
        if time.monotonic() < due_s:
            return
        due_s, said = time.monotonic() + (LIVE_S if live else LINES_S), True
        line = f"Reading {name}: {done / 1e6:,.0f} of {of / 1e6:,.0f} MB"
        print(f"\r{line}" if live else line, end="\033[K" if live else "\n", file=sys.stderr, flush=True)

    try:
        yield tell
    finally:
        if said and live:
            print("\r", end="\033[K", file=sys.stderr, flush=True)
