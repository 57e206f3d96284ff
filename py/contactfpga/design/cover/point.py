"""A switch under the cover, and a point force above it: the paper's (9) and (10), over any medium."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from contactfpga.design.cover import medium
from contactfpga.design.cover.answer import CoverError, NoSolution, finite, not_negative, numbers, positive


@dataclasses.dataclass(frozen=True)
class Switch:
    """A switch and its face under the cover; the defaults are the paper's prototype."""

    force_n: float = 1.0
    """Closing force."""
    area_m2: float = 12.6e-6
    """Area of the face."""
    travel_m: float = 0.0
    """Travel until the switch closes, linear in the force."""
    spread: float = 0.0
    """Relative standard deviation of the closing force, drawn within three of them."""
    hysteresis: float = 0.0
    """Share by which the opening force is below the closing force."""
    preload_n: float = 0.0
    """Force on the switch without a touch."""

    def __post_init__(self) -> None:
        positive("force_n", self.force_n, "N")
        positive("area_m2", self.area_m2, "m2")
        not_negative("travel_m", self.travel_m, "m")
        for name, most in (("spread", 0.3), ("hysteresis", 0.99)):
            if not 0 <= not_negative(name, getattr(self, name), "") <= most:
                raise CoverError(f"{name} is {getattr(self, name):g}; it must lie between 0 and {most:g}")
        if not_negative("preload_n", self.preload_n, "N") >= self.force_n:
            raise CoverError(f"preload_n is {self.preload_n:g}; the switch closes at {self.force_n:g} N, preload less")

    @property
    def closing_pa(self) -> float:
        """Normal stress at which the switch closes: force over area (paper, III.D)."""
        return self.force_n / self.area_m2


LEAST: float = 2 * math.pi / 3 * 2.5**2.5 / 1.5**1.5
"""Least force over the thickness, over stress times offset squared: 11.266052."""


def stress_pa(
    force_n: float, offset_m: np.ndarray | float, thickness_m: float, within: str = "halfspace"
) -> np.ndarray:
    """Normal stress at the switches, at horizontal distances ``offset_m`` from a point force.

    sigma = F/h^2 g(rho/h) (:mod:`contactfpga.design.cover.medium`); over a half-space, (9): 3 F z^3 / (2 pi (rho^2 +
    z^2)^(5/2)). ``within`` is in :data:`contactfpga.design.cover.medium.MEDIA`.
    """
    finite("force_n", force_n)
    positive("thickness_m", thickness_m, "m")
    offset = numbers("offset_m", offset_m, "m")
    return force_n / thickness_m**2 * medium.spread(within, offset / thickness_m)


def force_n(switch: Switch, offset_m: float, thickness_m: float, within: str = "halfspace") -> float | NoSolution:
    """Point force that closes a switch at the horizontal distance ``offset_m``, (9) solved for F; (10) has pitch /
    sqrt(2).

    A layer has none beyond :func:`contactfpga.design.cover.medium.first_zero`, where the cover is pulled off the switch
    or presses with less than 0.3 % of the stress on the axis.
    """
    not_negative("offset_m", offset_m, "m")
    positive("thickness_m", thickness_m, "m")
    ratio, limit = offset_m / thickness_m, medium.first_zero(within)
    if limit is not None and ratio >= limit:
        return NoSolution(
            f"a switch {1e3 * offset_m:g} mm from the force is {ratio:.4g} thicknesses of the cover away; from "
            f"{limit:.4g} on a point force on a {within} layer does not press it"
        )
    spread = medium.spread if within == "halfspace" else medium.exact_spread  # that is a closed form already
    return positive("the closing force", switch.closing_pa * thickness_m**2 / float(spread(within, ratio)), "N")


def reach_m(switch: Switch, force: float, thickness_m: float, within: str = "halfspace") -> float | NoSolution:
    """Distance from a point force up to which a switch closes: inverse of :func:`force_n`.

    Over a half-space rho = sqrt((3 z^3 F / (2 pi sigma))^0.4 - z^2).
    """
    positive("force", force, "N")
    below = force_n(switch, 0.0, thickness_m, within)
    assert not isinstance(below, NoSolution)
    if force < below:
        return NoSolution(f"{force:g} N do not even close the switch right below; that takes {below:.4g} N")
    limit = medium.first_zero(within)
    if limit is None:
        cubed = 1.5 / math.pi * thickness_m**3 * force / switch.closing_pa
        return math.sqrt(max(0.0, cubed**0.4 - thickness_m**2))
    wanted = switch.closing_pa * thickness_m**2 / force
    low, high = 0.0, limit
    while high - low > 1e-13:
        middle = (low + high) / 2
        low, high = (middle, high) if medium.exact_spread(within, middle) >= wanted else (low, middle)
    return low * thickness_m


def best_thickness_m(offset_m: float) -> float:
    """Thickness with the least point force for a switch at this distance over a half-space: z = sqrt(1.5) rho."""
    return math.sqrt(1.5) * positive("offset_m", offset_m, "m")


def least_force_n(switch: Switch, offset_m: float) -> float:
    """Force at :func:`best_thickness_m`: 11.266052 sigma rho^2."""
    return LEAST * switch.closing_pa * float(positive("offset_m", offset_m, "m")) ** 2
