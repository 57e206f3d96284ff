"""The time that the forces of a frame take."""

import time

import numpy as np
import pytest
from bumpers import exerted, hexapod, scattered, touch

from contactfpga.robot.haptics import contacts

MU = 0.5


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

    At most 0.4 ms where numpy solves six equations in 6.7 us, with as much again for a busy machine.
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
    assert takes / solve < 2 * 400 / 6.7, f"{takes:.1f} us, {solve:.1f} us a solve"
