"""Intervals of pushes with the units' noise: how often they hold the true push, by contacts, wrenches and noise that
the test draws itself; the ends against Clarabel, and for one contact on one unit against the closed form."""

import dataclasses
import math

import numpy as np
import pytest
from bumpers import exerted, hexapod, in_cone, programmed, scattered, touch, units, wrench

from contactfpga.robot.haptics import HapticsError, LoadCells, calibrate, contacts
from contactfpga.robot.haptics.calibrate import PER_UNIT
from contactfpga.robot.haptics.units import read, write

MU = 0.5
Z = 1.959964


def drawn(rng, count, drag, surface):
    """Points, normals and forces: ``drag`` is the share of friction's cone that they use, 1 at the cone itself."""
    points, normals = scattered(rng, count)
    if surface == "plane":
        while True:
            points = np.column_stack([rng.uniform(-0.07, 0.07, (count, 2)), np.full(count, 0.01)])
            if count == 1 or min(np.linalg.norm(a - b) for i, a in enumerate(points) for b in points[:i]) > 0.03:
                break
        normals = np.tile([0.0, 0.0, 1.0], (count, 1))
    forces = []
    for normal, push in zip(normals, rng.uniform(2, 12, count)):
        full = in_cone(rng, normal, MU, push) + push * normal
        forces.append(drag * MU * push * full / np.linalg.norm(full) - push * normal)
    return points, normals, np.array(forces)


def share_inside(count, drag, surface, trials, sigma_m=0.0, felt_n=0.05, stated_n=0.05, seed=1):
    """Of all pushes, those within their intervals, and the share of frames that were said to be beyond friction."""
    rng, inside, beyond = np.random.default_rng(seed), [], 0
    root = np.linalg.cholesky(hexapod(60, sigma_n=felt_n).noise.covariance)
    noise = hexapod(60, sigma_n=stated_n).noise
    for _ in range(trials):
        points, normals, forces = drawn(rng, count, drag, surface)
        six = exerted(points, forces).array + root @ rng.standard_normal(6)
        off = sigma_m * rng.standard_normal((count, 3))
        seen = points + off - normals * (off * normals).sum(axis=1)[:, None]
        found = contacts(wrench(six, noise), [touch(p, n, MU, sigma_m) for p, n in zip(seen, normals)])
        beyond += found.beyond_friction
        for one, force, normal in zip(found, forces, normals):
            least, largest = one.interval_n
            inside.append(least <= -force @ normal <= (math.inf if largest is None else largest))
    return np.mean(inside), beyond / trials


@pytest.mark.parametrize("sigma_n", [0.05, 0.2])
def test_one_contact_on_one_unit_is_the_reading_and_its_noise(sigma_n):
    cells = LoadCells(units([(0.0, 0.0, 0.0)], [(0.0, 0.0, 1.0)], sigma_n))
    (one,) = contacts(cells.wrench([7.0]), [touch((0.0, 0.0, 0.01), (0.0, 0.0, 1.0), 0.0)])
    assert one.interval_n == pytest.approx((7.0 - Z * sigma_n, 7.0 + Z * sigma_n), abs=1e-6)
    (lifted,) = contacts(cells.wrench([-0.5 * sigma_n]), [touch((0.0, 0.0, 0.01), (0.0, 0.0, 1.0), 0.0)])
    # Pushes above 0 alone: the best is 0, and the misfit may exceed its own by 1.96 squared.
    assert lifted.interval_n == pytest.approx((0.0, sigma_n * (math.hypot(0.5, Z) - 0.5)), abs=1e-3 * sigma_n)


