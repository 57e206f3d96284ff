"""Values worked out apart from the code, to all their digits."""

import dataclasses

import numpy as np
import pytest
from bumpers import exerted, flat, hexapod, on_cylinder, touch, units, wrench

from contactfpga.design.cover.hertz import Ball
from contactfpga.design.cover.point import Switch
from contactfpga.design.cover.sense import Model, PaddedSheet
from contactfpga.robot.haptics import Closing, Cylinder, LoadCells, Locator, Plane, Reach, contacts, posterior
from contactfpga.skin import sheet

MU = 0.5


def digits(text):
    """Half a unit of the last digit that is printed."""
    return 0.5001 * 10.0 ** -len(str(text).partition(".")[2])


def near(value, text):
    return value == pytest.approx(float(text), abs=digits(text))


def over_radius(cells, radius_m=0.03):
    return cells.geometry / np.array([1, 1, 1, radius_m, radius_m, radius_m])[:, None]


def test_hexapod_of_45_degrees():
    scaled = over_radius(hexapod(45))
    values = np.linalg.svd(scaled, compute_uv=False)
    assert near(values[0] / values[-1], "1.41421356")
    assert all(near(value, "1.73205081") for value in values[:2])
    assert all(near(value, "1.22474487") for value in values[2:])
    assert abs(np.linalg.det(scaled)) == pytest.approx(6.75)


def test_hexapod_of_60_degrees():
    assert near(np.linalg.cond(over_radius(hexapod(60))), "2.44948974")


def test_radial_units_see_little():
    """A ring of them holds two components, two rings of three four."""
    normals = np.array([on_cylinder(60 * i, 0.0, 0.03)[1] for i in range(6)])
    ring = LoadCells(units(0.03 * normals, normals))
    heights = np.array([0, 0.12] * 3)[:, None] * np.array([[0, 0, 1.0]])
    assert (ring.rank, LoadCells(units(0.03 * normals + heights, normals)).rank) == (2, 4)


def test_readings_of_three_units_on_a_plane():
    cells = flat()
    loaded = exerted((0.02, -0.01, 0), (0, 0, -12))
    readings = np.linalg.lstsq(-cells.geometry, loaded.array, rcond=None)[0]
    assert all(near(*pair) for pair in zip(readings, ("2.93333333", "2.68581247", "6.38085419")))
    assert cells.wrench(readings).array == pytest.approx(loaded.array, abs=1e-12)


@pytest.mark.parametrize(("x", "millimeters"), [(0.0, "0.54126588"), (0.05, "0.65052062")])
def test_error_of_the_center_of_pressure(x, millimeters):
    cells = flat()
    center = Plane().center(dataclasses.replace(exerted((x, 0, 0), (0, 0, -12)), noise=cells.noise))
    assert near(1e3 * np.sqrt(np.trace(center.covariance_m2)), millimeters)


def test_force_over_preload_that_lifts_a_unit():
    cells = flat(preload_n=10 / 3)
    assert near(cells.lifting_n((0.09, 0, 0), (0, 0, -1)) / 10, "0.92724728")


def test_center_of_pressure_on_a_plane():
    center = Plane().center(wrench((3, -2, -12, 0.12, 0.24, 0.005)))
    assert center.point_m == pytest.approx((0.02, -0.01, 0))
    assert center.torsion_nm == pytest.approx(0.015)
    assert (center.normal_n, center.tangential_n) == pytest.approx((12, np.sqrt(13)))


def test_center_of_pressure_on_a_cylinder():
    center = Cylinder(0.038).center(wrench((-11.12089615, -5.41531799, 2, 0.38909183, -0.71261739, 0.114)))
    assert np.degrees(np.arctan2(center.normal[1], center.normal[0])) == pytest.approx(40, abs=1e-6)
    assert center.point_m[2] == pytest.approx(0.06, abs=1e-8)
    assert center.normal_n == pytest.approx(12, abs=1e-7)
    assert center.tangential_n == pytest.approx(np.sqrt(13), abs=1e-7)
    assert center.torsion_nm == pytest.approx(0.02, abs=1e-7)


def test_a_radius_without_the_foam_is_off():
    loaded = exerted((0.043, 0, 0), (-12, 6, 0))
    center = Cylinder(0.038).center(loaded)
    assert near(1e3 * abs(center.sheet_m[0]), "2.54448")
    assert near(-center.normal_n, "-11.571648")
    assert near(center.tangential_n, "6.789474")


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
        ([(0, 0.05), (90, 0.05)], [("10.6666666667", "16.0000000000"), ("2.6666666667", "8.0000000000")]),
        ([(0, 0.04), (90, 0.10)], [("11.155754", "13.460945"), ("3.155754", "5.460945")]),
        ([(0, 0.05), (180, 0.05)], [("8.0000000000", None), ("0.0000000000", None)]),
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


def test_least_norm_breaks_friction_and_is_not_returned():
    points, normals = zip(*(on_cylinder(*place) for place in ((0, 0.04), (90, 0.10))))
    loaded = exerted(points, [-12 * normals[0], -4 * normals[1]])
    found = contacts(loaded, [touch(*pair, MU) for pair in zip(points, normals)])
    null = np.array(found.null_space[0])
    forces = np.ravel([one.force_n for one in found])
    least = forces - (null @ forces) * null
    expected = ("-10.219482", "-1.780518", "-2.811344", "-1.780518", "-2.219482", "2.811344")
    assert all(near(*pair) for pair in zip(least, expected))
    assert forces == pytest.approx([-12, 0, 0, 0, -4, 0], abs=1e-9)


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


def test_three_closings_give_the_place_exactly():
    foam, model = PaddedSheet(Switch(), 0.005), Model("halfspace", "point")
    cells = [(0, 0), (0, 1), (1, 0)]
    forces = [foam.force_n(model, np.hypot(5e-3 * column - 1.2e-3, 5e-3 * row - 0.7e-3)) for row, column in cells]
    assert all(near(*pair) for pair in zip(forces, ("5.004595", "13.397579", "17.993643")))
    place = Locator(lattice(5.0), Reach(foam, model)).locate(
        cells, 18.0, [Closing(*c, f) for c, f in zip(cells, forces)]
    )
    assert (place.x_m, place.y_m) == pytest.approx((1.2e-3, 0.7e-3), abs=2e-6)
    assert place.method == "closings"


def lattice(pitch_mm, lines=16):
    return sheet.Sheet(
        rows=lines,
        columns=lines,
        connectivity=8,
        report="moments",
        barycenter_bits=0,
        zone_capacity=8,
        pitch_x_mm=pitch_mm,
        pitch_y_mm=pitch_mm,
        radius_mm=None,
        ghosts=False,
    )


@pytest.mark.parametrize(
    ("reach", "barycenter", "consistent"), [(1, 0.2314, 0.1818), (2, 0.1505, 0.0974), (3, 0.1309, 0.0851)]
)
def test_barycenter_against_the_set_of_consistent_places(reach, barycenter, consistent):
    found = posterior.static(float(reach), fineness=512 if reach == 1 else 256)
    assert found.barycenter_rms == pytest.approx(barycenter, abs=1e-4)
    assert found.set_rms == pytest.approx(consistent, abs=1e-4)
