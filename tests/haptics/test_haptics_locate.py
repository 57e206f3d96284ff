"""Places finer than the pitch: what is stated covers the contact, and what cannot be is told."""

import dataclasses

import numpy as np
import pytest
from bumpers import exerted, hexapod, on_cylinder

from contactfpga.robot.haptics import (
    Closing,
    Cylinder,
    HapticsError,
    Locator,
    Place,
    Plane,
    Touch,
    closed,
    contacts,
    solve,
)
from contactfpga.robot.haptics.posterior import radius_95
from contactfpga.robot.haptics.wrench import Wrench
from contactfpga.skin import Skin
from contactfpga.wire.protocol import Frame
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.haptics import coverage

QUIET = coverage.CoverageCase("closings", 5.0, coverage.RAMP, 0.0, 0.0)


def named(case):
    return f"{case.method} {case.pitch_mm:g} mm"


@pytest.mark.parametrize("case", coverage.RIGHT, ids=named)
def test_the_stated_radius_covers_the_contact(case):
    """In 95 +- 2 % of contacts; of these few, chance takes up to 10 % more."""
    found = coverage.run(case, 36, seed=3)
    assert found.covered >= 0.85
    if not np.isnan(found.theory_m):
        assert found.radius_m <= 1.5 * found.theory_m


def test_closings_alone():
    """Pitch 5: 0.15 mm without noise, 0.4 mm with 0.5 N of noise and thresholds spread by 10 %."""
    assert coverage.run(QUIET, 16).rms_m < 0.15e-3
    noisy = coverage.run(dataclasses.replace(QUIET, spread=0.1, force_sigma_n=0.5), 36)
    assert noisy.rms_m < 0.4e-3 < noisy.barycenter_m


def test_a_wrong_contact_is_noticed_and_never_worse_than_twice_the_barycenter():
    wrong = dataclasses.replace(QUIET, spread=0.02, force_sigma_n=0.1, true=coverage.PATCH)
    found = coverage.run(wrong, 16)
    assert found.disagreed > 0.5
    assert found.rms_m < 2 * found.barycenter_m


def test_evidence_that_no_place_explains_falls_back():
    finder = coverage.locator(QUIET)
    closings = [Closing(3, 3, 5.0), Closing(3, 4, 5.0), Closing(4, 3, 25.0), Closing(3, 5, 5.0)]
    place = finder.locate([(one.row, one.column) for one in closings], 30.0, closings)
    assert (place.agrees, place.method) == (False, "barycenter")


def test_the_set_is_asked_only_where_it_helps():
    finder = coverage.locator(QUIET)
    assert finder.locate([(3, 3)], 4.0).method == "barycenter"
    cells = [(3, 3), (3, 4), (4, 3), (4, 4)]
    assert finder.locate(cells, 30.0).method == "set"
    center = Place(17.5e-3, 17.5e-3, 1e-3, 1.6e-7 * np.eye(2), "center of pressure")
    assert finder.locate(cells, 30.0, center=center).method == "set + center of pressure"


def test_a_place_needs_cells_and_a_covariance():
    finder = coverage.locator(QUIET)
    with pytest.raises(HapticsError, match="no pressed cell"):
        finder.locate([], 5.0)
    with pytest.raises(HapticsError, match="no covariance"):
        finder.center(Plane().center(Wrench((0.0, 0.0, -5.0), (0.0, 0.0, 0.0))))


@pytest.mark.parametrize("ratio", [1.0, 2.0, 1000.0])
def test_radius_of_a_normal_distribution(ratio):
    rng = np.random.default_rng(1)
    covariance = np.diag([ratio**2, 1.0]) * 1e-6
    drawn = rng.multivariate_normal([0, 0], covariance, 200_000)
    assert radius_95(covariance) == pytest.approx(np.quantile(np.hypot(*drawn.T), 0.95), rel=0.01)


def zones(records, **sheet):
    """A frame of these records: area, sum of columns, sum of rows."""
    skin = Skin(rows=8, columns=8, pitch_x_mm=5.0, pitch_y_mm=5.0, **sheet)
    moments = np.array(records, np.int64).reshape(-1, 3)
    pressed = int(moments[:, 0].sum())
    frame = Frame(0, 0, frozenset(), 0, 0, len(moments), pressed, moments, None, None)
    return Zones(frame, skin.sheet)


def test_exact_sums_tell_which_switch_closed():
    before, after = zones([(2, 5, 6)]), zones([(3, 9, 8)])
    assert closed(before, after) == (2, 4)
    assert closed(after, before) is None
    assert closed(before, before) is None
    merged = zones([(4, 10, 12)])  # two zones become one by the cell between them
    assert closed(zones([(1, 2, 3), (2, 5, 7)]), merged) == (2, 3)


def test_zones_become_places_on_the_outside():
    """On the foam, not on the sheet; as unsure as a place within a cell."""
    found = solve.touched(zones([(1, 2, 4)]), Plane(0.005), 0.7)
    assert found == [Touch((0.010, 0.020, 0.005), (0.0, 0.0, 1.0), 0.7, found[0].point_sigma_m)]
    assert found[0].point_sigma_m == pytest.approx(5e-3 / np.sqrt(12))
    (round_link,) = solve.touched(zones([(1, 2, 4)], surface="cylinder", radius_mm=38.0), Cylinder(0.043))
    angle = 10 / 38
    assert round_link.point_m == pytest.approx((0.043 * np.cos(angle), 0.043 * np.sin(angle), 0.020))
    loaded = Wrench((0.0, 0.0, -6.0), (-0.12, 0.06, 0.0))
    (one,) = contacts(loaded, zones([(1, 2, 4)]), Plane(0.005))
    assert one.normal_n == pytest.approx(6)
    with pytest.raises(HapticsError, match="surface is missing"):
        contacts(loaded, zones([(1, 2, 4)]))


def test_the_center_of_pressure_on_the_sheet_under_the_foam():
    """The force enters 5 mm outside of the sheet, at 200 degrees, which a sheet around the link has at its own arc."""
    sheet = Skin(rows=16, columns=24, pitch_x_mm=9.9, pitch_y_mm=5.0, surface="cylinder", radius_mm=38.0).sheet
    finder = Locator(sheet, coverage.reach_of(coverage.POINT))
    cells = hexapod(60, 0.05)
    point, normal = on_cylinder(200, 0.04, 0.043)
    place = finder.center(Cylinder(0.043).center(exerted(point, -12 * normal, cells.noise)))
    assert (place.x_m, place.y_m) == pytest.approx((0.038 * np.radians(200), 0.04))
    outside = Cylinder(0.043).center(exerted(point, -12 * normal, cells.noise)).covariance_m2
    assert place.covariance_m2[0, 0] == pytest.approx(outside[0, 0] * (38 / 43) ** 2)
