"""`contactfpga build`: a bitstream for a board, what it takes of the FPGA, and how the sheet is wired to it."""

from __future__ import annotations

import argparse
import dataclasses
import json
from pathlib import Path
from typing import Any

from contactfpga.boards import BOARDS, find, wiring
from contactfpga.boards.spec import BoardSpec, bitstream_path
from contactfpga.design.circuit import load_checked
from contactfpga.errors import ContactFPGAError
from contactfpga.skin import Skin
from contactfpga.skin.several import Several, sheets_of
from contactfpga.tools.console import flags, numbers, outputs
from contactfpga.tools.console.wiring import Table

EXTRA = "boards"

BOARD = f"One of {', '.join(BOARDS)}, or module:attribute of your own BoardSpec."


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the command's flags to its parser."""
    parser.add_argument("board", metavar="BOARD", help=BOARD)
    flags.design(parser, "Skin to build (default: one that fits the board).")
    parser.add_argument("--output", metavar="DIR", help="Folder for the results (default: build/BOARD).")
    start = "Seed of place and route (default: 1)."
    parser.add_argument("--seed", type=numbers.whole(0, 2**31 - 1), default=1, metavar="N", help=start)
    parser.add_argument("--wiring", action="store_true", help="Only print the wiring table; build nothing.")
    parser.add_argument("--json", action="store_true", help="Print one JSON object.")


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from contactfpga_hdl.board import sites

    board = find(args.board)
    design = flags.designed(args, board.skin)
    circuit = load_checked(args.skin, design) if isinstance(design, Skin) and args.skin else None
    board.check(design)
    table = Table(board, design, circuit, sites.wire_sites(board, wiring.wires(board, design)))
    built = {} if args.wiring else _built(args, board, design)
    if args.json:
        described = {"skin": design.changed} if isinstance(design, Skin) else {"sheets": _changed(design)}
        print(json.dumps({"board": board.name, **described, **built, **table.to_dict()}))
    else:
        table.show()
    return 0


def _changed(several: Several) -> list[dict[str, Any]]:
    return [skin.changed for skin in several.skins]


def _built(args: argparse.Namespace, board: BoardSpec, skin: Skin | Several) -> dict[str, Any]:
    """Build the bitstream and print what it takes; the same for JSON."""
    from contactfpga_hdl.board import build

    folder = outputs.folder(args.output or default_folder(board))
    try:
        report = build.build(skin, board, folder, args.seed)
    except build.BitstreamFailed as error:
        raise ContactFPGAError(str(error)) from None
    bitstream = str(bitstream_path(board, folder).resolve())
    if not args.json:
        print(f"{board.title}, {_described(skin)}", *report.lines(), sep="\n")
        print(f"{'bitstream':12} {bitstream}")
    return {"bitstream": bitstream, "report": dataclasses.asdict(report)}


def _described(skin: Skin | Several) -> str:
    if isinstance(skin, Several):
        return f"sheets of {sheets_of(skin.skins)}"
    return f"{skin.rows}x{skin.columns}, report {skin.report!r}"


def default_folder(board: BoardSpec) -> Path:
    """Where the bitstream of a board is put and looked for."""
    return Path("build") / board.name
