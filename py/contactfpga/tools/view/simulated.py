"""A robot in MuJoCo that wears sheets, in real time: the mouse pushes it, and a reflex moves it."""

from __future__ import annotations

import dataclasses
import inspect
import runpy
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.values import shortened, shown
from contactfpga.robot.body import Body, LinkState, Snapshot
from contactfpga.robot.body.kinematics import Pose
from contactfpga.surfaces import mesh_file
from contactfpga.tools.view.fingers import Touchable
from contactfpga.tools.view.limb import revolved
from contactfpga.tools.view.sources import SimulatedPace

REFLEX_S = 1e-3
"""A reflex is asked this often."""
REST_S = 0.05
"""After a start no reflex is asked for so long: what touched before it may still be on its way to the host."""
NO_REFLEX = "none"
UNDER = 0.96
"""Size of the geom that wears a sheet, so that the cells are seen on it."""
PLANE_M = 1.0
"""Half a side of a plane without an end."""

Reflex = Callable[[Snapshot, float], float]
"""From what is felt and the joint's angle to how fast to turn."""


class SimulatedSource:
    """A robot of MuJoCo in real time, or as near to it as the machine can."""

    def __init__(self, robot: str, model: str, reflex: str | None = None, gateware: bool = False):
        """``model``: MJCF or URDF; its first keyframe is where it starts. ``reflex``: a Python file, whose classes with
        ``__call__(snapshot, angle)`` can each set the first actuator.

        Raises :class:`~contactfpga.ContactFPGAError` for a model that cannot be read, what
        :class:`contactfpga.mujoco.Sheets` raises, and :class:`~contactfpga.MissingExtra`.
        """
        parts: Any = import_module("contactfpga.mujoco")
        self.title = model
        self.reflexes = _reflexes(reflex)
        """By name what makes a reflex of a speed; without :data:`NO_REFLEX`."""
        self.reflex = next(iter(self.reflexes), NO_REFLEX)
        """The name of the one that acts; :data:`NO_REFLEX`: the model's first command stays."""
        compiled, data = _compiled(parts, model, robot)
        if self.reflexes and not compiled.nu:
            raise ContactFPGAError(f"{model} has no actuator; --reflex needs one, a <velocity> servo of a joint")
        self.sheets: Any = parts.Sheets(compiled, data, robot, golden=not gateware)
        self.body: Body = self.sheets.body
        self.angles: dict[str, float] = {}  # its joints are MuJoCo's to turn
        self.virtual: dict[str, Touchable] = dict(self.sheets)
        self.most_n = dict.fromkeys(self.sheets, 0.0)
        """By link the largest force in N since the start."""
        self._pace = SimulatedPace(self.sheets.clock())
        self._restart()

    def restart(self) -> None:
        """Put the robot back to where it started, and its reflex as well, before the next moment."""
        self._stale = True

    def _restart(self) -> None:
        import mujoco

        self._stale, model, data = False, self.sheets.model, self.sheets.data
        self.sheets.reset()
        if model.nkey:
            mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_forward(model, data)
        self.most_n = dict.fromkeys(self.sheets, 0.0)
        made = self.reflexes.get(self.reflex)
        self._acts = None if made is None else made(float(data.ctrl[0]))
        self._asked = round(REST_S / REFLEX_S)

    def states(self) -> dict[str, LinkState]:
        """Of all links, after the next moment."""
        if self._stale:
            self._restart()
        sheets, pace = self.sheets, self._pace
        began_s, began = sheets.clock(), time.monotonic()
        until_s = began_s + min(pace.due(began_s), pace.most_s)
        while sheets.clock() < until_s:
            self._step()
        if sheets.clock() > began_s:
            pace.ran(sheets.clock() - began_s, time.monotonic() - began)
        links: dict[str, LinkState] = sheets.snapshot().links
        return links

    def _step(self) -> None:
        data = self.sheets.data
        if self._acts is not None and (tick := int(data.time / REFLEX_S + 1e-6)) > self._asked:
            self._asked = tick
            data.ctrl[0] = self._acts(self.sheets.snapshot(), self._angle())
        self.sheets.step()
        for name in self.most_n:
            self.most_n[name] = max(self.most_n[name], self.force_n(name))

    def _angle(self) -> float:
        """Of the joint that the first actuator turns."""
        model = self.sheets.model
        return float(self.sheets.data.qpos[model.jnt_qposadr[model.actuator_trnid[0, 0]]])

    def force_n(self, link: str) -> float:
        """All that presses on a link now."""
        return float(sum(touch.push_n for touch in self.sheets[link].touches))

    def told(self, link: str) -> str:
        """Of a link's forces, for the panel."""
        return f"pressed by {self.force_n(link):.1f} N, most so far {self.most_n[link]:.1f} N"

    @property
    def share(self) -> float:
        """Of real time."""
        return self._pace.share

    # ---- what is drawn

    def solids(self) -> list[Solid]:
        """All geoms that can be drawn."""
        model = self.sheets.model
        found = [_solid(model, number, self.body) for number in range(model.ngeom)]
        return [solid for solid in found if solid is not None]

    def poses(self) -> dict[str, Pose]:
        """Of MuJoCo's bodies, by their names."""
        model, data = self.sheets.model, self.sheets.data
        return {
            _named(model, number): Pose(data.xmat[number].reshape(3, 3).copy(), data.xpos[number].copy())
            for number in range(model.nbody)
        }

    def close(self) -> None:
        """Free the boards."""
        self.sheets.close()


