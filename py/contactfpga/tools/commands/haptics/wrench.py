"""The command `contactfpga haptics wrench`."""

from __future__ import annotations

import argparse
import json

from contactfpga import terminal
from contactfpga.tools.commands.haptics import reading

EXTRA = "haptics"


def add_flags(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE.json", help="Units and readings; docs/haptics.md has the format.")
    parser.add_argument("--json", action="store_true", help="Print one JSON object in SI units.")


def run(args: argparse.Namespace) -> int:
    cells, readings = reading.units(args.file)
    wrench = cells.wrench(readings)
    values = cells.singular_values.tolist()
    if args.json:
        covariance = cells.noise.covariance.tolist()
        answer = {"force_n": list(wrench.force_n), "moment_nm": list(wrench.moment_nm), "covariance": covariance}
        print(json.dumps(answer | {"rank": cells.rank, "singular_values": values}, allow_nan=False))
        return 0
    for name, three, unit in (("force", wrench.force_n, "N"), ("moment", wrench.moment_nm, "Nm")):
        terminal.say(f"{name}: ({', '.join(f'{one:.5g}' for one in three)}) {unit}")
    terminal.say(f"rank {cells.rank}; singular values {', '.join(f'{one:.5g}' for one in values)}", hang=2)
    if cells.rank < 6:
        terminal.say(f"cannot see: {'; '.join(cells.cannot_see)}", hang=2)
    return 0
