"""JVRC-1 with sheets of tiles, and rigid things that press the tiles as a bed of springs.

MuJoCo's contacts are points, and a support is an area. So each tile's foam is a bed: the pressure at a place follows
from the depth of the thing there, along the sheet's normal, and MuJoCo takes the sum of the forces.
"""

from __future__ import annotations

import dataclasses
import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from contactfpga.design.cover import Switch
from contactfpga.design.cover.press import SOLID
from contactfpga.robot.body import Body
from contactfpga.robot.body.plan import Plan
from contactfpga.skin import Skin
from contactfpga.surfaces.shapes import Floats
from contactfpga_sim.apps.covers import DOME, FOAM_M, GAP_MM, tiled

PITCH_MM, LINES = 6.4, 32
COVER = tiled(PITCH_MM, Switch(DOME.force_n, travel_m=0.0, spread=DOME.spread))
"""The second design of :mod:`contactfpga_sim.lab.support.compute`."""
LINKS = {
    "forearm": ("L_ELBOW_P_S", 45.0, -0.21, math.pi),
    "thigh": ("L_HIP_Y_S", 75.0, -0.34, 0.0),
    "shin": ("L_KNEE_S", 50.0, -0.3, 0.0),
}
"""Frame of JVRC-1, radius in mm, height of the first row in the frame in m, and angle about z of the sheet's middle."""
_COVER = f"""
[cover]
model = "foam"
thickness_m = {FOAM_M}
cut = true
[cover.cap]
side_m = {1e-3 * (PITCH_MM - GAP_MM)}
[cover.switch]
force_n = {DOME.force_n}
travel_m = 0.0
spread = {DOME.spread}
"""
RING_M, SIGMA_N, STEP_N = 0.05, 0.5, 0.4
"""Radius of the ring of pressure units, their noise, and a step of their readings, which have 2,000 either way."""


def write_robot(folder: Path, names: Sequence[str], units: bool) -> Path:
    """Write ``robot.toml`` with a sheet on these links, and with ``units`` six pressure units around each bone."""
    text = 'urdf = "package://jvrc_description/urdf/jvrc1.urdf"\n'
    for name in names:
        frame, radius_mm, low_m, middle = LINKS[name]
        begin = middle - 1e-3 * (LINES - 1) / 2 * PITCH_MM / (1e-3 * radius_mm)
        shape: dict[str, Any] = {"rows": LINES, "columns": LINES, "pitch_x_mm": PITCH_MM, "pitch_y_mm": PITCH_MM}
        shape |= {"surface": "cylinder", "radius_mm": radius_mm, "connectivity": 4, "report": "cells"}
        shape |= {"units": 6, "baud": 6_000_000} if units else {}
        (folder / f"{name}.toml").write_text(Skin(**shape).to_toml() + _COVER, encoding="utf-8")
        text += f'[[links]]\nname = "{name}"\nframe = "{frame}"\nskin = "{name}.toml"\n'
        text += f"point_m = [0.0, 0.0, {low_m}]\nrpy_rad = [0.0, 0.0, {begin}]\n"
        if units:
            text += f'units = "{name}-units.toml"\n'
            (folder / f"{name}-units.toml").write_text(_units(frame, low_m + 0.1), encoding="utf-8")
    (folder / "robot.toml").write_text(text, encoding="utf-8")
    return folder / "robot.toml"


def _units(frame: str, middle_m: float) -> str:
    """Six units on a ring around the link, tilted by 45 degrees to either side in turn."""
    text = f'frame = "{frame}"\n'
    for angle, tilt in zip(np.radians(np.arange(6) * 60), np.pi / 4 * np.array([-1, 1] * 3)):
        point = [RING_M * math.cos(angle), RING_M * math.sin(angle), middle_m]
        axis = [-math.sin(angle) * math.sin(tilt), math.cos(angle) * math.sin(tilt), math.cos(tilt)]
        text += f"[[unit]]\npoint_m = {point}\naxis = {axis}\ngain_n = {STEP_N}\nzero = 2048\n"
        text += f"sigma_n = {SIGMA_N}\nrange = [0, 4095]\n"
    return text


