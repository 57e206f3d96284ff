"""Commands that take every frame of a board for a while, and draw some of them."""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from contactfpga.driver.board import Board
from contactfpga.driver.health import Finding
from contactfpga.errors import ContactFPGAError, PortLost, ReadTimeout, ReplayEnded
from contactfpga.skin import Skin
from contactfpga.tools.console import interrupt, terminal
from contactfpga.zones.zone import Zones

if TYPE_CHECKING:
    from contactfpga.tools.console.live import Render


def follow(
    board: Board, args: argparse.Namespace, take: Callable[[Zones], None], render: Render | None = None
) -> tuple[float, list[Finding]]:
    """Hand every frame to ``take`` until ``args.seconds`` of device time are over (None: no limit), the recording ends,
    no frame comes any more, or Ctrl-C. Where the terminal can be redrawn it shows what ``render`` makes of fifteen
    frames per second.

    Returns the device time that was followed, in s, and what is to be said of its end and of frames that were lost.
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


def known_skin(board: Board) -> Skin | None:
    """The board's Skin; None where only its hello is known."""
    try:
        return board.skin
    except ContactFPGAError:
        return None


@contextlib.contextmanager
def shown(render: Render | None) -> Iterator[Callable[[Zones], None]]:
    if render is None or not terminal.of().live:
        yield lambda zones: None
        return
    from rich.live import Live  # which scripts do without

    from contactfpga.tools.console import live

    console = terminal.console()
    with Live(console=console, auto_refresh=False) as shown:
        pace = live.Pace()

        def show(zones: Zones) -> None:
            if pace.due(zones):
                shown.update(render(zones, live.room(console)), refresh=True)

        yield show
