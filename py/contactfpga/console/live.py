"""A display that follows a board."""

from __future__ import annotations

import argparse
import dataclasses
import sys
import time
from collections.abc import Callable, Iterator

from rich.console import Console, RenderableType
from rich.live import Live

from contactfpga.console import terminal
from contactfpga.driver.board import Board
from contactfpga.errors import ReplayEnded
from contactfpga.zones.zone import Zones

REFRESH_US = 66_667


@dataclasses.dataclass(frozen=True)
class Room:
    """What there is for a frame."""

    console: Console
    width: int
    height: int | None
    """Lines; None where there is no end of them."""
    unicode: bool

    def without(self, lines: int) -> Room:
        """The room that is left when this many lines are taken."""
        return self if self.height is None else dataclasses.replace(self, height=max(1, self.height - lines))


Render = Callable[[Zones, Room], RenderableType]

Take = Callable[[Zones], None]
"""Gets every frame, also those that are not shown."""


def _ignore(zones: Zones) -> None:
    pass


def show(board: Board, args: argparse.Namespace, render: Render, take: Take = _ignore) -> int:
    """Show one frame with ``--once``, otherwise fifteen per second until interrupted or the recording ends."""
    console = terminal.console()
    if args.once:
        zones = board.next(args.timeout)
        take(zones)
        console.print(render(zones, _room(console, endless=True)))
        return 0
    if not terminal.of().live:
        if sys.stdout.isatty():
            what = "contactfpga: this terminal cannot be redrawn, so only the last frame is shown, at the end"
            terminal.say(what, sys.stderr, hang=2)
        return _last(board, args, console, render, take)
    with Live(console=console, auto_refresh=False) as live:
        for zones in _paced(board, args.timeout, take):
            live.update(render(zones, _room(console)), refresh=True)
    return 0


def _room(console: Console, endless: bool = False) -> Room:
    shown = terminal.of()
    return Room(console, shown.width, None if endless else shown.height, shown.unicode)


def _last(board: Board, args: argparse.Namespace, console: Console, render: Render, take: Take) -> int:
    """Show the last frame, be it that of a recording or the one at which Ctrl-C comes."""
    zones = None
    try:
        for zones in _paced(board, args.timeout, take):  # noqa: B007
            pass
    finally:
        if zones is not None:
            console.print(render(zones, _room(console, endless=True)))
    return 0


def _paced(board: Board, timeout: float, take: Take) -> Iterator[Zones]:
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
        take(zones)
        if 0 <= zones.time_us - shown_us < REFRESH_US:
            skipped = zones
            continue
        skipped = None
        shown_us = zones.time_us
        due = max(due + REFRESH_US / 1e6, time.monotonic() - REFRESH_US / 1e6)
        time.sleep(max(0.0, due - time.monotonic()))
        yield zones
