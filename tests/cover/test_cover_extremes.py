"""Numbers that no cover has: each call answers with a number, with no solution, or with one sentence."""

import itertools
import math
import warnings

import numpy as np
import pytest

from contactfpga.design.cover import (
    Ball,
    Cap,
    Cells,
    Cover,
    CoverError,
    Ellipse,
    Load,
    NoSolution,
    Sheet,
    Switch,
    elastic,
    feel,
    hertz,
    hertz_layer,
    impact,
    point,
    sense,
)
from contactfpga.design.cover.arm import Arm, course
from contactfpga.design.cover.sense import Model, PaddedSheet

ODD = (1e300, 5e-324, 1e25, 1e-25, math.nan, math.inf, -1.0, 0.0, 10**400)
BALL, SWITCH, ARM = Ball(0.02, 5e5), Switch(), Arm(0.02, 0.2, 1.0, 0.5, 0.3)


def pressed(model, force, half_x, half_y, x, thickness=5e-3, pitch=0.01, **more):
    load = Load((Ellipse(half_x, half_y, x, 0.03),), force)
    return Cells(Cover(model, thickness, **more), 4, 4, 0.01, pitch).forces_n([load])


def under_caps(thickness, modulus, travel, side):
    switch = Switch(travel_m=travel)
    return pressed("foam", 2.0, 6e-3, 5e-3, 0.03, thickness, switch=switch, cap=Cap(side), modulus_pa=modulus)


def rest(acceleration, density, mass):
    return Cells(Cover("foam", switch=Switch(spread=0.1), cap=Cap(8e-3, mass_kg=mass)), 4, 4, 0.01, 0.01), (
        acceleration,
        density,
    )


def lightest(length, pitch, acceleration):
    found = feel(Cover("point"), Sheet(3, 3, pitch, 0.01), length, places=3, acceleration_m_s2=acceleration)
    return [found.least_share, found.false_presses, *found.worst_m]


def struck(mass, speed, modulus):
    hit = impact.strike(Arm.link(mass, 0.038, 0.15, 0.2), speed, elastic.stiffness(Ball(0.02, modulus)))
    return hit if isinstance(hit, NoSolution) else [hit.compression_m, hit.time_s, hit.force_n]


def held(hit):
    return hit if isinstance(hit, NoSolution) else [hit.compression_m, hit.time_s, hit.force_n, hit.stiffness]


def detected(offset, thickness, model):
    return PaddedSheet(SWITCH, thickness).detects(offset, Model(model, "point")).value


