"""Simulated contacts on a flat sheet: a push rises, switches close, units read."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable

import numpy as np

from contactfpga.design.cover.hertz import Ball
from contactfpga.design.cover.point import Switch
from contactfpga.design.cover.sense import Model, PaddedSheet
from contactfpga.robot.haptics import Closing, LoadCells, Locator, Place, Plane, Reach
from contactfpga.robot.haptics.posterior import radius_95
from contactfpga.robot.haptics.rate import tripod
from contactfpga.skin.sheet import Sheet

LINES = 16
MIDDLE = 7
"""Switch at a corner of the contacts' cell."""

POINT, PATCH = Model("halfspace", "point"), Model("bonded", "patch")
BALL = Ball(0.005, 4.6e5)
UNIT_SIGMA_N = 0.05
RING_M = 0.075


@functools.cache
def reach_of(model: Model, ball: Ball = BALL) -> Reach:
    """Reach of 5 mm of foam over the prototype's switches."""
    return Reach(PaddedSheet(Switch(), 0.005, ball), model)


@functools.cache
def units() -> LoadCells:
    """Three units on a plane, as on the pages."""
    found = tripod(RING_M).units
    return LoadCells([dataclasses.replace(unit, sigma_n=UNIT_SIGMA_N) for unit in found])


@dataclasses.dataclass(frozen=True)
class CoverageCase:
    """A method, its assumptions, and the truth."""

    method: str
    pitch_mm: float
    push_n: tuple[float, float] = (5.0, 30.0)
    spread: float = 0.1
    force_sigma_n: float = 0.5
    assumed: Model = POINT
    true: Model = POINT
    true_spread: float | None = None
    """True spread of thresholds; None: as assumed."""
    true_sigma_n: float | None = None
    drift_n: float = 0.0
    ball: Ball = BALL
    """Ball of the true patch."""
    late_n: float = 0.0
    """Rise of the push until measured."""
    inside_mm: float | None = None
    """Distance inside the outermost column; None: middle."""
    wrong: str = ""


@dataclasses.dataclass(frozen=True)
class Coverage:
    count: int
    rms_m: float
    barycenter_m: float
    covered: float
    """Share of contacts within the stated radius."""
    radius_m: float
    theory_m: float
    """Median smallest radius that noise allows; NaN if unknown."""
    disagreed: float
    """Share of contacts that the method reported as contradictory."""


@dataclasses.dataclass(frozen=True)
class Press:
    x_m: float
    y_m: float
    push_n: float
    cells: list[tuple[int, int]]
    closing_n: list[float]
    """True forces, in the order of the cells."""


def locator(case: CoverageCase) -> Locator:
    sheet = Sheet(
        rows=LINES,
        columns=LINES,
        connectivity=8,
        report="moments",
        barycenter_bits=0,
        zone_capacity=8,
        pitch_x_mm=case.pitch_mm,
        pitch_y_mm=case.pitch_mm,
        radius_mm=None,
        ghosts=False,
    )
    return Locator(sheet, reach_of(case.assumed), case.spread, case.force_sigma_n)


def run(case: CoverageCase, count: int, seed: int = 1) -> Coverage:
    rng, finder = np.random.default_rng(seed), locator(case)
    find: Callable[[Press], tuple[Place, float]] = functools.partial(METHODS[case.method], case, finder, rng)
    errors, coarse, radii, theory, agrees = [], [], [], [], []
    for _ in range(count):
        one = press(case, rng)
        if not one.cells:
            continue
        place, best = find(one)
        rows, columns = np.mean(one.cells, axis=0) * 1e-3 * case.pitch_mm
        errors.append(math.hypot(place.x_m - one.x_m, place.y_m - one.y_m))
        coarse.append(math.hypot(columns - one.x_m, rows - one.y_m))
        radii.append(place.radius_m)
        theory.append(best)
        agrees.append(place.agrees)
    covered = float(np.mean(np.array(errors) <= radii))
    finite = [one for one in theory if math.isfinite(one)]
    least = float(np.median(finite)) if finite else math.nan
    return Coverage(
        len(errors), _rms(errors), _rms(coarse), covered, float(np.median(radii)), least, 1 - float(np.mean(agrees))
    )


def press(case: CoverageCase, rng: np.random.Generator) -> Press:
    """A rising push at a random place of a cell."""
    pitch = 1e-3 * case.pitch_mm
    x, y = (MIDDLE + rng.random(2)) * pitch
    x = x if case.inside_mm is None else 1e-3 * case.inside_mm
    along = np.arange(LINES) * pitch
    distance = np.hypot(*(axis - at for axis, at in zip(np.meshgrid(along, along), (x, y))))
    spread = case.spread if case.true_spread is None else case.true_spread
    closing = reach_of(case.true, case.ball).closing_n(distance) * (1 + spread * rng.standard_normal(distance.shape))
    push = float(rng.uniform(*case.push_n))
    rows, columns = np.nonzero(closing <= push)
    cells = list(zip(rows.tolist(), columns.tolist()))
    return Press(float(x), float(y), push, cells, [float(closing[cell]) for cell in cells])


