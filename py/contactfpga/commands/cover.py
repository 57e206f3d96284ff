"""`contactfpga cover`: the soft cover's impact, sensitivity and design; tables in mm, JSON in SI units."""

from __future__ import annotations

import argparse
import dataclasses
import json
from typing import Any

from contactfpga.cover import elastic, impact, sense
from contactfpga.cover.answer import CoverError, NoSolution
from contactfpga.cover.hertz import Ball
from contactfpga.cover.impact import Arm, Impact
from contactfpga.cover.sense import Model, Sense, Sheet
from contactfpga.cover.switch import Switch

UNSOLVED = 3
"""Exit status when the answer is that there is no solution."""

MM, KPA = 1e3, 1e-3


def main(args: argparse.Namespace) -> int:
    """Run the command."""
    if args.topic in ("design", "figures"):
        from contactfpga.commands import cover_design  # which uses what is below

        return cover_design.main(args)
    try:
        return _impact(args) if args.topic == "impact" else _sense(args)
    except OverflowError:
        raise CoverError("a number is too large to compute with; all are in SI units") from None


# ---- impact


def _impact(args: argparse.Namespace) -> int:
    arm = Arm.link(
        args.mass,
        args.radius,
        args.com,
        args.lever,
        length_m=args.length,
        tube=args.tube,
        torque_nm=args.torque,
        gravity=args.gravity,
        angle_rad=args.angle,
    )
    answer = _struck(args, arm)
    if isinstance(answer, NoSolution):
        return _unsolved(answer, args.json)
    ball = elastic.ball_of(answer.stiffness, args.effective_radius)
    known: dict[str, Any] = {
        "compression_m": answer.compression_m,
        "time_s": answer.time_s,
        "force_n": answer.force_n,
        "stiffness": answer.stiffness,
        "modulus_pa": elastic.young_pa(ball.modulus_pa, args.poisson),
        "effective_modulus_pa": ball.modulus_pa,
        "effective_radius_m": ball.radius_m,
        "patch_m": ball.patch_m(answer.force_n),
        "energy_j": answer.energy_j,
        "inertia_kgm2": arm.inertia_kgm2,
        "method": answer.method,
        "notes": [*answer.notes, *_hertz_notes(args.thickness, ball, answer.force_n)],
    }
    if args.json:
        return say(known)
    table(
        ("compression", f"{MM * answer.compression_m:.4g} mm"),
        ("compression time", f"{MM * answer.time_s:.5g} ms"),
        ("peak force", f"{answer.force_n:.4g} N"),
        ("radius of the patch then", f"{MM * known['patch_m']:.4g} mm"),
        ("stiffness K_s", f"{answer.stiffness:.6g} N/m^1.5"),
        ("Young's modulus", f"{KPA * known['modulus_pa']:.5g} kPa"),
        ("effective modulus E*", f"{KPA * ball.modulus_pa:.5g} kPa"),
        ("inertia", f"{arm.inertia_kgm2:.6g} kg m2"),
        ("method", answer.method),
    )
    return notes(known["notes"])


def _struck(args: argparse.Namespace, arm: Arm) -> Impact | NoSolution:
    if args.modulus is not None:
        ball = Ball(args.effective_radius, elastic.effective_modulus_pa(args.modulus, args.poisson))
        return impact.strike(
            arm,
            args.speed,
            elastic.stiffness(ball),
            method=args.method,
            thickness_m=args.thickness,
            yield_m=_yield(args, ball),
        )
    if args.method not in ("auto", "quadrature"):
        raise CoverError(f"method is {args.method!r}; the modulus for a time is found by 'auto' only")
    answer = impact.stiffness_for(arm, args.speed, args.time, thickness_m=args.thickness)
    if isinstance(answer, NoSolution):
        return answer
    limit = _yield(args, elastic.ball_of(answer.stiffness, args.effective_radius))
    return impact.refusal(arm, answer.stiffness, answer.compression_m, args.thickness, limit) or answer


def _yield(args: argparse.Namespace, ball: Ball) -> float | None:
    return None if args.yield_strength is None else elastic.yield_indentation_m(ball, args.yield_strength)


def _hertz_notes(thickness_m: float | None, ball: Ball, force_n: float) -> list[str]:
    patch = ball.patch_m(force_n)
    if thickness_m is None or patch <= thickness_m:
        return []
    radius, thick = f"{MM * patch:.4g} mm", f"{MM * thickness_m:.4g} mm"
    return [f"Hertz stops holding: the patch has a radius of {radius}, the foam is {thick} thick"]


# ---- sense


def _sense(args: argparse.Namespace) -> int:
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
    sheet = Sheet(switch, args.thickness, _touching(args))
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
        "dropped": list(last.dropped),
        "notes": list(dict.fromkeys(note for one in judged for note in one.notes)),
    }
    unsolved = any(isinstance(one.value, NoSolution) for one in judged)
    if args.json:
        return say(found) or (UNSOLVED if unsolved else 0)
    lines.append(("model", str(last.model)))
    if last.error is not None and last.model != sheet.reference:
        lines.append(("off from the reference by", f"{100 * last.error:+.1f} % ({sheet.reference})"))
    if last.dropped:
        lines.append(("left out", ", ".join(last.dropped)))
    table(*lines)
    return notes(found["notes"]) or (UNSOLVED if unsolved else 0)


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
    force = Sheet(switch, thickness).force_n(Model(within, "point"), offset)
    known = {"thickness_m": thickness, "force_n": force, "offset_m": offset, "model": within, "contact": "point"}
    if args.json:
        return say(known)
    table(
        (f"best thickness, {MM * offset:.4g} mm from a switch", f"{MM * thickness:.5g} mm"),
        ("force that closes it", f"{force:.5g} N"),
        ("model", f"{within}, point"),
    )
    return 0


def _touching(args: argparse.Namespace) -> Ball | None:
    if args.modulus is None and args.effective_radius is None:
        return None
    if args.modulus is None or args.effective_radius is None:
        missing = "--modulus" if args.modulus is None else "--effective-radius"
        raise CoverError(f"{missing} is missing; a patch needs the modulus and R*")
    return Ball(args.effective_radius, elastic.effective_modulus_pa(args.modulus, args.poisson))


# ---- what all say


def say(known: dict[str, Any]) -> int:
    """Print an answer as one JSON object."""
    print(json.dumps(known, default=_plain, allow_nan=False))
    return 0


def _plain(value: object) -> object:
    if isinstance(value, NoSolution):
        return {"no_solution": value.reason}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return dataclasses.asdict(value)
    raise TypeError(f"{value!r} is no JSON")


def _unsolved(answer: NoSolution, as_json: bool) -> int:
    if as_json:
        say({"no_solution": answer.reason})
    else:
        print(answer)
    return UNSOLVED


def table(*lines: tuple[str, str]) -> None:
    """Print titles and values as two columns."""
    wide = max(len(title) for title, _ in lines)
    for title, value in lines:
        print(f"{title:{wide}}  {value}")


def notes(found: list[str]) -> int:
    """Print where a model is rough."""
    for note in found:
        print(f"note: {note}")
    return 0
