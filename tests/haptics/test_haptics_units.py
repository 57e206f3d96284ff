"""Readings to a wrench: signs, ends, weight, what is not seen, calibration, zeros that wander."""

import dataclasses

import numpy as np
import pytest
from bumpers import direction, exerted, flat, hexapod, units
from hypothesis import given, settings
from hypothesis import strategies as st

import contactfpga
from contactfpga.robot.haptics import Bumper, DriftWatch, HapticsError, LoadCells, Motion, calibrate
from contactfpga.robot.haptics.units import write

SEEDS = st.integers(0, 2**32 - 1)


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_units_that_balance_a_load_show_it(seed):
    """The oracle is the balance itself: what units and contacts exert on the bumper adds up to nothing."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(6, 9))
    points, axes = rng.normal(0, 0.05, (count, 3)), np.array([direction(rng) for _ in range(count)])
    readings = rng.normal(0, 20, count)
    cells = LoadCells(units(points, axes))
    found = cells.wrench(readings)
    by_units = exerted(points, readings[:, None] * axes).array
    assert found.array + by_units == pytest.approx(np.zeros(6), abs=1e-9)
    assert cells.wrenches([readings, 2 * readings])[1] == pytest.approx(2 * found.array)


def test_units_at_their_ends_and_lifted_ones_are_named():
    cells = flat(range=(-10.0, 50.0), preload_n=8.0)
    assert cells.wrench([0, 0, 0]).saturated == cells.wrench([0, 0, 0]).lifted == ()
    found = cells.wrench([50.0, -8.5, -11.0])
    assert (found.saturated, found.lifted) == ((0, 2), (1, 2))


def test_a_unit_lifts_where_it_says():
    cells = flat(preload_n=3.0)
    point, down = np.array([0.09, 0.01, 0.0]), np.array([0, 0, -1.0])
    least = cells.lifting_n(tuple(point), tuple(down))
    for share, lifts in ((0.999, False), (1.001, True)):
        load = exerted(point, share * least * down).array
        readings = np.linalg.lstsq(cells.matrix, load, rcond=None)[0]
        assert bool(cells.wrench(readings).lifted) == lifts
    assert cells.lifting_n((0, 0, 0), (0, 0, -1)) == np.inf


@pytest.mark.parametrize(("tilt", "rank", "lost"), [(45, 6, 0), (90, 3, 3)])
def test_what_the_units_cannot_see(tilt, rank, lost):
    cells = hexapod(tilt, 0.04)
    assert (cells.rank, len(cells.unseen), len(cells.cannot_see)) == (rank, lost, lost)
    for wrench in cells.unseen:
        assert cells.geometry.T @ wrench == pytest.approx(np.zeros(6), abs=1e-12)
    if rank == 3:
        assert set(cells.cannot_see) == {"force along x", "force along y", "moment about z"}
        with pytest.raises(HapticsError, match="see 3 of 6"):
            cells.noise_at((0, 0, 0))


def rigid_body(bumper, position, motion, step=1e-4):
    """Force and moment about the origin by differences of momentum: a body of point masses that is carried along."""
    masses = np.full(4, bumper.mass_kg / 4)
    spread = 0.02 * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    points = np.array(bumper.center_m) + spread
    omega, alpha = np.array(motion.turning_rad_s), np.array(motion.turning_rad_s2)

    def moved(time):
        turn = omega * time + alpha * time**2 / 2
        angle = np.linalg.norm(turn)
        axis = turn / angle if angle else turn
        k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
        rotation = np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
        return points @ rotation.T + np.array(motion.acceleration_m_s2) * time**2 / 2

    accelerations = (moved(step) - 2 * moved(0.0) + moved(-step)) / step**2
    forces = masses[:, None] * (accelerations - np.array(motion.gravity_m_s2))
    return np.concatenate([forces.sum(axis=0), np.cross(points, forces).sum(axis=0)]), spread


def test_weight_and_inertia_are_taken_out():
    spread = 0.02 * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    inertia = 0.1 * (np.sum(spread**2) * np.eye(3) - spread.T @ spread)
    bumper = Bumper(0.4, (0.01, -0.02, 0.05), tuple(map(tuple, inertia.tolist())))
    motion = Motion((1.0, -9.0, 3.0), (2.0, 0.5, -1.0), (1.0, -2.0, 0.7), (3.0, 5.0, -4.0))
    carried, _ = rigid_body(bumper, None, motion)
    assert bumper.wrench(motion) == pytest.approx(carried, rel=1e-4)
    cells = LoadCells(hexapod(45).units, bumper=bumper, zero_gravity_m_s2=(0.0, 0.0, -9.8))
    at_rest = Motion((0.0, 0.0, -9.8))
    load = exerted((0.04, 0, 0.05), (-5, 1, 2)).array
    pushed = np.linalg.solve(cells.geometry, carried - bumper.wrench(at_rest) - load)
    assert cells.wrench(pushed, motion).array == pytest.approx(load, abs=1e-4)
    assert cells.wrench(np.zeros(6)).array == pytest.approx(np.zeros(6))
    assert cells.wrench(np.zeros(6), at_rest).array == pytest.approx(np.zeros(6), abs=1e-12)


def poses(rng, count):
    return [-9.80665 * direction(rng) for _ in range(count)]


HANGING = np.array([[0.04, 0, 0.0], [-0.02, 0.035, 0.03], [-0.02, -0.03, 0.12]])


def calibration(loads, seed=3):
    rng = np.random.default_rng(seed)
    nominal = hexapod(45, 0.05)
    gains = 1 + 0.05 * rng.standard_normal(6)
    zeros = rng.normal(0, 2, 6)
    true = LoadCells(
        [dataclasses.replace(u, gain_n=float(g), zero=float(z)) for u, g, z in zip(nominal.units, gains, zeros)]
    )
    readings = loads @ np.linalg.inv(true.matrix).T + true.zeros
    return nominal, true, readings + rng.normal(0, 0.03, readings.shape)


def test_18_known_loads_calibrate():
    rng = np.random.default_rng(4)
    loads = np.array([exerted(point, weight).array for weight in poses(rng, 6) for point in HANGING])
    nominal, true, readings = calibration(loads)
    found = calibrate(nominal, readings, loads)
    assert (found.rank, found.missing, found.advice) == (6, (), "the loads suffice")
    before = nominal.wrenches(readings) - loads
    assert found.residual_n < 0.1 < 0.3 < np.sqrt((before[:, :3] ** 2).sum(axis=1).mean())
    fresh = np.array([exerted(direction(rng) * 0.04, direction(rng) * 10).array for _ in range(50)])
    new = fresh @ np.linalg.inv(true.matrix).T + true.zeros
    off = found.cells.wrenches(new) - fresh
    assert np.sqrt((off[:, :3] ** 2).sum(axis=1).mean()) < 0.15


def test_loads_that_are_not_enough_are_named_and_do_no_harm():
    """The weight hung from one point: no moment about that point is known, and the nominal matrix is kept there."""
    rng = np.random.default_rng(5)
    loads = np.array([exerted((0, 0, 0.05), weight).array for weight in poses(rng, 12)])
    nominal, _, readings = calibration(loads)
    found = calibrate(nominal, readings, loads)
    assert found.rank == 3
    assert len(found.missing) == 3
    assert "rank 3, the units see 6" in found.advice
    assert "three points that lie on no line" in found.advice
    turned = np.array([0, 0, 0, 0, 0, 0.1])
    readings = np.linalg.solve(nominal.matrix, turned) + found.cells.zeros
    assert found.cells.wrench(readings).array == pytest.approx(turned, abs=0.25)


def test_a_load_that_was_written_down_wrong_is_noticed():
    rng = np.random.default_rng(6)
    loads = np.array([exerted(point, weight).array for weight in poses(rng, 6) for point in HANGING])
    nominal, _, readings = calibration(loads)
    loads[4] *= 1.5
    assert "look for a load that was written down wrong" in calibrate(nominal, readings, loads).advice
    with pytest.raises(HapticsError, match="6 loads are too few"):
        calibrate(nominal, readings[:6], loads[:6])


def test_zeros_are_read_only_while_nothing_touches():
    rng = np.random.default_rng(7)
    cells = hexapod(45)
    quiet = 5.0 + rng.normal(0, 0.05, (50, 6))
    assert cells.rezeroed(quiet, zones=0).zeros == pytest.approx(np.full(6, 5.0), abs=0.03)
    with pytest.raises(HapticsError, match="2 zones are pressed"):
        cells.rezeroed(quiet, zones=2)
    moved = quiet.copy()
    moved[25:, 3] += 1.0
    with pytest.raises(HapticsError, match="unit 3 varies by"):
        cells.rezeroed(moved, zones=0)
    with pytest.raises(HapticsError, match="5 readings are too few"):
        cells.rezeroed(quiet[:5], zones=0)


def test_drift_is_told_and_a_push_is_none():
    rng = np.random.default_rng(8)
    cells = hexapod(45)
    watch = DriftWatch(cells, over_s=5.0)
    for step in range(2000):
        time_s = 0.01 * step
        readings = rng.normal(0, 0.05, 6)
        pressed = 300 <= step < 500
        readings += 10.0 * pressed
        found = watch.update(time_s, readings, zones=int(pressed))
        assert found.drifted == ()
    for step in range(2000, 6000):
        readings = rng.normal(0, 0.05, 6) + np.array([0, 0, 0.4, 0, 0, 0])
        found = watch.update(0.01 * step, readings, zones=0)
    assert found.drifted == (2,)
    assert found.deviations_n[2] == pytest.approx(0.4, abs=0.02)


def test_the_example_file_is_read_and_written_back(tmp_path):
    cells = LoadCells.load(contactfpga.examples() / "units.toml")
    assert (cells.frame, cells.rank, len(cells.units)) == ("forearm", 6, 6)
    assert cells.wrench(cells.zeros).array == pytest.approx(np.zeros(6))
    again = tmp_path / "units.toml"
    again.write_text(write(cells))
    assert LoadCells.load(again).units == cells.units
    better = LoadCells(cells.units, bumper=cells.bumper, matrix=1.01 * cells.matrix)
    again.write_text(write(better))
    assert LoadCells.load(again).matrix == pytest.approx(1.01 * cells.matrix)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("unit = 3", "there is no unit"),
        ("[[unit]]\npoint_m = [0, 0, 0]", r"axis is missing in unit\[0\]"),
        ("[[unit]]\npoint_m = [0, 0]\naxis = [0, 0, 1]", r"unit\[0\].point_m is \[0, 0\]; it must be a list of three"),
        ("[[unit]]\npoint_m = [0, 0, 0]\naxis = [0, 0, 0]", "must point somewhere"),
        ("[[unit]]\npoint_m = [0, 0, 0]\naxis = [0, 0, 1]\ngain_n = 0", "gain_n is 0"),
        ("[[unit]]\npoint_m = [0, 0, 0]\naxis = [0, 0, 1]\nrange = [5, 2]", "the first reading must be below"),
        ("[[unit]]\npoint_m = [0, 0, 0]\naxis = [0, 0, 1]\nsigma = 2", "unknown key 'sigma'"),
        ("matrix = [[1]]\n[[unit]]\npoint_m = [0, 0, 0]\naxis = [0, 0, 1]", "matrix is .* 6 lists of 1 numbers"),
    ],
)
def test_bad_files_are_refused(tmp_path, text, message):
    path = tmp_path / "units.toml"
    path.write_text(text)
    with pytest.raises(HapticsError, match=message):
        LoadCells.load(path)


@pytest.mark.parametrize("readings", [[1.0] * 5, [[1.0] * 6], 3.0, [np.nan] * 6])
def test_bad_readings_are_refused(readings):
    with pytest.raises(HapticsError, match="readings"):
        hexapod(45).wrench(readings)
