"""`contactfpga flash`: hands a bitstream to the board's usual programmer."""

from __future__ import annotations

import argparse
import shutil
import subprocess
from pathlib import Path

from contactfpga.boards import find
from contactfpga.boards.spec import bitstream_path
from contactfpga.errors import ContactFPGAError, MissingTool
from contactfpga.tools.commands.build import BOARD, default_folder

EXTRA = None


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the command's flags to its parser."""
    parser.add_argument("board", metavar="BOARD", help=BOARD)
    parser.add_argument("file", nargs="?", metavar="FILE", help="Bitstream (default: the one in build/BOARD).")


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    board = find(args.board)
    file = Path(args.file) if args.file else bitstream_path(board, default_folder(board))
    if not file.is_file():
        raise ContactFPGAError(f"there is no file {file}; build it with: contactfpga build {args.board}")
    programmer = board.programmer
    tool = shutil.which(programmer.tool)
    if tool is None:
        raise MissingTool(f"writing a bitstream to {board.title}", programmer.tool, programmer.install)
    status = subprocess.run([tool, *programmer.options, str(file)]).returncode
    if status:
        raise ContactFPGAError(
            f"{programmer.tool} ended with status {status}; is {board.title} plugged in, may you write to its USB "
            "device, and is no program using its serial port?"
        )
    return 0
