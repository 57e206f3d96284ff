"""The command `contactfpga wire`."""

from __future__ import annotations

import argparse

from contactfpga.driver.board import Board
from contactfpga.errors import ContactFPGAError
from contactfpga.tools.commands.wire import bounce, rest, settle
from contactfpga.tools.console import flags, live, numbers

EXTRA = None
_MEASUREMENTS = {"bounce": bounce, "settle": settle, "rest": rest}


def add_flags(flag: flags.Flags) -> None:
    flags.connection(flag)
    flags.once(flag)
    bounces = 'Measure how long each switch bounces, and propose a debounce; needs debounce = "none" and --skin.'
    flag("--bounce", bounces)
    settles = "Measure how many clocks each switch takes to read pressed, and propose settle_us; needs the same."
    flag("--settle", settles)
    rests = "Measure the level at which each resistive cell reads pressed without a touch, and the lightest that holds."
    flag("--rest", rests)
    flag("--seconds S", "Seconds of device time to measure for (default: until Ctrl-C).", numbers.SECONDS)
    flags.json(flag, "Print one JSON object with what was measured.")


def run(args: argparse.Namespace) -> int:
    asked = [f"--{name}" for name in _MEASUREMENTS if getattr(args, name)]
    if len(asked) > 1:
        raise ContactFPGAError(f"{asked[0]} and {asked[1]} are two measurements; make one after the other")
    if asked:
        return _measure(args)
    for name in ("seconds", "json"):
        if getattr(args, name):
            raise ContactFPGAError(f"--{name} needs a measurement; add --bounce, --settle or --rest")
    return _show(args)


def _measure(args: argparse.Namespace) -> int:
    if args.once:
        what = "bounce" if args.bounce else "settle time" if args.settle else "rest level"
        raise ContactFPGAError(f"--once shows one frame, which tells of no {what}; leave it out")
    with flags.opened(args) as board:
        _check_cells(board)
        ended: int = next(one for name, one in _MEASUREMENTS.items() if getattr(args, name)).measure(board, args)
        return ended


def _show(args: argparse.Namespace) -> int:
    from contactfpga.tools.console import views  # rich, which scripts do without

    with flags.opened(args) as board:
        _check_cells(board)
        return live.show(board, args, lambda zones, room: views.cells_view(board, zones, room))


def _check_cells(board: Board) -> None:
    if board.sheet.report != "cells":
        raise ContactFPGAError(
            f"{board.port} sends zones, not cells; build a bitstream from the same Skin with "
            'report = "cells" for wiring, or see the zones with `contactfpga zones`'
        )
