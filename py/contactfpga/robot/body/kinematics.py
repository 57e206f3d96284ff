"""A robot's links and joints; poses of links and Jacobians from joint angles."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np

from contactfpga.inputs.values import is_finite, shown
from contactfpga.robot.body.state import BodyError, NoJoints
from contactfpga.surfaces.shapes import Floats, Vector


@dataclasses.dataclass(frozen=True, eq=False)
class Pose:
    """A rotation, then a shift: ``apply`` maps points of the inner frame to the outer one."""

    rotation: Floats
    """(3, 3)."""
    point_m: Floats
    """(3,): origin of the inner frame."""

    @classmethod
    def of(cls, point_m: Vector = (0.0, 0.0, 0.0), rpy_rad: Vector = (0.0, 0.0, 0.0)) -> Pose:
        """A pose from an origin, and roll, pitch and yaw about the outer frame's x, y and z axes, as in URDF."""
        roll, pitch, yaw = rpy_rad
        rotation = rotation_about((0, 0, 1), yaw) @ rotation_about((0, 1, 0), pitch) @ rotation_about((1, 0, 0), roll)
        return cls(rotation, np.array(point_m, float))

    @property
    def rpy_rad(self) -> Vector:
        """Roll, pitch and yaw; at a pitch of 90 degrees the yaw is 0."""
        r = self.rotation
        pitch = math.atan2(-r[2, 0], math.hypot(r[0, 0], r[1, 0]))
        if math.hypot(r[0, 0], r[1, 0]) < 1e-9:
            return math.atan2(-r[1, 2], r[1, 1]), pitch, 0.0
        return math.atan2(r[2, 1], r[2, 2]), pitch, math.atan2(r[1, 0], r[0, 0])

    def __matmul__(self, inner: Pose) -> Pose:
        """The composed pose of a frame with pose ``inner`` in this one."""
        return Pose(self.rotation @ inner.rotation, self.apply(inner.point_m))

    def apply(self, points_m: Floats) -> Floats:
        """(..., 3) points of the inner frame in the outer one."""
        return np.asarray(points_m @ self.rotation.T + self.point_m)

    def turn(self, vectors: Floats) -> Floats:
        """(..., 3) directions of the inner frame in the outer one."""
        return np.asarray(vectors @ self.rotation.T)


def rotation_about(axis: Vector | Floats, angle_rad: float) -> Floats:
    """(3, 3) rotation about a unit vector, by Rodrigues."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], float)
    return np.asarray(np.eye(3) + math.sin(angle_rad) * cross + (1 - math.cos(angle_rad)) * (cross @ cross))


MOVING = ("revolute", "continuous", "prismatic")


@dataclasses.dataclass(frozen=True, eq=False)
class Joint:
    name: str
    kind: str
    """One of :data:`MOVING`, or ``fixed``."""
    parent: str
    child: str
    origin: Pose
    """Pose of the child's frame in the parent's, at angle 0."""
    axis: Floats
    """(3,): unit vector in the child's frame; 0 if fixed."""
    mimic: tuple[str, float, float] | None = None
    """Joint that this one follows, with factor and offset."""


@dataclasses.dataclass(frozen=True, eq=False)
class Robot:
    name: str
    links: tuple[str, ...]
    joints: dict[str, Joint]
    root: str
    """The link that is no joint's child: the base frame."""


class Kinematics:
    """A tree of links and joints. Angles are in rad, in m for prismatic joints."""

    def __init__(self, robot: Robot):
        self.robot = robot
        self._to = {joint.child: joint for joint in robot.joints.values()}
        moving = [joint for joint in robot.joints.values() if joint.kind in MOVING]
        self.joint_names: tuple[str, ...] = tuple(joint.name for joint in moving if joint.mimic is None)
        """Independent joints, in URDF order: the columns of a Jacobian."""
        self._follows = {joint.name: self._master(joint) for joint in moving}
        self._order = self._from_root()
        self._chains: dict[str, list[Joint]] = {robot.root: []}
        for joint in self._order:
            self._chains[joint.child] = [*self._chains[joint.parent], joint]

    def _master(self, joint: Joint) -> tuple[str, float, float]:
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
        names = (self._follows[joint.name][0] for joint in self._chains[link] if joint.kind in MOVING)
        return tuple(dict.fromkeys(names))

    def pose(self, link: str, angles: Mapping[str, float]) -> Pose:
        """The pose of a link's frame in the base frame. Raises :class:`NoJoints` if an angle is missing."""
        found = Pose.of()
        for joint in self._chains[link]:
            found = found @ joint.origin @ self._moved(joint, angles)
        return found

    def poses(self, angles: Mapping[str, float]) -> dict[str, Pose]:
        """Poses of all links, as fast as that of the farthest."""
        found = {self.robot.root: Pose.of()}
        for joint in self._order:
            found[joint.child] = found[joint.parent] @ joint.origin @ self._moved(joint, angles)
        return found

    def jacobian(self, link: str, point_m: Floats, angles: Mapping[str, float]) -> Floats:
        """(6, n): velocity, then the link's angular velocity, of a point of the link with each of :attr:`joint_names`,
        all in the base frame."""
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
        return Pose(rotation_about(joint.axis, value), np.zeros(3))
