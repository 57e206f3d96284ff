"""The view: a source, a stage, a panel, and the loop between them."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from contactfpga.tools.view.fingers import Hand
from contactfpga.tools.view.panel import Panel
from contactfpga.tools.view.sources import Moment, Source
from contactfpga.tools.view.stage import Stage
from contactfpga.tools.view.tiles import Tiles

if TYPE_CHECKING:
    import viser

PANEL_S = 0.25
"""How often the panel is written."""


class View:
    """Shows a source in a server's page."""

    def __init__(self, server: viser.ViserServer, source: Source, hand: Hand | None = None):
        self._source = source
        self.stage = Stage(server, Tiles(source.sheet), source.cells)
        self.panel = Panel(server, source, hand)
        self._told_s = 0.0
        self._moment: Moment | None = None
        self.drawn = 0
        """Moments drawn."""
        self.stage.look()
        if hand is not None:
            self.stage.press_with(hand)

    def turn(self) -> None:
        """Wait for a moment and draw it."""
        moment = self._source.turn()
        if moment is not None:
            self._moment = moment
            self.stage.draw(moment)
            self.drawn += 1
        if (now := time.monotonic()) - self._told_s > PANEL_S:
            self._told_s = now
            self.panel.write(self._moment)
