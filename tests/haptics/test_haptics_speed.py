"""Many frames at once, and what a single one takes."""

import dataclasses
import time

import numpy as np
import pytest
from bumpers import (
    exerted,
    hexapod,
    in_cone,
    random_bumper,
    scattered,
    solved,
    touch,
)

from contactfpga.robot.haptics import Cylinder, Plane, batch, contacts

MU = 0.5


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
            exact = solved(points[number], normals[number], dataclasses.replace(load, noise=None))
            stated = [[low, np.inf if high is None else high] for low, high in (one.interval_n for one in exact)]
            assert intervals[number] == pytest.approx(np.array(stated), rel=1e-6, abs=1e-6)
            (single,) = contacts(load, [touch(points[number, 0], -alone[number] / np.linalg.norm(alone[number]))])
            assert alone[number] == pytest.approx(single.force_n, abs=1e-8)
        for surface in (Cylinder(0.038), Plane(0.01)):
            centers = [surface.center(load) for load in loads]
            expected = [[np.nan] * 3 if center is None else center.point_m for center in centers]
            assert batch.centers(surface, six) == pytest.approx(np.array(expected), nan_ok=True)


def cpu_us(*works, repeats=150):
    """The best of 25 rounds for each; a round has one after the other, so that a busy machine slows them alike."""
    best = [np.inf] * len(works)
    for _ in range(25):
        for number, work in enumerate(works):
            start = time.thread_time()
            for _ in range(repeats):
                work()
            best[number] = min(best[number], time.thread_time() - start)
    return [1e6 * each / repeats for each in best]


@pytest.mark.parametrize("count", [1, 2])
def test_a_frame_takes_no_longer_than_a_few_small_solves(count, record_property):
    """Readings to contacts, with places that are unsure.

    At most 50 us where numpy solves six equations in 6.7 us, with as much again for a busy machine:
    an idle one takes 4.2 solves for one contact and 5.9 for two.
    """
    cells = hexapod(60, 0.075)
    rng = np.random.default_rng(1)
    points, normals = scattered(rng, count)
    readings = np.linalg.solve(cells.matrix, exerted(points, -9 * normals).array)
    pairs = [(tuple(p.tolist()), tuple(n.tolist())) for p, n in zip(points, normals)]
    system, wanted = rng.standard_normal((6, 6)), rng.standard_normal(6)

    def frame():
        contacts(cells.wrench(readings), [touch(*pair, MU, 0.002) for pair in pairs])

    takes, solve = cpu_us(frame, lambda: np.linalg.solve(system, wanted))
    record_property("us", round(takes, 1))
    assert takes / solve < 2 * 50 / 6.7, f"{takes:.1f} us, {solve:.1f} us a solve"
