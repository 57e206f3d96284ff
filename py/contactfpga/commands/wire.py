"""`contactfpga wire`: the pressed cells, live, to see that every switch sits where it should."""

from __future__ import annotations

import argparse

from contactfpga.console import flags
from contactfpga.errors import ContactFPGAError

HELP = "Show the pressed cells live, to check the wiring."
EXTRA = None


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the command's flags to its parser."""
    flags.connection(parser)
    flags.once(parser)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from contactfpga.console import live, views

    with flags.opened(args) as board:
        if board.sheet.report != "cells":
            raise ContactFPGAError(
                f"{board.port} sends zones, not cells; build a bitstream from the same Skin with "
                'report = "cells" for wiring, or see the zones with `contactfpga zones`'
            )
        return live.show(board, args, lambda zones, room: views.cells_view(board, zones, room))
