"""The command `contactfpga haptics threshold`."""

from __future__ import annotations

import argparse
import re

from contactfpga import terminal
from contactfpga.errors import NoSuchCommand
from contactfpga.inputs.values import shown
from contactfpga.robot.haptics import HapticsError, LoadCells
from contactfpga.tools.console import flags, results
from contactfpga.tools.console.forces import cells_of
from contactfpga.wire.units import UnitFacts

EXTRA = "haptics"


def add_flags(flag: flags.Flags) -> None:
    flags.connection(flag)
    unit = "Unit K raises contact from this deviation on, either way; 0: never. May be given again for other units."
    flag("--unit K=STEPS ...", unit, default=[])
    flag("--sum K=STEPS ...", "Sum K, a row of the Skin's unit_sums, likewise.", default=[])
    units = "The units (docs/haptics.md): then --unit takes newtons, as 0=8, and so does --sum if all gains are equal."
    flag("--units FILE", units)
    flags.json(flag)


def run(args: argparse.Namespace) -> int:
    pairs = [("unit", *_pair("--unit", one)) for one in args.unit] + [("sum", *_pair("--sum", one)) for one in args.sum]
    if not pairs:
        raise HapticsError("no threshold is given; add --unit K=STEPS or --sum K=STEPS")
    with flags.opened(args) as board:
        facts = board.hello.units
        if facts is None:
            raise NoSuchCommand(f"{board.port}: this board has no pressure units; build its Skin with units")
        cells = None if args.units is None else cells_of(board, args.units)
        wanted = [(*pair[:2], _checked(facts, cells, *pair)) for pair in pairs]  # all, before the first is set
        for kind, number, steps in wanted:
            set_one = board.set_threshold if kind == "unit" else board.set_sum_threshold
            set_one(number, steps)
            said = "never raises contact" if steps == 0 else f"raises contact from a deviation of {steps} steps on"
            if not args.json:
                terminal.say(f"{kind} {number}: {said}; the board took it")
    results.show(args, {"thresholds": [{kind: number, "steps": steps} for kind, number, steps in wanted]})
    return 0


def _checked(facts: UnitFacts, cells: LoadCells | None, kind: str, number: int, value: float) -> int:
    limit = facts.count if kind == "unit" else facts.sums
    if number >= limit:
        raise HapticsError(f"--{kind} names {kind} {number}; the board has {limit}, counted from 0")
    steps = round(value if cells is None else _steps(cells, kind, number, value))
    if steps == 0 and value != 0:
        raise HapticsError(f"--{kind} {number}={value:g} is less than half a step; 0 would mean never")
    return steps


def _pair(flag: str, text: str) -> tuple[int, float]:
    found = re.fullmatch(r"(\d{1,2})=(\d+(?:\.\d*)?)", text)
    if found is None:
        raise HapticsError(f"{flag} is {shown(text)}; it must be a number and a deviation, as 0=400")
    return int(found[1]), float(found[2])


def _steps(cells: LoadCells, kind: str, number: int, newtons: float) -> float:
    gains = {abs(unit.gain_n) for unit in cells.units}
    if kind == "unit":
        return newtons / abs(cells.units[number].gain_n)
    if len(gains) > 1:
        raise HapticsError("--sum takes steps here: the units have different gains, so a sum has no newtons")
    return newtons / gains.pop()
