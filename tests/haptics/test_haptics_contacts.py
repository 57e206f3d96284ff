"""Forces at contacts: random bumpers and loads, against oracles that share no code with them."""

import time

import numpy as np
import pytest
from bumpers import direction, exerted, flat, hexapod, in_cone, on_cylinder, touch, units, wrench
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from contactfpga.errors import MissingExtra
from contactfpga.haptics import Cylinder, HapticsError, LoadCells, Noise, Plane, batch, contacts
from contactfpga.haptics.contact import FULL_WRENCH, PURE_FORCE, PURE_FORCE_WITH_KNOWN_DIRECTION

SEEDS = st.integers(0, 2**32 - 1)
MU = 0.5
FACETS = 96
"""Of the cones of linear programs: 0.05 % wider than friction's."""


def random_bumper(rng, count=7):
    points = rng.normal(0, 0.05, (count, 3))
    return LoadCells(units(points, [direction(rng) for _ in range(count)], 0.03))


def scattered(rng, count):
    """Places on a cylinder, not too near to each other, with their normals."""
    while True:
        places = [on_cylinder(rng.uniform(0, 360), rng.uniform(0, 0.15)) for _ in range(count)]
        points, normals = np.array([p for p, _ in places]), np.array([n for _, n in places])
        gaps = np.linalg.norm(points[:, None] - points, axis=2) + np.eye(count)
        if gaps.min() > 0.01:
            return points, normals


def solved(points, normals, loaded, friction=MU, **how):
    return contacts(loaded, [touch(*pair, friction) for pair in zip(points, normals)], **how)


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
            ends.append(sign * run.fun if run.status == 0 else None)
        found.append(ends)
    return found


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_one_force_is_found_exactly(seed):
    rng = np.random.default_rng(seed)
    (point,), (normal,) = scattered(rng, 1)
    force = in_cone(rng, normal, MU, rng.uniform(0.1, 50))
    for noise in (None, random_bumper(rng).noise):
        (found,) = result = solved([point], [normal], exerted(point, force, noise))
        assert found.force_n == pytest.approx(force, abs=1e-9)
        assert found.interval_n == pytest.approx((found.normal_n, found.normal_n))
        assert found.normal_n == pytest.approx(-force @ normal)
        assert (result.model, result.rank, result.beyond_friction) == (PURE_FORCE, 3, False)


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_two_pushes_without_friction_are_found_exactly(seed):
    rng = np.random.default_rng(seed)
    points, normals = scattered(rng, 2)
    pushes = rng.uniform(0.1, 50, 2)
    for noise in (None, random_bumper(rng).noise):
        found = solved(points, normals, exerted(points, -pushes[:, None] * normals, noise))
        turned = abs((points[0] - points[1]) @ np.cross(*normals)) > 1e-4  # else normals may be a squeeze
        if turned:
            assert [one.normal_n for one in found] == pytest.approx(pushes, rel=1e-5)


@given(SEEDS, st.sampled_from([0.1, 0.5, 1.2]))
@settings(max_examples=15, deadline=None)
def test_intervals_of_two_are_those_of_linear_programs(seed, friction):
    rng = np.random.default_rng(seed)
    points, normals = scattered(rng, 2)
    forces = [in_cone(rng, normal, friction, rng.uniform(1, 30)) for normal in normals]
    loaded = exerted(points, forces)
    found = solved(points, normals, loaded, friction)
    assert not found.beyond_friction
    for one, force, (low, high) in zip(found, forces, oracle(points, normals, loaded.array, friction)):
        push = -np.array(one.force_n) @ one.normal
        least, largest = one.interval_n
        assert least - 1e-6 <= -force @ np.array(one.normal) <= (np.inf if largest is None else largest) + 1e-6
        assert least - 1e-6 <= push <= (np.inf if largest is None else largest) + 1e-6
        assert least == pytest.approx(low, abs=2e-3 * max(1, low))
        if largest is None:
            assert high is None
        elif high is not None and high < 1e3:
            assert largest == pytest.approx(high, rel=5e-3, abs=2e-3)


