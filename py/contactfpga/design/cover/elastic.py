"""Foam under load: stiffness of the contact, yield (6) and (7), resilience, and thickness by energy (8)."""

from __future__ import annotations

import math

from contactfpga.design.cover.answer import CoverError, positive
from contactfpga.design.cover.hertz import Ball
from contactfpga.inputs.values import is_finite, shown

BETWEEN_SPHERES = 1.1
CYLINDER_ON_PLANE = 1.5
"""nu_Y: mean contact pressure over yield strength at the foam's first yield (paper, III.B)."""

_OF_WORK: float = (8 / 15) ** 0.4
"""W/delta over (E_k^3 E*^2 R*)^(1/5), 0.7777, by W = 8/15 E* sqrt(R*) delta^(5/2). The paper takes it for the force,
which is 5/2 of it, 1.9442, at its peak."""

_SHARE: float = 2**0.6 * 16 * math.pi
"""E_k^(3/5) to (m v0^2)^(3/5), and a volume of 16 contact areas."""

THICKNESS_RULES = {
    "printed": 84.0,
    "printed_exact": _SHARE * 1.3 * _OF_WORK ** (2 / 3),
    "peak_force": _SHARE * 1.3 * (2.5 * _OF_WORK) ** (2 / 3),
    "hertz": _SHARE * 0.75 ** (2 / 3) * (2.5 * _OF_WORK) ** (2 / 3),
}
"""The constant in (8): as printed; unrounded (83.7589); with the peak force (154.285); also with Hertz's area on R*,
0.8255 pi (F R*/E*)^(2/3), for 1.3 pi (97.969)."""


def effective_modulus_pa(modulus_pa: float, poisson: float, other_pa: float = math.inf, other: float = 0.0) -> float:
    """E* of a foam on an obstacle, rigid by default: 1/E* = (1 - nu^2)/E + (1 - nu'^2)/E' (paper, III)."""
    compliance = (1 - _poisson(poisson) ** 2) / positive("modulus_pa", modulus_pa, "Pa")
    if other_pa != math.inf:
        compliance += (1 - _poisson(other) ** 2) / positive("other_pa", other_pa, "Pa")
    return 1 / compliance


def young_pa(effective_pa: float, poisson: float) -> float:
    """E of a foam with effective modulus E* on a rigid obstacle: E* (1 - nu^2)."""
    return positive("effective_pa", effective_pa, "Pa") * (1 - _poisson(poisson) ** 2)


def stiffness(ball: Ball) -> float:
    """K_s in N/m^1.5 of F = K_s delta^1.5: 4/3 E* sqrt(R*) (paper, III.A)."""
    return 4 / 3 * ball.modulus_pa * math.sqrt(ball.radius_m)


def ball_of(stiffness: float, radius_m: float) -> Ball:
    """The contact on R* with stiffness K_s in N/m^1.5; inverse of :func:`stiffness`."""
    return Ball(radius_m, 0.75 * positive("stiffness", stiffness, "N/m^1.5") / math.sqrt(positive("R*", radius_m, "m")))


def yield_indentation_m(ball: Ball, yield_pa: float, ratio: float = BETWEEN_SPHERES) -> float:
    """Indentation at which the foam first yields, (7): delta_Y = R* (3 pi/4)^2 (nu_Y Y/E*)^2."""
    share = positive("ratio", ratio, "") * positive("yield_pa", yield_pa, "Pa") / ball.modulus_pa
    return ball.radius_m * (0.75 * math.pi * share) ** 2


def resilience(yield_pa: float, modulus_pa: float) -> float:
    """U_r in J/m^3, the elastic energy capacity per volume: Y^2/(2 E) (paper, III.C)."""
    return positive("yield_pa", yield_pa, "Pa") ** 2 / (2 * positive("modulus_pa", modulus_pa, "Pa"))


def thickness_m(
    ball: Ball, mass_kg: float, speed_m_s: float, resilience: float, time_share: float = 1.0, rule: str = "printed"
) -> float:
    """Thickness that absorbs the energy, (8): m^(3/5) v0^(6/5) (t0/t_c) / (84 U_r (R*^2/E*)^(2/5)).

    ``resilience`` is U_r in J/m^3, ``time_share`` t0/t_c; a ``rule`` of :data:`THICKNESS_RULES` replaces the 84.
    """
    if rule not in THICKNESS_RULES:
        raise CoverError(f"rule is {rule!r}; it must be one of {', '.join(THICKNESS_RULES)}")
    positive("resilience", resilience, "J/m3")
    energy: float = positive("mass_kg", mass_kg, "kg") ** 0.6 * positive("speed_m_s", speed_m_s, "m/s") ** 1.2
    below: float = THICKNESS_RULES[rule] * resilience * (ball.radius_m**2 / ball.modulus_pa) ** 0.4
    return energy * positive("time_share", time_share, "") / below


def _poisson(value: float) -> float:
    if not is_finite(value) or not -1 < value <= 0.5:
        raise CoverError(f"poisson is {shown(value)}; it must lie above -1 and not above 0.5")
    return value
