"""The command `contactfpga haptics wrench`."""

from __future__ import annotations

import argparse

from contactfpga import terminal
from contactfpga.robot.haptics import LoadCells, Wrench
from contactfpga.tools.commands.haptics import reading
from contactfpga.tools.console import flags, results

EXTRA = "haptics"


def add_flags(flag: flags.Flags) -> None:
    flag("FILE.json", "Units and readings; docs/haptics.md has the format.")
    flags.json(flag, flags.SI)


def run(args: argparse.Namespace) -> int:
    cells, readings = reading.units(args.file)
    wrench = cells.wrench(readings)
    answer = {
        "force_n": wrench.force_n,
        "moment_nm": wrench.moment_nm,
        "covariance": cells.noise.covariance,
        "rank": cells.rank,
        "singular_values": cells.singular_values,
    }
    results.show(args, answer, lambda: _show(cells, wrench))
    return 0


def _show(cells: LoadCells, wrench: Wrench) -> None:
    for name, three, unit in (("force", wrench.force_n, "N"), ("moment", wrench.moment_nm, "Nm")):
        terminal.say(f"{name}: ({', '.join(f'{one:.5g}' for one in three)}) {unit}")
    values = ", ".join(f"{one:.5g}" for one in cells.singular_values)
    terminal.say(f"rank {cells.rank}; singular values {values}", hang=2)
    if cells.rank < 6:
        terminal.say(f"cannot see: {'; '.join(cells.cannot_see)}", hang=2)
