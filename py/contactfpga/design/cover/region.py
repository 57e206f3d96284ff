"""A body region that the arm runs into: speed and reaction time that keep its limits.

The user's table of regions, of which no number is ours, has the quantities of ISO/TS 15066:2016, annex A, and ISO
10218-2:2025: effective mass, spring constant, and largest force and pressure in a transient contact, from which the
region can recoil, and in a quasi-static one, where it is clamped.

The foam, F = K_s delta^1.5 (Hertz), is in series with the region's spring, F = k y. Both are pressed by x(F) =
(F/K_s)^(2/3) + F/k, and store W(F) = 2/5 F (F/K_s)^(2/3) + F^2/(2 k).

*Transient*: two free masses without drive, mu = 1/(1/m_arm + 1/m_region): mu v^2/2 = W(F).

*Quasi-static*: the arm presses on with u until it reacts, at x_r, then brakes with b: m_arm v^2/2 + u x_r - b (x - x_r)
= W(F), solved for x_r at the limit's F.

Pressure is the largest under a Hertz patch, 3/2 of its mean: p^3 = 6 F E*^2/(pi^3 R*^2).
"""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np

from contactfpga.design.cover.answer import LARGEST, SMALLEST, CoverError, NoSolution, not_negative, positive
from contactfpga.design.cover.elastic import stiffness
from contactfpga.design.cover.hertz import Ball
from contactfpga.design.cover.numerics import Floats, integral, root
from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import shown

MAX_REGIONS = 100


@dataclasses.dataclass(frozen=True)
class Region:
    """A body region of the user's table."""

    name: str
    mass_kg: float
    """Effective mass."""
    spring_n_m: float
    """Effective spring constant."""
    transient_n: float
    """Largest force in a transient contact."""
    transient_pa: float
    """Largest pressure in a transient contact; 100 N/cm2 are 1e6."""
    quasistatic_n: float
    """Largest force on the clamped region."""
    quasistatic_pa: float
    """Largest pressure on the clamped region."""

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.isprintable() or not self.name:
            raise CoverError(f"name is {shown(self.name)}; it must be a text that can be printed, on one line")
        for field in dataclasses.fields(self)[1:]:
            unit = {"kg": "kg", "m": "N/m", "n": "N", "pa": "Pa"}[field.name.rsplit("_", 1)[1]]
            value = positive(field.name, getattr(self, field.name), unit)
            if not SMALLEST <= value <= LARGEST:
                raise CoverError(f"{field.name} is {value:g}; it must lie from {SMALLEST:g} to {LARGEST:g} {unit}")


def load_regions(path: str | Path) -> tuple[Region, ...]:
    """The tables `[[region]]` of a TOML file. Raises :class:`CoverError`, OSError."""
    values = tomlfile.load(path, CoverError)
    rows = values.get("region")
    if set(values) - {"region"} or not isinstance(rows, list) or not rows:
        raise CoverError(f"{path}: it must hold tables [[region]] alone, one at least")
    if len(rows) > MAX_REGIONS:
        raise CoverError(f"{path}: there are {len(rows)} regions; at most {MAX_REGIONS} are read")
    found = []
    for number, row in enumerate(rows):
        name = f"{path}: region[{number}]"
        given = dict(tomlfile.fields_of(Region, name, row, CoverError))
        for field in dataclasses.fields(Region):
            if field.name not in given:
                raise CoverError(f"{name}: {field.name} is missing; take it from the standard")
        found.append(Region(**given))
    return tuple(found)


@dataclasses.dataclass(frozen=True)
class Pressing:
    """An arm under its cover."""

    mass_kg: float
    """Effective mass at the contact, J/d^2."""
    push_n: float
    """Force that drives the arm on until it reacts."""
    brake_n: float
    """Force that slows the arm after the reaction."""
    ball: Ball
    """R* and E* of the foam on the region."""
    deepest_m: float
    """Largest indentation of the foam."""

    def __post_init__(self) -> None:
        positive("mass_kg", self.mass_kg, "kg")
        not_negative("push_n", self.push_n, "N")
        not_negative("brake_n", self.brake_n, "N")
        positive("deepest_m", self.deepest_m, "m")

    def most_n(self, force_n: float, pressure_pa: float) -> float:
        """The largest force that keeps both limits and does not press the foam flat."""
        by_pressure = (math.pi * pressure_pa) ** 3 * self.ball.radius_m**2 / (6 * self.ball.modulus_pa**2)
        return float(min(force_n, by_pressure, stiffness(self.ball) * self.deepest_m**1.5))


