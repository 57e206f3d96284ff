"""A robot's links and the sheets on them, in viser's scene."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np

from contactfpga import picture_style
from contactfpga.body import Body
from contactfpga.body.plan import Plan
from contactfpga.body.pose import Pose
from contactfpga.body.urdf import located
from contactfpga.surfaces import Surface
from contactfpga.view.picture import rgb
from contactfpga.view.stage import AMBIENT, SIDE, Stage
from contactfpga.view.tiles import MM, Tiles, quaternions

if TYPE_CHECKING:
    import viser

ROOT = "/robot"
BONE = rgb(picture_style.GRAY)


@dataclasses.dataclass(frozen=True)
class Visual:
    """A mesh of a link."""

    link: str
    pose: Pose
    path: Path
    scale: tuple[float, float, float]


@dataclasses.dataclass(frozen=True)
class Mirrored:
    """A surface on which columns count from the other end."""

    surface: Surface
    width_mm: float
    """From the first to the last column."""

    def place(self, x_mm: Any, y_mm: Any) -> Any:
        """As of the surface."""
        return self.surface.place(self.width_mm - x_mm, y_mm)


def surface_of(plan: Plan) -> Any:
    """Where the cells of a link's sheet lie, in the sheet's own frame."""
    width_mm = (plan.skin.columns - 1) * plan.skin.pitch_x_mm
    return Mirrored(plan.surface, width_mm) if plan.mirrored else plan.surface


def visuals(urdf: Path) -> list[Visual]:
    """The meshes that a URDF names and that are there; boxes, spheres and cylinders are left out."""
    found = []
    for link in ElementTree.parse(urdf).getroot().findall("link"):
        for visual in link.findall("visual"):
            mesh = visual.find("geometry/mesh")
            if mesh is None:
                continue
            name = mesh.get("filename", "")
            path = located(name.removeprefix("file://"), urdf.parent) if name else None
            if path is None or not path.is_file():
                continue
            origin = visual.find("origin")
            shift, turn = (_numbers(origin, each, (0.0, 0.0, 0.0)) for each in ("xyz", "rpy"))
            found.append(Visual(link.get("name", ""), Pose.of(shift, turn), path, _numbers(mesh, "scale", (1, 1, 1))))
    return found


def _numbers(element: Any, name: str, usual: tuple[float, float, float]) -> tuple[float, float, float]:
    text = None if element is None else element.get(name)
    if not text:
        return usual
    x, y, z = map(float, text.split())
    return x, y, z


class RobotStage:
    """Links as meshes where these can be read, else as lines between joints; and a stage for each sheet."""

    def __init__(self, server: viser.ViserServer, body: Body, urdf: Path | None):
        self._server, self._body = server, body
        self._frames: dict[str, Any] = {}
        self.unread: set[str] = set()
        """Kinds of mesh files that could not be read."""
        scene = server.scene
        scene.configure_default_lights(enabled=False, cast_shadow=False)
        scene.configure_environment_map(None)
        scene.add_light_ambient("/light/all", intensity=AMBIENT)
        scene.add_light_directional("/light/side", intensity=SIDE, position=(1.0, -0.5, 1.0))
        names = [plan.frame for plan in body.links.values()]
        if body.kinematics is not None:
            names = list(body.kinematics.robot.links)
        for name in dict.fromkeys(names):
            self._frames[name] = scene.add_frame(f"{ROOT}/{name}", show_axes=False)
        for visual in visuals(urdf) if urdf is not None else ():
            self._add_mesh(visual)
        self.stages = {name: self._add_sheet(plan) for name, plan in body.links.items()}
        self._bones: Any = None
        for name, plan in body.links.items():
            self.stages[name].rotation, self.stages[name].point_m = plan.pose.rotation, plan.pose.point_m

    def _add_mesh(self, visual: Visual) -> None:
        import trimesh

        try:
            mesh: Any = trimesh.load(str(visual.path), force="mesh")
        except Exception:  # of many kinds: a format that another package reads, or a damaged file
            self.unread.add(visual.path.suffix)
            return
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
        return Stage(self._server, Tiles(plan.skin.sheet, surface_of(plan)), node=node)

    def move(self, angles: Mapping[str, float]) -> None:
        """Draw all links at these angles."""
        kinematics = self._body.kinematics
        if kinematics is None:
            return
        poses = {name: kinematics.pose(name, angles) for name in kinematics.robot.links}
        turns = quaternions(np.array([pose.rotation for pose in poses.values()]))
        for name, plan in self._body.links.items():
            mine = poses[plan.frame] @ plan.pose
            self.stages[name].rotation, self.stages[name].point_m = mine.rotation, mine.point_m
        for (name, pose), wxyz in zip(poses.items(), turns):
            self._frames[name].wxyz, self._frames[name].position = wxyz, pose.point_m
        joints = kinematics.robot.joints.values()
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
