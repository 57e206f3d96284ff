"""The figures of docs/collisions.md: places of 480 touches on JVRC-1, pushes of 2,040 contacts on six units."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

from mujoco_rig import pressed, random_touches, robot

from contactfpga.mujoco import Sheets

pytestmark = [pytest.mark.campaign, pytest.mark.timeout(3600)]
UNITS = 'frame = "link"\n' + "".join(
    f"[[unit]]\npoint_m = [{0.075 + 0.06 * np.cos(angle)}, {0.075 + 0.06 * np.sin(angle)}, -0.02]\n"
    f"axis = [{-np.sin(angle) * np.sin(tilt)}, {np.cos(angle) * np.sin(tilt)}, {np.cos(tilt)}]\n"
    "gain_n = 0.02\nzero = 1500\nsigma_n = 0.05\nrange = [0, 4095]\n"
    for angle, tilt in zip(np.radians(np.arange(6) * 60), np.pi / 4 * np.array([-1, 1] * 3), strict=True)
)
"""A hexapod: six units on a ring of 60 mm, tilted by 45 degrees to either side in turn."""


def test_pushes_are_as_the_page_says(tmp_path):
    """As many contacts as MuJoCo has; for one, two and three at once the root mean square of the error and how many
    pushes lie in their intervals, which for all is 93 to 97 %."""
    toml = robot(tmp_path, "units = 6\nbaud = 6000000\n", 'units = "units.toml"\n')
    (tmp_path / "units.toml").write_text(UNITS)
    rng, errors, inside = np.random.default_rng(7), {1: [], 2: [], 3: []}, {1: [], 2: [], 3: []}
    for seed in range(1020):
        count = 1 + seed % 3
        contacts, true = heard(toml, random_touches(rng, count), 7000 + seed)
        assert len(contacts) == len(true) == count
        for one in contacts:
            nearest = min(true, key=lambda other: np.linalg.norm(np.array(other.point_m) - one.point_m))
            errors[count].append(one.normal_n - nearest.push_n)
            least, largest = one.interval_n
            inside[count].append(least <= nearest.push_n <= largest)
    found = [float(np.sqrt(np.mean(np.square(each)))) for each in errors.values()]
    assert found == pytest.approx([0.08, 0.15, 0.53], abs=0.006)
    assert [abs(float(np.mean(each))) for each in errors.values()] == pytest.approx([0, 0, 0], abs=0.035)
    shares = [100 * float(np.mean(each)) for each in inside.values()]
    assert shares == pytest.approx([93.8, 97.1, 97.5], abs=0.06)
    assert 93 < 100 * np.mean(np.concatenate(list(inside.values()))) < 97


def heard(toml, touches, seed):
    """The contacts of the first snapshot after 35 ms whose pushes are all known, and MuJoCo's."""
    model, data = pressed(toml, touches)
    with Sheets(model, data, toml, radius_m=0.005, seed=seed) as sheets:
        while data.time < 0.035:
            sheets.step()
        for _ in range(60):
            contacts = sheets.snapshot().contacts("link")
            if contacts and all(one.normal_n is not None for one in contacts):
                return contacts, sheets["link"].touches
            sheets.step()
    raise AssertionError(f"no pushes within 65 ms of {touches}")
