"""The time that forces take, the most contacts that a file may hold, and contacts nearly at one place."""

import time

import numpy as np
import pytest

from contactfpga.robot.haptics import contacts
from contactfpga.robot.haptics.contact import Touch
from contactfpga.robot.haptics.wrench import Wrench
from contactfpga.tools.commands.haptics.reading import MAX_CONTACTS

ROUNDING_N = 1e-12


def scene(rng, count, around_m, friction, sideways=0.0):
    """Contacts on a ball about ``around_m`` apart, and the wrench of random pushes on them."""
    middle = rng.normal(size=3)
    places = 0.05 * middle / np.linalg.norm(middle) + around_m * rng.normal(size=(count, 3))
    normals = places / np.linalg.norm(places, axis=1)[:, None]
    forces = -normals * rng.uniform(0.001, 2, (count, 1)) * (rng.random((count, 1)) < 0.7)
    forces += sideways * rng.normal(size=(count, 3))
    six = np.concatenate([forces.sum(0), np.cross(places, forces).sum(0)])
    touches = [Touch(tuple(place), tuple(normal), friction) for place, normal in zip(places.tolist(), normals.tolist())]
    return Wrench(tuple(six[:3].tolist()), tuple(six[3:].tolist())), touches


@pytest.mark.parametrize("sideways", [0.0, 0.3])
@pytest.mark.parametrize("cones", [False, True])
def test_the_most_contacts_take_no_second(sideways, cones):
    """About 0.3 s of processor time with all intervals; it was 8 to 13 s."""
    wrench, touches = scene(np.random.default_rng(5), MAX_CONTACTS, 0.05, 0.5, sideways)
    begun_s = time.thread_time()
    found = contacts(wrench, touches, cones=cones)
    held = [one.interval_n for one in found]
    assert time.thread_time() - begun_s < 2
    assert len(held) == MAX_CONTACTS


@pytest.mark.parametrize("around_m", [4e-9, 1e-7, 1e-3])
@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_every_interval_holds_its_own_push(around_m, friction):
    rng = np.random.default_rng(round(1 / around_m))
    for count in (2, 3, 3, 3, 3, 4, 5, 3, 3, 3):
        for _ in range(4):
            wrench, touches = scene(rng, count, around_m, friction)
            for one in contacts(wrench, touches):
                least, most = one.interval_n
                assert least <= one.normal_n + ROUNDING_N
                assert most is None or one.normal_n <= most + ROUNDING_N