def _compiled(parts: Any, path: str, robot: str) -> tuple[Any, Any]:
    """Model and data; its sheets' shapes are added where a link has none."""
    import mujoco

    if not Path(path).is_file():
        raise ContactFPGAError(f"{path} is no file; --mujoco takes the MJCF or URDF of a robot")
    try:
        spec = mujoco.MjSpec.from_file(path)
        bodies = [spec.body(plan.frame) for plan in Body.load(robot).links.values()]
        if any(body is None or not len(body.geoms) for body in bodies):
            parts.wear(spec, robot)
        model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        if isinstance(error, ContactFPGAError):
            raise
        raise ContactFPGAError(f"{path}: MuJoCo says {shortened(' '.join(str(error).split()))}") from None
    return model, mujoco.MjData(model)


def _reflexes(path: str | None) -> dict[str, Callable[[float], Reflex]]:
    """The classes of a file that are reflexes. The file is run, as `python FILE` would."""
    if path is None:
        return {}
    if not Path(path).is_file():
        raise ContactFPGAError(f"--reflex is {shown(path)}, no file; name one as examples/arm/reflexes.py")
    names = runpy.run_path(path, run_name="reflex")
    found: dict[str, Any] = {
        name: one
        for name, one in names.items()
        if inspect.isclass(one) and one.__module__ == "reflex" and "__call__" in vars(one)
    }
    if not found:
        raise ContactFPGAError(f"--reflex {path} has no class with __call__(snapshot, angle)")
    return found


@dataclasses.dataclass(frozen=True)
class Solid:
    """A part of a link that is drawn."""

    link: str
    pose: Pose
    """In the link's frame."""
    vertices_m: np.ndarray
    """(n, 3)"""
    faces: np.ndarray
    """(m, 3)"""
    color: tuple[int, int, int]


def _named(model: Any, number: int) -> str:
    return str(model.body(number).name) or f"body{number}"


def _solid(model: Any, number: int, body: Body) -> Solid | None:
    """None for a kind of geom that is not drawn: a height field, a field of distances."""
    import mujoco

    geom = model.geom(number)
    worn = geom.name in body.links
    made = _mesh(model, int(geom.dataid[0])) if geom.dataid[0] >= 0 else _form(int(geom.type[0]), geom.size)
    if made is None:
        return None
    vertices, faces = made
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, geom.quat)
    pose = Pose(turn.reshape(3, 3), geom.pos.copy())
    red, green, blue = (round(255 * float(share)) for share in geom.rgba[:3])
    owner = _named(model, int(geom.bodyid[0]))
    return Solid(owner, pose, vertices * (UNDER if worn else 1.0), faces, (red, green, blue))


def _mesh(model: Any, number: int) -> tuple[np.ndarray, np.ndarray]:
    mesh = model.mesh(number)
    first, count = int(mesh.vertadr[0]), int(mesh.vertnum[0])
    begin, faces = int(mesh.faceadr[0]), int(mesh.facenum[0])
    if faces > mesh_file.MAX_TRIANGLES:
        raise ContactFPGAError(f"mesh {shown(mesh.name)} has {faces} triangles; at most {mesh_file.MAX_TRIANGLES}")
    return model.mesh_vert[first : first + count].copy(), model.mesh_face[begin : begin + faces].copy()


def _form(kind: int, size: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Vertices in m and faces of MuJoCo's primitives."""
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
