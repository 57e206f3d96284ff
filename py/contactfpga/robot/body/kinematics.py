"""From joint angles to poses of links and to Jacobians."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from contactfpga.inputs.values import is_finite, shown
from contactfpga.robot.body.answer import BodyError, NoJoints
from contactfpga.robot.body.pose import Pose, turn
from contactfpga.robot.body.urdf import MOVING, Joint, Robot
from contactfpga.surfaces.shapes import Floats


class Kinematics:
    """A tree of links and joints. Angles are in rad, of prismatic joints in m."""

    def __init__(self, robot: Robot):
        self.robot = robot
        self._to = {joint.child: joint for joint in robot.joints.values()}
        moving = [joint for joint in robot.joints.values() if joint.kind in MOVING]
        self.joint_names: tuple[str, ...] = tuple(joint.name for joint in moving if joint.mimic is None)
        """Joints that follow no other one, in the order of the URDF: the columns of a Jacobian."""
        self._follows = {joint.name: self._master(joint) for joint in moving}
        self._order = self._from_root()
        self._chains: dict[str, list[Joint]] = {robot.root: []}
        for joint in self._order:
            self._chains[joint.child] = [*self._chains[joint.parent], joint]

    def _master(self, joint: Joint) -> tuple[str, float, float]:
        """The joint whose angle moves this one, with factor and offset."""
        factor, offset, seen = 1.0, 0.0, {joint.name}
        while joint.mimic is not None:
            name, times, plus = joint.mimic
            factor, offset = factor * times, offset + factor * plus
            if name in seen:
                raise BodyError(f"joint {shown(name)} follows itself")
            seen.add(name)
            joint = self.robot.joints[name]
        return joint.name, factor, offset

    def _from_root(self) -> list[Joint]:
        """All joints, each after the one that its parent hangs on."""
        hanging: dict[str, list[Joint]] = {}
        for joint in self.robot.joints.values():
            hanging.setdefault(joint.parent, []).append(joint)
        found = list(hanging.get(self.robot.root, ()))
        for joint in found:  # which grows
            found += hanging.get(joint.child, ())
        reached = {joint.child for joint in found}
        for link in self._to:
            if link not in reached:
                raise BodyError(f"link {shown(link)} hangs on itself")
        return found

    def needed(self, link: str) -> tuple[str, ...]:
        """The joints on whose angles the pose of this link depends."""
        names = (self._follows[joint.name][0] for joint in self._chains[link] if joint.kind in MOVING)
        return tuple(dict.fromkeys(names))

    def pose(self, link: str, angles: Mapping[str, float]) -> Pose:
        """Where a link's frame lies in the base frame. Raises :class:`NoJoints` where an angle is missing."""
        found = Pose.of()
        for joint in self._chains[link]:
            found = found @ joint.origin @ self._moved(joint, angles)
        return found

    def poses(self, angles: Mapping[str, float]) -> dict[str, Pose]:
        """:meth:`pose` of every link, in the time of one of the farthest."""
        found = {self.robot.root: Pose.of()}
        for joint in self._order:
            found[joint.child] = found[joint.parent] @ joint.origin @ self._moved(joint, angles)
        return found

    def jacobian(self, link: str, point_m: Floats, angles: Mapping[str, float]) -> Floats:
        """(6, n): how a point of the link, given in the base frame, moves with each of :attr:`joint_names`, in the base
        frame: three rows of its velocity, three of the link's angular velocity."""
        found = np.zeros((6, len(self.joint_names)))
        columns = {name: number for number, name in enumerate(self.joint_names)}
        pose = Pose.of()
        for joint in self._chains[link]:
            pose = pose @ joint.origin
            if joint.kind in MOVING:
                master, factor, _ = self._follows[joint.name]
                axis = factor * pose.turn(joint.axis)
                column = found[:, columns[master]]
                if joint.kind == "prismatic":
                    column[:3] += axis
                else:
                    column[:3] += np.cross(axis, point_m - pose.point_m)
                    column[3:] += axis
            pose = pose @ self._moved(joint, angles)
        return found

    def _moved(self, joint: Joint, angles: Mapping[str, float]) -> Pose:
        if joint.kind not in MOVING:
            return Pose.of()
        master, factor, offset = self._follows[joint.name]
        if master not in angles:
            raise NoJoints(f"the angle of joint {shown(master)} is missing; it moves link {shown(joint.child)}")
        value = angles[master]
        if not is_finite(value):
            raise NoJoints(f"the angle of joint {shown(master)} is {shown(value)}; it must be a finite number")
        value = factor * float(value) + offset
        if joint.kind == "prismatic":
            return Pose(np.eye(3), value * joint.axis)
        return Pose(turn(joint.axis, value), np.zeros(3))
