"""The command `contactfpga study failures`."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from contactfpga.inputs.files import write_text
from contactfpga.tools.console import flags, outputs
from contactfpga.tools.console.interrupt import Interruption

if TYPE_CHECKING:
    from contactfpga_sim.lab.failures.knob import Sweep

EXTRA = "sim"


def add_flags(flag: flags.Flags) -> None:
    flag("--study NAME ...", "Run only this study; can be repeated.")
    flags.output_folder(flag, "build/failures")


def run(args: argparse.Namespace) -> int:
    from contactfpga_sim.lab.failures import tables as failures_tables
    from contactfpga_sim.lab.failures.catalogue import KNOBS

    names = flags.known("--study", args.study, list(KNOBS))
    folder = outputs.folder(args.output)
    sweeps: dict[str, dict[str, Sweep]] = {}
    try:
        failures_tables.sweep_all(names, sweeps)
    except KeyboardInterrupt:
        raise Interruption(_kept(sweeps, folder)) from None
    print(_write(sweeps, folder / "failures.md"), flush=True)
    for path in failures_tables.draw(folder, sweeps):
        print(path)
    return 0


def _write(sweeps: Mapping[str, Mapping[str, Sweep]], path: Path) -> Path:
    from contactfpga_sim.lab.failures import tables as failures_tables

    both = failures_tables.table(sweeps), failures_tables.unnoticed(sweeps)
    write_text(path, "\n\n".join(both) + "\n")
    return path


def _kept(sweeps: Mapping[str, Mapping[str, Sweep]], folder: Path) -> str:
    done = sum(map(len, sweeps.values()))
    if not done:
        return "interrupted before the first knob was turned"
    path = _write(sweeps, folder / "failures-so-far.md")
    return f"interrupted; {done} row{'' if done == 1 else 's'} of the table, all that was finished, in {path}"
