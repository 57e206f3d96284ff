"""`contactfpga build`: a bitstream for a board, and what it takes of the FPGA."""

from __future__ import annotations

import argparse
from pathlib import Path

from contactfpga.console import outputs
from contactfpga.errors import ContactFPGAError
from contactfpga.skin import Skin


def main(args: argparse.Namespace) -> int:
    """Run the command."""
    from contactfpga_hdl.board import boards, build

    board = boards.find(args.board)
    skin = Skin.load(args.skin) if args.skin else board.skin
    folder = outputs.folder(args.output or default_folder(args.board))
    try:
        report = build.build(skin, board, folder, args.seed)
    except build.BitstreamFailed as error:
        raise ContactFPGAError(str(error)) from None
    print(f"{board.title}, {skin.rows}x{skin.columns}, report {skin.report!r}", *report.lines(), sep="\n")
    print(f"{'bitstream':12} {boards.bitstream_path(board, folder).resolve()}")
    return 0


def default_folder(board: str) -> Path:
    """Where the bitstream of a board is put and looked for."""
    return Path("build") / board
