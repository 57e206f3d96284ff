"""Follows a board frame by frame, and draws some frames. Only drawing needs rich."""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import math
import sys
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from contactfpga import terminal
from contactfpga.driver.board import Board
from contactfpga.driver.events import Silence, longest_pause_s
from contactfpga.driver.health import Finding
from contactfpga.errors import PortLost, ReadTimeout, ReplayEnded
from contactfpga.tools.console import interrupt
from contactfpga.zones.zone import Zones

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

    from contactfpga.robot.haptics.live import FrameSource

REFRESH_US = 66_667

LISTED_S = 1.0

SILENT_S = 0.2
"""Excess over the board's longest pause that is displayed as silence."""


@dataclasses.dataclass(frozen=True)
class Room:
    console: Console
    width: int
    height: int | None
    """Lines; None: unlimited."""
    unicode: bool

    def without(self, lines: int) -> Room:
        return self if self.height is None else dataclasses.replace(self, height=max(1, self.height - lines))


Render = Callable[[Zones, Room], "RenderableType"]

Take = Callable[[Zones], None]
"""Receives every frame, also those not shown."""


def _ignore(zones: Zones) -> None:
    pass


def show(
    board: Board, args: argparse.Namespace, render: Render, take: Take = _ignore, frames: FrameSource | None = None
) -> int:
    """Show one frame with ``--once``, otherwise fifteen per second until Ctrl-C or the recording ends, or one per
    second without redrawing.
    """
    console = terminal.console()
    frames = frames or board
    if args.once:
        zones = frames.next(args.timeout)
        take(zones)
        console.print(render(zones, room(console, endless=True)))
        return 0
    with interrupt.usual_end():
        _display(board, args, render, take, frames, console)
    return 0


def _display(
    board: Board, args: argparse.Namespace, render: Render, take: Take, frames: FrameSource, console: Console
) -> None:
    if not terminal.of().live:
        if sys.stdout.isatty():
            what = "contactfpga: this terminal cannot be redrawn, so one frame per second is shown, and the last one"
            terminal.say(what, sys.stderr, hang=2)
        _list(board, frames, args, console, render, take)
        return
    from rich.live import Live

    with Live(console=console, auto_refresh=False) as live:
        for found in _paced(board, frames, args.timeout, take, tell_silence=True):
            shown = str(found) if isinstance(found, Silence) else render(found, room(console))
            live.update(shown, refresh=True)


def follow(
    board: Board, args: argparse.Namespace, take: Callable[[Zones], None], render: Render | None = None
) -> tuple[float, list[Finding]]:
    """Pass every frame to ``take`` for ``args.seconds`` of device time (None: no limit), until the frames end, or
    Ctrl-C; show fifteen per second by ``render`` if the terminal can redraw.

    Returns the followed device time in s, and findings about its end and lost frames.
    """
    first_us: int | None = None
    time_us = 0
    findings: list[Finding] = []
    with shown(render) as show, interrupt.usual_end(), contextlib.suppress(ReplayEnded):
        try:
            while args.seconds is None or first_us is None or time_us - first_us < args.seconds * 1e6:
                zones = board.next(args.timeout)
                if first_us is None or zones.time_us < time_us:  # the board started again
                    first_us = zones.time_us
                time_us = zones.time_us
                take(zones)
                show(zones)
        except (PortLost, ReadTimeout) as error:  # what was found is worth having all the same
            findings.append(Finding("fault", str(error)))
    lost = board.stats.lost + board.stats.dropped
    if lost:
        findings.append(Finding("note", f"{lost} frames were lost on the way; what they held is not known"))
    return 0.0 if first_us is None else (time_us - first_us) / 1e6, findings


@contextlib.contextmanager
def shown(render: Render | None) -> Iterator[Take]:
    """Context that draws the given frames by ``render``, if the terminal can redraw."""
    if render is None or not terminal.of().live:
        yield lambda zones: None
        return
    from rich.live import Live

    console = terminal.console()
    with Live(console=console, auto_refresh=False) as display:
        refresh = _Refresh()

        def show(zones: Zones) -> None:
            if refresh.due(zones):
                display.update(render(zones, room(console)), refresh=True)

        yield show


def room(console: Console, endless: bool = False) -> Room:
    """Current space for a frame; ``endless``: unlimited lines."""
    shown = terminal.of(console.file)  # not standard output, for which Live stands in
    return Room(console, shown.width, None if endless else shown.height, shown.unicode)


def _list(
    board: Board, frames: FrameSource, args: argparse.Namespace, console: Console, render: Render, take: Take
) -> None:
    waits: Zones | None = None  # the last one, while it is not shown
    due_s = -math.inf

    def shown(zones: Zones) -> None:
        console.print(render(zones, room(console, endless=True)))

    try:
        for found in _paced(board, frames, args.timeout, take):
            assert isinstance(found, Zones)
            waits = found
            if time.monotonic() >= due_s:
                due_s = time.monotonic() + LISTED_S
                shown(found)
                waits = None
    finally:
        if waits is not None:
            shown(waits)


def _paced(
    board: Board, frames: FrameSource, timeout: float, take: Take, tell_silence: bool = False
) -> Iterator[Zones | Silence]:
    """One frame every REFRESH_US of device time, and the last of a recording; with ``tell_silence``, also silences."""
    wait_s = min(timeout, SILENT_S + longest_pause_s(board.hello, None)) if tell_silence else timeout
    refresh = _Refresh()
    skipped = None
    while True:
        try:
            zones = frames.next(wait_s)
        except ReadTimeout:
            if board.silence.seconds >= timeout:
                raise
            yield board.silence
            continue
        except ReplayEnded:
            if skipped is not None:
                yield skipped  # the last frame is shown in any case
            return
        take(zones)
        if refresh.due(zones):
            skipped = None
            yield zones
        else:
            skipped = zones


class _Refresh:
    """Selects one frame every REFRESH_US of device time, and not faster in real time, as simulated boards and
    recordings would be.
    """

    def __init__(self) -> None:
        self._shown_us = -REFRESH_US
        self._due = time.monotonic()

    def due(self, zones: Zones) -> bool:
        if 0 <= zones.time_us - self._shown_us < REFRESH_US:
            return False
        self._shown_us = zones.time_us
        self._due = max(self._due + REFRESH_US / 1e6, time.monotonic() - REFRESH_US / 1e6)
        time.sleep(max(0.0, self._due - time.monotonic()))
        return True
