"""Values worked out apart from the code, to all their digits."""

import numpy as np
import pytest
from bumpers import exerted, hexapod, on_cylinder, touch, wrench

from contactfpga.design.cover.hertz import Ball
from contactfpga.design.cover.point import Switch
from contactfpga.design.cover.sense import Model, PaddedSheet
from contactfpga.robot.haptics import Reach, contacts, posterior

MU = 0.5


def digits(text):
    """Half a unit of the last digit that is printed."""
    return 0.5001 * 10.0 ** -len(str(text).partition(".")[2])


def near(value, text):
    return value == pytest.approx(float(text), abs=digits(text))


def test_one_contact_at_a_known_place():
    cells = hexapod(45, 0.06)
    loaded = wrench((-10, 0, 0, 0, -0.6, 0), cells.noise)
    found = contacts(loaded, [touch((0.038, 0, 0.063), (1, 0, 0))])
    assert near(found[0].force_n[0], "-9.976297")
    assert found[0].force_n[1] == pytest.approx(0, abs=1e-12)
    assert near(found[0].force_n[2], "-0.600474")
    assert near(found.chi2, "63.207796")
    assert (found.freedom, found.rank, found.null_space) == (3, 3, [])
    sigmas = cells.noise_at((0.038, 0, 0.06))
    assert all(near(*pair) for pair in zip(sigmas, ("0.0612372", "0.0456154", "0.0422131")))
    found = contacts(loaded, [touch((0.038, 0, 0.06), (1, 0, 0))])
    assert np.sqrt(np.diag(found.covariance_n2)) == pytest.approx(sigmas)


@pytest.mark.parametrize(
    ("places", "intervals"),
    [
        ([(0, 0.05), (90, 0.05)], [("10.666667", "16.000000"), ("2.666667", "8.000000")]),
        ([(0, 0.04), (90, 0.10)], [("11.155754", "13.460945"), ("3.155754", "5.460945")]),
        ([(0, 0.05), (180, 0.05)], [("8.000000", None), ("0.000000", None)]),
    ],
)
def test_intervals_of_two_pushes(places, intervals):
    points, normals = zip(*(on_cylinder(*place) for place in places))
    loaded = exerted(points, [-12 * normals[0], -4 * normals[1]])
    found = contacts(loaded, [touch(*pair, MU) for pair in zip(points, normals)])
    assert found.rank == 5
    for one, (low, high) in zip(found, intervals):
        assert near(one.interval_n[0], low)
        assert one.interval_n[1] is None if high is None else near(one.interval_n[1], high)


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
