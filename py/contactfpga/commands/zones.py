"""`contactfpga zones`: the contact zones, live, as a table beside the drawn sheet, or as JSON."""

from __future__ import annotations

import argparse
import json

from contactfpga.console import flags

HELP = "Show the contact zones live."
EXTRA = None


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the command's flags to its parser."""
    flags.connection(parser)
    flags.once(parser)
    parser.add_argument("--json", action="store_true", help="Print every frame as a line with one JSON object.")
    record = "Write every byte received to this file; replay://FILE plays it back."
    parser.add_argument("--record", metavar="FILE", help=record)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    if args.json:
        return _json(args)
    from contactfpga.console import live, views  # rich, which scripts do without

    with flags.opened(args, args.record) as board:
        return live.show(board, args, lambda zones, room: views.zones_view(board, zones, room))


def _json(args: argparse.Namespace) -> int:
    with flags.opened(args, args.record) as board:
        for zones in board:
            print(json.dumps(zones.to_dict()), flush=True)
            if args.once:
                break
    return 0
