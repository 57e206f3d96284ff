"""`contactfpga recover`: what is whole of a recording that was not closed."""

from __future__ import annotations

import argparse

from contactfpga.tools.console import terminal

EXTRA = "record"


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the command's flags to its parser."""
    parser.add_argument("file", metavar="FILE.mcap", help="The recording; it is not changed.")
    into = "The new file (default: FILE_recovered.mcap)."
    parser.add_argument("into", metavar="INTO.mcap", nargs="?", help=into)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from contactfpga.tools.recordings.recover import recover

    found = recover(args.file, args.into)
    terminal.say(f"{found.path}: {found.messages:,} messages of {found.seconds:.1f} s")
    if found.recordings > 1:
        terminal.say(
            f"{args.file} holds {found.recordings} recordings, one after the other; the new file has them all."
        )
    elif found.closed and not found.damaged and not found.beyond:
        terminal.say(f"Nothing is missing: {args.file} was closed and whole, so you can use it as it is.")
    if found.cut:
        terminal.say(f"Left out at the end: {found.cut:,} bytes of a piece that is not whole.")
    if found.damaged:
        terminal.say(f"Left out in between: {_pieces(found.damaged)}; frames are missing there.")
    if found.beyond:
        terminal.say(f"Left out after the end: {found.beyond:,} bytes that are no recording.")
    return 0


def _pieces(count: int) -> str:
    return "1 damaged piece" if count == 1 else f"{count} damaged pieces"
