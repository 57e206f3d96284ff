"""Speed on this machine and accuracy of the cover's formulas, with rules that fail."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from contactfpga.design.cover import arm, elastic, impact
from contactfpga.design.cover.answer import NoSolution
from contactfpga.design.cover.arm import Arm, slowness, speed2
from contactfpga.design.cover.hertz import Ball
from contactfpga.design.cover.numerics import Floats, gauss
from contactfpga.design.cover.point import Switch
from contactfpga.design.cover.sense import LADDER, Model, PaddedSheet

FLOOR = 1e-13
"""Errors below this are the reference's own."""

STALLED = 200_000
"""Steps after which Euler's method gives up."""


class Blow(NamedTuple):
    name: str
    arm: Arm
    speed_m_s: float
    stiffness: float

    @property
    def depth_m(self) -> float:
        return impact.compression_m(self.arm, self.speed_m_s, self.stiffness)

    def square(self, depth: np.ndarray) -> Floats:
        return speed2(self.arm, self.speed_m_s, self.stiffness, depth)


_SPRING = elastic.stiffness(Ball(0.019, elastic.effective_modulus_pa(3.65e5, 0.5)))

BLOWS = (
    Blow("paper", Arm.link(0.6, 0.038, 0.15, 0.2), 0.4, _SPRING),
    Blow(
        "u = 2 Nm, gravity", Arm.link(0.6, 0.038, 0.15, 0.2, torque_nm=2.0, gravity=True, angle_rad=0.3), 0.4, _SPRING
    ),
    Blow("u = 20 Nm, from rest", Arm.link(0.6, 0.038, 0.15, 0.2, torque_nm=20.0), 0.0, _SPRING),
    Blow("u = 20 Nm, 1 mm/s", Arm.link(0.6, 0.038, 0.15, 0.2, torque_nm=20.0), 1e-3, _SPRING),
)

Rule = Callable[[Blow], float]


def _sine(nodes: int) -> Callable[..., float]:
    def rule(blow: Blow, depth: float | None = None) -> float:
        end = blow.depth_m if depth is None else depth
        return gauss(lambda phi: slowness(blow.arm, blow.speed_m_s, blow.stiffness, end, phi), 0.0, math.pi / 2, nodes)

    return rule


def _closed(blow: Blow) -> float:
    if not blow.arm.free:
        return math.nan
    return impact.COMPRESSION_TIME * blow.depth_m / blow.speed_m_s


def _adaptive(blow: Blow) -> float:
    found = impact.time_s(blow.arm, blow.speed_m_s, blow.stiffness, blow.depth_m)
    return math.nan if found is None else found


def _ode(rtol: float) -> Rule:
    return lambda blow: arm.compress(blow.arm, blow.speed_m_s, blow.stiffness, rtol)[1]


RULES: dict[str, Rule] = {
    "closed form": _closed,
    "**adaptive, sin²**": _adaptive,
    "8 nodes, sin²": _sine(8),
    "16 nodes, sin²": _sine(16),
    "ODE, 1e-6": _ode(1e-6),
    "ODE, 1e-8": _ode(1e-8),
    "**ODE, 1e-10**": _ode(1e-10),
    "ODE, 1e-12": _ode(1e-12),
}


def relative_errors(rule: Rule) -> list[float]:
    """Relative errors of a rule over :data:`BLOWS`; NaN without a result."""
    with np.errstate(all="ignore"):
        return [rule(blow) / _adaptive(blow) - 1 for blow in BLOWS]


def seconds(call: Callable[[], object], repeats: int = 5) -> float:
    call()
    count, took = 1, 0.0
    while took < 2e-3:
        count *= 2
        start = time.perf_counter()
        for _ in range(count):
            call()
        took = time.perf_counter() - start
    runs = [took]
    for _ in range(repeats - 1):
        start = time.perf_counter()
        for _ in range(count):
            call()
        runs.append(time.perf_counter() - start)
    return min(runs) / count


# ---- sensitivity

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
