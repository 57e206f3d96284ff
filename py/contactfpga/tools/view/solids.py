"""The looks of MuJoCo's geoms."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection
from typing import Any

import numpy as np

from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.values import shown
from contactfpga.robot.body.kinematics import Pose
from contactfpga.surfaces import mesh_file
from contactfpga.tools.view.limb import revolved

UNDER = 0.96
"""Scale of the geom under a sheet, so that the cells are visible."""
PLANE_M = 1.0


@dataclasses.dataclass(frozen=True)
class Solid:
    link: str
    pose: Pose
    """In the link's frame."""
    vertices_m: np.ndarray
    """(n, 3)"""
    faces: np.ndarray
    """(m, 3)"""
    color: tuple[int, int, int]


def solids_of(model: Any, worn: Collection[str]) -> list[Solid]:
    """All drawable geoms; ``worn``: names of those that wear a sheet. Raises :class:`~contactfpga.ContactFPGAError` for
    a mesh with too many triangles.
    """
    found = [_solid(model, number, worn) for number in range(model.ngeom)]
    return [solid for solid in found if solid is not None]


def named(model: Any, number: int) -> str:
    return str(model.body(number).name) or f"body{number}"


def _solid(model: Any, number: int, worn: Collection[str]) -> Solid | None:
    import mujoco

    geom = model.geom(number)
    kind, form = int(geom.type[0]), int(geom.dataid[0])
    is_mesh = form >= 0 and kind != mujoco.mjtGeom.mjGEOM_HFIELD  # whose number is of terrain, which is not drawn
    made = _mesh(model, form) if is_mesh else _form(kind, geom.size)
    if made is None:
        return None
    vertices, faces = made
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, geom.quat)
    pose = Pose(turn.reshape(3, 3), geom.pos.copy())
    red, green, blue = (round(255 * float(share)) for share in geom.rgba[:3])
    owner = named(model, int(geom.bodyid[0]))
    return Solid(owner, pose, vertices * (UNDER if geom.name in worn else 1.0), faces, (red, green, blue))


def _mesh(model: Any, number: int) -> tuple[np.ndarray, np.ndarray]:
    mesh = model.mesh(number)
    first, count = int(mesh.vertadr[0]), int(mesh.vertnum[0])
    begin, faces = int(mesh.faceadr[0]), int(mesh.facenum[0])
    if faces > mesh_file.MAX_TRIANGLES:
        raise ContactFPGAError(f"mesh {shown(mesh.name)} has {faces} triangles; at most {mesh_file.MAX_TRIANGLES}")
    return model.mesh_vert[first : first + count].copy(), model.mesh_face[begin : begin + faces].copy()


def _form(kind: int, size: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    from mujoco import mjtGeom

    turn = np.linspace(-np.pi / 2, np.pi / 2, 17)
    ball = np.stack([np.cos(turn), np.sin(turn)], -1)
    if kind in (mjtGeom.mjGEOM_BOX, mjtGeom.mjGEOM_PLANE):
        half = size.copy() if kind == mjtGeom.mjGEOM_BOX else np.append(np.where(size[:2] > 0, size[:2], PLANE_M), 5e-4)
        shift = 0.0 if kind == mjtGeom.mjGEOM_BOX else -5e-4
        square = np.array([(0, -1), (np.sqrt(2), -1), (np.sqrt(2), 1), (0, 1)])
        vertices, faces = revolved(square, sides=4, first=np.pi / 4)
        return vertices * half + np.array([0, 0, shift]), faces
    if kind in (mjtGeom.mjGEOM_SPHERE, mjtGeom.mjGEOM_ELLIPSOID):
        vertices, faces = revolved(ball)
        return vertices * (size if kind == mjtGeom.mjGEOM_ELLIPSOID else size[0]), faces
    radius, half_length = float(size[0]), float(size[1])
    if kind == mjtGeom.mjGEOM_CAPSULE:
        return revolved(radius * ball + np.stack([0 * turn, half_length * np.where(turn < 0, -1, 1)], -1))
    if kind == mjtGeom.mjGEOM_CYLINDER:
        return revolved(np.array([(0, -1), (radius, -1), (radius, 1), (0, 1)]) * (1, half_length))
    return None
