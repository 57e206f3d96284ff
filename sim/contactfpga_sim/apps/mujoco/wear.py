"""Geoms with the shape of the sheets, for models without them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from contactfpga.inputs.values import shown
from contactfpga.robot.body import Body, BodyError
from contactfpga.robot.body.plan import Plan
from contactfpga.surfaces import CylinderSurface, PlaneSurface

BACK_M = 0.01


def wear(spec: Any, robot: str | Path) -> None:
    """Add to a ``mujoco.MjSpec`` a massless geom per link of ``robot.toml``, with its name, on the body of its frame: a
    box under a flat sheet, a cylinder in a bent one, else the convex hull of the cells. Its outside is the sheet's."""
    for name, plan in Body.load(robot).links.items():
        body = spec.body(plan.frame)
        if body is None:
            raise BodyError(f"link {shown(name)}: frame is {shown(plan.frame)}; the model has no such body")
        geom = body.add_geom(name=name, mass=0)
        if isinstance(plan.surface, PlaneSurface):
            _box(geom, plan)
        elif isinstance(plan.surface, CylinderSurface):
            _cylinder(geom, plan, plan.surface)
        else:
            _hull(spec, geom, plan)


def _ends_m(plan: Plan) -> np.ndarray:
    """(2, 2): first and last x and y in m, half a pitch beyond outer switches."""
    pitches = np.array([plan.skin.pitch_x_mm, plan.skin.pitch_y_mm])
    counts = np.array([plan.skin.columns, plan.skin.rows])
    return 1e-3 * np.stack([-pitches / 2, (counts - 0.5) * pitches])


def _place(geom: Any, plan: Plan, middle_m: np.ndarray) -> None:
    geom.pos = plan.pose.apply(middle_m)
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, plan.pose.rotation.ravel())
    geom.quat = quaternion


def _box(geom: Any, plan: Plan) -> None:
    (left, low), (right, high) = _ends_m(plan)
    geom.type = mujoco.mjtGeom.mjGEOM_BOX
    geom.size = [(right - left) / 2, (high - low) / 2, BACK_M / 2]
    height = 1e-3 * getattr(plan.surface, "height_mm", 0.0)
    _place(geom, plan, np.array([(left + right) / 2, (low + high) / 2, height - BACK_M / 2]))


def _cylinder(geom: Any, plan: Plan, surface: CylinderSurface) -> None:
    (_, low), (_, high) = _ends_m(plan)
    geom.type = mujoco.mjtGeom.mjGEOM_CYLINDER
    geom.size = [1e-3 * surface.radius_mm, (high - low) / 2, 0.0]
    _place(geom, plan, np.array([0.0, 0.0, (low + high) / 2]))


def _hull(spec: Any, geom: Any, plan: Plan) -> None:
    skin = plan.skin
    x, y = np.meshgrid(np.arange(skin.columns) * skin.pitch_x_mm, np.arange(skin.rows) * skin.pitch_y_mm)
    points, normals = (np.asarray(each) for each in plan.surface.place(x, y))
    vertices = 1e-3 * np.concatenate([points.reshape(-1, 3), (points - 1e3 * BACK_M * normals).reshape(-1, 3)])
    spec.add_mesh(name=geom.name, uservert=vertices.ravel())
    geom.type, geom.meshname = mujoco.mjtGeom.mjGEOM_MESH, geom.name
    _place(geom, plan, np.zeros(3))
