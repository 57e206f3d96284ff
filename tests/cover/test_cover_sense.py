"""Sensitivity: models by name, the simplest one that will do, patches on layers, pitch and thickness, refusals."""

import math
import re

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import integrate, special

from contactfpga.design.cover import Ball, CoverError, NoSolution, Switch, hertz_layer, medium, point, sense
from contactfpga.design.cover.sense import Model, PaddedSheet

SWITCH = Switch(1.0, 12.6e-6)
PAPERS = Ball(0.038, 4.6e5)
SMALL = Ball(2e-3, 1e6)
HALFSPACE, BONDED, SLIDING = (Model(name, "point") for name in medium.MEDIA)
PATCHES = [Model(name, "patch") for name in medium.MEDIA]
WORST = 5e-3 * math.sqrt(2)


# ---- the model that is taken


def test_the_half_space_is_left_for_the_layer_where_it_fails():
    found = PaddedSheet(SWITCH, 5e-3).detects(WORST)
    assert found.model == BONDED
    assert (round(found.value), found.error, found.dropped) == (341, 0, ())
    named = PaddedSheet(SWITCH, 5e-3).detects(WORST, HALFSPACE)
    assert found.value / named.value == pytest.approx(5.26, abs=0.01)
    assert named.reference == found.value
    assert named.error == pytest.approx(-0.81, abs=0.001)
    assert "'halfspace, point' is off by -81 % from 'bonded, point'" in named.notes


def test_a_named_model_is_refused_beyond_a_tolerance_that_is_asked_for():
    sheet = PaddedSheet(SWITCH, 5e-3)
    assert sheet.detects(WORST, HALFSPACE, 0.05).value == NoSolution(
        "'halfspace, point' is off by -81 %, 5 % are asked for; take 'bonded, point'"
    )
    assert sheet.detects(WORST, HALFSPACE, 0.9).value == sheet.detects(WORST, HALFSPACE).value
    assert sheet.reaches(15.0, HALFSPACE, 0.05).value == sheet.reaches(15.0, HALFSPACE).value
    beyond = sheet.detects(1.68 * 5e-3, HALFSPACE, 0.9).value
    assert "'halfspace, point' has an answer, 90 % are asked for; no solution: a switch 8.4 mm" in beyond.reason


def test_no_model_is_larger_than_needed():
    # where the layer's and the half-space's stress happen to be alike, the closed form will do
    found = PaddedSheet(SWITCH, 5e-3).detects(0.83 * 5e-3)
    assert (found.model, found.dropped) == (HALFSPACE, ("the rigid base",))
    assert 0 < abs(found.error) <= sense.TOLERANCE
    assert PaddedSheet(SWITCH, 5e-3).detects(0.83 * 5e-3, tolerance=1e-3).model == BONDED
    needle = PaddedSheet(SWITCH, 5e-3, Ball(1e-5, 1e8)).detects(0.001)
    assert (needle.model, needle.dropped) == (BONDED, ("the width of the contact",))
    ball = PaddedSheet(SWITCH, 5e-3, SMALL)
    assert ball.detects(0.002).model == PATCHES[1]
    between = ball.detects(4.5e-3)
    assert (between.model, between.dropped) == (PATCHES[0], ("the rigid base",))
    assert between.value / ball.force_n(PATCHES[1], 4.5e-3) - 1 == pytest.approx(between.error)
    assert ball.detects(4.5e-3, tolerance=0.2).model == HALFSPACE
    assert ball.detects(4.5e-3, tolerance=0.2).dropped == ("the rigid base", "the width of the contact")


@pytest.mark.parametrize("ball", [None, SMALL, Ball(0.01, 3e5)])
def test_the_answer_is_within_the_tolerance_whatever_model_gives_it(ball):
    sheet = PaddedSheet(SWITCH, 5e-3, ball)
    taken = set()
    for ratio in np.linspace(0, 1.6, 17):
        for tolerance in (0.01, 0.1, 0.5):
            found = sheet.detects(ratio * 5e-3, tolerance=tolerance)
            assert abs(found.error) <= tolerance
            assert found.value == pytest.approx(sheet.force_n(sheet.reference, ratio * 5e-3), rel=1.0001 * tolerance)
            taken.add(found.model)
    assert len(taken) >= 2


def test_past_the_zero_no_force_closes_the_switch():
    assert round(medium.first_zero("bonded"), 3) == 1.671
    assert round(medium.first_zero("frictionless"), 3) == 1.566
    assert point.force_n(SWITCH, 1.66 * 5e-3, 5e-3, "bonded") > 1000
    for ball in (None, PAPERS):
        found = PaddedSheet(SWITCH, 5e-3, ball).detects(1.68 * 5e-3)
        assert isinstance(found.value, NoSolution)
        assert re.search("1.68 thicknesses (of the cover )?away", found.value.reason)
        assert "from 1.671 on a point force on a bonded layer does not press it" in found.value.reason
    named = PaddedSheet(SWITCH, 5e-3).detects(1.68 * 5e-3, HALFSPACE)
    assert named.value < 200
    assert any("has no solution" in note for note in named.notes)


def test_hertz_stops_holding_where_the_patch_is_wider_than_the_foam():
    found = PaddedSheet(SWITCH, 5e-3, PAPERS).detects(0.0)
    assert found.notes == (
        "Hertz stops holding: at 26.24 N the patch has a radius of 11.76 mm, the foam is 5 mm thick",
    )
    assert PaddedSheet(SWITCH, 5e-3, SMALL).detects(0.0).notes == ()
    assert PaddedSheet(SWITCH, 5e-3).detects(0.0).notes == ("what touches is not known: a point force is taken",)


