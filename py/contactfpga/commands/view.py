"""`contactfpga view`: the sheet in the browser, live or from a recording."""

from __future__ import annotations

import argparse

from contactfpga.console import flags, terminal

HELP = "Show the sheet in the browser, live or from a recording."
EXTRA = "view"


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the command's flags to its parser."""
    flags.connection(parser)
    parser.add_argument("--host", default="127.0.0.1", help="Address to listen on (default: 127.0.0.1).")
    parser.add_argument("--http-port", type=int, metavar="N", help="Port to listen on.")


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from contactfpga.view import opening

    with opening.opened(args.port, args.skin, args.host, args.http_port, args.baud, args.timeout) as shown:
        terminal.say(f"Open {shown.url}")
        terminal.say("Ctrl-C ends it.")
        while True:
            shown.view.turn()
    return 0
