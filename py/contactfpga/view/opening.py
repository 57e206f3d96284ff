"""From what the user names to a view of it."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from contactfpga.driver import driver, transport
from contactfpga.skin import Skin
from contactfpga.view import server
from contactfpga.view.app import View
from contactfpga.view.fingers import Hand
from contactfpga.view.guard import Guard
from contactfpga.view.player import Player
from contactfpga.view.replayed import is_recording, load
from contactfpga.view.sources import BoardSource, Source

if TYPE_CHECKING:
    import viser

CLOCK_HZ = 6_000_000
"""Of the virtual board that is shown where nothing is named: half the usual clock, which keeps up with real time."""

FINGER = 0.9
"""Radius of the mouse's finger, of the pitch."""


@dataclasses.dataclass(frozen=True)
class Shown:
    """A view that is being served."""

    web: viser.ViserServer
    guard: Guard
    view: View
    source: Source
    hand: Hand | None
    """The mouse's, on a virtual board."""
    url: str
    """With the token: whoever has it can read and press."""


@contextlib.contextmanager
def opened(
    port: str | None = None,
    skin: str | Path | None = None,
    host: str = server.LOCAL,
    http_port: int | None = None,
    baud: int | None = None,
    timeout: float = 1.0,
    link: str | None = None,
) -> Iterator[Shown]:
    """Open what is named, a virtual board by default, and serve a view of it; raises what :func:`contactfpga.open`
    does."""
    source, hand = _source(port, skin, baud, timeout, link)
    try:
        web, guard = server.serve(host, http_port)
        try:
            yield Shown(web, guard, View(web, source, hand), source, hand, guard.url(web.get_port()))
        finally:
            server.stop(web)
    finally:
        source.close()


def _source(
    port: str | None, skin: str | Path | None, baud: int | None, timeout: float, link: str | None
) -> tuple[Source, Hand | None]:
    if port is not None and is_recording(port):
        return Player(load(port, link, timeout)), None
    if port is not None and not port.startswith("sim:"):
        return BoardSource(driver.open(port, skin, baud=baud, timeout=timeout), port), None
    if port is None:
        asked = Skin.load(skin) if skin is not None else Skin(clock_hz=CLOCK_HZ, send="on_change")
        virtual: Any = transport.virtual_board("sim://?scene=nothing", asked)
    else:
        virtual = transport.virtual_board(port)
    board = driver.open(virtual, skin, timeout=timeout)
    sheet = board.sheet
    name = port or "sim://"
    return BoardSource(board, name, virtual), Hand(virtual, FINGER * max(sheet.pitch_x_mm, sheet.pitch_y_mm))