CALLS = {
    "point.stress_pa": (point.stress_pa, 2.0, 3e-3, 5e-3),
    "point.stress_pa bonded": (lambda *given: point.stress_pa(*given, "bonded"), 2.0, 3e-3, 5e-3),
    "point.force_n": (lambda *given: point.force_n(SWITCH, *given), 3e-3, 5e-3),
    "point.force_n bonded": (lambda *given: point.force_n(SWITCH, *given, "bonded"), 3e-3, 5e-3),
    "point.reach_m": (lambda *given: point.reach_m(SWITCH, *given), 20.0, 5e-3),
    "point.reach_m bonded": (lambda *given: point.reach_m(SWITCH, *given, "bonded"), 20.0, 5e-3),
    "point.best_thickness_m": (point.best_thickness_m, 3e-3),
    "point.least_force_n": (lambda offset: point.least_force_n(SWITCH, offset), 3e-3),
    "closing_pa": (lambda force, area: Switch(force, area).closing_pa, 1.0, 1e-5),
    "elastic.effective_modulus_pa": (elastic.effective_modulus_pa, 3e5, 0.3, 1e9, 0.3),
    "elastic.young_pa": (elastic.young_pa, 3e5, 0.3),
    "elastic.stiffness": (lambda *given: elastic.stiffness(Ball(*given)), 0.02, 3e5),
    "elastic.ball_of": (lambda *given: elastic.ball_of(*given).modulus_pa, 1e5, 0.02),
    "elastic.yield_indentation_m": (lambda *given: elastic.yield_indentation_m(BALL, *given), 3e4, 1.1),
    "elastic.resilience": (elastic.resilience, 3e4, 3e5),
    "elastic.thickness_m": (lambda *given: elastic.thickness_m(BALL, *given), 1.0, 1.0, 4e3, 1.0),
    "elastic.thickness_m of a ball": (lambda *ball: elastic.thickness_m(Ball(*ball), 1.0, 1.0, 4e3), 0.02, 3e5),
    "Ball": (lambda force, *ball: [Ball(*ball).patch_m(force), Ball(*ball).indentation_m(force)], 2.0, 0.02, 3e5),
    "Ball.closing_n": (lambda depth, *ball: Ball(*ball).closing_n(SWITCH, depth), 5e-3, 0.02, 3e5),
    "hertz.on_axis_pa": (hertz.on_axis_pa, 2.0, 5e-3, 5e-3),
    "hertz.stress_pa": (hertz.stress_pa, 2.0, 5e-3, 3e-3, 5e-3),
    "hertz_layer.stress_pa": (lambda *given: hertz_layer.stress_pa(*given, "bonded"), 2.0, 5e-3, 3e-3, 5e-3),
    "sense.worst_offset_m": (sense.worst_offset_m, 1e-2, 1e-2),
    "sense.best_thickness_m": (lambda offset: sense.best_thickness_m(offset, "bonded"), 3e-3),
    "sense by a half-space": (lambda *given: detected(*given, "halfspace"), 3e-3, 5e-3),
    "sense by a layer": (lambda *given: detected(*given, "bonded"), 3e-3, 5e-3),
    "impact.strike": (struck, 0.6, 0.4, 3e5),
    "impact.stiffness_for": (lambda *given: held(impact.stiffness_for(ARM, *given)), 0.3, 6e-3),
    "impact.compression_m": (lambda *given: impact.compression_m(ARM, *given), 0.3, 1e5),
    "impact.time_s": (lambda *given: impact.time_s(ARM, *given) or 0.0, 0.3, 1e5, 2e-3),
    "arm.push_n": (ARM.push_n, 1e-3),
    "arm.work_j": (ARM.work_j, 1e-3),
    "arm.course": (lambda *given: course(ARM, *given, 8).time_s, 0.3, 1e5, 2e-3),
    "false presses": (
        lambda *given: (lambda cells, more: cells.false_presses(*more))(*rest(*given)),
        9.81,
        300.0,
        1e-3,
    ),
    "under caps": (under_caps, 5e-3, 3e5, 1e-4, 8e-3),
    "feel": (lightest, 12e-3, 0.01, 9.81),
} | {
    f"Cells, {model}": (lambda *given, model=model: pressed(model, *given), 2.0, 6e-3, 5e-3, 0.03, 5e-3, 0.01)
    for model in ("point", "foam")
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_one_or_two_odd_numbers_give_an_answer_or_one_sentence(call):
    function, *usual = call
    refused = [error for given in odd(usual) if (error := answer(function, given)) is not None]
    assert refused
    assert all(0 < len(text) < 300 and "\n" not in text for text in refused)
    assert answer(function, usual) is None


def odd(usual):
    """The arguments with one or two of them odd."""
    for places in itertools.combinations_with_replacement(range(len(usual)), 2):
        for values in itertools.product(ODD, repeat=len({*places})):
            given = [*usual]
            for place, value in zip(sorted({*places}), values, strict=True):
                given[place] = value
            yield given


def answer(function, given):
    """None for numbers and for no solution, the sentence of a refusal; anything else fails."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            found = function(*given)
        except CoverError as error:
            return str(error)
    assert isinstance(found, NoSolution) or np.isfinite(found).all(), given
    return None


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: point.stress_pa(math.nan, 0.0, 5e-3), "force_n is nan; it must be a finite number"),
        (lambda: point.stress_pa(2.0, [0.0, math.nan], 5e-3), "offset_m has a value that is no finite number"),
        (lambda: elastic.resilience(1e300, 3e5), "yield_pa is 1e.300; it must be at most 1e.25 Pa"),
        (lambda: elastic.resilience(3e4, 5e-324), "modulus_pa is 5e-324; it must be at least 1e-25 Pa"),
        (lambda: elastic.young_pa(3e5, math.nan), "poisson is nan; it must lie above -1 and not above 0.5"),
        (lambda: Cells(Cover("foam"), 4, 4, math.nan, 0.01), "pitch_x_m is nan; it must be a finite number above 0 m"),
        (lambda: Cells(Cover("foam", 0.3), 4, 4, 0.01, 0.01), "thickness_m is 0.3; it must be at most 20 pitches"),
    ],
)
def test_the_sentence_names_the_value_and_its_limit(make, words):
    with pytest.raises(CoverError, match=words):
        make()
