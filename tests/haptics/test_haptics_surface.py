"""Centers of pressure, and what is no covariance."""

import numpy as np
import pytest
from bumpers import exerted, in_cone, on_cylinder, random_bumper, wrench
from hypothesis import given, settings
from hypothesis import strategies as st

from contactfpga.robot.haptics import Cylinder, HapticsError, Noise, Plane

SEEDS = st.integers(0, 2**32 - 1)


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_the_center_of_pressure_is_the_contact(seed):
    """With any torsion; and its covariance follows the slopes, taken by differences."""
    rng = np.random.default_rng(seed)
    cells = random_bumper(rng)
    on_plane = np.array([*rng.uniform(-0.1, 0.1, 2), 0.02])
    for surface, point, normal in (
        (Cylinder(0.038), *on_cylinder(rng.uniform(-180, 180), rng.uniform(0, 0.15))),
        (Plane(0.02), on_plane, np.array([0, 0, 1.0])),
    ):
        force, torsion = in_cone(rng, normal, 0.5, rng.uniform(1, 30)), rng.uniform(-0.02, 0.02)
        six = exerted(point, force).array + [0, 0, 0, *(torsion * normal)]
        center = surface.center(wrench(six, cells.noise))
        assert center.point_m == pytest.approx(point, abs=1e-9)
        assert center.torsion_nm == pytest.approx(torsion, abs=1e-9)
        assert center.tangential_n == pytest.approx(np.linalg.norm(force + (-force @ normal) * normal), abs=1e-8)
        steps = 1e-6 * np.eye(6)
        ends = [[surface.center(wrench(six + sign * step)).sheet_m for sign in (1, -1)] for step in steps]
        slopes = np.array([(np.array(up) - down) / 2e-6 for up, down in ends]).T
        expected = slopes @ cells.noise.covariance @ slopes.T
        assert center.covariance_m2 == pytest.approx(expected, rel=1e-3, abs=1e-12)


def test_no_push_has_no_center_of_pressure():
    assert Plane().center(wrench((0, 0, 3, 0, 0, 0))) is None
    assert Cylinder(0.038).center(wrench((1, 0, 0, 0, 0, 0.1))) is None


def test_a_covariance_with_a_negative_direction_is_refused():
    """Others are in test_haptics_confidence.py."""
    covariance = np.eye(6)
    covariance[:3, :3] = np.eye(3) * 1.9 - 0.9
    with pytest.raises(HapticsError, match="below 0"):
        Noise.checked(covariance)
