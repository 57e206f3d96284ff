"""Limits of force joined to location: each sweep violates one assumption more and more.

Each value is tried with random contacts until it is clear whether the stated 95 % hold for 90 % of them. A value that
fails counts as reported if half of its failures are.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable

import numpy as np

from contactfpga.design.cover.hertz import Ball
from contactfpga.robot.haptics import Contact, Contacts, Cylinder, LoadCells, Touch, contacts
from contactfpga.robot.haptics.posterior import radius_95
from contactfpga.robot.haptics.rate import hexapod
from contactfpga.surfaces.shapes import Floats
from contactfpga_sim.lab.haptics import coverage
from contactfpga_sim.lab.haptics.coverage import PATCH, CoverageCase
from contactfpga_sim.lab.knobs import LOOKS, Knob, Outcome, RateTest

HOLDS = 0.9
"""Required share of contacts within the stated interval, below 95 % to allow for chance."""

TELLS = 0.5

CLOSE_N = 1.0

PUSH_N, LEVER_M = 12.0, 0.05
SURFACE = Cylinder(0.038)
SIGMA_N = 0.05
REACH_M = 0.0036
"""Distance at which 12 N close switches; half of it is a zone's uncertainty by axis."""

SLOW = 480
"""Most draws of methods that need 10 ms each."""

TRIES = 50

CHI2_3 = 7.815
"""95 % quantile of chi-squared with three degrees of freedom."""

Random = np.random.Generator


@dataclasses.dataclass(frozen=True)
class Disturbance:
    """Load on a link with units, and violated assumptions."""

    unseen_n: float = 0.0
    """Push of a second contact beside the sheet."""
    drift_n: float = 0.0
    torsion_nm: float = 0.0
    ends_n: float = math.inf
    """Range of a unit, either way."""
    elsewhere_m: float = 0.0
    preload_n: float | None = None


def _outcome(right: bool, told: tuple[str, ...], off: float, unit: str) -> Outcome:
    return Outcome(right, told, f"{off:.3g} {unit} off")


def cells(load: Disturbance) -> LoadCells:
    """A hexapod at mid-length, tilted by 60 degrees."""
    ends = None if math.isinf(load.ends_n) else (-load.ends_n, load.ends_n)
    units = [
        dataclasses.replace(unit, sigma_n=SIGMA_N, range=ends, preload_n=load.preload_n)
        for unit in hexapod(0.03, math.radians(60)).units
    ]
    return LoadCells(units)


def pressed(load: Disturbance, made: LoadCells, rng: Random) -> tuple[Floats, Floats, Contacts]:
    """Place and force of a contact, and the estimate."""
    x, y = rng.uniform(0, 2 * math.pi * SURFACE.radius_m), rng.uniform(-LEVER_M, LEVER_M)
    point, normal = (np.array(each) for each in SURFACE.place(x, y))
    across = np.array([0.0, 0.0, 1.0])
    turn = rng.uniform(0, 2 * math.pi)
    drag = rng.uniform(0, 0.4) * (math.cos(turn) * across + math.sin(turn) * np.cross(across, normal))
    force = PUSH_N * (drag - normal)
    exerted = np.concatenate([force, np.cross(point, force) + load.torsion_nm * normal])
    if load.unseen_n:
        other, out = (np.array(each) for each in SURFACE.place(rng.uniform(0, 0.24), rng.uniform(-LEVER_M, LEVER_M)))
        exerted += np.concatenate([-load.unseen_n * out, np.cross(other, -load.unseen_n * out)])
    readings = np.linalg.lstsq(made.matrix, exerted, rcond=None)[0] + SIGMA_N * rng.standard_normal(len(made.units))
    readings[rng.integers(len(readings))] += load.drift_n
    if load.preload_n is not None:
        readings = np.maximum(readings, -load.preload_n)
    wrench = made.wrench(np.clip(readings, -load.ends_n, load.ends_n))
    sigma = REACH_M / 2
    shifted = SURFACE.place(
        x + sigma * rng.standard_normal() + load.elsewhere_m, y + sigma * rng.standard_normal() + load.elsewhere_m / 2
    )
    found = contacts(wrench, [Touch(*shifted, 0.5, sigma)])
    return np.array([x, y]), force, found


