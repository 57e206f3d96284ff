"""Own kinematics against Pinocchio, on a robot from a package and on one with every kind of joint."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from contactfpga.robot.body import urdf
from contactfpga.robot.body.joints import JointHistory
from contactfpga.robot.body.kinematics import Kinematics, Pose
from contactfpga.robot.body.state import BodyError, NoJoints

JVRC = "package://jvrc_description/urdf/jvrc1.urdf"

KINDS = """<robot name="kinds">
<link name="base"/><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
<joint name="turns" type="continuous"><parent link="base"/><child link="a"/>
  <origin xyz="0.1 -0.2 0.3" rpy="0.4 -0.5 0.6"/><axis xyz="1 2 -2"/></joint>
<joint name="slides" type="prismatic"><parent link="a"/><child link="b"/>
  <origin xyz="0 0.1 0"/><axis xyz="0 0 3"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="still" type="fixed"><parent link="b"/><child link="c"/><origin rpy="1.5707963 0 0"/></joint>
<joint name="follows" type="revolute"><parent link="c"/><child link="d"/><origin xyz="0.2 0 0"/>
  <limit lower="-3" upper="3" effort="1" velocity="1"/><mimic joint="turns" multiplier="-0.5" offset="0.25"/></joint>
</robot>"""


def random_angles(kinematics, seed):
    rng = np.random.default_rng(seed)
    return dict(zip(kinematics.joint_names, rng.uniform(-1, 1, len(kinematics.joint_names)).tolist()))


@pytest.fixture(scope="module")
def jvrc():
    pytest.importorskip("jvrc_description")
    return Kinematics(urdf.load(urdf.located(JVRC, Path())))


def test_poses_and_jacobians_are_those_of_pinocchio(jvrc):
    pinocchio = pytest.importorskip("pinocchio")
    model = pinocchio.buildModelFromUrdf(str(urdf.located(JVRC, Path())))
    data = model.createData()
    followed = {name: jvrc._follows[name] for name in model.names[1:]}  # this model turns each joint by itself
    for seed in range(3):
        angles = random_angles(jvrc, seed)
        q = np.zeros(model.nq)
        for name, (master, factor, offset) in followed.items():
            q[model.joints[model.getJointId(name)].idx_q] = factor * angles[master] + offset
        pinocchio.computeJointJacobians(model, data, q)
        pinocchio.updateFramePlacements(model, data)
        for link in ("L_ELBOW_Y_S", "R_LLITTLE_S", "rcamera", "base_link"):
            frame = model.getFrameId(link)
            ours, theirs = jvrc.pose(link, angles), data.oMf[frame]
            assert ours.rotation == pytest.approx(theirs.rotation, abs=1e-12)
            assert ours.point_m == pytest.approx(theirs.translation, abs=1e-12)
            offset = np.array([0.03, -0.02, 0.05])
            at = pinocchio.getFrameJacobian(model, data, frame, pinocchio.LOCAL_WORLD_ALIGNED).copy()
            at[:3] += np.cross(at[3:].T, offset).T
            expected = np.zeros((6, len(jvrc.joint_names)))
            for name, (master, factor, _) in followed.items():
                column = model.joints[model.getJointId(name)].idx_v
                expected[:, jvrc.joint_names.index(master)] += factor * at[:, column]
            assert jvrc.jacobian(link, theirs.translation + offset, angles) == pytest.approx(expected, abs=1e-12)


def test_every_kind_of_joint_moves_as_its_jacobian_says(tmp_path):
    (tmp_path / "kinds.urdf").write_text(KINDS)
    kinds = Kinematics(urdf.load(tmp_path / "kinds.urdf"))
    assert kinds.joint_names == ("turns", "slides")
    assert kinds.needed("d") == ("turns", "slides")
    angles = {"turns": 0.7, "slides": -0.2}
    here = np.array([0.05, 0.02, -0.01])
    jacobian = kinds.jacobian("d", kinds.pose("d", angles).apply(here), angles)
    step = 1e-6
    for column, name in enumerate(kinds.joint_names):
        ahead, back = (kinds.pose("d", angles | {name: angles[name] + way * step}) for way in (1, -1))
        assert (ahead.apply(here) - back.apply(here)) / (2 * step) == pytest.approx(jacobian[:3, column], abs=1e-8)
        spin = (ahead.rotation - back.rotation) / (2 * step) @ kinds.pose("d", angles).rotation.T
        assert (spin[2, 1], spin[0, 2], spin[1, 0]) == pytest.approx(jacobian[3:, column], abs=1e-8)


def test_roll_pitch_and_yaw_come_back():
    rng = np.random.default_rng(2)
    for rpy in [*rng.uniform(-1.5, 1.5, (20, 3)), (0.3, math.pi / 2, 0.0), (-2.0, -math.pi / 2, 0.0), (3.0, 0.1, -3.0)]:
        pose = Pose.of(rpy_rad=rpy)
        assert Pose.of(rpy_rad=pose.rpy_rad).rotation == pytest.approx(pose.rotation, abs=1e-8)


def test_missing_angle_is_named(jvrc):
    with pytest.raises(NoJoints, match="the angle of joint 'R_HIP_P' is missing; it moves link 'R_HIP_P_S'"):
        jvrc.pose("R_KNEE_S", {})


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('type="fixed"', 'type="floating"', "joint 'still' is of type 'floating'; only the single joint of the"),
        ("<robot", '<robot version="1.3"', "version is '1.3'; known are 1.0, 1.1, 1.2"),
        ('rpy="0.4 -0.5 0.6"', 'quat_xyzw="0 0 1 1"', 'quat_xyzw before URDF 1.1; write <robot version="1.1">'),
        ("</robot>", '<xacro:if value="0"/></robot>', "this is xacro; expand it with `xacro FILE > expanded.urdf`"),
        ('xyz="0 0 3"', 'xyz="0 0 ${h}"', "this is xacro; expand it with `xacro FILE > expanded.urdf`"),
        ('type="continuous"', 'type="planar"', "joint 'follows' follows 'turns', which is not there"),
        ('<link name="a"/>', "", "joint 'turns' names the link 'a', which is not there"),
        (
            '<link name="d"/>',
            '<link name="d"/><link name="e"/>',
            "2 links hang on no joint; a robot has one base",
        ),
        ('xyz="0 0 3"', 'xyz="0 0 nan"', "joint 'slides' says 'nan' where a finite number is due"),
        ("<robot", "<!DOCTYPE x><robot", "it declares a document type, which a URDF file does not need; remove it"),
    ],
)
def test_urdf_that_cannot_be_is_refused_in_one_line(tmp_path, old, new, says):
    assert old in KINDS
    (tmp_path / "odd.urdf").write_text(KINDS.replace(old, new))
    with pytest.raises(BodyError) as error:
        Kinematics(urdf.load(tmp_path / "odd.urdf"))
    assert says in str(error.value)
    assert "\n" not in str(error.value)


PLAIN, RPY = KINDS.encode(), b'rpy="0.4 -0.5 0.6"'
WORLD = b'<link name="w"/><joint name="f" type="floating"><parent link="w"/><child link="base"/></joint></robot>'


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b'<robot name="kinds"', b'\n \t<?xml version="1.0"?><robot name="kinds"'),
        (b'<robot name="kinds"', b'\xef\xbb\xbf\n<?xml version="1.0"?><robot name="kinds" xmlns="http://a.b"'),
        (b"</robot>", b'<gazebo><sensor:camera name="c"/></gazebo><xacro:gray/></robot>'),
        (b"</robot>", b"<!-- a -- b --><![CDATA[<!--]]><!-- \xff \n <link/> ---></robot>"),
        (b"</robot>", WORLD),
        (b"</robot>", WORLD.replace(b"floating", b"planar")),
        (PLAIN, PLAIN.replace(b"<robot", b'<robot version="1.1"').replace(RPY, b'quat_xyzw="0.1 -0.2 0.4 1.6"')),
    ],
)
def test_urdf_that_ros_loads_gives_the_same_poses(tmp_path, old, new):
    """Pinocchio reads with ROS's own parser."""
    pinocchio = pytest.importorskip("pinocchio")
    path = tmp_path / "kinds.urdf"
    path.write_bytes(PLAIN.replace(old, new))
    model = pinocchio.buildModelFromUrdf(str(path))
    data = model.createData()
    pinocchio.framesForwardKinematics(model, data, pinocchio.neutral(model))
    kinds = Kinematics(urdf.load(path))
    assert (kinds.robot.links, kinds.robot.root) == (("base", "a", "b", "c", "d"), "base")
    ours, theirs = kinds.pose("c", {"turns": 0.0, "slides": 0.0}), data.oMf[model.getFrameId("c")]
    assert np.c_[ours.rotation, ours.point_m] == pytest.approx(theirs.homogeneous[:3], abs=1e-12)


