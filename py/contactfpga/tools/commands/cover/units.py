"""Numbers on the command line of `contactfpga cover`, in SI units."""

from __future__ import annotations

import argparse
import math

from contactfpga.design.cover.answer import MAX_LENGTH_M
from contactfpga.tools.console import numbers

LENGTH, LENGTH_FROM_0 = numbers.length(MAX_LENGTH_M), numbers.length(MAX_LENGTH_M, 0.0)
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


def json_flag(parser: argparse.ArgumentParser) -> None:
    """Of every topic."""
    parser.add_argument("--json", action="store_true", help="Print one JSON object in SI units.")
