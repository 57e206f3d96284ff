"""A robot's links and the sheets on them, in viser's scene."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from contactfpga import picture_style
from contactfpga.inputs.values import shown
from contactfpga.robot.body import Body, BodyError
from contactfpga.robot.body import urdf as urdf_file
from contactfpga.robot.body.kinematics import Pose
from contactfpga.robot.body.plan import Plan
from contactfpga.surfaces import SurfaceError, mesh_file
from contactfpga.tools.view.picture import rgb
from contactfpga.tools.view.stage import Stage, light
from contactfpga.tools.view.tiles import MM, Tiles, quaternions

if TYPE_CHECKING:
    from xml.etree import ElementTree

    import viser

ROOT = "/robot"
BONE = rgb(picture_style.GRAY)
MESHES = (*mesh_file.SUFFIXES, mesh_file.COLLADA)
MAX_MESHES = 1000
MAX_MESH_BYTES = 100_000_000
"""Of all meshes of a robot; they may have as many triangles as one alone."""
REST = "what is beyond the limit of all meshes"


@dataclasses.dataclass(frozen=True)
class Visual:
    """A mesh of a link."""

    link: str
    pose: Pose
    path: Path
    scale: tuple[float, float, float]


def visuals(urdf: Path) -> list[Visual]:
    """The meshes that a URDF names and that are there; boxes, spheres and cylinders are left out. Raises
    :class:`BodyError`, OSError."""
    found = []
    links = urdf_file.tree(urdf).findall("link")
    try:
        for link in links:
            found += [_visual(one, link.get("name", ""), urdf.parent) for one in link.findall("visual")]
    except BodyError as error:
        raise BodyError(f"{urdf}: {error}") from None
    return [visual for visual in found if visual is not None]


def _visual(element: ElementTree.Element, link: str, folder: Path) -> Visual | None:
    mesh = element.find("geometry/mesh")
    path = None if mesh is None else _path(mesh.get("filename", ""), folder)
    if path is None:
        return None
    where, origin = f"a mesh of link {shown(link)}", element.find("origin")
    shift, turn = (urdf_file.vector(origin, key, where) for key in ("xyz", "rpy"))
    return Visual(link, Pose.of(shift, turn), path, urdf_file.vector(mesh, "scale", where, "1 1 1"))


def _path(name: str, folder: Path) -> Path | None:
    try:
        path = urdf_file.located(name.removeprefix("file://"), folder)
    except BodyError:  # of a package that is not installed: the sheets can be shown all the same
        return None
    return path if path.is_file() else None


class RobotStage:
    """Links as meshes where these can be read, else as lines between joints; and a stage for each sheet."""

    def __init__(self, server: viser.ViserServer, body: Body):
        self._server, self._body = server, body
        self._frames: dict[str, Any] = {}
        self.unread: set[str] = set()
        """Kinds of mesh files that could not be read."""
        self._meshes = self._mesh_bytes = self._triangles = 0
        scene = server.scene
        light(server, (1.0, -0.5, 1.0))
        names = [plan.frame for plan in body.links.values()]
        if body.kinematics is not None:
            names = list(body.kinematics.robot.links)
        for name in dict.fromkeys(names):
            self._frames[name] = scene.add_frame(f"{ROOT}/{name}", show_axes=False)
        for visual in visuals(body.urdf) if body.urdf is not None else ():
            self._add_mesh(visual)
        self.stages = {name: self._add_sheet(plan) for name, plan in body.links.items()}
        self._bones: Any = None
        for name, plan in body.links.items():
            self.stages[name].rotation, self.stages[name].point_m = plan.pose.rotation, plan.pose.point_m

    def _add_mesh(self, visual: Visual) -> None:
        try:
            self._meshes += 1
            self._mesh_bytes += visual.path.stat().st_size
            if self._meshes > MAX_MESHES or self._mesh_bytes > MAX_MESH_BYTES:
                raise SurfaceError(REST)
            mesh = mesh_file.read(visual.path, "view", MESHES)
            self._triangles += len(mesh.faces)
            if self._triangles > mesh_file.MAX_TRIANGLES:
                raise SurfaceError(REST)
        except (SurfaceError, OSError) as error:
            self.unread.add(REST if str(error) == REST else visual.path.suffix)
            return
        mesh.merge_vertices()
        count = len(self._frames)
        self._frames[f"{visual.link}#{count}"] = self._server.scene.add_mesh_simple(
            f"{ROOT}/{visual.link}/mesh{count}",
            np.asarray(mesh.vertices) * visual.scale,
            np.asarray(mesh.faces),
            color=rgb(picture_style.SHEET),
            wxyz=quaternions(visual.pose.rotation[None])[0],
            position=visual.pose.point_m,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )

    def _add_sheet(self, plan: Plan) -> Stage:
        node = f"{ROOT}/{plan.frame}/{plan.name}"
        wxyz = quaternions(plan.pose.rotation[None])[0]
        self._server.scene.add_frame(node, show_axes=False, wxyz=wxyz, position=plan.pose.point_m)
        return Stage(self._server, Tiles(plan.skin.sheet, plan.laid), node=node)

    def move(self, angles: Mapping[str, float]) -> None:
        """Draw all links at these angles."""
        kinematics = self._body.kinematics
        if kinematics is None:
            return
        poses = kinematics.poses(angles)
        turns = quaternions(np.array([pose.rotation for pose in poses.values()]))
        for name, plan in self._body.links.items():
            mine = poses[plan.frame] @ plan.pose
            self.stages[name].rotation, self.stages[name].point_m = mine.rotation, mine.point_m
        for (name, pose), wxyz in zip(poses.items(), turns):
            self._frames[name].wxyz, self._frames[name].position = wxyz, pose.point_m
        joints = kinematics.robot.joints.values()
        if not joints:
            return
        bones = np.array([(poses[joint.parent].point_m, poses[joint.child].point_m) for joint in joints])
        if self._bones is None:
            self._bones = self._server.scene.add_line_segments(
                f"{ROOT}/bones", bones, BONE, thickness=2.0, thickness_units="screen"
            )
        self._bones.points = bones.astype(np.float32)

    def look(self, angles: Mapping[str, float]) -> None:
        """Set the camera so that all sheets are in view, from the side that the robot faces."""
        points = np.concatenate([self._sheet_points(plan, angles) for plan in self._body.links.values()])
        low, high = points.min(0), points.max(0)
        middle, far = (low + high) / 2, 1.6 * float(np.linalg.norm(high - low)) + 0.2
        camera = self._server.initial_camera
        camera.look_at = tuple(middle)
        camera.position = tuple(middle + far * np.array([0.85, 0.35, 0.35]))
        camera.near = 0.01 * far

    def _sheet_points(self, plan: Plan, angles: Mapping[str, float]) -> np.ndarray:
        points = plan.pose.apply(self.stages[plan.name].tiles.points_mm * MM)
        if self._body.kinematics is not None:
            points = self._body.kinematics.pose(plan.frame, angles).apply(points)
        return np.asarray(points)