def test_forces_that_friction_allows_reach_both_ends():
    """Brute force: forces drawn within the cones that exert the same wrench never leave the interval, and fill it."""
    rng = np.random.default_rng(4)
    for _ in range(5):
        points, normals = scattered(rng, 2)
        forces = np.array([in_cone(rng, normal, MU, rng.uniform(2, 20)) for normal in normals])
        found = solved(points, normals, exerted(points, forces))
        along = (points[0] - points[1]) / np.linalg.norm(points[0] - points[1])
        squeezes = np.linspace(-200, 200, 400_001)
        both = forces[:, None] + np.stack([squeezes, -squeezes])[:, :, None] * along
        pushes = -np.einsum("ksi,ki->ks", both, normals)
        sideways = np.linalg.norm(both + pushes[:, :, None] * normals[:, None], axis=2)
        allowed = ((pushes >= 0) & (sideways <= MU * pushes)).all(axis=0)
        for number, one in enumerate(found):
            least, largest = one.interval_n
            reached = pushes[number, allowed]
            assert reached.min() == pytest.approx(least, abs=2e-3)
            if largest is not None and largest < 150:
                assert reached.max() == pytest.approx(largest, abs=2e-3)


@given(SEEDS)
@settings(max_examples=80, deadline=None)
def test_no_contact_ever_pulls(seed):
    """Whatever the wrench, also one that pulls, and however wrong friction is."""
    rng = np.random.default_rng(seed)
    points, normals = scattered(rng, int(rng.integers(1, 5)))
    noise = random_bumper(rng).noise if rng.random() < 0.5 else None
    loaded = wrench(rng.normal(0, 10, 6) * [1, 1, 1, 0.05, 0.05, 0.05], noise)
    for one in solved(points, normals, loaded, friction=float(rng.choice([0.0, 0.3, 1.0]))):
        assert one.normal_n >= 0
        assert np.array(one.force_n) @ one.normal <= 1e-9


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
    if sigma == 0:
        keep = np.eye(3 * count) - sum((np.outer(n, n) for n in result.null_space), np.zeros((3 * count,) * 2))
        spread = keep @ np.cov(np.transpose(found)) @ keep
        stated = result.covariance_n2
        assert np.sqrt(np.diag(spread)) == pytest.approx(np.sqrt(np.diag(stated)), rel=0.1, abs=2e-3)


def test_a_place_that_is_unsure_raises_no_alarm():
    """Without the place's own spread nearly every frame of a 12 N push would."""
    rng = np.random.default_rng(2)
    cells = hexapod(60, 0.075)
    reach = 3.8e-3
    alarms = {0.0: 0, reach / 2: 0}
    for _ in range(300):
        point, normal = on_cylinder(rng.uniform(0, 360), rng.uniform(0.02, 0.13))
        off = reach * np.sqrt(rng.random()) * np.array([np.cos(t := rng.uniform(0, 6.3)), np.sin(t)])
        shown = point + off[0] * np.cross([0, 0, 1], normal) + off[1] * np.array([0, 0, 1.0])
        six = exerted(point, -12 * normal).array + cells.geometry @ rng.normal(0, 0.05, 6)
        for sigma in alarms:
            alarms[sigma] += contacts(wrench(six, cells.noise), [touch(shown, normal, MU, sigma)]).alarm
    assert alarms[reach / 2] == 0
    assert alarms[0.0] > 0.85 * 300


def test_what_only_the_units_see():
    """The sheet has one zone; a second push is in the wrench alone."""
    cells = hexapod(60, 0.075)
    points, normals = zip(on_cylinder(0, 0.03), on_cylinder(120, 0.12))
    both = exerted(points, [-12 * normals[0], -6 * normals[1]], cells.noise)
    seen = contacts(both, [touch(points[0], normals[0], MU, 0.002)])
    assert seen.alarm
    assert seen.unexplained is not None
    clean = exerted(points[0], -12 * normals[0], cells.noise)
    assert contacts(clean, [touch(points[0], normals[0], MU, 0.002)]).unexplained is None


