"""The command `contactfpga haptics zero`."""

from __future__ import annotations

import argparse

import numpy as np

from contactfpga import terminal
from contactfpga.driver.board import Board
from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.files import write_text
from contactfpga.robot.haptics import HapticsError, WithReadings
from contactfpga.robot.haptics.units import write
from contactfpga.surfaces.shapes import Floats
from contactfpga.tools.console import flags, numbers, outputs, results
from contactfpga.tools.console.forces import cells_of

EXTRA = "haptics"

LEAST = 10


def add_flags(flag: flags.Flags) -> None:
    flags.connection(flag)
    flag("--seconds S", "Seconds of the board's time over which readings are averaged.", numbers.SECONDS, 0.1)
    flag("--units FILE", "The units (docs/haptics.md): refuse readings that are noisier than this file states.")
    flags.output(flag, "Write the units with their new zeros to this TOML file.")
    flags.json(flag)


def run(args: argparse.Namespace) -> int:
    if args.output is not None and args.units is None:
        raise HapticsError("--output writes units with new zeros; add --units FILE with the old ones")
    output = None if args.output is None else outputs.file(args.output, "--output")
    with flags.opened(args) as board:
        cells = None if args.units is None else cells_of(board, args.units)
        read = _readings(board, args.seconds)
        better = None if cells is None else cells.rezeroed(read, 0)
        units = []
        for unit, (mean, spread) in enumerate(zip(read.mean(axis=0).tolist(), read.std(axis=0, ddof=1).tolist())):
            board.set_zero(unit, round(mean))
            units.append({"zero_steps": mean, "spread_steps": spread, "set_steps": round(mean)})
            if not args.json:
                terminal.say(f"unit {unit}: zero {mean:.1f} steps, spread {spread:.2f}; the board took {round(mean)}")
    if output is not None and better is not None:
        write_text(output, write(better))
    written = None if output is None else lambda: terminal.say(f"wrote {output}")
    results.show(args, {"units": units, "file": output}, written)
    return 0


def _readings(board: Board, seconds: float) -> Floats:
    if board.hello.units is None:
        raise ContactFPGAError(f"{board.port}: this board has no pressure units; build its Skin with units")
    found: list[tuple[float, ...]] = []
    first_us: int | None = None
    for zones in WithReadings(board):
        first_us = zones.time_us if first_us is None else first_us
        if len(zones):
            raise HapticsError(f"pressed zones: {len(zones)}; zeros are read while nothing touches")
        if zones.units is not None:
            if any(zones.units.saturated):
                raise HapticsError("a unit reads 0 or full scale; `contactfpga doctor` says which")
            found.append(zones.units.readings)
        if zones.time_us - first_us >= 1e6 * seconds and len(found) >= LEAST:
            return np.array(found)
        if zones.time_us - first_us >= 1e6 * (seconds + 1):
            break
    raise HapticsError(f"{len(found)} readings came, {LEAST} are needed; does every frame have a sweep beside it?")
