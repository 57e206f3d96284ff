"""Where a sheet sits, from presses whose truth is known."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from model_board import DirectPort
from wire import Wire

import contactfpga
from contactfpga.robot.body import BodyError, registration
from contactfpga.robot.body.kinematics import Pose
from contactfpga.robot.body.plan import read
from contactfpga.robot.body.registration import Press
from contactfpga.tools import cli
from contactfpga.wire.protocol import Frame
from contactfpga.zones.zone import Zones

ROUND = contactfpga.Skin(surface="cylinder", radius_mm=40.0)
FLAT = contactfpga.Skin()
PLACES = [(10.0, 10.0), (140.0, 20.0), (75.0, 75.0), (20.0, 130.0), (150.0, 140.0)]


def plan_of(tmp_path, skin, **more):
    (tmp_path / "skin.toml").write_text(skin.to_toml())
    return read({"name": "arm", "skin": "skin.toml", **more}, tmp_path)


def truth(skin, pose, mirrored, x_mm, y_mm):
    """Point and normal in the link's frame, by hand."""
    x = 150.0 - x_mm if mirrored else x_mm
    if skin.radius_mm is None:
        point, normal = np.array([x, y_mm, 0.0]), np.array([0.0, 0.0, 1.0])
    else:
        normal = np.array([math.cos(x / 40), math.sin(x / 40), 0.0])
        point = 40 * normal + [0, 0, y_mm]
    return pose.rotation @ point / 1000 + pose.point_m, pose.rotation @ normal


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("skin", [ROUND, FLAT], ids=["cylinder", "plane"])
def test_pose_and_mounting_are_found(tmp_path, skin, mirrored):
    rng = np.random.default_rng(1)
    for _ in range(20):
        pose = Pose.of(rng.uniform(-0.5, 0.5, 3), rng.uniform(-1.5, 1.5, 3))
        presses = []
        for x, y in PLACES:
            point, normal = truth(skin, pose, mirrored, x, y)
            presses.append(Press(tuple(point), tuple(normal) if skin is FLAT else None, (x, y)))
        found = registration.register(plan_of(tmp_path, skin), presses)
        assert found.mirrored == mirrored
        assert found.pose.rotation == pytest.approx(pose.rotation, abs=1e-9)
        assert found.pose.point_m == pytest.approx(pose.point_m, abs=1e-9)
        assert found.rms_mm < 1e-6


def test_residual_and_sigma_tell_how_sure_it_is(tmp_path):
    rng = np.random.default_rng(3)
    pose, off, ratios = Pose.of((0.1, 0.2, 0.3), (0.3, -0.2, 0.9)), [], []
    plan = plan_of(tmp_path, ROUND)
    for _ in range(200):
        presses = [Press(tuple(truth(ROUND, pose, False, x, y)[0]), None, (x, y)) for x, y in PLACES]
        noisy = [Press(one.point_m, None, tuple(np.add(one.pressed_mm, rng.uniform(-5, 5, 2)))) for one in presses]
        found = registration.register(plan, noisy)
        off.append(found.rms_mm)
        turned = found.pose.rotation @ pose.rotation.T
        ratios.append(math.acos(min(1.0, (np.trace(turned) - 1) / 2)) / found.sigma_rad)
    # Of 10 coordinates along the sheet 6 go into the pose.
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(10 / math.sqrt(12) * math.sqrt(2 * 4 / 10), rel=0.25)
    assert 0.5 < np.sqrt(np.mean(np.square(ratios))) < math.sqrt(3)


@pytest.mark.parametrize(
    ("places", "normals", "says"),
    [
        (PLACES[:2], True, "2 points were pressed; a pose takes at least 3"),
        ([(10.0, 10.0), (50.0, 50.0), (100.0, 100.0)], False, "the points lie so nearly in a line that the angle"),
        (PLACES, False, "mounted as it is or mirrored, the points fit to 0.0 and 0.0 mm, which does not tell"),
    ],
)
def test_points_that_do_not_tell_are_refused(tmp_path, places, normals, says):
    presses = []
    for x, y in places:
        point, normal = truth(FLAT, Pose.of(), False, x, y)
        presses.append(Press(tuple(point), tuple(normal) if normals else None, (x, y)))
    with pytest.raises(BodyError) as error:
        registration.register(plan_of(tmp_path, FLAT), presses)
    assert str(error.value).startswith(says)


