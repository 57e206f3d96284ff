"""Values worked out apart from the code, to all their digits."""

import pytest

from contactfpga.design.cover.hertz import Ball
from contactfpga.design.cover.point import Switch
from contactfpga.design.cover.sense import Model, PaddedSheet
from contactfpga.robot.haptics import Reach, posterior


def digits(text):
    """Half a unit of the last digit that is printed."""
    return 0.5001 * 10.0 ** -len(str(text).partition(".")[2])


def near(value, text):
    return value == pytest.approx(float(text), abs=digits(text))


@pytest.mark.parametrize(
    ("model", "millimeters"),
    [
        (Model("halfspace", "point"), "3.634366"),
        (Model("bonded", "point"), "3.813657"),
        (Model("bonded", "patch"), "4.077134"),
    ],
    ids=str,
)
def test_reach_under_5_mm_of_foam(model, millimeters):
    ball = Ball(0.005, 4.6e5)
    foam = PaddedSheet(Switch(), 0.005, ball)
    assert near(1e3 * foam.reach_m(model, 12.0), millimeters)
    assert 1e3 * Reach(foam, model).reach_m(12.0) == pytest.approx(float(millimeters), abs=1e-4)


@pytest.mark.parametrize(
    ("reach", "barycenter", "consistent"), [(1, 0.2314, 0.1818), (2, 0.1505, 0.0974), (3, 0.1309, 0.0851)]
)
def test_barycenter_against_the_set_of_consistent_places(reach, barycenter, consistent):
    found = posterior.static(float(reach), fineness=512 if reach == 1 else 256)
    assert found.barycenter_rms == pytest.approx(barycenter, abs=1e-4)
    assert found.set_rms == pytest.approx(consistent, abs=1e-4)