def test_force_without_a_zone():
    cells = hexapod(60, 0.075)
    point, normal = on_cylinder(70, 0.1)
    found = contacts(exerted(point, -2 * normal, cells.noise), [], Cylinder(0.038))
    assert found.center.point_m == pytest.approx(point)
    assert (found.model, len(found), found.freedom, found.alarm) == (FULL_WRENCH, 0, 6, True)
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


@pytest.mark.parametrize("friction", [0.0, 0.5, 2.0])
def test_three_zones_on_a_plane_have_exact_pushes(friction):
    """At any friction, with scipy alone."""
    points = np.array([[0.05, 0, 0.01], [-0.03, 0.04, 0.01], [-0.02, -0.05, 0.01]])
    normals = np.tile([0, 0, 1.0], (3, 1))
    pushes = np.array([3.0, 8.0, 5.0])
    found = solved(points, normals, exerted(points, -pushes[:, None] * normals), friction)
    assert found.model == PURE_FORCE_WITH_KNOWN_DIRECTION
    for one, push in zip(found, pushes):
        assert one.normal_n == pytest.approx(push)
        assert one.interval_n == pytest.approx((push, push))


def test_normals_on_a_cylinder_have_rank_4_at_most():
    rng = np.random.default_rng(3)
    points, normals = scattered(rng, 6)
    found = solved(points, normals, exerted(points, -rng.uniform(1, 9, 6)[:, None] * normals))
    assert (found.model, found.rank) == (PURE_FORCE_WITH_KNOWN_DIRECTION, 4)
    assert np.shape(found.null_space) == (2, 6)


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


@given(SEEDS)
@settings(max_examples=8, deadline=None)
def test_cones_give_the_intervals_of_linear_programs(seed):
    pytest.importorskip("clarabel", reason="extra haptics")
    rng = np.random.default_rng(seed)
    points, normals = scattered(rng, 3)
    forces = [in_cone(rng, normal, 0.6 * MU, rng.uniform(1, 30)) for normal in normals]
    loaded = exerted(points, forces)
    found = solved(points, normals, loaded, cones=True)
    assert found.model == PURE_FORCE
    exerts = exerted(points, [one.force_n for one in found]).array
    assert exerts == pytest.approx(loaded.array, abs=2e-4 * np.abs(loaded.array).max())
    for one, (low, high) in zip(found, oracle(points, normals, loaded.array, MU)):
        assert one.interval_n[0] == pytest.approx(low, abs=1e-2 * max(1, low))
        assert (one.interval_n[1] is None) == (high is None)
        if high is not None and high < 1e3:
            assert one.interval_n[1] == pytest.approx(high, rel=2e-2)


def test_cones_agree_with_the_exact_intervals_of_two():
    pytest.importorskip("clarabel", reason="extra haptics")
    rng = np.random.default_rng(8)
    for _ in range(10):
        points, normals = scattered(rng, 2)
        loaded = exerted(points, [in_cone(rng, normal, 0.4, rng.uniform(1, 30)) for normal in normals])
        exact, cones = solved(points, normals, loaded), solved(points, normals, loaded, cones=True)
        for one, other in zip(exact, cones):
            pairs = [(low, np.inf if high is None else high) for low, high in (one.interval_n, other.interval_n)]
            assert pairs[1] == pytest.approx(pairs[0], rel=1e-4, abs=1e-4)


