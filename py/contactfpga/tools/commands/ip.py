"""The command `contactfpga ip`."""

from __future__ import annotations

import argparse

from contactfpga import terminal
from contactfpga.skin import Skin
from contactfpga.tools.console import flags, outputs

EXTRA = "sim"


def add_flags(flag: flags.Flags) -> None:
    flags.sheet(flag, "Skin of the core (default: the reference Skin).")
    text = "Module, and beginning of the names of all other modules (default: %(default)s)."
    flag("--name NAME", text, default="contactfpga_core")
    flags.output_folder(flag, "build/ip")


def run(args: argparse.Namespace) -> int:
    from contactfpga_sim.verify import ip

    file = flags.sheet_file(args)
    for path in ip.write(Skin.load(file) if file else Skin(), outputs.folder(args.output), args.name):
        terminal.say(str(path))
    return 0