# ---- patches on layers


@pytest.mark.parametrize("within", ["bonded", "frictionless"])
@pytest.mark.parametrize(("wide", "away"), [(0.01, 0.0), (0.4, 0.9), (1.8, 0.8), (1.8, 2.4), (5.0, 4.5), (7.9, 8.0)])
def test_patch_on_a_layer_against_scipys_integral(within, wide, away):
    def wave(t):
        x = t * wide
        pressed = 3 * (math.sin(x) - x * math.cos(x)) / x**3 if x > 1e-2 else 1 - x**2 / 10
        return t * float(medium.transfer(within, np.array([t]))[0]) * pressed * special.j0(t * away)

    whole = sum(integrate.quad(wave, low, low + 5, limit=300, epsabs=1e-12)[0] for low in range(0, 30, 5))
    found = hertz_layer.stress_pa(1.0, wide * 1e-3, away * 1e-3, 1e-3, within) * 1e-6
    assert found == pytest.approx(whole / (2 * math.pi), abs=1e-8)


@pytest.mark.parametrize("model", PATCHES)
@pytest.mark.parametrize("offset", [0.0, 2e-3, 6e-3])
def test_the_switch_just_closes_under_the_force_that_is_found(model, offset):
    force = PaddedSheet(SWITCH, 5e-3, PAPERS).force_n(model, offset)
    for share, closed in ((1 - 1e-9, False), (1 + 1e-9, True)):
        stress = hertz_layer.stress_pa(share * force, PAPERS.patch_m(share * force), offset, 5e-3, model.within)
        assert (stress >= SWITCH.closing_pa) is closed


@settings(deadline=None, max_examples=40)
@given(
    st.sampled_from(PATCHES),
    st.floats(-3.0, -1.3),
    st.floats(5.0, 7.0),
    st.floats(0.0, 1.4),
    st.floats(-3.0, -1.5),
    st.floats(-1, 1.3),
)
def test_reach_undoes_force(model, radius, modulus, ratio, thickness, newtons):
    sheet = PaddedSheet(Switch(10**newtons), 10**thickness, Ball(10**radius, 10**modulus))
    force = sheet.force_n(model, ratio * sheet.thickness_m)
    assume(not isinstance(force, NoSolution))
    back = sheet.reach_m(model, force * (1 + 1e-12))
    assert back == pytest.approx(ratio * sheet.thickness_m, abs=1e-5 * sheet.thickness_m)


# ---- thickness


def test_best_thickness():
    assert 1 / sense.best_ratio() == pytest.approx(math.sqrt(1.5))
    assert sense.best_thickness_m(WORST) == pytest.approx(point.best_thickness_m(WORST))
    assert point.least_force_n(SWITCH, WORST) == pytest.approx(44.7066, abs=1e-4)
    for name in medium.MEDIA:
        best = sense.best_thickness_m(WORST, name)
        least = point.force_n(SWITCH, WORST, best, name)
        for share in (0.97, 0.99, 1.01, 1.03):
            assert point.force_n(SWITCH, WORST, share * best, name) > least


# ---- refusals


def test_a_force_too_small_says_what_it_takes():
    assert PaddedSheet(SWITCH, 5e-3).reaches(2.0).value.reason == (
        "2 N do not even close the switch right below; that takes 2.645 N"
    )
    assert PaddedSheet(SWITCH, 5e-3, PAPERS).reaches(12.0).value.reason == (
        "12 N do not even close the switch right below; that takes 26.24 N"
    )


def test_a_ball_too_soft_for_any_model():
    soft = PaddedSheet(SWITCH, 5e-3, Ball(0.1, 1e4))
    assert soft.force_n(PATCHES[1], 0.0).reason == (
        "a switch 0 mm from the axis stays open until the patch is 8 times as wide as the foam is thick"
    )
    softer = PaddedSheet(SWITCH, 5e-3, Ball(0.1, 1e3))
    assert softer.force_n(PATCHES[1], 0.0).reason == (
        "the patch is 42.71 mm in radius long before a switch closes, the foam is 5 mm thick"
    )
    assert softer.reach_m(PATCHES[1], 3.0).reason == "the patch is 60.82 mm in radius, the foam 5 mm thick"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: PaddedSheet(SWITCH, 5e-3).detects(0.0, tolerance=0.0),
            "tolerance is 0.0; it must be a finite number above 0",
        ),
        (
            lambda: PaddedSheet(SWITCH, 5e-3).detects(0.0, Model("bonded", "patch")),
            "model is 'bonded, patch'; a patch needs the radius R* and the modulus E* of the contact",
        ),
        (
            lambda: PaddedSheet(SWITCH, 5e-3).detects(0.0, Model("sand", "point")),
            "medium is 'sand'; it must be one of halfspace, bonded, frictionless",
        ),
        (
            lambda: PaddedSheet(SWITCH, 5e-3).detects(0.0, Model("bonded", "foot")),
            "contact is 'foot'; it must be one of point, patch",
        ),
    ],
)
def test_what_cannot_be_is_refused(make, message):
    with pytest.raises(CoverError) as caught:
        make()
    assert message in str(caught.value)
