"""The flags of `contactfpga cover`; SI units throughout."""

from __future__ import annotations

import argparse
import math

from contactfpga.console import numbers

SWITCH_FORCE_N = 1.0
SWITCH_AREA_M2 = 12.6e-6

LENGTH, LENGTH_FROM_0 = numbers.length(), numbers.length(low=0.0)
ALONG = numbers.length(10.0)
"""Along an arm."""
KG = numbers.number(1e-6, 1e6, "kg")
SPEED = numbers.number(0, 1000, "m/s")
TORQUE = numbers.number(-1e6, 1e6, "Nm")
BRIEF = numbers.number(1e-6, 1, "s")
FACE = numbers.number(1e-12, 1e-2, "m2")
SHARE = numbers.number(0, 10, above=True)
ANGLE = numbers.number(-2 * math.pi, 2 * math.pi, "rad")
POISSON = numbers.number(-1, 0.5, above=True)
PASCAL = numbers.number(1, 1e12, "Pa")
NEWTON = numbers.number(1e-6, 1e6, "N")


def add(parser: argparse.ArgumentParser) -> None:
    """The commands of `contactfpga cover` and their flags."""
    commands = parser.add_subparsers(dest="topic", required=True, metavar="TOPIC")
    _impact(commands.add_parser("impact", help="an arm runs into something: compression, time, peak force"))
    _sense(commands.add_parser("sense", help="the force that closes a switch under the cover, or its reach"))
    _design(commands.add_parser("design", help="material, thickness and pitch for an arm, a switch and limits"))
    _figures(commands.add_parser("figures", help="the paper's curves, the impact over time and the design map"))


def _impact(parser: argparse.ArgumentParser) -> None:
    arm = parser.add_argument_group("arm")
    arm.add_argument("--mass", type=KG, required=True, metavar="KG", help="of the link")
    arm.add_argument("--radius", type=LENGTH, required=True, metavar="M", help="of the link, a cylinder")
    arm.add_argument("--com", type=ALONG, required=True, metavar="M", help="from the joint to the center of mass")
    arm.add_argument("--lever", type=ALONG, required=True, metavar="M", help="from the joint to the contact")
    arm.add_argument("--length", type=ALONG, metavar="M", help="of the link (default: the lever)")
    arm.add_argument("--tube", action="store_true", help="the link is a thin tube")
    arm.add_argument("--speed", type=SPEED, required=True, metavar="M/S", help="of the contact point at the touch")
    arm.add_argument("--torque", type=TORQUE, default=0.0, metavar="NM", help="of the motor, constant (default: 0)")
    arm.add_argument("--gravity", action="store_true", help="9.81 m/s2; without it gravity is left out")
    arm.add_argument("--angle", type=ANGLE, default=0.0, metavar="RAD", help="of the joint, 0 hangs down (default: 0)")
    foam = parser.add_argument_group("foam")
    wanted = foam.add_mutually_exclusive_group(required=True)
    wanted.add_argument("--modulus", type=PASCAL, metavar="PA", help="Young's modulus")
    wanted.add_argument("--time", type=BRIEF, metavar="S", help="compression time for which the modulus is sought")
    foam.add_argument("--poisson", type=POISSON, default=0.5, help="Poisson's ratio (default: 0.5)")
    foam.add_argument("--effective-radius", type=LENGTH, required=True, metavar="M", help="R*, 1/R* = 1/R + 1/R'")
    foam.add_argument("--thickness", type=LENGTH, metavar="M", help="refuse what presses the foam flat")
    foam.add_argument("--yield-strength", type=PASCAL, metavar="PA", help="refuse what it does not spring back from")
    parser.add_argument("--method", choices=("auto", "closed", "quadrature", "ode"), default="auto")
    parser.add_argument("--json", action="store_true", help="one JSON object, SI units")


def _sense(parser: argparse.ArgumentParser) -> None:
    asked = parser.add_argument_group("what is asked")
    asked.add_argument(
        "--offset", type=LENGTH_FROM_0, metavar="M", help="from the contact to the switch: the force is sought"
    )
    asked.add_argument("--force", type=NEWTON, metavar="N", help="the reach and the pitch are sought")
    asked.add_argument("--pitch", type=LENGTH, metavar="M", help="of a square sheet: its smallest force is sought")
    asked.add_argument("--thickness", type=LENGTH, metavar="M", help="of the cover; without it the best one is sought")
    switch = parser.add_argument_group("switch")
    switch.add_argument("--switch-force", type=NEWTON, default=SWITCH_FORCE_N, metavar="N", help="that closes it (1)")
    switch.add_argument("--switch-area", type=FACE, default=SWITCH_AREA_M2, metavar="M2", help="its face (12.6e-6)")
    ball = parser.add_argument_group("what touches, if known")
    ball.add_argument("--modulus", type=PASCAL, metavar="PA", help="Young's modulus of the cover")
    ball.add_argument("--poisson", type=POISSON, default=0.5, help="Poisson's ratio of the cover (default: 0.5)")
    ball.add_argument("--effective-radius", type=LENGTH, metavar="M", help="R*, 1/R* = 1/R + 1/R'")
    model = parser.add_argument_group("model (default: the simplest within the tolerance)")
    model.add_argument("--model", choices=("halfspace", "bonded", "frictionless"), help="what the cover lies on")
    model.add_argument("--contact", choices=("point", "patch"), help="with --model (default: point)")
    model.add_argument(
        "--tolerance", type=SHARE, help="share by which the answer may be off (0.05); refuse --model beyond it"
    )
    parser.add_argument("--json", action="store_true", help="one JSON object, SI units")


def _design(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE.toml", help="arm, impact, switch and limits; see examples/")
    parser.add_argument("--json", action="store_true", help="one JSON object, SI units")


def _figures(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--design", metavar="FILE.toml", help="the case that is drawn (default: the paper's)")
    parser.add_argument("--data", metavar="FILE.csv", help="force in N, deformation in m: their line is drawn, too")
    parser.add_argument("--output", metavar="DIR", default="build/cover", help="(default: build/cover)")
    parser.add_argument("--format", choices=("png", "svg"), default="png", help="(default: png)")
    parser.add_argument("--json", action="store_true", help="say in JSON what was drawn")
