"""robot.toml, snapshots and their contacts: places against independent computations, the rest by what boards do."""

from __future__ import annotations

import json
import math
import shutil
import threading
import time

import numpy as np
import pytest
from model_board import DirectPort

import contactfpga
from contactfpga import cli
from contactfpga.body import Body, BodyError, JointHistory, NoJoints, NoLinkData, OpenBody
from contactfpga.body.pose import Pose
from contactfpga.body.snapshot import LinkState, Snapshot
from contactfpga.wire.protocol import Frame
from contactfpga.zones.units import UnitSamples
from contactfpga.zones.zone import Zones

URDF = """<robot name="two"><link name="torso"/><link name="arm"/>
<joint name="elbow" type="revolute"><parent link="torso"/><child link="arm"/>
<origin xyz="0.5 0 1"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint></robot>"""

ROBOT = """
urdf = "two.urdf"
[[links]]
name = "arm"
skin = "round.toml"
port = "a"
point_m = [0.1, 0.0, 0.0]
rpy_rad = [0.0, 1.5707963267948966, 0.0]
[[links]]
name = "chest"
frame = "torso"
skin = "flat.toml"
port = "b"
mirrored = true
"""
ROUND = contactfpga.Skin(surface="cylinder", radius_mm=40.0)
FLAT = contactfpga.Skin()


@pytest.fixture
def robot(tmp_path):
    (tmp_path / "two.urdf").write_text(URDF)
    (tmp_path / "round.toml").write_text(ROUND.to_toml())
    (tmp_path / "flat.toml").write_text(FLAT.to_toml())
    (tmp_path / "robot.toml").write_text(ROBOT)
    return tmp_path / "robot.toml"


@pytest.fixture
def patient(robot):
    """The same, for threads on a machine that is busy."""
    robot.write_text(ROBOT.replace("[[links]]", "[[links]]\nlate_s = 1.0\nsilent_s = 1.5"))
    return robot


class Streaming(DirectPort):
    """Sends a frame every 5 ms, and nothing once it is mute."""

    mute = False
    due_s = 0.0

    def read(self, seconds):
        if not self._out and seconds:
            time.sleep(0.001)
        if not self.mute and time.monotonic() >= self.due_s:
            self.due_s = time.monotonic() + 0.005
            self._out += self.frame()
        return super().read(seconds)

    def clock(self):
        return time.monotonic()


class Plugged:
    """Ports by name, for :class:`OpenBody`."""

    def __init__(self):
        self.ports = {}
        self.skins = {"a": ROUND, "b": FLAT}
        for name in self.skins:
            self.plug(name)

    def plug(self, name):
        self.ports[name] = Streaming(self.skins[name])

    def opened(self, plan):
        if plan.port not in self.ports:
            raise contactfpga.PortNotFound(f"{plan.port} is not there")
        return contactfpga.open(self.ports[plan.port], plan.skin)


def state_of(skin, x_cells, y_cells, frame_s):
    board = DirectPort(skin)
    board.moments = [(4, 4 * x_cells, 4 * y_cells)]
    with contactfpga.open(board, skin) as opened:
        return LinkState(opened.read(), 0.0, "ok", "", frame_s)


def wait_for(condition):
    end = time.monotonic() + 20
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.005)


def test_contacts_lie_where_the_geometry_says(robot):
    body = Body.load(robot)
    states = {"arm": state_of(ROUND, 3, 5, 10.0), "chest": state_of(FLAT, 3, 5, 10.0)}
    snapshot = Snapshot(body, 10.0, states, lambda _: {"elbow": 0.3})
    arm, chest = snapshot.contacts()
    angle = 30.0 / 40.0
    # On the cylinder; then its z axis becomes the arm's x axis, and its x axis the arm's -z axis.
    on_arm = np.array([0.1 + 0.05, 0.04 * math.sin(angle), -0.04 * math.cos(angle)])
    turned = [0.5 + on_arm[0] * math.cos(0.3) + on_arm[2] * math.sin(0.3), on_arm[1]]
    turned.append(1.0 - on_arm[0] * math.sin(0.3) + on_arm[2] * math.cos(0.3))
    assert arm.point_m == pytest.approx(turned)
    assert chest.point_m == pytest.approx((0.15 - 0.03, 0.05, 0.0)), "x counts from the last column"
    assert chest.normal == pytest.approx((0, 0, 1))
    assert np.diag(chest.covariance_m2) == pytest.approx([1e-4 / 12, 1e-4 / 12, 0])
    assert (arm.frame, arm.link, arm.host_time_s, arm.force_n) == ("base", "arm", 10.0, None)
    own = snapshot.contacts("link", links=["arm"])[0]
    assert (own.frame, own.point_m) == ("arm", pytest.approx(tuple(on_arm)))
    jacobian = snapshot.jacobian(arm)
    lever = np.array(turned) - [0.5, 0, 1]
    assert jacobian[:, 0] == pytest.approx([lever[2], 0, -lever[0], 0, 1, 0])
    assert snapshot.jacobian(own) == pytest.approx(jacobian)
    assert snapshot.joint_names == ("elbow",)
    json.dumps(arm.to_dict())