@pytest.mark.parametrize("columns", [[5], [5, 6], [15], [0, 15]])
def test_a_point_may_be_pressed_on_the_seam(columns):
    """The barycenter falls now on one side of it and now on the other."""
    skin = contactfpga.Skin(surface="cylinder", radius_mm=40.0, closed=True)
    frames = []
    for number in range(40):
        left = columns[number % len(columns)]
        record = np.array([[2, left + (left + 1) % 16, 8, int(left == 15)]], np.int64)
        frame = Frame(number, 10_000 * number, frozenset(), 0, 0, 1, 2, record, None)
        frames.append(Zones(frame, skin.sheet))
    x, y = registration.held(frames, 1.01 * skin.pitch_x_mm)
    middle = {(5,): 5.5, (5, 6): 6.0, (15,): 15.5, (0, 15): 0.0}[tuple(columns)]
    off = (x / skin.pitch_x_mm - middle + 8) % 16 - 8
    assert off == pytest.approx(0, abs=0.05)
    assert 0 <= x < 16 * skin.pitch_x_mm
    assert y == 40.0


class Pressing(DirectPort):
    """One place after the other is pressed for 0.5 s, with a pause and a second zone between."""

    def __init__(self, skin, places):
        super().__init__(skin)
        self.wire, self.places = Wire(skin), places

    def read(self, seconds):
        which, part = divmod(self.time_us / 1e6, 1.0)
        x, y = self.places[min(int(which), len(self.places) - 1)]
        spot = (4, round(0.4 * x), round(0.4 * y))
        self.moments = [] if part < 0.2 else [spot, (1, 15, 0)] if part < 0.3 else [spot] if part < 0.8 else []
        self.time_us += 20_000
        self._out += self.frame() if not self._out else b""
        return super().read(seconds) or super().read(seconds)


def test_command_waits_for_presses_and_prints_lines_for_the_table(tmp_path, capsys, monkeypatch):
    pose, places = Pose.of((0.1, 0.0, -0.2), (0.0, 0.0, math.pi)), [(10, 10), (140, 20), (75, 75), (20, 130)]
    (tmp_path / "round.toml").write_text(ROUND.to_toml())
    (tmp_path / "robot.toml").write_text('[[links]]\nname = "arm"\nskin = "round.toml"\nport = "a"\n')
    points = [truth(ROUND, pose, True, x, y)[0].tolist() for x, y in places]
    (tmp_path / "points.toml").write_text("".join(f"[[point]]\npoint_m = {point}\n" for point in points))
    boards = [contactfpga.open(Pressing(ROUND, places), ROUND) for _ in range(2)]
    monkeypatch.setattr("contactfpga.driver.driver.open", lambda port, skin: boards.pop())
    asked = ["body", "register", str(tmp_path / "robot.toml"), "arm", str(tmp_path / "points.toml")]
    assert cli.main([*asked]) == 0
    printed = capsys.readouterr().out
    assert printed.count("let go") == 4
    assert "point_m = [0.1, " in printed
    assert "mirrored = true\n" in printed
    assert "against robot.toml it is mirrored and turned by 180.0 degrees" in printed
    assert cli.main([*asked, "--json"]) == 0
    printed, asks = capsys.readouterr()
    assert json.loads(printed)["mirrored"]
    assert asks.count("let go") == 4


def test_command_takes_presses_from_the_file(tmp_path, capsys):
    plan_of(tmp_path, FLAT)
    (tmp_path / "robot.toml").write_text('[[links]]\nname = "arm"\nskin = "skin.toml"\n')
    lines = []
    for x, y in PLACES:
        point, normal = truth(FLAT, Pose.of((0.0, 0.0, 0.1)), False, x, y)
        lines.append(
            f"[[point]]\npoint_m = {point.tolist()}\nnormal = {(3 * normal).tolist()}\npressed_mm = [{x}, {y}]\n"
        )
    (tmp_path / "points.toml").write_text("".join(lines))
    asked = ["body", "register", str(tmp_path / "robot.toml"), "arm", str(tmp_path / "points.toml"), "--json"]
    assert cli.main(asked) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["point_m"] == pytest.approx([0, 0, 0.1])
    assert (found["mirrored"], found["turned_rad"]) == (False, pytest.approx(0, abs=1e-6))
    for old, new, says in (
        ("point_m", "point", "point 1 is {"),
        ("normal = [0.0, 0.0, 3.0]", "normal = [0, 0, 0]", "point 1: normal is [0, 0, 0], which has no direction"),
        ("pressed_mm = [10.0, 10.0]", "pressed_mm = [1]", "point 1: pressed_mm is [1]; it must be 2 numbers"),
        ("[[point]]", "[[points]]", "it holds no points; give a table"),
    ):
        (tmp_path / "points.toml").write_text("".join(lines).replace(old, new))
        assert cli.main(asked) == 1
        assert says in capsys.readouterr().err
