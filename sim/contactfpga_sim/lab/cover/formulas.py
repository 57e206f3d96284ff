"""Accuracy of the cover's models of sensitivity."""

from __future__ import annotations

import math

from contactfpga.design.cover.answer import NoSolution
from contactfpga.design.cover.hertz import Ball
from contactfpga.design.cover.point import Switch
from contactfpga.design.cover.sense import LADDER, Model, PaddedSheet

SWITCH = Switch()
THICKNESS_M = 5e-3
PLACES = (0.0, 0.5, 0.83, 1.0, 1.414)
"""Offsets over the thickness."""

BALLS = {"R* = 2 mm, E* = 1 MPa": Ball(2e-3, 1e6), "R* = 0.1 mm, E* = 10 MPa": Ball(1e-4, 1e7)}


def sense_errors(model: Model, ball: Ball) -> list[float]:
    """Relative errors of a model's closing force over :data:`PLACES`."""
    sheet = PaddedSheet(SWITCH, THICKNESS_M, ball)
    found = []
    for ratio in PLACES:
        one, reference = (sheet.force_n(which, ratio * THICKNESS_M) for which in (model, LADDER[-1]))
        gone = isinstance(one, NoSolution) or isinstance(reference, NoSolution)
        found.append(math.nan if gone else one / reference - 1)  # type: ignore[operator]
    return found
