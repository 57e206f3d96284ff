"""`contactfpga build`: a bitstream for a board, and what it takes of the FPGA."""

from __future__ import annotations

import argparse
from pathlib import Path

from contactfpga.boards import BOARDS, find
from contactfpga.boards.spec import BoardSpec, bitstream_path
from contactfpga.circuit import load_checked
from contactfpga.console import numbers, outputs
from contactfpga.errors import ContactFPGAError
from contactfpga.skin import Skin

HELP = "Build a bitstream for a board."
EXTRA = "boards"

BOARD = f"One of {', '.join(BOARDS)}, or module:attribute of your own BoardSpec."


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the command's flags to its parser."""
    parser.add_argument("board", metavar="BOARD", help=BOARD)
    parser.add_argument("--skin", metavar="FILE", help="Skin to build (default: one that fits the board).")
    parser.add_argument("--output", metavar="DIR", help="Folder for the results (default: build/BOARD).")
    start = "Seed of place and route (default: 1)."
    parser.add_argument("--seed", type=numbers.whole(0, 2**31 - 1), default=1, metavar="N", help=start)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from contactfpga_hdl.board import build

    board = find(args.board)
    skin = Skin.load(args.skin) if args.skin else board.skin
    if args.skin:
        load_checked(args.skin, skin)
    folder = outputs.folder(args.output or default_folder(board))
    try:
        report = build.build(skin, board, folder, args.seed)
    except build.BitstreamFailed as error:
        raise ContactFPGAError(str(error)) from None
    print(f"{board.title}, {skin.rows}x{skin.columns}, report {skin.report!r}", *report.lines(), sep="\n")
    print(f"{'bitstream':12} {bitstream_path(board, folder).resolve()}")
    return 0


def default_folder(board: BoardSpec) -> Path:
    """Where the bitstream of a board is put and looked for."""
    return Path("build") / board.name