def _measured(case: CoverageCase, rng: np.random.Generator, force: float) -> float:
    sigma = case.force_sigma_n if case.true_sigma_n is None else case.true_sigma_n
    return max(0.01, force + sigma * float(rng.standard_normal()))


def _closings(case: CoverageCase, rng: np.random.Generator, one: Press) -> list[Closing]:
    return [Closing(*cell, _measured(case, rng, force + case.late_n)) for cell, force in zip(one.cells, one.closing_n)]


def by_barycenter(case: CoverageCase, finder: Locator, rng: np.random.Generator, one: Press) -> tuple[Place, float]:
    """Static estimate from the push."""
    rows, columns = np.mean(one.cells, axis=0) * 1e-3 * case.pitch_mm
    return finder.barycenter(float(columns), float(rows), _measured(case, rng, one.push_n)), math.nan


def by_set(case: CoverageCase, finder: Locator, rng: np.random.Generator, one: Press) -> tuple[Place, float]:
    """Static estimate from cells and push."""
    return finder.locate(one.cells, _measured(case, rng, one.push_n)), math.nan


def by_closings(case: CoverageCase, finder: Locator, rng: np.random.Generator, one: Press) -> tuple[Place, float]:
    closings = _closings(case, rng, one)
    return finder.locate(one.cells, _measured(case, rng, one.push_n), closings), bound_m(case, one)


def by_center(case: CoverageCase, finder: Locator, rng: np.random.Generator, one: Press) -> tuple[Place, float]:
    found = _center(case, finder, rng, one)
    return found, found.radius_m


def by_both(case: CoverageCase, finder: Locator, rng: np.random.Generator, one: Press) -> tuple[Place, float]:
    center = _center(case, finder, rng, one)
    found = finder.locate(one.cells, one.push_n, _closings(case, rng, one), center)
    return found, math.nan


def _center(case: CoverageCase, finder: Locator, rng: np.random.Generator, one: Press) -> Place:
    cells = units()
    x, y = one.x_m - _middle_m(case), one.y_m - _middle_m(case)
    exerted = np.array([0, 0, -one.push_n, -one.push_n * y, one.push_n * x, 0])
    readings = np.linalg.lstsq(cells.matrix, exerted, rcond=None)[0] + UNIT_SIGMA_N * rng.standard_normal(3)
    readings[0] += case.drift_n
    center = Plane().center(cells.wrench(readings))
    assert center is not None
    return finder.center(center, (-_middle_m(case), -_middle_m(case)))


def _middle_m(case: CoverageCase) -> float:
    return 1e-3 * case.pitch_mm * (LINES - 1) / 2


def bound_m(case: CoverageCase, one: Press) -> float:
    """Smallest 95 % radius that noise allows, from the slopes of closing forces over the place (Cramér-Rao); NaN
    with fewer than two closings, or two in line with the contact."""
    reach, pitch = reach_of(case.assumed), 1e-3 * case.pitch_mm
    if not case.force_sigma_n and not case.spread:
        return math.nan
    known = np.zeros((2, 2))
    for row, column in one.cells:
        away = np.array([one.x_m - column * pitch, one.y_m - row * pitch])
        distance = float(np.hypot(*away))
        step = 1e-6
        needed, more = reach.closing_n(np.array([distance, distance + step]))
        slope = (more - needed) / step * away / max(distance, 1e-9)
        known += np.outer(slope, slope) / (case.force_sigma_n**2 + (case.spread * needed) ** 2)
    if np.linalg.cond(known) > 1e4:
        return math.nan
    return radius_95(np.asarray(np.linalg.inv(known), float))


def _rms(errors: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


METHODS: dict[str, Callable[[CoverageCase, Locator, np.random.Generator, Press], tuple[Place, float]]] = {
    "barycenter": by_barycenter,
    "set": by_set,
    "closings": by_closings,
    "center of pressure": by_center,
    "closings + center of pressure": by_both,
}

RAMP = (30.0, 30.0)
RIGHT = (
    CoverageCase("barycenter", 10.0, RAMP, 0.0, 0.0),
    CoverageCase("barycenter", 5.0, RAMP, 0.0, 0.0),
    CoverageCase("set", 5.0),
    CoverageCase("set", 3.4),
    CoverageCase("closings", 5.0, RAMP),
    CoverageCase("closings", 3.4, RAMP),
    CoverageCase("center of pressure", 10.0, (12.0, 12.0)),
    CoverageCase("closings + center of pressure", 5.0, RAMP),
)

WRONG = (
    CoverageCase("set", 5.0, true=PATCH, wrong="a ball of 5 mm, taken for a point"),
    CoverageCase("closings", 5.0, RAMP, true=PATCH, wrong="a ball of 5 mm, taken for a point"),
    CoverageCase("closings", 5.0, RAMP, true_spread=0.3, wrong="thresholds spread by 30 %, taken for 10 %"),
    CoverageCase("closings", 5.0, RAMP, true_sigma_n=2.0, wrong="forces off by 2 N, taken for 0.5 N"),
    CoverageCase("center of pressure", 10.0, (12.0, 12.0), drift_n=0.2, wrong="a unit drifted by 0.2 N"),
)