def test_without_the_solvers_the_extra_is_named(monkeypatch):
    points, normals = scattered(np.random.default_rng(0), 4)
    loaded = exerted(points, -5 * normals)
    monkeypatch.setitem(__import__("sys").modules, "clarabel", None)
    with pytest.raises(MissingExtra, match=r"\.\[haptics\]"):
        solved(points, normals, loaded)[0].interval_n  # noqa: B018
    monkeypatch.setitem(__import__("sys").modules, "scipy.optimize", None)
    with pytest.raises(MissingExtra, match=r"\.\[haptics\]"):
        solved(points, normals, loaded)


def test_contacts_at_one_place_are_refused():
    with pytest.raises(HapticsError, match="contacts 0 and 1 both lie at"):
        contacts(wrench([1] * 6), [touch((0, 0, 0), (0, 0, 1))] * 2)


def test_batches_give_what_single_frames_give():
    rng = np.random.default_rng(5)
    cells = random_bumper(rng)
    places = [scattered(rng, 2) for _ in range(40)]
    points, normals = (np.array(each) for each in zip(*places))
    forces = np.array([[in_cone(rng, n, MU, rng.uniform(1, 20)) for n in pair] for pair in normals])
    for noise in (None, cells.noise):
        loads = [exerted(*pair, noise) for pair in zip(points, forces)]
        six = np.array([one.array for one in loads])
        many, intervals = batch.two(six, points, normals, MU, noise)
        alone = batch.one(six, points[:, 0], noise)
        for number, load in enumerate(loads):
            pair = solved(points[number], normals[number], load)
            assert np.ravel(many[number]) == pytest.approx(np.ravel([one.force_n for one in pair]), abs=1e-6)
            stated = [[low, np.inf if high is None else high] for low, high in (one.interval_n for one in pair)]
            assert intervals[number] == pytest.approx(np.array(stated), rel=1e-6, abs=1e-6)
            (single,) = contacts(load, [touch(points[number, 0], -alone[number] / np.linalg.norm(alone[number]))])
            assert alone[number] == pytest.approx(single.force_n, abs=1e-8)
        for surface in (Cylinder(0.038), Plane(0.01)):
            centers = [surface.center(load) for load in loads]
            expected = [[np.nan] * 3 if center is None else center.point_m for center in centers]
            assert batch.centers(surface, six) == pytest.approx(np.array(expected), nan_ok=True)


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


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: c.__setitem__((0, 0), -1.0), "exceeds what its variances allow"),
        (lambda c: c.__setitem__((0, 1), 0.5), "not symmetric"),
        (lambda c: c.__setitem__((slice(0, 3), slice(0, 3)), np.eye(3) * 1.9 - 0.9), "below 0"),
    ],
)
def test_what_is_no_covariance_is_refused(change, message):
    covariance = np.eye(6)
    change(covariance)
    with pytest.raises(HapticsError, match=message):
        Noise.checked(covariance)


def cpu_us(work, repeats=150):
    best = np.inf
    for _ in range(25):
        start = time.process_time()
        for _ in range(repeats):
            work()
        best = min(best, time.process_time() - start)
    return 1e6 * best / repeats


@pytest.mark.parametrize("count", [1, 2])
def test_a_frame_takes_no_longer_than_a_few_small_solves(count, record_property):
    """Readings to contacts, with places that are unsure: at most 50 us where numpy solves six equations in 6.7 us."""
    cells = hexapod(60, 0.075)
    rng = np.random.default_rng(1)
    points, normals = scattered(rng, count)
    readings = np.linalg.solve(cells.matrix, exerted(points, -9 * normals).array)
    pairs = [(tuple(p.tolist()), tuple(n.tolist())) for p, n in zip(points, normals)]
    system, wanted = rng.standard_normal((6, 6)), rng.standard_normal(6)

    def frame():
        contacts(cells.wrench(readings), [touch(*pair, MU, 0.002) for pair in pairs])

    takes, solve = cpu_us(frame), cpu_us(lambda: np.linalg.solve(system, wanted))
    record_property("us", round(takes, 1))
    assert takes / solve < 50 / 6.7, f"{takes:.1f} us, {solve:.1f} us a solve"
