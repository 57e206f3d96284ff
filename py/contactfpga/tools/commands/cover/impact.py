"""The command `contactfpga cover impact`."""

from __future__ import annotations

import argparse
from typing import Any

from contactfpga.design.cover import elastic, impact
from contactfpga.design.cover.answer import CoverError, NoSolution
from contactfpga.design.cover.arm import Arm
from contactfpga.design.cover.hertz import Ball
from contactfpga.design.cover.impact import METHODS, Impact
from contactfpga.errors import UNSOLVED
from contactfpga.tools.commands import cover
from contactfpga.tools.commands.cover import KPA, MM, notes
from contactfpga.tools.console import flags, results

EXTRA = "sim"


def add_flags(flag: flags.Flags) -> None:
    arm = flag.group("arm")
    arm("--mass KG", "Mass of the link.", cover.KG, required=True)
    arm("--radius M", "Radius of the link, a cylinder.", cover.LENGTH, required=True)
    arm("--com M", "Distance from the joint to the center of mass.", cover.ALONG, required=True)
    arm("--lever M", "Distance from the joint to the contact.", cover.ALONG, required=True)
    arm("--length M", "Length of the link (default: the lever).", cover.ALONG)
    arm("--tube", "Take the link for a thin tube.")
    arm("--speed M/S", "Speed of the contact point at the touch.", cover.SPEED, required=True)
    arm("--torque NM", "Constant torque of the motor.", cover.TORQUE, 0.0)
    arm("--gravity", "Include gravity, 9.81 m/s2.")
    arm("--angle RAD", "Angle of the joint; at 0 the link hangs down.", cover.ANGLE, 0.0)
    foam = flag.group("foam")
    wanted = foam.one_of()
    wanted("--modulus PA", "Young's modulus.", cover.PASCAL)
    wanted("--time S", "Compression time for which the modulus is sought.", cover.BRIEF)
    foam("--poisson POISSON", "Poisson's ratio.", cover.POISSON, 0.5)
    foam("--effective-radius M", "R* with 1/R* = 1/R + 1/R'.", cover.LENGTH, required=True)
    foam("--thickness M", "Thickness; refuse an impact that presses the foam flat.", cover.LENGTH)
    strength = "Yield strength; refuse an impact from which the foam does not spring back."
    foam("--yield-strength PA", strength, cover.PASCAL)
    flag("--solver", "How the equation of motion is solved.", METHODS, "auto")
    flags.json(flag, flags.SI)


def run(args: argparse.Namespace) -> int:
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
        results.show(args, answer, lambda: print(answer))
        return UNSOLVED
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
    results.show(args, known, lambda: _show(known))
    return 0


def _show(known: dict[str, Any]) -> None:
    results.table(
        ("compression", f"{MM * known['compression_m']:.4g} mm"),
        ("compression time", f"{MM * known['time_s']:.5g} ms"),
        ("peak force", f"{known['force_n']:.4g} N"),
        ("radius of the patch then", f"{MM * known['patch_m']:.4g} mm"),
        ("stiffness K_s", f"{known['stiffness']:.6g} N/m^1.5"),
        ("Young's modulus", f"{KPA * known['modulus_pa']:.5g} kPa"),
        ("effective modulus E*", f"{KPA * known['effective_modulus_pa']:.5g} kPa"),
        ("inertia", f"{known['inertia_kgm2']:.6g} kg m2"),
        ("method", known["method"]),
    )
    notes(known["notes"])


def _struck(args: argparse.Namespace, arm: Arm) -> Impact | NoSolution:
    if args.modulus is not None:
        ball = Ball(args.effective_radius, elastic.effective_modulus_pa(args.modulus, args.poisson))
        return impact.strike(
            arm,
            args.speed,
            elastic.stiffness(ball),
            method=args.solver,
            thickness_m=args.thickness,
            yield_m=_yield(args, ball),
        )
    if args.solver not in ("auto", "quadrature"):
        raise CoverError(f"solver is {args.solver!r}; the modulus for a time is found by 'auto' only")
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