@pytest.mark.parametrize("drag", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_the_ends_are_those_of_clarabel(count, drag):
    rng = np.random.default_rng([count, 3])
    noise = hexapod(60).noise
    root = np.linalg.cholesky(noise.covariance)
    for _ in range(12):
        points, normals, forces = drawn(rng, count, drag, "cylinder")
        six = exerted(points, forces).array + root @ rng.standard_normal(6)
        found = contacts(wrench(six, noise), [touch(p, n, MU) for p, n in zip(points, normals)], cones=True)
        expected = programmed(points, normals, wrench(six, noise), None if found.beyond_friction else MU)
        size = max(one.normal_n for one in found)
        for one, (least, largest) in zip(found, expected):
            low, high = one.interval_n
            assert low == pytest.approx(max(0.0, least), rel=1e-6, abs=1e-6 * size)
            assert high is None or high == pytest.approx(largest, rel=1e-6, abs=1e-6 * size)
            assert high is not None or largest is None or largest > 500 * size


@pytest.mark.parametrize(
    ("count", "drag", "surface", "trials"),
    [(1, 0.0, "cylinder", 300), (1, 1.0, "cylinder", 60), (2, 0.5, "plane", 80), (3, 0.5, "plane", 30)],
)
def test_where_the_units_fix_a_push_its_interval_holds_it_in_95_of_100(count, drag, surface, trials):
    """Within three standard deviations of chance; with noise stated half as large as it is it does not."""
    share, beyond = share_inside(count, drag, surface, trials, sigma_m=0.002)
    assert share == pytest.approx(0.95, abs=3 * math.sqrt(0.95 * 0.05 / trials))
    assert (beyond > 0.2) == (drag == 1.0)
    if count > 1 or drag:
        return
    narrow, _ = share_inside(count, drag, surface, trials, felt_n=0.1)
    assert narrow < 0.95 - 3 * math.sqrt(0.95 * 0.05 / trials)


def test_a_drag_at_the_cone_is_reported_and_widens():
    """Two fingers side by side on a cylinder, 1 % inside friction's cone and 1 % beyond it."""
    cells, intervals = hexapod(60), []
    points, normals = np.array([[0.038, 0, 0.0], [0.0, 0.038, 0.05]]), np.array([[1.0, 0, 0], [0, 1.0, 0]])
    for drag in (0.99, 1.01):
        forces = [[-8.0, 0, 8 * MU * drag], [0, -8.0, 8 * MU * drag]]
        found = contacts(exerted(points, forces, cells.noise), [touch(*each, MU) for each in zip(points, normals)])
        assert found.beyond_friction == (drag > 1)
        assert all(one.interval_n[0] < 8 < (one.interval_n[1] or math.inf) for one in found)
        intervals.append([(one.interval_n[1] or math.inf) - one.interval_n[0] for one in found])
    assert all(wide > 2 * narrow for narrow, wide in zip(*intervals))


def together(sigma_n=0.05):
    """(6, 6) covariance of units that share a supply and parts of the bumper's bending."""
    mixed = np.random.default_rng(2).standard_normal((6, 2)) * [1.0, 1.5]
    whole = mixed @ mixed.T + 0.3 * np.eye(6)
    size = np.sqrt(np.diag(whole))
    return sigma_n**2 * whole / np.outer(size, size)


def test_noise_that_units_share_is_read_from_the_file_and_counts(tmp_path):
    cells = hexapod(60)
    made = LoadCells([dataclasses.replace(unit, gain_n=-0.5) for unit in cells.units], noise_n2=together())
    (tmp_path / "units.toml").write_text(write(made))
    again = LoadCells.load(tmp_path / "units.toml")
    assert again.noise_n2 == pytest.approx(together())
    geometry = cells.geometry
    for one in (made, again):
        assert one.noise.covariance == pytest.approx(geometry @ together() @ geometry.T)
    point, normal = np.array([0.038, 0, 0.02]), np.array([1.0, 0, 0])
    six = exerted([point], [[-9.0, 0, 0]])
    widths = []
    for noise in (made.noise, cells.noise):
        (found,) = contacts(dataclasses.replace(six, noise=noise), [touch(point, normal)])
        widths.append(found.interval_n[1] - found.interval_n[0])
    best = np.linalg.inv(made.noise.covariance)
    exerts = np.vstack([np.eye(3), [[0, -0.02, 0], [0.02, 0, -0.038], [0, 0.038, 0]]])
    sigma = math.sqrt(np.linalg.inv(exerts.T @ best @ exerts)[0, 0])
    assert widths[0] == pytest.approx(2 * Z * sigma, rel=1e-4)
    assert abs(widths[1] / widths[0] - 1) > 0.02


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ([[1.0, 2.0], [2.0, 1.0]], "exceeds what its variances allow"),
        ([[1.0, 0.5], [0.4, 1.0]], "not symmetric"),
        ([[0.0, 0.0], [0.0, 1.0]], "variance of 0"),
        ([[1.0, 0.0]], "2 lists of 2 numbers"),
        ([[float("nan"), 0.0], [0.0, 1.0]], "is nan; it must be a number"),
    ],
)
def test_what_is_no_covariance_of_noise_is_refused(given, said):
    two = [{"point_m": [x, 0, 0], "axis": [0, 0, 1]} for x in (0.0, 0.1)]
    with pytest.raises(HapticsError, match=said) as error:
        read({"unit": two, "noise_n2": given})
    assert "noise_n2" in str(error.value) or "covariance" in str(error.value)


def test_calibration_estimates_the_covariance_of_noise():
    """From 600 loads within 25 % of the largest variance; with too few it keeps what was stated. Taken for independent
    the same noise has ellipsoids of 95 % that hold less than 92 % of forces."""
    rng, cells = np.random.default_rng(3), hexapod(60)
    root = np.linalg.cholesky(together())
    loads = rng.uniform(-10, 10, (600, 6)) * [1, 1, 1, 0.05, 0.05, 0.05]
    readings = np.linalg.solve(cells.matrix, loads.T).T + rng.standard_normal((600, 6)) @ root.T + 0.3
    found = calibrate(cells, readings, loads).cells
    assert found.noise_n2 == pytest.approx(together(), abs=0.25 * 0.05**2)
    few = PER_UNIT * 6 - 1
    assert calibrate(cells, readings[:few], loads[:few]).cells.noise_n2 is None
    point, inside = np.array([0.038, 0, 0.02]), {"estimated": 0, "independent": 0}
    for _ in range(800):
        force = in_cone(rng, np.array([1.0, 0, 0]), MU, rng.uniform(2, 12))
        six = exerted([point], [force]).array + cells.matrix @ root @ rng.standard_normal(6)
        for name, noise in (("estimated", found.noise), ("independent", cells.noise)):
            made = contacts(wrench(six, noise), [touch(point, (1.0, 0, 0))])
            off = np.array(made[0].force_n) - force
            inside[name] += off @ np.linalg.solve(made.covariance_n2, off) < 7.815
    assert inside["estimated"] / 800 == pytest.approx(0.95, abs=0.025)
    assert inside["independent"] / 800 < 0.92
