"""The command `contactfpga board`."""

from __future__ import annotations

import argparse

from contactfpga.design.circuit import load_checked
from contactfpga.design.cover import load_cover
from contactfpga.skin import Skin
from contactfpga.tools.console import flags

EXTRA = "sim"


def add_flags(flag: flags.Flags) -> None:
    flags.design(flag, "Skin of the board (default: the reference Skin).")
    flag("--scene NAME", "What touches the sheet: a scene's name or a .npy file (default: nothing).")
    flag("--symlink PATH", "Create this symbolic link to the pseudo-terminal.")


def run(args: argparse.Namespace) -> int:
    from contactfpga_sim.model.board.pty_board import PtyBoard

    design = flags.designed(args, Skin())
    cover, circuit = None, None
    if args.skin and isinstance(design, Skin):
        cover, circuit = load_cover(args.skin), load_checked(args.skin, design)
    return PtyBoard(design, args.scene, link=args.symlink, cover=cover, circuit=circuit).serve()
