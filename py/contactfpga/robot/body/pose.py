"""Where a frame lies in another one."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from contactfpga.surfaces.shapes import Floats, Vector


@dataclasses.dataclass(frozen=True, eq=False)
class Pose:
    """A turn, then a shift: ``apply`` takes points of the inner frame to the outer one."""

    rotation: Floats
    """(3, 3)."""
    point_m: Floats
    """(3,): the inner frame's origin."""

    @classmethod
    def of(cls, point_m: Vector = (0.0, 0.0, 0.0), rpy_rad: Vector = (0.0, 0.0, 0.0)) -> Pose:
        """From an origin, and roll, pitch and yaw about the outer frame's x, y and z axes, as in URDF."""
        roll, pitch, yaw = rpy_rad
        turned = turn((0, 0, 1), yaw) @ turn((0, 1, 0), pitch) @ turn((1, 0, 0), roll)
        return cls(turned, np.array(point_m, float))

    @property
    def rpy_rad(self) -> Vector:
        """Roll, pitch and yaw; at a pitch of 90 degrees the yaw is 0."""
        r = self.rotation
        pitch = math.atan2(-r[2, 0], math.hypot(r[0, 0], r[1, 0]))
        if math.hypot(r[0, 0], r[1, 0]) < 1e-9:
            return math.atan2(-r[1, 2], r[1, 1]), pitch, 0.0
        return math.atan2(r[2, 1], r[2, 2]), pitch, math.atan2(r[1, 0], r[0, 0])

    def __matmul__(self, inner: Pose) -> Pose:
        """The pose of what lies at ``inner`` in this one's frame."""
        return Pose(self.rotation @ inner.rotation, self.apply(inner.point_m))

    def apply(self, points_m: Floats) -> Floats:
        """(..., 3) points of the inner frame in the outer one."""
        return np.asarray(points_m @ self.rotation.T + self.point_m)

    def turn(self, vectors: Floats) -> Floats:
        """(..., 3) directions of the inner frame in the outer one."""
        return np.asarray(vectors @ self.rotation.T)


def turn(axis: Vector | Floats, angle_rad: float) -> Floats:
    """(3, 3): the turn about a unit vector, by Rodrigues."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], float)
    return np.asarray(np.eye(3) + math.sin(angle_rad) * cross + (1 - math.cos(angle_rad)) * (cross @ cross))
