"""Forces at contacts: random bumpers and loads, and what chance does to them."""

import numpy as np
import pytest
from bumpers import (
    exerted,
    flat,
    hexapod,
    in_cone,
    least_sideways,
    on_cylinder,
    placed,
    random_bumper,
    scattered,
    solved,
    touch,
    wrench,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls

from contactfpga.robot.haptics import Cylinder, contacts
from contactfpga.robot.haptics.contact import FULL_WRENCH, PURE_FORCE, PURE_FORCE_WITH_KNOWN_DIRECTION

SEEDS = st.integers(0, 2**32 - 1)
KINDS = ["scattered", "line", "near", "stacked", "parallel", "opposed"]
MU = 0.5
CHI2_1 = 3.841


def split(forces, normals):
    """(k,) pushes, and (k,) sizes of the parts along the surface."""
    pushes = -(forces * normals).sum(axis=1)
    return pushes, np.linalg.norm(forces + pushes[:, None] * normals, axis=1)


def weighed(pushes, sides):
    """The sum of squares that the chosen forces of three contacts or more have least."""
    return (sides**2).sum() + 0.03 * (pushes**2).sum()


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_one_force_is_that_of_the_closed_form(seed):
    """Generalized least squares of the wrench's six components, also where they pull or drag beyond friction."""
    rng = np.random.default_rng(seed)
    cells, ((point,), (normal,)) = random_bumper(rng), scattered(rng, 1)
    true = in_cone(rng, normal, 2 * MU, rng.uniform(1, 9))
    (exact,) = solved([point], [normal], exerted(point, true))
    assert exact.force_n == pytest.approx(true, abs=1e-9)
    assert exact.interval_n == pytest.approx((-true @ normal, -true @ normal))
    six = exerted(point, true).array + rng.multivariate_normal(np.zeros(6), cells.noise.covariance)
    exerts, best = np.vstack([np.eye(3), np.cross(point, np.eye(3)).T]), np.linalg.inv(cells.noise.covariance)
    spread = np.linalg.inv(exerts.T @ best @ exerts)
    force = spread @ exerts.T @ best @ six
    rest, push, half = six - exerts @ force, -normal @ force, 1.96 * np.sqrt(normal @ spread @ normal)
    found = solved([point], [normal], wrench(six, cells.noise))
    if push < 0:
        assert found[0].force_n == (0, 0, 0)
        return
    assert found[0].force_n == pytest.approx(force, rel=1e-6, abs=1e-8)
    assert found.chi2 == pytest.approx(rest @ best @ rest, rel=1e-5)
    assert found.covariance_n2 == pytest.approx(spread, rel=1e-5, abs=1e-9)
    assert (found.model, found.rank, found.freedom) == (PURE_FORCE, 3, 3)
    assert found.beyond_friction == (np.linalg.norm(force + push * normal) > MU * push)
    if push > 50 * half and np.linalg.norm(force + push * normal) < 0.8 * MU * push:
        assert found[0].interval_n == pytest.approx((push - half, push + half), rel=1e-4)


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_two_forces_have_the_smallest_parts_along_the_surface(seed):
    """Among all squeezes along the contacts' line, tried one by one, that keep both within friction's cones."""
    rng = np.random.default_rng(seed)
    points, normals = scattered(rng, 2)
    forces = np.array([in_cone(rng, normal, rng.choice([0.0, MU, 1.3 * MU]), rng.uniform(1, 9)) for normal in normals])
    along = (points[0] - points[1]) / np.linalg.norm(points[0] - points[1])
    tried = forces + np.linspace(-40, 40, 80001)[:, None, None] * np.array([along, -along])
    pushes = -(tried * normals).sum(axis=2)
    sides = np.linalg.norm(tried + pushes[:, :, None] * normals, axis=2)
    room = (MU * pushes - sides).min(axis=1)
    found = solved(points, normals, exerted(points, forces))
    if abs(room.max()) > 2e-3:
        assert found.beyond_friction == (room.max() < 0)
    if room.max() > 2e-3:
        least = np.where(room >= 0, (sides**2).sum(axis=1), np.inf).min()
        mine = np.array([np.array(one.force_n) + one.normal_n * np.array(one.normal) for one in found])
        assert (mine**2).sum() == pytest.approx(least, rel=0.01, abs=0.01)
    # Beyond friction, too: forces of any friction exert the wrench.
    assert found.wrench.array == pytest.approx(exerted(points, [one.force_n for one in found]).array, abs=1e-3)


@pytest.mark.parametrize("kind", KINDS)
@given(SEEDS)
@settings(max_examples=15, deadline=None)
def test_forces_of_many_are_those_of_clarabel(kind, seed):
    """Both find forces within friction's cones that have the smallest parts along the surface, or both find none.

    Clarabel has the places from their middle, in units of their spread, which turns moments but no force.
    """
    rng = np.random.default_rng(seed)
    points, normals = placed(rng, int(rng.integers(3, 7)), kind)
    friction, drag = np.full(len(points), rng.choice([0.1, MU, 1.2])), rng.choice([0.5, 1.0, 2.0])
    friction[0] *= rng.integers(2)
    true = [in_cone(rng, normal, drag * mu, rng.uniform(1, 30)) for normal, mu in zip(normals, friction)]
    middle = points - points.mean(axis=0)
    near = middle / np.sqrt((middle**2).mean())
    expected = least_sideways(near, normals, exerted(near, true), friction)
    found = solved(points, normals, exerted(points, true), friction, cones=True)
    assert found.beyond_friction == (expected is None)
    if expected is None:
        return
    forces, size = np.array([one.force_n for one in found]), np.abs(expected).max()
    assert exerted(near, forces).array == pytest.approx(exerted(near, true).array, abs=1e-7 * size)
    (pushes, sides), best = (split(each, normals) for each in (forces, expected))
    assert (sides <= friction * pushes + 1e-7 * size).all()
    assert weighed(pushes, sides) == pytest.approx(weighed(*best), rel=1e-6)


@pytest.mark.parametrize("friction", [0.0, MU])
@given(seed=SEEDS)
@settings(max_examples=40, deadline=None)
def test_misfits_are_those_of_least_squares(friction, seed):
    """Without friction the misfit is that of pushes, whatever the wrench. With friction, and with a contact left out,
    it is that of any forces within friction. Beyond friction it is not significant, and at most that of forces in
    pyramids of friction 10."""
    rng = np.random.default_rng(seed)
    points, normals = scattered(rng, int(rng.integers(2, 7)))
    noise = random_bumper(rng).noise
    six = rng.normal(0, 10, 6) * [1, 1, 1, 0.05, 0.05, 0.05]
    if friction:
        pressed = [in_cone(rng, normal, 2 * friction, rng.uniform(1, 9)) for normal in normals]
        six = exerted(points, pressed).array + rng.multivariate_normal(np.zeros(6), noise.covariance)
    root, points, normals = np.linalg.inv(np.linalg.cholesky(noise.covariance)), points[1:], normals[1:]

    def least(solve, ways):
        columns = root @ np.hstack([np.vstack([way.T, np.cross(points, way).T]) for way in ways])
        return ((columns @ solve(columns, root @ six)[0] - root @ six) ** 2).sum()

    found = solved(points, normals, wrench(six, noise), friction, cones=True)
    any_way, across = np.eye(3)[:, None] + 0 * normals, 10 * np.cross(normals, [0, 0, 1.0])
    low = high = least(np.linalg.lstsq, any_way) if friction else least(nnls, [-normals])
    if found.beyond_friction:
        turned = np.cross(normals, across)
        high = CHI2_1 + least(nnls, [side - normals for side in (across, -across, turned, -turned)])
    assert (1 - 1e-5) * low - 1e-6 < found.chi2 < (1 + 1e-5) * high + 1e-6


@given(SEEDS)
@settings(max_examples=80, deadline=None)
def test_no_contact_ever_pulls(seed):
    """Whatever the wrench, also one that pulls, however wrong friction is, and wherever contacts lie."""
    rng = np.random.default_rng(seed)
    points, normals = placed(rng, int(rng.integers(1, 6)), rng.choice(KINDS))
    noise = [None, random_bumper(rng).noise, hexapod(60).noise, hexapod(60, sigma_n=1e-4).noise][rng.integers(4)]
    loaded = wrench(rng.normal(0, 10, 6) * [1, 1, 1, 0.05, 0.05, 0.05], noise)
    friction = float(rng.choice([0.0, 1e-6, 0.3, 1.0, 100.0]))
    found = solved(points, normals, loaded, friction, cones=bool(rng.random() < 0.5))
    size = max(one.normal_n for one in found)
    for one in found:
        least, most = one.interval_n
        assert 0 <= least <= one.normal_n + 1e-9
        assert most is None or one.normal_n <= most + 1e-9
        assert np.array(one.force_n) @ one.normal <= 1e-9 * (1 + size)


@pytest.mark.parametrize("count", [2, 3])
def test_a_step_lost_in_rounding_widens_ranges_at_most(monkeypatch, count):
    """numpy finds a matrix singular, as it does in some frames and on some machines, at each of the steps in turn."""
    rng, inverse = np.random.default_rng(4), np.linalg.inv
    points, normals = scattered(rng, count)
    loaded = exerted(points, [in_cone(rng, normal, 0.9 * MU, 5) for normal in normals], hexapod(60).noise)
    calls, lost = [], set()

    def inverted(matrices):
        calls.append(len(matrices))
        if len(calls) - 1 in lost:
            raise np.linalg.LinAlgError("Singular matrix")
        return inverse(matrices)

    monkeypatch.setattr(np.linalg, "inv", inverted)
    whole = [one.interval_n for one in solved(points, normals, loaded, cones=True)]
    steps = [at for at, many in enumerate(calls) if many > 1]
    assert len(steps) > 5
    for at in steps:
        calls.clear()
        lost = {at}
        again = [one.interval_n for one in solved(points, normals, loaded, cones=True)]
        for (least, most), (low, high) in zip(again, whole):
            assert least == pytest.approx(low, abs=1e-4)
            assert (most or np.inf) == pytest.approx(high or np.inf, rel=1e-4)


def test_missing_friction_is_found_in_a_few_steps(monkeypatch):
    """Not after the 40 at which a program ends anyhow."""
    inverse, calls = np.linalg.inv, []
    points, normals = zip(on_cylinder(0, 0.0), on_cylinder(90, 0.05))
    dragged = exerted(points, [[-8, 0, 6], [0, -8, 6]], hexapod(60).noise)
    monkeypatch.setattr(np.linalg, "inv", lambda matrices: calls.append(matrices) or inverse(matrices))
    assert solved(points, normals, dragged).beyond_friction
    assert 10 < len(calls) < 40


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_a_turned_link_has_turned_forces(seed):
    rng = np.random.default_rng(seed)
    points, normals = scattered(rng, int(rng.integers(1, 4)))
    forces = [in_cone(rng, normal, 0.3, rng.uniform(1, 30)) for normal in normals]
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    moved = rng.normal(0, 0.2, 3)
    first = solved(points, normals, exerted(points, forces))
    second = solved(points @ turn.T + moved, normals @ turn.T, exerted(points @ turn.T + moved, forces @ turn.T))
    assert first.model == second.model
    if len(points) < 3 or first.model == PURE_FORCE_WITH_KNOWN_DIRECTION:
        for one, other in zip(first, second):
            assert turn @ one.force_n == pytest.approx(other.force_n, abs=1e-4)


@pytest.mark.parametrize("sigma", [0.0, 0.002])
@pytest.mark.parametrize("count", [1, 2])
def test_covariance_and_chi2_are_those_of_many_trials(count, sigma):
    rng = np.random.default_rng(7)
    cells = hexapod(60, 0.075)
    points, normals = scattered(rng, count)
    forces = -rng.uniform(8, 12, count)[:, None] * normals
    exact = exerted(points, forces).array
    found, chi2 = [], []
    for _ in range(1500):
        moved = points + sigma * rng.standard_normal(points.shape)
        six = (exerted(moved, forces).array if sigma else exact) + cells.geometry @ rng.normal(0, 0.05, 6)
        touches = [touch(*pair, MU, sigma) for pair in zip(points, normals)]
        result = contacts(wrench(six, cells.noise), touches)
        found.append(np.ravel([one.force_n for one in result]))
        chi2.append(result.chi2)
    freedom = 6 - result.rank
    assert result.freedom == freedom
    assert np.mean(chi2) == pytest.approx(freedom, rel=0.12)
    assert np.mean(np.array(chi2) > {1: 3.841, 3: 7.815}[freedom]) == pytest.approx(0.05, abs=0.02)
    keep = np.eye(3 * count) - sum((np.outer(n, n) for n in result.null_space), np.zeros((3 * count,) * 2))
    spread = keep @ np.cov(np.transpose(found)) @ keep
    stated = result.covariance_n2
    assert np.sqrt(np.diag(spread)) == pytest.approx(np.sqrt(np.diag(stated)), rel=0.1, abs=2e-3)


def test_force_without_a_zone():
    cells = hexapod(60, 0.075)
    point, normal = on_cylinder(70, 0.1)
    found = contacts(exerted(point, -2 * normal, cells.noise), [], Cylinder(0.038))
    assert found.center.point_m == pytest.approx(point)
    assert (found.model, len(found), found.freedom, found.alarm) == (FULL_WRENCH, 0, 6, True)
    assert found.unexplained.force_n == pytest.approx(-2 * normal)
    assert not contacts(wrench([0] * 6, cells.noise), [], Cylinder(0.038)).alarm
    rng = np.random.default_rng(1)
    quiet = [contacts(wrench(cells.geometry @ rng.normal(0, 0.05, 6), cells.noise), []).alarm for _ in range(2000)]
    assert np.mean(quiet) < 0.004


def test_a_squeeze_is_seen_by_the_sheet_alone():
    points, normals = zip(on_cylinder(0, 0.05), on_cylinder(180, 0.05))
    found = solved(points, normals, exerted(points, [-7 * normals[0], -7 * normals[1]], hexapod(60, 0.07).noise))
    assert len(found.unfelt) == 2
    assert [one.interval_n for one in found] == [(pytest.approx(0, abs=1e-9), None)] * 2
    pushed = solved(points[:1], normals[:1], exerted(points[0], -7 * normals[0], hexapod(60, 0.07).noise))
    assert pushed.unfelt == []


def test_three_units_on_a_plane_find_pushes():
    """They see no friction; its forces are not asked."""
    cells = flat()
    points = np.array([[0.03, 0.01, 0.0], [-0.04, 0.02, 0.0]])
    normals = np.tile([0, 0, 1.0], (2, 1))
    loaded = exerted(points, [[0, 0, -5], [0, 0, -9]])
    six = cells.wrench(np.linalg.lstsq(cells.matrix, loaded.array, rcond=None)[0])
    found = contacts(six, [touch(*pair) for pair in zip(points, normals)])
    assert [one.normal_n for one in found] == pytest.approx([5, 9])
    assert (found.model, found.rank, found.freedom) == (PURE_FORCE_WITH_KNOWN_DIRECTION, 2, 1)
