"""`contactfpga board`: the virtual board on a pseudo-terminal."""

from __future__ import annotations

import argparse

from contactfpga.circuit import load_checked
from contactfpga.cover import load_cover
from contactfpga.skin import Skin

HELP = "Run the virtual board on a pseudo-terminal."
EXTRA = "sim"


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the command's flags to its parser."""
    parser.add_argument("--skin", metavar="FILE", help="Skin of the board (default: the reference Skin).")
    parser.add_argument("--scene", metavar="NAME", help="What touches the sheet: a scene's name or a .npy file.")
    parser.add_argument("--link", metavar="PATH", help="Create this symbolic link to the pseudo-terminal.")


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from contactfpga_sim.board.pty_board import PtyBoard

    skin = Skin.load(args.skin) if args.skin else Skin()
    cover = load_cover(args.skin) if args.skin else None
    circuit = load_checked(args.skin, skin) if args.skin else None
    return PtyBoard(skin, args.scene, link=args.link, cover=cover, circuit=circuit).serve()
