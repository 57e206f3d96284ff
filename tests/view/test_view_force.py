"""Forces in the view are drawn where they press."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tracker_frames import frame

from contactfpga.robot.haptics import LoadCells, Wrench, contacts
from contactfpga.surfaces import CylinderSurface, PlaneSurface
from contactfpga.tools.view import picture

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
FLAT = EXAMPLES / "units-flat.toml"


def test_an_arrow_ends_at_its_zone_and_is_as_long_as_its_force():
    cells, zones = LoadCells.load(FLAT), frame(0, [(10, 4)])
    force = SimpleNamespace(force_n=(1.0, 0.5, -5.0))
    ((tail, tip),) = picture.pushes([force], zones, cells, PlaneSurface())
    np.testing.assert_allclose(tip, [0.1, 0.04, 0.0], atol=1e-9)
    np.testing.assert_allclose((tip - tail) * 1000, np.array([1.0, 0.5, -5.0]) * picture.MM_PER_N, atol=1e-6)


def test_on_a_cylinder_it_points_at_its_axis():
    """However the units' own frame is turned: a push is a push."""
    cells, zones = LoadCells.load(FLAT), frame(0, [(7, 4)])
    ((tail, tip),) = picture.pushes([SimpleNamespace(force_n=(0.0, 0.0, -5.0))], zones, cells, CylinderSurface(40.0))
    angle = 70 / 40
    outward = np.array([np.cos(angle), np.sin(angle), 0.0])
    np.testing.assert_allclose(tip, 0.04 * outward + [0, 0, 0.04], atol=1e-9)
    np.testing.assert_allclose(tail - tip, 5e-3 * picture.MM_PER_N * outward, atol=1e-6)


def test_what_is_not_known_has_no_arrow():
    cells, zones = LoadCells.load(FLAT), frame(0, [(6, 4), (12, 12)])
    unknown = [SimpleNamespace(force_n=None), SimpleNamespace(force_n=(0.0, 0.0, -0.001))]
    assert picture.pushes(unknown, zones, cells, PlaneSurface()).shape == (0, 2, 3)


def test_the_shape_of_contacts_is_that_of_zones():
    """Arrows are paired with zones by their order."""
    cells, zones = LoadCells.load(FLAT), frame(0, [(3, 4), (12, 12)])
    found = contacts(Wrench((0.0, 0.0, -5.0), (0.0, 0.0, 0.0)), zones, cells.surface, sheet_m=cells.sheet_m)
    places = [(contact.point_m[0] + 0.075, contact.point_m[1] + 0.075) for contact in found]
    assert places == [pytest.approx((zone.x_mm / 1000, zone.y_mm / 1000)) for zone in zones]