def humanoid(body: Body) -> Any:
    """The ``MjSpec`` of a robot's URDF without its shapes."""
    assert body.urdf is not None
    tree = ET.parse(body.urdf).getroot()
    for link in tree.iter("link"):
        for part in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(part)
    ET.SubElement(ET.SubElement(tree, "mujoco"), "compiler", fusestatic="false", discardvisual="true")
    return mujoco.MjSpec.from_string(ET.tostring(tree, encoding="unicode"))


@dataclasses.dataclass(frozen=True)
class Thing:
    """A rigid box, or an endless round bar along its x axis, in the world."""

    half_m: tuple[float, float, float] | float
    """Half edges of the box, or radius of the bar."""
    rotation: Floats
    point_m: Floats
    """Its middle."""

    def depth_m(self, points_m: Floats, normals: Floats, most_m: float) -> Floats:
        """(n,): how far it reaches into columns of foam that end at (n, 3) points with these outward normals."""
        start, way = self.rotation.T @ (points_m - self.point_m).T, -self.rotation.T @ normals.T
        with np.errstate(divide="ignore", invalid="ignore"):
            if isinstance(self.half_m, float):
                a, b = (way[1:] ** 2).sum(axis=0), (way[1:] * start[1:]).sum(axis=0)
                root = np.sqrt(b**2 - a * ((start[1:] ** 2).sum(axis=0) - self.half_m**2))
                enters, leaves = (-b - root) / a, (-b + root) / a
            else:
                middle, half = -start / way, np.array(self.half_m)[:, None] / np.abs(way)
                enters, leaves = (middle - half).max(axis=0), (middle + half).min(axis=0)
        inside = (enters < leaves) & (leaves > 0) & (enters < most_m)
        return np.where(inside, np.minimum(leaves, most_m), 0.0)


class Bed:
    """The foam on a link's sheet, at ``per`` x ``per`` places for each cell."""

    def __init__(self, plan: Plan, per: int):
        self.plan, self.per = plan, per
        self.x_mm, self.y_mm = (
            plan.skin.pitch_x_mm * ((np.arange(per * lines) + 0.5) / per - 0.5)
            for lines in (plan.skin.columns, plan.skin.rows)
        )  # pitches are equal
        points, normals = plan.laid.place(*np.meshgrid(self.x_mm, self.y_mm))
        self.points_m = plan.pose.apply(1e-3 * np.asarray(points)).reshape(-1, 3)
        self.normals = plan.pose.turn(np.asarray(normals)).reshape(-1, 3)
        rows, columns = (np.arange(per * lines) // per for lines in (plan.skin.rows, plan.skin.columns))
        self.cell = (plan.skin.columns * rows[:, None] + columns).ravel()
        self.area_m2 = (1e-3 * plan.skin.pitch_x_mm / per) ** 2

    def keep(self, near: np.ndarray) -> None:
        """Forget all other places, by (n,) bool."""
        self.points_m, self.normals, self.cell = self.points_m[near], self.normals[near], self.cell[near]

    def cells_n(self, forces_n: Floats, at: Any = slice(None)) -> Floats:
        """(rows, columns) force on each cell, of (n,) forces at these places."""
        shape = self.plan.skin.rows, self.plan.skin.columns
        return np.asarray(np.bincount(self.cell[at], forces_n, math.prod(shape)).reshape(shape), float)

    def depths_m(self, things: Sequence[Thing], position_m: Floats, rotation: Floats, at: Any = slice(None)) -> Floats:
        """(n,): the depth at these places, of a link at this pose in the world."""
        points, normals = self.points_m[at], self.normals[at]
        found = np.zeros(len(points))
        for one in things:
            own = Thing(one.half_m, rotation.T @ one.rotation, rotation.T @ (one.point_m - position_m))
            found = np.maximum(found, own.depth_m(points, normals, FOAM_M))
        return found

    def forces_n(self, depths_m: Floats) -> Floats:
        """The force at each place, by p = E e/(1 - e), straight on from :data:`SOLID`."""
        strain = depths_m / FOAM_M
        within = np.minimum(strain, SOLID)
        stress = within / (1 - within) + (strain - within) / (1 - SOLID) ** 2
        return np.asarray(self.area_m2 * COVER.modulus_pa * stress)
