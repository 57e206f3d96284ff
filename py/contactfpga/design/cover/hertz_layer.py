"""A ball's pressure on a layer: the stress at the switches, and the closing force.

The pressure p0 sqrt(1 - r^2/a^2) has the Hankel transform F 3 (sin x - x cos x)/x^3, x = k a. With t = k h

    sigma = F/h^2 1/(2 pi) int_0^inf t G(t) 3 (sin x - x cos x)/x^3 J0(t rho/h) dt,  x = t a/h.
"""

from __future__ import annotations

import functools
import itertools
import math

import numpy as np

from contactfpga.design.cover import hertz, medium
from contactfpga.design.cover.answer import CoverError, NoSolution, not_negative, positive
from contactfpga.design.cover.hertz import Ball
from contactfpga.design.cover.numerics import Floats, legendre, root
from contactfpga.design.cover.point import Switch

WIDEST = 8.0
"""Largest patch radius over thickness for stresses; Hertz holds up to 1."""

MOST_WIDE = 1e6
"""Patch radius over thickness beyond which the stress is negligible."""

TRIED = 96
"""Patches tried, logarithmically spaced, for the first that closes the switch."""


def stress_pa(force_n: float, patch_m: float, offset_m: float, thickness_m: float, within: str) -> float:
    """Normal stress at ``offset_m`` from the axis of a Hertz patch of radius ``patch_m``, under ``thickness_m``.

    ``within`` is in :data:`contactfpga.design.cover.medium.MEDIA`. Accurate to 1e-8 of F/h^2 up to 8 thicknesses away
    and for patches up to :data:`WIDEST` thicknesses.
    """
    if within == "halfspace":
        return float(hertz.stress_pa(force_n, patch_m, offset_m, thickness_m))
    force, thickness = not_negative("force_n", force_n, "N"), positive("thickness_m", thickness_m, "m")
    wide, away = positive("patch_m", patch_m, "m") / thickness, not_negative("offset_m", offset_m, "m") / thickness
    if wide > MOST_WIDE:
        raise CoverError(f"patch_m is {wide:g} times thickness_m; it must be at most {MOST_WIDE:g} times as much")
    return force / thickness**2 * _shape(within, wide, away)


def closing_n(ball: Ball, switch: Switch, offset_m: float, thickness_m: float, within: str) -> float | NoSolution:
    """Least force that closes a switch ``offset_m`` from the ball's axis."""
    not_negative("offset_m", offset_m, "m")
    positive("thickness_m", thickness_m, "m")
    # A quarter of the point force that closes a switch below it in a half-space; a layer does not double the stress.
    start = ball.patch_m(math.pi / 6 * switch.closing_pa * thickness_m**2)
    if start > WIDEST * thickness_m:
        return NoSolution(
            f"the patch is {1e3 * start:.4g} mm in radius long before a switch closes, the foam is "
            f"{1e3 * thickness_m:.4g} mm thick"
        )

    def excess(patch_m: float) -> float:
        force = _force(ball, patch_m)
        return stress_pa(force, patch_m, offset_m, thickness_m, within) / switch.closing_pa - 1

    patches = np.geomspace(start, max(WIDEST * thickness_m, 1.01 * start), TRIED)
    for low, high in itertools.pairwise(patches.tolist()):
        if excess(high) >= 0:
            return _force(ball, root(excess, low, high))
    return NoSolution(
        f"a switch {1e3 * offset_m:.4g} mm from the axis stays open until the patch is {WIDEST:g} times as wide as the "
        f"foam is thick"
    )


def reach_m(ball: Ball, switch: Switch, force_n: float, thickness_m: float, within: str) -> float | NoSolution:
    """Distance from the axis up to which a switch closes under ``force_n``."""
    patch = ball.patch_m(positive("force_n", force_n, "N"))
    if patch > WIDEST * positive("thickness_m", thickness_m, "m"):
        return NoSolution(f"the patch is {1e3 * patch:.4g} mm in radius, the foam {1e3 * thickness_m:.4g} mm thick")

    def excess(offset_m: float) -> float:
        return stress_pa(force_n, patch, offset_m, thickness_m, within) / switch.closing_pa - 1

    if excess(0.0) < 0:
        below = closing_n(ball, switch, 0.0, thickness_m, within)
        needed = below.reason if isinstance(below, NoSolution) else f"that takes {below:.4g} N"
        return NoSolution(f"{force_n:g} N do not even close the switch right below; {needed}")
    high = thickness_m
    while excess(high) >= 0:
        high *= 1.25
    return root(excess, 0.0, high)


def _force(ball: Ball, patch_m: float) -> float:
    """Inverse of :meth:`Ball.patch_m`."""
    return 4 * ball.modulus_pa * patch_m**3 / (3 * ball.radius_m)


def _shape(within: str, wide: float, away: float) -> float:
    if away > wide + medium.FARTHEST:
        return 0.0
    t, weighted = _weighted(within)
    x = t * wide
    # The fraction loses digits where x is small; its series does not.
    safe = np.maximum(x, 0.05)
    pressed = np.where(x < 0.05, 1 - x**2 / 10 + x**4 / 280, 3 * (np.sin(safe) - safe * np.cos(safe)) / safe**3)
    return float((weighted * pressed) @ _bessel(away))


@functools.cache
def _weighted(within: str) -> tuple[Floats, Floats]:
    t, weights = _nodes()
    return t, weights * t * medium.transfer(within, t) / (2 * math.pi)


@functools.cache
def _nodes() -> tuple[Floats, Floats]:
    nodes, weights = legendre(16)
    t = np.add.outer(np.arange(medium.HIGHEST_T), (nodes + 1) / 2)
    return t.ravel(), np.tile(weights / 2, len(t))


@functools.lru_cache(maxsize=64)
def _bessel(away: float) -> Floats:
    """J0(t ``away``) at the nodes: the mean of cos(x sin a) over a quarter turn."""
    count = 40 + round(8 * away)
    sines = np.sin((np.arange(count) + 0.5) * (np.pi / 2 / count))
    return np.asarray(np.cos(np.multiply.outer(sines * away, _nodes()[0])).mean(axis=0))
