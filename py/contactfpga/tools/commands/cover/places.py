"""The command `contactfpga cover places`."""

from __future__ import annotations

import argparse
from pathlib import Path

from contactfpga.inputs.files import write_text
from contactfpga.tools.commands.cover.felt import sheet_and_cover
from contactfpga.tools.console import flags, numbers, outputs

EXTRA = "sim"


def add_flags(flag: flags.Flags) -> None:
    flag("[SKIN]", "TOML file of a Skin with a table [cover].")
    flags.kit(flag)
    flags.output(flag, "Write the table to this TOML file; Places.load() reads it.", default="places.toml")
    touches = "Simulated touches of each family: fingers, forearms and edges."
    flag("--touches N", touches, numbers.whole(100, 100_000), 1000)
    flag("--seed N", "Seed of the touches.", numbers.SEED, 0)


def run(args: argparse.Namespace) -> int:
    from contactfpga_sim.apps import places

    output = outputs.file(args.output)
    skin, laid = sheet_and_cover(args)
    write_text(Path(output), places.fit(skin, laid, args.touches, args.seed).toml())
    print(f"table of places: {output}")
    return 0
