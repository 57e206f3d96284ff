"""`contactfpga wire`: the pressed cells, live, to see that every switch sits where it should."""

from __future__ import annotations

import argparse

from rich.console import Group, RenderableType
from rich.text import Text

from contactfpga.commands import live
from contactfpga.commands.sheet import draw
from contactfpga.commands.zones import mask, status
from contactfpga.driver import Board
from contactfpga.errors import ContactFPGAError
from contactfpga.zone import Zones


def main(args: argparse.Namespace) -> int:
    """Run the command."""
    with live.connect(args) as board:
        if board.sheet.report != "cells":
            raise ContactFPGAError(
                f"{board.port} sends zones, not cells; build a bitstream from the same Skin with "
                'report = "cells" for wiring, or see the zones with `contactfpga zones`'
            )
        return live.show(board, args, lambda zones: _render(board, zones))


def _render(board: Board, zones: Zones) -> RenderableType:
    assert zones.cells is not None
    pressed = [f"({row}, {column})" for row, column in zip(*zones.cells.nonzero())]
    shown = ", ".join(pressed[:12]) + (f" and {len(pressed) - 12} more" if len(pressed) > 12 else "")
    return Group(
        Text(draw(zones, mask(board))), Text(f"pressed (row, column): {shown or 'none'}"), Text(status(board, zones))
    )