def test_force_is_that_which_the_units_measure(robot):
    robot.write_text(ROBOT.replace("mirrored = true", 'units = "units.toml"'))
    shutil.copy(contactfpga.examples() / "units.toml", robot.parent / "units.toml")
    body = Body.load(robot)
    cells = body.links["chest"].units
    state = state_of(FLAT, 3, 5, 10.0)
    push = np.array([0.5, -0.25, -4.0])
    exerted = np.concatenate([push, np.cross([0.03, 0.05, 0.0], push)])
    readings = cells.zeros + np.linalg.pinv(cells.matrix) @ exerted
    state.zones._units = UnitSamples(0, tuple(readings.tolist()), (0.0,) * 6, (False,) * 6)
    snapshot = Snapshot(body, 10.0, {"chest": state, "arm": state_of(ROUND, 0, 0, 10.0)}, lambda _: {"elbow": 0.0})
    chest, arm = snapshot.contacts(links=["chest", "arm"])
    assert chest.force_n == pytest.approx(tuple(push))
    assert chest.normal_n == pytest.approx(4.0)
    assert (arm.force_n, arm.normal_n) == (None, None)
    turned = chest.moved(Pose.of((0, 0, 1), (math.pi / 2, 0, 0)), "elsewhere")
    assert turned.force_n == pytest.approx((0.5, 4.0, -0.25))


def test_zone_without_a_place_is_a_contact_all_the_same(robot):
    board = DirectPort(FLAT)
    board.moments = [(0, 0, 0)]
    board.frame = lambda real=board.frame: real(flags=["mismatch"])
    with contactfpga.open(board, FLAT) as opened:
        states = {"arm": state_of(ROUND, 3, 5, 10.0), "chest": LinkState(opened.read(), 0.0, "ok", "", 10.0)}
    snapshot = Snapshot(Body.load(robot), 10.0, states, lambda _: {"elbow": 0.3})
    (chest,) = snapshot.contacts(links=["chest"])
    assert (chest.point_m, chest.normal, chest.covariance_m2, chest.flags) == (None, None, None, {"mismatch"})
    json.dumps(chest.to_dict())
    with pytest.raises(BodyError, match="a contact on link 'chest' has no place"):
        snapshot.jacobian(chest)


def test_ring_on_a_closed_sheet_is_a_contact_without_a_place(robot):
    skin = contactfpga.Skin(rows=6, columns=8, surface="cylinder", radius_mm=40.0, closed=True, report="cells")
    (robot.parent / "flat.toml").write_text(skin.to_toml())
    cells = np.zeros((6, 8), bool)
    cells[4] = cells[0, [0, 7]] = True  # a ring, and a spot that lies on the seam
    frame = Frame(0, 0, frozenset(), 0, 0, 0, 10, np.zeros((0, 4), np.int64), cells)
    states = {"arm": None, "chest": LinkState(Zones(frame, skin.sheet, 0), 0.0, "ok", "", 10.0)}
    body = Body.load(robot)
    seam, ring = Snapshot(body, 10.0, {"chest": states["chest"]}).contacts("link")
    assert ring.point_m is None
    assert ring.zone.area_cells == 8
    # Mirrored, columns 7 and 0 lie where 0 and 7 did: their middle is half a column before the x axis.
    angle = -math.tau / 16
    assert seam.point_m == pytest.approx((0.04 * math.cos(angle), 0.04 * math.sin(angle), 0.0))


