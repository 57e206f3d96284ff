"""Accuracy of the cover's models of sensitivity, and the modeled fingertip beside published ones."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from contactfpga.design.cover.answer import NoSolution
from contactfpga.design.cover.felt import BODY, LENGTH_M, WIDTH_M
from contactfpga.design.cover.hertz import Ball
from contactfpga.design.cover.layers import Indentation
from contactfpga.design.cover.patch import Ellipse, Pad
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


HARDEST_N = 2.0
"""Largest force of the published curves that are compared."""


class Fingertip(NamedTuple):
    """A fingertip on a hard plate at forces from 0.25 N to :data:`HARDEST_N`."""

    exponential: float
    """Correlation of the force's logarithm with the depth."""
    secant: float
    """Correlation of Hertz's secant modulus, F/d^1.5, with the force."""
    paraboloid: float
    """Largest difference of the pressure from a paraboloid's, over the peak."""
    power: float
    """Power of the force with which depth and area grow."""


def pressed_finger() -> Indentation:
    """The finger of ``contactfpga cover felt`` on a hard plate."""
    assert BODY.flesh is not None
    return Indentation([Ellipse(LENGTH_M / 2, WIDTH_M / 2)], BODY.depth_m, [BODY.flesh])


def fingertip() -> Fingertip:
    finger, force = pressed_finger(), np.linspace(0.25, HARDEST_N, 30)
    depth = np.array([finger.depth_m(one) for one in force])
    pads = [pad for one in depth for pad in finger.parts_at(one) if isinstance(pad, Pad)]
    off = [np.abs(np.array(pad.pressures) / pad.pressures[-1] - Pad.SHARES).max() for pad in pads]
    return Fingertip(
        exponential=float(np.corrcoef(depth, np.log(force))[0, 1]),
        secant=float(np.corrcoef(force, force / depth**1.5)[0, 1]),
        paraboloid=float(max(off)),
        power=float(np.polyfit(np.log(force), np.log(depth), 1)[0]),
    )