def _told(found: Contacts, alarm: bool) -> tuple[str, ...]:
    marks = {"saturated": found.wrench.saturated, "lifted": found.wrench.lifted, "alarm": alarm and found.alarm}
    return tuple(name for name, mark in marks.items() if mark)


def force(load: Disturbance, rng: Random, count: int) -> list[Outcome]:
    """Outcomes of the force at a zone, from its place."""
    made, trials = cells(load), []
    for _ in range(count):
        _, exerted, found = pressed(load, made, rng)
        assert found.covariance_n2 is not None
        off = np.array(found[0].force_n) - exerted
        within = bool(off @ np.linalg.solve(found.covariance_n2, off) < CHI2_3)
        trials.append(_outcome(within, _told(found, True), float(np.linalg.norm(off)), "N"))
    return trials


def _center(load: Disturbance, rng: Random, count: int) -> list[Outcome]:
    made, trials = cells(load), []
    around = 2 * math.pi * SURFACE.radius_m
    for _ in range(count):
        place, _, found = pressed(load, made, rng)
        center = SURFACE.center(found.wrench)
        if center is None or center.covariance_m2 is None:
            trials.append(Outcome(False, ("no center",), "no center"))
            continue
        away = np.array(center.sheet_m) - place
        away[0] -= around * round(away[0] / around)
        off = float(np.hypot(*away))
        trials.append(_outcome(off <= radius_95(center.covariance_m2), _told(found, False), 1e3 * off, "mm"))
    return trials


def _friction(kind: str, drag: float, rng: Random, count: int) -> list[Outcome]:
    made, trials = cells(Disturbance()), []
    for _ in range(count):
        places = [SURFACE.place(rng.uniform(0, 0.09), at) for at in (-0.03, 0.03)]
        exerted, pushes = np.zeros(6), rng.uniform(4, 12, 2)
        for (point, normal), push in zip(places, pushes):
            turn, across = rng.uniform(0, 2 * math.pi), np.array([0.0, 0.0, 1.0])
            side = math.cos(turn) * across + math.sin(turn) * np.cross(across, normal)
            dragged = push * (drag * side - np.array(normal))
            exerted += np.concatenate([dragged, np.cross(point, dragged)])
        readings = np.linalg.lstsq(made.matrix, exerted, rcond=None)[0] + SIGMA_N * rng.standard_normal(6)
        found = contacts(made.wrench(readings), [Touch(*place, 0.5) for place in places])
        told = ("beyond friction",) if found.beyond_friction else ()
        off = abs((found[0].normal_n or 0.0) - pushes[0])
        trials.append(_outcome(holds(found[0], pushes[0]) if kind == "interval" else off <= CLOSE_N, told, off, "N"))
    return trials


def holds(contact: Contact, push_n: float) -> bool:
    least, largest = contact.interval_n or (math.inf, None)
    return least <= push_n and (largest is None or push_n <= largest)


def _located(case: CoverageCase, rng: Random, count: int) -> list[Outcome]:
    finder, trials = coverage.locator(case), []
    for _ in range(TRIES * count):
        one = coverage.press(case, rng)
        if not one.cells:
            continue
        place, _ = coverage.METHODS[case.method](case, finder, rng, one)
        off = math.hypot(place.x_m - one.x_m, place.y_m - one.y_m)
        told = () if place.agrees else ("agrees = False",)
        trials.append(_outcome(off <= place.radius_m, told, 1e3 * off, "mm"))
        if len(trials) == count:
            return trials
    raise ValueError(f"{TRIES} touches close no switch for one that does: {case}")


def _rated(draws: Callable[[float, Random, int], list[Outcome]], most: int = LOOKS[-1]) -> RateTest:
    return RateTest(draws, most=most, level=HOLDS, telling=TELLS)


def _both(change: Callable[[float], Disturbance]) -> dict[str, Callable[[float], Outcome]]:
    return {
        "force at the zone": _rated(lambda value, rng, count: force(change(value), rng, count)),
        "center of pressure": _rated(lambda value, rng, count: _center(change(value), rng, count)),
    }