@dataclasses.dataclass(frozen=True)
class RegionLimits:
    """Limits of one region."""

    region: Region
    transient_n: float
    """Largest force in a transient contact, by all limits."""
    transient_m_s: float
    """Speed with the transient force."""
    quasistatic_n: float
    """Largest force on the clamped region, by all limits."""
    reaction_s: float
    """Longest time from the touch to the reaction at the requested speed; infinite if the arm stops without one, 0 if
    none is soon enough."""
    clamped_m_s: float | NoSolution
    """Largest speed for the clamped region with the requested reaction time."""

    @property
    def speed_m_s(self) -> float:
        """Largest speed that keeps both limits with the requested reaction time; 0: none does."""
        return 0.0 if isinstance(self.clamped_m_s, NoSolution) else min(self.transient_m_s, self.clamped_m_s)

    @property
    def binding(self) -> str:
        """The contact that allows the smaller speed."""
        return "transient" if self.speed_m_s == self.transient_m_s else "quasi-static"


def limits_of(pressing: Pressing, region: Region, speed_m_s: float, reaction_s: float) -> RegionLimits:
    """Speed and reaction time for one region."""
    positive("speed_m_s", speed_m_s, "m/s")
    not_negative("reaction_s", reaction_s, "s")
    pair = _Pair(pressing, region)
    transient = pressing.most_n(region.transient_n, region.transient_pa)
    clamped = pressing.most_n(region.quasistatic_n, region.quasistatic_pa)
    reduced = 1 / (1 / pressing.mass_kg + 1 / region.mass_kg)
    return RegionLimits(
        region,
        transient,
        math.sqrt(2 * pair.stored_j(transient) / reduced),
        clamped,
        pair.reaction_s(clamped, speed_m_s),
        _speed(pair, clamped, reaction_s),
    )


def _speed(pair: _Pair, force_n: float, reaction_s: float) -> float | NoSolution:
    fastest = pair.fastest_m_s(force_n)
    if reaction_s == 0:
        return fastest
    slowest = 1e-9 * fastest
    longest = pair.reaction_s(force_n, slowest)
    if longest < reaction_s:
        return NoSolution(
            f"the drive alone presses with more than {force_n:.4g} N within {1e3 * longest:.4g} ms of the touch"
        )

    def short_of(speed: float) -> float:
        return min(pair.reaction_s(force_n, speed), 2 * reaction_s + 1) - reaction_s

    return root(short_of, slowest, fastest)


@dataclasses.dataclass(frozen=True)
class _Pair:
    pressing: Pressing
    region: Region

    def pressed_m(self, force_n: float) -> float:
        """x(F)."""
        return float((force_n / stiffness(self.pressing.ball)) ** (2 / 3) + force_n / self.region.spring_n_m)

    def stored_j(self, force_n: float) -> float:
        """W(F)."""
        foam = 0.4 * force_n * (force_n / stiffness(self.pressing.ball)) ** (2 / 3)
        return float(foam + force_n**2 / (2 * self.region.spring_n_m))

    def fastest_m_s(self, force_n: float) -> float:
        """Speed at which a reaction at the touch itself keeps the force."""
        braked = self.stored_j(force_n) + self.pressing.brake_n * self.pressed_m(force_n)
        return math.sqrt(2 * braked / self.pressing.mass_kg)

    def reaction_s(self, force_n: float, speed_m_s: float) -> float:
        arm, depth = self.pressing, self.pressed_m(force_n)
        left = self.stored_j(force_n) - arm.mass_kg * speed_m_s**2 / 2
        if left >= arm.push_n * depth:
            return math.inf
        if left + arm.brake_n * depth <= 0:
            return 0.0
        at_m = (left + arm.brake_n * depth) / (arm.push_n + arm.brake_n)
        force = root(lambda force: self.pressed_m(force) - at_m, 0.0, force_n)
        seconds = integral(lambda share: self._slowness(share, force, speed_m_s), 0.0, 1.0, 1e-12)
        assert seconds is not None
        return seconds

    def _slowness(self, share: Floats, force_n: float, speed_m_s: float) -> Floats:
        """dt/dshare in s at F = ``force_n`` share^3, smooth from the touch on."""
        arm, force = self.pressing, force_n * share**3
        foam = (force_n / stiffness(arm.ball)) ** (2 / 3) * share**2
        pressed = foam + force / self.region.spring_n_m
        stored = 0.4 * force * foam + force**2 / (2 * self.region.spring_n_m)
        square = speed_m_s**2 + 2 / arm.mass_kg * (arm.push_n * pressed - stored)
        slope = 2 * (force_n / stiffness(arm.ball)) ** (2 / 3) * share
        slope = slope + 3 * force_n / self.region.spring_n_m * share**2
        return np.asarray(slope / np.sqrt(square))
