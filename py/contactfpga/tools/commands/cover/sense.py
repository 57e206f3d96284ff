"""The command `contactfpga cover sense`."""

from __future__ import annotations

import argparse
from typing import Any

from contactfpga.design.cover import elastic, sense
from contactfpga.design.cover.answer import CoverError, NoSolution
from contactfpga.design.cover.hertz import Ball
from contactfpga.design.cover.point import Switch
from contactfpga.design.cover.sense import Model, PaddedSheet, Sense
from contactfpga.errors import UNSOLVED
from contactfpga.tools.commands import cover
from contactfpga.tools.commands.cover import MM, notes
from contactfpga.tools.console import flags, results

EXTRA = "sim"


def add_flags(flag: flags.Flags) -> None:
    asked = flag.group("what is asked")
    asked("--offset M", "Distance from the contact to the switch: find the force.", cover.LENGTH_FROM_0)
    asked("--force N", "Force: find its reach and the pitch.", cover.NEWTON)
    asked("--pitch M", "Pitch of a square sheet: find its smallest force.", cover.LENGTH)
    asked("--thickness M", "Thickness of the cover; without it, find the best one.", cover.LENGTH)
    switch = flag.group("switch")
    usual = Switch()
    switch("--switch-force N", "Force that closes the switch.", cover.NEWTON, usual.force_n)
    switch("--switch-area M2", "Area of its face.", cover.FACE, usual.area_m2)
    ball = flag.group("what touches, if known")
    ball("--modulus PA", "Young's modulus of the cover.", cover.PASCAL)
    ball("--poisson POISSON", "Poisson's ratio of the cover.", cover.POISSON, 0.5)
    ball("--effective-radius M", "R* with 1/R* = 1/R + 1/R'.", cover.LENGTH)
    model = flag.group("model (default: the simplest within the tolerance)")
    within = "What the cover is: a half-space, or a layer on a rigid base."
    model("--model", within, ("halfspace", "bonded", "frictionless"))
    model("--contact", "Contact of --model (default: point).", ("point", "patch"))
    share = "Largest share by which the answer may be off (default: 0.05); refuse --model beyond it."
    model("--tolerance TOLERANCE", share, cover.SHARE)
    flags.json(flag, flags.SI)


def run(args: argparse.Namespace) -> int:
    model = Model(args.model, args.contact or "point") if args.model else None
    if args.contact and not args.model:
        raise CoverError(
            f"--contact is {args.contact!r}; name the model, too: --model halfspace, bonded or frictionless"
        )
    if args.offset is None and args.force is None and args.pitch is None:
        raise CoverError("nothing is asked; give --offset, --force or --pitch")
    switch = Switch(args.switch_force, args.switch_area)
    if args.thickness is None:
        return _best_thickness(args, switch)
    sheet = PaddedSheet(switch, args.thickness, _touching(args))
    found: dict[str, Any] = {}
    lines: list[tuple[str, str]] = []
    judged: list[Sense] = []
    if args.offset is not None:
        one = sheet.detects(args.offset, model, args.tolerance)
        _answer(found, lines, one, "force_n", f"force that closes a switch {MM * args.offset:.4g} mm away", 1, "N")
        judged.append(one)
    if args.pitch is not None:
        one = sheet.detects(sense.worst_offset_m(args.pitch), model, args.tolerance)
        name = "sheet_force_n" if args.offset is not None else "force_n"
        _answer(found, lines, one, name, f"smallest force sure to be felt, pitch {MM * args.pitch:.4g} mm", 1, "N")
        judged.append(one)
    if args.force is not None:
        one = sheet.reaches(args.force, model, args.tolerance)
        _answer(found, lines, one, "reach_m", f"reach of {args.force:.4g} N", MM, "mm")
        judged.append(one)
        if not isinstance(one.value, NoSolution):
            found["pitch_m"] = sense.pitch_m(one.value)
            lines.append(("pitch that reach allows", f"{MM * found['pitch_m']:.4g} mm"))
    last = judged[0]
    found |= {
        "model": last.model.within,
        "contact": last.model.contact,
        "reference": str(sheet.reference),
        "error": last.error,
        "dropped": last.dropped,
        "notes": list(dict.fromkeys(note for one in judged for note in one.notes)),
    }
    unsolved = any(isinstance(one.value, NoSolution) for one in judged)
    lines.append(("model", str(last.model)))
    if last.error is not None and last.model != sheet.reference:
        lines.append(("off from the reference by", f"{100 * last.error:+.1f} % ({sheet.reference})"))
    if last.dropped:
        lines.append(("left out", ", ".join(last.dropped)))
    results.show(args, found, lambda: _show(lines, found["notes"]))
    return UNSOLVED if unsolved else 0


def _show(lines: list[tuple[str, str]], said: list[str]) -> None:
    results.table(*lines)
    notes(said)


def _answer(
    found: dict[str, Any], lines: list[tuple[str, str]], one: Sense, name: str, title: str, scale: float, unit: str
) -> None:
    if isinstance(one.value, NoSolution):
        found[name] = None
        found["no_solution"] = one.value.reason
        lines.append((title, str(one.value)))
        return
    found[name] = one.value
    lines.append((title, f"{scale * one.value:.5g} {unit}"))
    if not isinstance(one.reference, NoSolution):
        found[f"reference_{name}"] = one.reference


def _best_thickness(args: argparse.Namespace, switch: Switch) -> int:
    if args.force is not None or (args.offset is None) == (args.pitch is None):
        raise CoverError("thickness is missing; the best one is found for --offset or --pitch alone")
    if args.contact == "patch":
        raise CoverError("thickness is missing; the best one is found for a point force only")
    offset = args.offset if args.offset is not None else sense.worst_offset_m(args.pitch)
    within = args.model or "bonded"
    thickness = sense.best_thickness_m(offset, within)
    force = PaddedSheet(switch, thickness).force_n(Model(within, "point"), offset)
    known = {"thickness_m": thickness, "force_n": force, "offset_m": offset, "model": within, "contact": "point"}
    lines = [
        (f"best thickness, {MM * offset:.4g} mm from a switch", f"{MM * thickness:.5g} mm"),
        ("force that closes it", f"{force:.5g} N"),
        ("model", f"{within}, point"),
    ]
    results.show(args, known, lambda: results.table(*lines))
    return 0


def _touching(args: argparse.Namespace) -> Ball | None:
    if args.modulus is None and args.effective_radius is None:
        return None
    if args.modulus is None or args.effective_radius is None:
        missing = "--modulus" if args.modulus is None else "--effective-radius"
        raise CoverError(f"{missing} is missing; a patch needs the modulus and R*")
    return Ball(args.effective_radius, elastic.effective_modulus_pa(args.modulus, args.poisson))
