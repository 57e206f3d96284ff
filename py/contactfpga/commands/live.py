"""A board opened from command-line arguments, and a display that follows it."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator

from rich.console import Console, RenderableType
from rich.live import Live

from contactfpga import driver
from contactfpga.driver import Board
from contactfpga.errors import ReplayEnded
from contactfpga.zone import Zones

REFRESH_US = 66_667


def connect(args: argparse.Namespace, record: str | None = None) -> Board:
    """The board that the arguments of a command name."""
    return driver.open(args.port, args.skin, baud=args.baud, record=record, timeout=args.timeout)


def show(board: Board, args: argparse.Namespace, render: Callable[[Zones], RenderableType]) -> int:
    """Show one frame with ``--once``, else fifteen a second until interrupted or the recording ends."""
    if args.once:
        Console().print(render(board.next(args.timeout)))
        return 0
    with Live(auto_refresh=False) as live:
        for zones in _paced(board, args.timeout):
            live.update(render(zones), refresh=True)
    return 0


def _paced(board: Board, timeout: float) -> Iterator[Zones]:
    """One frame every REFRESH_US of device time, not faster than that in real time.

    A board on a port keeps that pace by itself; the simulated one and a recording would run ahead.
    """
    shown_us = -REFRESH_US
    due = time.monotonic()
    skipped = None
    while True:
        try:
            zones = board.next(timeout)
        except ReplayEnded:
            if skipped is not None:
                yield skipped  # the last frame is shown in any case
            return
        if 0 <= zones.time_us - shown_us < REFRESH_US:
            skipped = zones
            continue
        skipped = None
        shown_us = zones.time_us
        due = max(due + REFRESH_US / 1e6, time.monotonic() - REFRESH_US / 1e6)
        time.sleep(max(0.0, due - time.monotonic()))
        yield zones
