"""The command `contactfpga flash`."""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

from contactfpga import terminal
from contactfpga.boards.spec import BoardSpec, Programmer, bitstream_path
from contactfpga.design import kits
from contactfpga.errors import ContactFPGAError, MissingTool
from contactfpga.tools.commands.build import BOARD, default_folder
from contactfpga.tools.console import flags

EXTRA = "boards"


def add_flags(flag: flags.Flags) -> None:
    flag("[BOARD]", f"{BOARD} With --kit it is the kit's.")
    flag("[FILE]", "Bitstream (default: the one in build/BOARD; of a kit, that of the release, or one is built).")
    flags.kit(flag)


def run(args: argparse.Namespace) -> int:
    board = flags.named_board(args)
    file = _file(args, board)
    programmer = board.programmer
    tool = _tool(programmer)
    if tool is None:
        raise MissingTool(f"writing a bitstream to {board.title}", programmer.tool, programmer.install)
    if not file.is_file():
        _build(kits.kit(args.kit), file.parent)
    status = subprocess.run([tool, *programmer.options, str(file)]).returncode
    if status:
        raise ContactFPGAError(
            f"{programmer.tool} ended with status {status}; is {board.title} plugged in, may you write to its USB "
            "device, and is no program using its serial port?"
        )
    return 0


def _file(args: argparse.Namespace, board: BoardSpec) -> Path:
    if args.kit and not args.file:
        released = kits.kit(args.kit).bitstream
        return released if released.is_file() else bitstream_path(board, default_folder(board, args.kit))
    file = Path(args.file) if args.file else bitstream_path(board, default_folder(board, None))
    if not file.is_file():
        raise ContactFPGAError(f"there is no file {file}; build it with: contactfpga build {board.name}")
    return file


def _build(kit: kits.Kit, folder: Path) -> None:
    from contactfpga_hdl.board import build

    terminal.say(f"this copy of contactfpga brings no bitstream; building one in {folder}, about a minute", sys.stderr)
    try:
        build.build(kit.skin, kit.board, folder)
    except build.BitstreamFailed as error:
        raise ContactFPGAError(str(error)) from None


def _tool(programmer: Programmer) -> str | None:
    """Path of the program, or of its wheel's command if that starts; otherwise None."""
    if (found := shutil.which(programmer.tool)) is not None or not programmer.wheel:
        return found
    beside = shutil.which(programmer.wheel) or shutil.which(programmer.wheel, path=str(Path(sys.executable).parent))
    return beside if beside and _starts(beside) else None


def _starts(tool: str) -> bool:
    return subprocess.run([tool, "--Version"], capture_output=True).returncode == 0
