"""Snapshots and their contacts: places against independent computations."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from model_board import DirectPort
from two_links import FLAT, ROBOT, ROUND, state_of, with_units

import contactfpga
from contactfpga.robot.body import Body, BodyError, JointHistory, NoJoints
from contactfpga.robot.body.kinematics import Pose
from contactfpga.robot.body.snapshot import Snapshot, forces_of, on_link
from contactfpga.robot.body.state import LinkState
from contactfpga.tracking.tracker import Tracker
from contactfpga.wire.protocol import Frame
from contactfpga.zones.units import UnitSamples
from contactfpga.zones.zone import Zones


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
    body = Body.load(with_units(robot))
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
    assert (arm.force_n, arm.normal_n, arm.interval_n) == (None, None, None)
    # Its noise is that of the force at a place that is certain at least, and that of the force alone at most.
    noise = 0.05**2 * cells.geometry @ cells.geometry.T
    x, y, z = chest.point_m
    exerts = np.vstack([np.eye(3), [[0, -z, y], [z, 0, -x], [-y, x, 0]]])
    certain = np.linalg.inv(exerts.T @ np.linalg.inv(noise) @ exerts)
    low, high = chest.interval_n
    assert low + high == pytest.approx(8.0)
    assert certain[2, 2] ** 0.5 < (high - low) / 2 / 1.95996 < noise[2, 2] ** 0.5
    assert json.loads(json.dumps(chest.to_dict()))["interval_n"] == [low, high]
    turned = chest.moved(Pose.of((0, 0, 1), (math.pi / 2, 0, 0)), "elsewhere")
    assert turned.force_n == pytest.approx((0.5, 4.0, -0.25))


def test_forces_of_a_recording_are_those_of_the_contacts_by_their_tracks(robot):
    plan = Body.load(with_units(robot)).links["chest"]
    zones = state_of(FLAT, 3, 5, 10.0).zones
    tracks = Tracker().update(zones)
    assert forces_of(plan, zones, tracks) is None
    zones._units = UnitSamples(0, tuple((plan.units.zeros + 1e4).tolist()), (0.0,) * 6, (False,) * 6)
    (found,) = forces_of(plan, zones, tracks)
    (contact,) = on_link(plan, LinkState(zones, 0.0, "ok", "", 10.0, tracks))
    assert contact.force_n == found.force_n
    assert contact.track == found.track == tracks.active[0].id
    assert found.point_m == contact.point_m


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


def test_a_closed_sheet_is_not_laid_on_a_cone(robot):
    """Bent around one, its ends lie apart."""
    skin = contactfpga.Skin(rows=6, columns=8, surface="cylinder", radius_mm=40.0, closed=True)
    (robot.parent / "flat.toml").write_text(skin.to_toml())
    robot.write_text(ROBOT.replace("mirrored = true", "surface = {radius_mm = 40.0, slope = 0.15}"))
    with pytest.raises(BodyError) as error:
        Body.load(robot)
    assert str(error.value).endswith(
        "link 'chest': surface is a cone, around which the ends of a closed sheet do not meet; leave it out, or "
        "make a table of the link's shape with `contactfpga body surface`"
    )


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


def blurred(sigma_s):
    """Newest frames at 10 s on the body's clock, known to within ``sigma_s``."""
    states = {"arm": state_of(ROUND, 0, 0, 10.0), "chest": state_of(FLAT, 0, 0, 10.0)}
    for state in states.values():
        state.zones._line = state.zones._line._replace(sigma_s=sigma_s)
    return states


@pytest.mark.parametrize("since_s", [9.9, 10.0], ids=["known before", "known from the frame on"])
def test_place_is_as_uncertain_as_the_time_at_which_the_joint_moved(robot, since_s):
    """Of a contact at 1.5 rad/s and a time known to 4 ms: 6 mrad of the elbow's lever, in the way that it turns."""
    history = JointHistory(gap_s=1.0)
    for moment_s in (since_s, 10.1):
        history.add(moment_s, {"elbow": 1.5 * (moment_s - 10.0)})
    snapshot = Snapshot(Body.load(robot), 10.0, blurred(0.004), history)
    arm, chest = snapshot.contacts()
    assert (arm.time_sigma_s, chest.time_sigma_s) == (0.004, 0.004)
    still_arm, still_chest = Snapshot(Body.load(robot), 10.0, blurred(0.0), history).contacts()
    lever = np.array(arm.point_m) - [0.5, 0, 1]
    way = 1.5 * 0.004 * np.array([lever[2], 0, -lever[0]])
    added = arm.covariance_m2 - still_arm.covariance_m2
    assert added == pytest.approx(np.outer(way, way), rel=0.02, abs=1e-9)
    assert chest.covariance_m2 == pytest.approx(still_chest.covariance_m2), "no joint moves it"
    own = snapshot.contacts("link")[0]
    assert own.covariance_m2 == pytest.approx(
        Snapshot(snapshot._body, 10.0, blurred(0.0)).contacts("link")[0].covariance_m2
    )
    assert own.to_dict()["time_sigma_s"] == 0.004


def test_angles_known_at_one_moment_alone_say_nothing_of_motion(robot):
    def joints(host_time_s):
        if host_time_s != 10.0:
            raise NoJoints("no other moment is known")
        return {"elbow": 0.0}

    arm, _ = Snapshot(Body.load(robot), 10.0, blurred(0.004), joints).contacts()
    assert arm.covariance_m2 is None
    assert arm.point_m is not None


def test_base_frame_needs_angles_and_a_urdf(robot):
    states = {"arm": state_of(ROUND, 0, 0, 10.0), "chest": state_of(FLAT, 0, 0, 10.0)}
    with pytest.raises(NoJoints, match=r"give them to Body.open\(joints\)"):
        Snapshot(Body.load(robot), 10.0, states).contacts()
    robot.write_text(ROBOT.replace('urdf = "two.urdf"', ""))
    snapshot = Snapshot(Body.load(robot), 10.0, states, lambda _: {})
    with pytest.raises(BodyError, match=r"give robot.toml a urdf"):
        snapshot.contacts()
    assert len(snapshot.contacts("link")) == 2