def _places(
    *methods: tuple[str, CoverageCase], **knob: Callable[[float], object]
) -> dict[str, Callable[[float], Outcome]]:
    def draws(case: CoverageCase, value: float, rng: Random, count: int) -> list[Outcome]:
        changed = dataclasses.replace(case, **{name: change(value) for name, change in knob.items()})  # type: ignore[arg-type]
        return _located(changed, rng, count)

    return {
        name: _rated(functools.partial(draws, case), SLOW if case.method == "closings" else LOOKS[-1])
        for name, case in methods
    }


RAMP = (30.0, 30.0)
CLOSINGS = CoverageCase("closings", 5.0, RAMP)
KNOBS = {
    knob.name: knob
    for knob in (
        Knob("unseen", "A second contact that the sheet does not show", "its push, N",
              (0, 0.1, 0.2, 0.5, 1, 2, 4, 8), _both(lambda value: Disturbance(unseen_n=value)),
              "look at `alarm`; trust neither force nor place where it is set"),
        Knob("drift", "A unit whose zero has drifted", "drift, N", (0, 0.05, 0.1, 0.2, 0.5, 1, 2),
              _both(lambda value: Disturbance(drift_n=value)), "`haptics zero` while nothing touches; `DriftWatch`"),
        Knob("torsion", "A contact that turns about its normal", "torsion, Nm",
              (0, 0.002, 0.005, 0.01, 0.02, 0.05), _both(lambda value: Disturbance(torsion_nm=value)),
              "the center of pressure, which measures the torsion"),
        Knob("clipping", "A unit that reads no more than this", "end of its range, N",
              (20, 14, 12, 10, 8, 6, 4), _both(lambda value: Disturbance(ends_n=value)),
              "units for the loads that `haptics place` names; `saturated`"),
        Knob("lifted", "Units that only push, on springs", "preload, N", (20, 14, 12, 10, 8, 6, 4),
              _both(lambda value: Disturbance(preload_n=value)), "more preload; `lifted`"),
        Knob("elsewhere", "A stuck switch: the zone is not where the contact is", "distance, mm",
              (0, 2, 5, 10, 20, 40), _both(lambda value: Disturbance(elsewhere_m=1e-3 * value)),
              "`contactfpga doctor --watch` names the switch; `mask`"),
        Knob("shape", "A ball that is taken for a point", "its radius, mm", (1, 2, 3, 5, 8, 12, 19),
              _places(("set, 5 mm", CoverageCase("set", 5.0, true=PATCH)),
                      ("closings, 5 mm", dataclasses.replace(CLOSINGS, true=PATCH)),
                      ball=lambda value: Ball(1e-3 * value, 4.6e5)),
              "the right `Model`; with several, the one that agrees"),
        Knob("friction", "Two fingers that drag more than friction 0.5 allows", "drag over push",
              (0.1, 0.3, 0.45, 0.55, 0.7, 0.9, 1.2),
              {"interval": _rated(functools.partial(_friction, "interval"), SLOW),
               f"estimate, {CLOSE_N:g} N": _rated(functools.partial(_friction, "estimate"))},
              "a larger `friction`: intervals grow, but hold"),
        Knob("skew", "Force and switches by two clocks; the push rises by 1.6 N per ms", "force is late by, ms",
              (0, 0.05, 0.1, 0.2, 0.5, 1, 2),
              _places(("closings, 0.5 N of noise", CLOSINGS),
                      ("closings, 0.1 N, no spread", CoverageCase("closings", 5.0, RAMP, 0.0, 0.1)),
                      late_n=lambda value: 1.6 * value),
              "units on the board, which has one clock"),
        Knob("edge", "A contact on the edge of the sheet", "inside of the outermost switch, mm",
              (12, 8, 5, 2, 0, -1, -2, -3),
              _places(("barycenter, 5 mm", CoverageCase("barycenter", 5.0, RAMP, 0.0, 0.0)),
                      ("set, 5 mm", CoverageCase("set", 5.0)),
                      ("closings, 5 mm", CLOSINGS), inside_mm=float),
              "`Locator.locate`, which knows where the sheet ends; switches beyond what may be touched"),
    )
}  # fmt: skip
