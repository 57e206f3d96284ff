"""`contactfpga wire`: the pressed cells, live, to see that every switch sits where it should."""

from __future__ import annotations

import argparse

from rich.console import Group, RenderableType
from rich.text import Text

from contactfpga.commands import live
from contactfpga.commands.live import Room
from contactfpga.commands.zones import LEGEND_LINES, mask, status, styled
from contactfpga.console import drawn_sheet, terminal
from contactfpga.driver.driver import Board
from contactfpga.errors import ContactFPGAError
from contactfpga.zones.zone import Zones

NAMED = 12
"""Pressed cells whose places are written out."""


def main(args: argparse.Namespace) -> int:
    """Run the command."""
    with live.connect(args) as board:
        if board.sheet.report != "cells":
            raise ContactFPGAError(
                f"{board.port} sends zones, not cells; build a bitstream from the same Skin with "
                'report = "cells" for wiring, or see the zones with `contactfpga zones`'
            )
        return live.show(board, args, lambda zones, room: _render(board, zones, room))


def _render(board: Board, zones: Zones, room: Room) -> RenderableType:
    assert zones.cells is not None
    places = [f"({row}, {column})" for row, column in zip(*zones.cells.nonzero())]
    named = [*places[:NAMED], *([f"and {len(places) - NAMED} more"] if len(places) > NAMED else [])]
    pressed = terminal.listed("pressed (row, column): ", named or ["none"], room.width)
    below = f"{pressed}\n{status(board, zones, room.width)}"
    left = room.without(below.count("\n") + 1 + LEGEND_LINES)
    drawing = drawn_sheet.draw(zones, drawn_sheet.scales(zones, left.width, left.height)[0], room.unicode, mask(board))
    return Group(styled(drawing), Text(terminal.wrapped(drawing.legend, room.width)), Text(below))
