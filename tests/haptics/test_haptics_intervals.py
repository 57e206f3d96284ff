"""How far each push may vary, against linear programs and brute force, which share no code with it."""

import sys

import numpy as np
import pytest
from bumpers import exerted, hexapod, in_cone, scattered, solved
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from contactfpga.robot.haptics.contact import PURE_FORCE_WITH_KNOWN_DIRECTION

SEEDS = st.integers(0, 2**32 - 1)
MU = 0.5
FACETS = 96
"""Of the cones of linear programs."""
INSIDE = np.cos(np.pi / FACETS)
"""Friction of a cone of facets whose edges lie on friction's cone, as a share of friction."""


def facets(normal, friction, count=FACETS):
    """Rows A of A f <= 0 that hold a force within a cone of many facets, which touches friction's from outside."""
    first = np.cross(normal, [0.3, 0.5, 0.8])
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    turns = 2 * np.pi * np.arange(count) / count
    return np.cos(turns)[:, None] * first + np.sin(turns)[:, None] * second + friction * normal


def oracle(points, normals, six, friction):
    """Least and largest push of each contact by linear programs, None where there is no largest one."""
    count = len(points)
    equal = np.zeros((6, 3 * count))
    for number, point in enumerate(points):
        for axis in range(3):
            force = np.eye(3)[axis]
            equal[:, 3 * number + axis] = [*force, *np.cross(point, force)]
    rows = np.zeros((FACETS * count, 3 * count))
    for number, normal in enumerate(normals):
        rows[FACETS * number : FACETS * (number + 1), 3 * number : 3 * number + 3] = facets(normal, friction)
    found = []
    for number, normal in enumerate(normals):
        cost = np.zeros(3 * count)
        cost[3 * number : 3 * number + 3] = -normal
        ends = []
        for sign in (1, -1):
            run = linprog(sign * cost, rows, np.zeros(len(rows)), equal, six, bounds=(None, None))
            ends.append(sign * run.fun if run.status == 0 else None if run.status == 3 else np.nan)
        found.append(ends)
    return found


def lies_between(interval, outer, inner, close):
    """Friction's cone lies between both cones of facets, so its interval does; NaN where no force fits the inner."""
    (least, largest), (low, high), (low_inside, high_inside) = interval, outer, inner
    room = close * max(1, low)
    assert low - room <= least
    assert np.isnan(low_inside) or least <= low_inside + room
    if high is not None and high < 1e3:
        room = close * max(1, high)
        assert largest is not None
        assert largest <= high + room
        assert np.isnan(high_inside) or largest >= high_inside - room
    if largest is not None:
        assert high_inside is not None


@pytest.mark.parametrize(("count", "cones", "close"), [(2, False, 1e-6), (3, True, 1e-3)])
@given(seed=SEEDS, friction=st.sampled_from([0.1, 0.5, 1.2]))
@example(seed=1143701, friction=0.5)  # 0.05 % of friction change this interval by 0.5 %
@settings(max_examples=8, deadline=None)
def test_intervals_are_those_of_linear_programs(count, cones, close, seed, friction):
    rng = np.random.default_rng(seed)
    points, normals = scattered(rng, count)
    share = 0.6 if count > 2 else 1.0
    forces = [in_cone(rng, normal, share * friction, rng.uniform(1, 30)) for normal in normals]
    loaded = exerted(points, forces)
    found = solved(points, normals, loaded, friction, cones=cones)
    assert not found.beyond_friction
    outer = oracle(points, normals, loaded.array, friction)
    inner = oracle(points, normals, loaded.array, INSIDE * friction)
    for one, force, wide, narrow in zip(found, forces, outer, inner):
        push = -np.array(one.force_n) @ one.normal
        least, largest = one.interval_n
        for each in (push, -force @ np.array(one.normal)):
            assert least - close <= each <= (np.inf if largest is None else largest) + close
        lies_between(one.interval_n, wide, narrow, close)


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