def test_angles_between_two_samples_are_on_the_line_between_them():
    history = JointHistory(turning=("wheel",))
    history.add(10.0, {"elbow": 1.0, "wheel": 3.0})
    history.add(10.1, {"elbow": 2.0, "wheel": -3.0})
    found = history(10.025)
    assert found == {"elbow": pytest.approx(1.25), "wheel": pytest.approx(3.0 + 0.25 * (math.tau - 6.0))}
    assert history(10.1)["elbow"] == 2.0
    assert history(10.11)["elbow"] == pytest.approx(2.1)


@pytest.mark.parametrize(
    ("time_s", "says"),
    [
        (9.9, "joint angles are known since 10.000 s, and not at 9.900 s"),
        (10.2, "no joint angles came for 0.400 s around the frame; allowed are 0.1"),
        (10.6, "the last joint angles are 0.200 s older than the frame; allowed are 0.02"),
    ],
)
def test_angles_that_are_not_known_are_not_guessed(time_s, says):
    history = JointHistory()
    history.add(10.0, {"elbow": 1.0})
    history.add(10.4, {"elbow": 2.0})
    with pytest.raises(NoJoints) as error:
        history(time_s)
    assert str(error.value) == says


def test_history_is_short():
    history = JointHistory(kept_s=1.0)
    for step in range(1000):
        history.add(step / 100, {"elbow": step})
    assert len(history._times) < 250
    assert history(9.005)["elbow"] == pytest.approx(900.5)
