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


def add_flags(parser: argparse.ArgumentParser) -> None:
    arm = parser.add_argument_group("arm")
    arm.add_argument("--mass", type=cover.KG, required=True, metavar="KG", help="Mass of the link.")
    arm.add_argument("--radius", type=cover.LENGTH, required=True, metavar="M", help="Radius of the link, a cylinder.")
    com = "Distance from the joint to the center of mass."
    arm.add_argument("--com", type=cover.ALONG, required=True, metavar="M", help=com)
    lever = "Distance from the joint to the contact."
    arm.add_argument("--lever", type=cover.ALONG, required=True, metavar="M", help=lever)
    arm.add_argument("--length", type=cover.ALONG, metavar="M", help="Length of the link (default: the lever).")
    arm.add_argument("--tube", action="store_true", help="Take the link for a thin tube.")
    speed = "Speed of the contact point at the touch."
    arm.add_argument("--speed", type=cover.SPEED, required=True, metavar="M/S", help=speed)
    torque = "Constant torque of the motor (default: 0)."
    arm.add_argument("--torque", type=cover.TORQUE, default=0.0, metavar="NM", help=torque)
    arm.add_argument("--gravity", action="store_true", help="Include gravity, 9.81 m/s2.")
    angle = "Angle of the joint; at 0 the link hangs down (default: 0)."
    arm.add_argument("--angle", type=cover.ANGLE, default=0.0, metavar="RAD", help=angle)
    foam = parser.add_argument_group("foam")
    wanted = foam.add_mutually_exclusive_group(required=True)
    wanted.add_argument("--modulus", type=cover.PASCAL, metavar="PA", help="Young's modulus.")
    time = "Compression time for which the modulus is sought."
    wanted.add_argument("--time", type=cover.BRIEF, metavar="S", help=time)
    foam.add_argument("--poisson", type=cover.POISSON, default=0.5, help="Poisson's ratio (default: 0.5).")
    both = "R* with 1/R* = 1/R + 1/R'."
    foam.add_argument("--effective-radius", type=cover.LENGTH, required=True, metavar="M", help=both)
    flat = "Thickness; refuse an impact that presses the foam flat."
    foam.add_argument("--thickness", type=cover.LENGTH, metavar="M", help=flat)
    strength = "Yield strength; refuse an impact from which the foam does not spring back."
    foam.add_argument("--yield-strength", type=cover.PASCAL, metavar="PA", help=strength)
    method = "How the equation of motion is solved (default: auto)."
    parser.add_argument("--solver", choices=METHODS, default="auto", help=method)
    flags.json(parser, flags.SI)


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
