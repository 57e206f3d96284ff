"""The links of a robot in viser's scene, with the sheets on them."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Mapping, Sequence
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
from contactfpga.tools.view.solids import Solid
from contactfpga.tools.view.stage import Stage
from contactfpga.tools.view.tiles import MM, Tiles, quaternions

if TYPE_CHECKING:
    from xml.etree import ElementTree

    import viser

ROOT = "/robot"
BONE = rgb(picture_style.GRAY)
MESHES = (*mesh_file.SUFFIXES, mesh_file.COLLADA)
MAX_MESHES = 1000
MAX_MESH_BYTES = 100_000_000
"""Most bytes of all meshes of a robot."""
REST = "beyond the limit of all meshes"
MISSING = "not found, from the URDF's folder or in an installed Python package"
NAMED = 3
"""Most names of meshes in a message, for each reason."""


@dataclasses.dataclass(frozen=True)
class Visual:
    link: str
    pose: Pose
    name: str
    """File name of the mesh, as in the URDF."""
    folder: Path
    """Folder of the URDF."""
    scale: tuple[float, float, float]


def visuals(urdf: Path) -> list[Visual]:
    """The meshes of a URDF, without boxes, spheres and cylinders. Raises :class:`BodyError`, OSError."""
    links = urdf_file.tree(urdf).findall("link")
    try:
        return [
            _visual(one, mesh, link.get("name", ""), urdf.parent)
            for link in links
            for one in link.findall("visual")
            if (mesh := one.find("geometry/mesh")) is not None
        ]
    except BodyError as error:
        raise BodyError(f"{urdf}: {error}") from None


def _visual(element: ElementTree.Element, mesh: ElementTree.Element, link: str, folder: Path) -> Visual:
    where = f"a mesh of link {shown(link)}"
    pose, scale = urdf_file.pose(element.find("origin"), where), urdf_file.vector(mesh, "scale", where, "1 1 1")
    return Visual(link, pose, mesh.get("filename", ""), folder, scale)


class RobotStage:
    """Links as readable meshes, otherwise as lines between joints; and a stage for each sheet."""

    def __init__(self, server: viser.ViserServer, body: Body, solids: Sequence[Solid] = (), node: str = ROOT):
        """``solids``: drawn in place of the URDF's links."""
        self._server, self._body, self._node = server, body, node
        self._root = server.scene.add_frame(node, show_axes=False)
        self.at_m = np.zeros(3)
        self._frames: dict[str, Any] = {}
        self._left_out: dict[str, dict[str, None]] = {}
        """Names of meshes that are not drawn, by the reason."""
        self._meshes = self._mesh_bytes = self._triangles = 0
        self._corners: list[tuple[str, np.ndarray]] = []
        """Corners of a box around each link's mesh, (8, 3) in m in the link's frame."""
        self._poses: Mapping[str, Pose] = {}
        self._hidden: set[str] = set()
        scene = server.scene
        names = [plan.frame for plan in body.links.values()]
        if solids:
            names += [solid.link for solid in solids]
        elif body.kinematics is not None:
            names = list(body.kinematics.robot.links)
        for name in dict.fromkeys(names):
            self._frames[name] = scene.add_frame(f"{self._node}/{name}", show_axes=False)
        for visual in visuals(body.urdf) if body.urdf is not None and not solids else ():
            if visual.link in self._frames:  # and not the world under a base that moves freely
                self._add_mesh(visual)
        for solid in solids:
            self._add(solid)
        self.stages = {name: self._add_sheet(plan) for name, plan in body.links.items()}
        self._bones: Any = None
        for name, plan in body.links.items():
            self.stages[name].rotation, self.stages[name].point_m = plan.pose.rotation, plan.pose.point_m

    def _add_mesh(self, visual: Visual) -> None:
        try:
            path = urdf_file.located(visual.name.removeprefix("file://"), visual.folder)
            self._mesh_bytes += path.stat().st_size
            self._meshes += 1
            if self._meshes > MAX_MESHES or self._mesh_bytes > MAX_MESH_BYTES:
                raise SurfaceError(REST)
            mesh = mesh_file.read(path, "view", MESHES)
            self._triangles += len(mesh.faces)
            if self._triangles > mesh_file.MAX_TRIANGLES:
                raise SurfaceError(REST)
        except (BodyError, SurfaceError, OSError) as error:  # the sheets can be shown all the same
            reason = REST if str(error) == REST else "unreadable" if isinstance(error, SurfaceError) else MISSING
            self._left_out.setdefault(reason, {})[shown(visual.name)] = None
            return
        mesh.merge_vertices()
        vertices, faces = np.asarray(mesh.vertices) * visual.scale, np.asarray(mesh.faces)
        self._add(Solid(visual.link, visual.pose, vertices, faces, rgb(picture_style.SHEET)))

    def left_out(self) -> str:
        """Which meshes are not drawn, and why; empty if all are."""
        missing = "".join(
            f"{len(names)} {reason}: {', '.join(list(names)[:NAMED])}{', ...' if len(names) > NAMED else ''}; "
            for reason, names in self._left_out.items()
        )
        return f"{missing}lines between joints are drawn" if missing else ""

    def _add(self, solid: Solid) -> None:
        box = np.array(list(itertools.product(*zip(solid.vertices_m.min(0), solid.vertices_m.max(0)))))
        self._corners.append((solid.link, solid.pose.apply(box)))
        count = len(self._frames)
        self._frames[f"{solid.link}#{count}"] = self._server.scene.add_mesh_simple(
            f"{self._node}/{solid.link}/mesh{count}",
            solid.vertices_m,
            solid.faces,
            color=solid.color,
            wxyz=quaternions(solid.pose.rotation[None])[0],
            position=solid.pose.point_m,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )

    def _add_sheet(self, plan: Plan) -> Stage:
        node = f"{self._node}/{plan.frame}/{plan.name}"
        wxyz = quaternions(plan.pose.rotation[None])[0]
        self._server.scene.add_frame(node, show_axes=False, wxyz=wxyz, position=plan.pose.point_m)
        return Stage(self._server, Tiles(plan.skin.sheet, plan.laid), node=node, carried=False, cover=plan.cover)

    def move(self, angles: Mapping[str, float]) -> None:
        kinematics = self._body.kinematics
        if kinematics is None:
            return
        poses = kinematics.poses(angles)
        self.place(poses)
        joints = kinematics.robot.joints.values()
        if not joints:
            return
        bones = np.array([(poses[joint.parent].point_m, poses[joint.child].point_m) for joint in joints])
        if self._bones is None:
            self._bones = self._server.scene.add_line_segments(
                f"{self._node}/bones", bones, BONE, thickness=2.0, thickness_units="screen"
            )
        self._bones.points = bones.astype(np.float32)

    def place(self, poses: Mapping[str, Pose]) -> None:
        self._poses = poses
        orientations = quaternions(np.array([pose.rotation for pose in poses.values()]))
        for name, plan in self._body.links.items():
            mine = poses[plan.frame] @ plan.pose
            self.stages[name].rotation, self.stages[name].point_m = mine.rotation, mine.point_m + self.at_m
        for (name, pose), wxyz in zip(poses.items(), orientations):
            if (frame := self._frames.get(name)) is not None:
                frame.wxyz, frame.position = wxyz, pose.point_m

    def shift(self, at_m: np.ndarray) -> None:
        """Draw the robot's base at (3,) ``at_m`` from the next poses on."""
        self.at_m = at_m
        self._root.position = at_m

    def show(self, visible: bool = True, link: str | None = None) -> None:
        (self._root if link is None else self._frames[link]).visible = visible
        if link is not None:
            (self._hidden.discard if visible else self._hidden.add)(link)

    def on_drag(self, link: str, follow: Callable[[Any], Any]) -> None:
        """Call ``follow`` with viser's event when the left mouse button drags a link's meshes."""
        for name, mesh in self._frames.items():
            if name.startswith(f"{link}#"):
                mesh.on_drag("left")(follow)

    def points_m(self) -> np.ndarray:
        """(n, 3) points around everything drawn, at the current angles."""
        sheets = [stage.tiles.points_mm * MM @ stage.rotation.T + stage.point_m for stage in self.stages.values()]
        seen = [(link, corners) for link, corners in self._corners if link not in self._hidden]
        meshes = [self._poses[link].apply(corners) + self.at_m for link, corners in seen]
        return np.concatenate([*sheets, *meshes])