def test_angles_are_those_of_the_frames_time(robot):
    history = JointHistory(gap_s=1.0)
    history.add(10.0, {"elbow": 0.0})
    history.add(10.4, {"elbow": 0.4})
    states = {"arm": state_of(ROUND, 0, 0, 10.1), "chest": state_of(FLAT, 0, 0, 9.0)}
    snapshot = Snapshot(Body.load(robot), 10.4, states, history)
    (arm,) = snapshot.contacts(links=["arm"])
    # The cylinder's x axis is the arm's -z axis: its cell (0, 0) lies at (0.1, 0, -0.04).
    assert arm.point_m[2] == pytest.approx(1.0 - 0.1 * math.sin(0.1) - 0.04 * math.cos(0.1))
    with pytest.raises(NoJoints, match=r"link 'chest': joint angles are known since 10.000 s, and not at 9.000 s"):
        snapshot.contacts()


def test_joints_that_fail_say_so_where_angles_are_needed(patient):
    def joints(_):
        raise KeyError("elbow")

    plugged = Plugged()
    with OpenBody(Body.load(patient), joints, opened=plugged.opened) as body, body.subscribe() as queue:
        first = queue.next(10.0)
        assert queue.next(10.0).host_time_s > first.host_time_s  # its threads go on
        snapshot = body.read(10.0)
        assert set(snapshot.answering) == {"arm", "chest"}
        with pytest.raises(NoJoints, match=r"^link 'arm': the joints given to the body failed: KeyError\('elbow'\)"):
            snapshot.contacts()
        assert snapshot.contacts("link") is not None


def test_base_frame_needs_angles_and_a_urdf(robot):
    states = {"arm": state_of(ROUND, 0, 0, 10.0), "chest": state_of(FLAT, 0, 0, 10.0)}
    with pytest.raises(NoJoints, match=r"give them to Body.open\(joints\)"):
        Snapshot(Body.load(robot), 10.0, states).contacts()
    robot.write_text(ROBOT.replace('urdf = "two.urdf"', ""))
    snapshot = Snapshot(Body.load(robot), 10.0, states, lambda _: {})
    with pytest.raises(BodyError, match=r"give robot.toml a urdf"):
        snapshot.contacts()
    assert len(snapshot.contacts("link")) == 2


def test_open_body_goes_on_without_a_link_and_takes_it_back(patient):
    plugged = Plugged()
    with OpenBody(Body.load(patient), lambda _: {"elbow": 0.0}, opened=plugged.opened) as body:
        assert len(body.read().contacts()) == 2
        port = plugged.ports.pop("a")
        port.read = lambda seconds: (_ for _ in ()).throw(contactfpga.PortLost("a is gone"))
        wait_for(lambda: body.latest().links["arm"].status == "lost")
        snapshot = body.read(timeout=5)
        with pytest.raises(NoLinkData, match=r"no data of arm: lost \(.*a is "):
            snapshot.contacts()
        assert [one.link for one in snapshot.contacts(links=snapshot.answering)] == ["chest"]
        plugged.plug("a")
        wait_for(lambda: body.latest().links["arm"].status == "ok")
        assert len(body.next().contacts()) == 2
        plugged.ports["b"].mute = True
        wait_for(lambda: body.latest().links["chest"].status == "silent")
        assert body.latest().links["chest"].zones is None
    with pytest.raises(contactfpga.BoardClosed):
        body.latest()


def test_ids_stay_with_contacts_that_move(patient):
    plugged = Plugged()
    with OpenBody(Body.load(patient), opened=plugged.opened) as body:
        first = body.read().contacts("link", links=["chest"])
        plugged.ports["b"].moments = [(4, 11, 6)]
        moved = body.read().contacts("link", links=["chest"])
        assert [one.track for one in first] == [one.track for one in moved] == [1]
        assert moved[0].point_m != first[0].point_m


def test_read_waits_for_frames_scanned_after_the_call(patient):
    plugged = Plugged()
    with OpenBody(Body.load(patient), opened=plugged.opened) as body:
        body.read()
        for port in plugged.ports.values():
            port.moments = [(9, 9, 9)]
        found = body.read()
        assert [one.zone.area_cells for one in found.contacts("link")] == [9, 9]


def test_subscription_gets_each_change_in_order_and_counts_what_it_drops(patient):
    plugged = Plugged()
    with OpenBody(Body.load(patient), opened=plugged.opened) as body:
        with body.subscribe(maxsize=8) as queue:
            times = [queue.next().host_time_s for _ in range(5)]
            wait_for(lambda: queue.dropped > 3)
        assert times == sorted(times)
        assert len(body.batch(0.05)) > 1
        with pytest.raises(ValueError, match="maxsize is 0"):
            body.subscribe(0)


