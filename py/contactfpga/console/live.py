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


def show(board: Board, args: argparse.Namespace, render: Render) -> int:
    """Show one frame with ``--once``, otherwise fifteen per second until interrupted or the recording ends."""
    console = terminal.console()
    if args.once:
        console.print(render(board.next(args.timeout), room(console, endless=True)))
        return 0
    if not terminal.of().live:
        if sys.stdout.isatty():
            what = "contactfpga: this terminal cannot be redrawn, so only the last frame is shown, at the end"
            terminal.say(what, sys.stderr, hang=2)
        return _last(board, args, console, render)
    with Live(console=console, auto_refresh=False) as live:
        for zones in _paced(board, args.timeout):
            live.update(render(zones, room(console)), refresh=True)
    return 0


def room(console: Console, endless: bool = False) -> Room:
    """What there is for a frame now; ``endless``: as many lines as it takes."""
    shown = terminal.of()
    return Room(console, shown.width, None if endless else shown.height, shown.unicode)


def _last(board: Board, args: argparse.Namespace, console: Console, render: Render) -> int:
    """Show the last frame, be it that of a recording or the one at which Ctrl-C comes."""
    zones = None
    try:
        for zones in _paced(board, args.timeout):  # noqa: B007
            pass
    finally:
        if zones is not None:
            console.print(render(zones, room(console, endless=True)))
    return 0


def _paced(board: Board, timeout: float) -> Iterator[Zones]:
    """One frame every REFRESH_US of device time, and the last one of a recording in any case."""
    pace = Pace()
    skipped = None
    while True:
        try:
            zones = board.next(timeout)
        except ReplayEnded:
            if skipped is not None:
                yield skipped
            return
        if pace.due(zones):
            skipped = None
            yield zones
        else:
            skipped = zones


class Pace:
    """Of frames that are shown: one every REFRESH_US of device time, not faster than that in real time.

    A board on a port keeps that pace by itself; the simulated one and a recording would run ahead.
    """

    def __init__(self) -> None:
        self._shown_us = -REFRESH_US
        self._due = time.monotonic()

    def due(self, zones: Zones) -> bool:
        """Whether to show this frame; if so, waits until it is time to."""
        if 0 <= zones.time_us - self._shown_us < REFRESH_US:
            return False
        self._shown_us = zones.time_us
        self._due = max(self._due + REFRESH_US / 1e6, time.monotonic() - REFRESH_US / 1e6)
        time.sleep(max(0.0, self._due - time.monotonic()))
        return True
