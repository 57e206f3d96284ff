"""How far each push may vary without noise, against Clarabel, which shares no code with it."""

import sys

import numpy as np
import pytest
from bumpers import exerted, hexapod, in_cone, programmed, scattered, solved
from hypothesis import example, given, settings
from hypothesis import strategies as st

from contactfpga.robot.haptics.contact import PURE_FORCE_WITH_KNOWN_DIRECTION

SEEDS = st.integers(0, 2**32 - 1)
MU = 0.5


@pytest.mark.parametrize("count", [2, 3])
@given(seed=SEEDS, friction=st.sampled_from([0.1, 0.5, 1.2]))
@example(seed=1143701, friction=0.5)  # 0.05 % of friction change this interval by 0.5 %
@settings(max_examples=8, deadline=None)
def test_intervals_without_noise_are_those_of_clarabel(count, seed, friction):
    rng = np.random.default_rng(seed)
    points, normals = scattered(rng, count)
    forces = [in_cone(rng, normal, 0.9 * friction, rng.uniform(1, 30)) for normal in normals]
    loaded = exerted(points, forces)
    found = solved(points, normals, loaded, friction, cones=True)
    assert not found.beyond_friction
    size = max(one.normal_n for one in found)
    for one, force, (low, high) in zip(found, forces, programmed(points, normals, loaded, friction)):
        least, largest = one.interval_n
        for push in (one.normal_n, -force @ np.array(one.normal)):
            assert least - 1e-6 * size <= push <= (np.inf if largest is None else largest) + 1e-6 * size
        assert least == pytest.approx(max(0.0, low), rel=1e-6, abs=1e-6 * size)
        assert largest is None or largest == pytest.approx(high, rel=1e-6, abs=1e-6 * size)
        assert largest is not None or high is None or high > 500 * size


@pytest.mark.parametrize("friction", [0.0, 0.5, 2.0])
def test_three_zones_on_a_plane_have_exact_pushes(friction):
    """At any friction."""
    points = np.array([[0.05, 0, 0.01], [-0.03, 0.04, 0.01], [-0.02, -0.05, 0.01]])
    normals = np.tile([0, 0, 1.0], (3, 1))
    pushes = np.array([3.0, 8.0, 5.0])
    found = solved(points, normals, exerted(points, -pushes[:, None] * normals), friction)
    assert found.model == PURE_FORCE_WITH_KNOWN_DIRECTION
    for one, push in zip(found, pushes):
        assert one.normal_n == pytest.approx(push)
        assert one.interval_n == pytest.approx((push, push))


@pytest.mark.parametrize("count", [1, 2, 3])
def test_forces_and_intervals_need_numpy_alone(monkeypatch, count):
    """With noise, at friction's limit."""
    for library in ("clarabel", "scipy"):
        monkeypatch.setitem(sys.modules, library, None)
    rng = np.random.default_rng(0)
    points, normals = scattered(rng, count)
    forces = [in_cone(rng, normal, MU, 5) for normal in normals]
    found = solved(points, normals, exerted(points, forces, hexapod(60, 0.075).noise), cones=True)
    assert all(one.interval_n[0] <= 5.2 for one in found)