def test_closing_wakes_who_waits_and_ends_all_threads(patient):
    plugged = Plugged()
    before = threading.active_count()
    body = OpenBody(Body.load(patient), opened=plugged.opened)
    queue = body.subscribe()
    body.close()
    body.close()
    with pytest.raises(contactfpga.BoardClosed):
        queue.next(5)
    assert threading.active_count() == before


def test_link_whose_code_fails_is_lost_and_says_why(patient):
    plugged = Plugged()

    def opened(plan):
        if plan.name == "arm":
            raise ZeroDivisionError("of a scene")
        return plugged.opened(plan)

    with OpenBody(Body.load(patient), opened=opened) as body:
        assert str(body.latest().links["arm"]) == "lost (no frame yet; of a scene)"
        assert body.read().answering == ("chest",)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('name = "chest"', 'name = "arm"', "two links are named 'arm'"),
        ('frame = "torso"', 'frame = "leg"', "link 'chest': frame is 'leg'; the URDF has no such link"),
        ('port = "b"', 'port = "a"', "links 'arm' and 'chest' have one port, 'a'"),
        ("mirrored = true", "mirrored = 1", "link 'chest': mirrored is 1; it must be true or false"),
        ("mirrored = true", "mirored = true", "link 'chest': unknown key 'mirored'; known are name"),
        ("mirrored = true", "late_s = 0.001", "link 'chest': late_s is 0.001; a board of this Skin may be silent for"),
        ("mirrored = true", "late_s = 1\nsilent_s = 0.5", "link 'chest': late_s is 1 and silent_s 0.5; late_s must be"),
        ("mirrored = true", 'surface = "none.npz"', "none.npz"),
        ("mirrored = true", "surface = {radius_mm = 3}", "link 'chest': surface is {'radius_mm': 3}; a cone is"),
        ("[0.1, 0.0, 0.0]", "[0.1, 0.0]", "link 'arm': point_m is [0.1, 0.0]; it must be a list of three numbers"),
        ("[0.1, 0.0, 0.0]", "[0.1, 0.0, 2000]", "link 'arm': point_m is [0.1, 0.0, 2000]"),
        ("two.urdf", "package://nobody/x.urdf", "no Python package 'nobody' is installed"),
        ("two.urdf", "package://contactfpga/../x.urdf", "it must name a file inside the package"),
        ('"round.toml"', "3", "link 'arm': skin is 3; it must be a text"),
        ("[[links]]", "[[link]]", "unknown key 'link'; known are urdf, links"),
    ],
)
def test_robot_that_cannot_be_is_refused_in_one_line(robot, capsys, old, new, says):
    robot.write_text(ROBOT.replace(old, new))
    assert cli.main(["body", str(robot)]) == 1
    printed = capsys.readouterr().err
    assert says in printed.replace("\n  ", " ")
    assert printed.startswith("contactfpga: ")


@pytest.mark.campaign  # compiles the boards of four links
def test_example_prints_contacts_in_the_base_frame(capsys):
    """Of four virtual links of a humanoid from a package."""
    pytest.importorskip("jvrc_description")
    example = str(contactfpga.examples() / "robot.toml")
    assert cli.main(["body", example, "--json", "--joint", "L_ELBOW_P=-0.8", "--timeout", "60"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert {name: link["status"] for name, link in found["links"].items()} == dict.fromkeys(
        ("left_forearm", "right_forearm", "chest", "left_shin"), "ok"
    )
    assert {one["link"] for one in found["contacts"]} == set(found["links"])
    assert {one["frame"] for one in found["contacts"]} == {"base"}
    chest = next(one for one in found["contacts"] if one["link"] == "chest")
    assert chest["normal"] == pytest.approx([1, 0, 0], abs=1e-5)
    assert cli.main(["body", example, "--joint", "NECK=1"]) == 1
    assert "--joint 'NECK' is no joint of the URDF; it has R_HIP_P, " in capsys.readouterr().err


def test_command_says_that_contacts_of_a_lost_link_are_not_known(robot, capsys):
    assert cli.main(["body", str(robot), "--frame", "link", "--timeout", "0.2"]) == 1
    printed = capsys.readouterr().out
    assert printed.count("contacts not known") == 2
    assert "arm: lost (no frame yet; a cannot be opened" in printed
