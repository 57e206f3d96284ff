"""Each link of `robot.toml`: its board, and the place of its sheet."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from contactfpga import surfaces
from contactfpga.choices.choice import trusting
from contactfpga.design.cover import Cover, load_cover
from contactfpga.driver.address import MAX_NAME, SheetOf, Sim
from contactfpga.driver.events import longest_pause_s
from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.values import is_finite, shown, suggestion
from contactfpga.robot.body.folds import Folds
from contactfpga.robot.body.kinematics import Pose
from contactfpga.robot.body.state import BodyError
from contactfpga.robot.body.support import ContactSurfaces
from contactfpga.robot.haptics.cover_bias import CoverBias
from contactfpga.robot.haptics.units import LoadCells
from contactfpga.skin import Skin
from contactfpga.surfaces import Cone, CylinderSurface, Mesh, MirroredSurface, PlaneSurface, Surface
from contactfpga.surfaces.shapes import Vector, vector

KEYS = (
    "name", "frame", "skin", "port", "point_m", "rpy_rad", "mirrored", "surface", "units", "friction", "late_s",
    "silent_s", "folds",
)  # fmt: skip
MARGIN_S = 0.05
"""Allowance beyond the longest pause of a working board before its link is late."""
SILENT_S = 0.5


@dataclasses.dataclass(frozen=True, eq=False)
class Plan:
    name: str
    frame: str
    """Name of the link's frame, in the URDF and in contacts."""
    skin: Skin
    port: str | None
    pose: Pose
    """Pose of the surface's frame in the link's."""
    mirrored: bool
    """Whether x counts from the last column."""
    surface: PlaneSurface | CylinderSurface | Cone | Mesh
    units: LoadCells | None
    friction: float
    late_s: float
    """Age from which the newest frame is not current."""
    silent_s: float
    """Time without a frame from which the link is silent."""
    folds: Folds | None = None
    cover: Cover | None = None
    """The Skin's cover."""
    bias: CoverBias | None = None
    """Places under this cover; None if it knows no force."""
    trust: bool = False
    """Whether Skin files of the port may name modules."""

    @property
    def laid(self) -> Surface:
        """The surface with the sheet on it, mirrored or not."""
        width_mm = (self.skin.columns - 1) * self.skin.pitch_x_mm
        return MirroredSurface(self.surface, width_mm) if self.mirrored else self.surface

    def place(self, x_mm: float, y_mm: float) -> tuple[Vector, Vector]:
        """Point in m and outward normal, in the link's frame, of a place on the sheet."""
        point_mm, normal = self.laid.place(x_mm, y_mm)
        return vector(self.pose.apply(1e-3 * np.array(point_mm))), vector(self.pose.turn(np.array(normal)))

    @functools.cached_property
    def contact_surfaces(self) -> ContactSurfaces:
        """Finds the contact surfaces of the link's zones. Raises :class:`BodyError` as :class:`ContactSurfaces`."""
        return ContactSurfaces(
            self.skin.sheet, self.cover, surface=self.laid, pose=self.pose, link=self.name, frame=self.frame
        )

    @property
    def virtual(self) -> bool:
        return self.port is not None and self.port.startswith("sim:")

    @property
    def sigma_mm(self) -> float:
        """Standard deviation of a place within a cell, along the surface."""
        return math.hypot(self.skin.pitch_x_mm, self.skin.pitch_y_mm) / math.sqrt(24)

    def __post_init__(self) -> None:
        if not 0 < self.late_s <= self.silent_s:
            raise BodyError(
                f"late_s is {self.late_s:g} and silent_s {self.silent_s:g}; late_s must be above 0 s and at most "
                "silent_s"
            )
        least = longest_pause_s(self.skin, self.skin)
        if self.late_s < least:
            raise BodyError(f"late_s is {self.late_s:g}; a board of this Skin may be silent for {least:.3g} s")


def read(values: Any, folder: Path) -> Plan:
    """One table of links; paths are relative to ``folder``. Raises :class:`BodyError`, OSError."""
    if not isinstance(values, dict):
        raise BodyError(f"a link is {shown(values)}; it must be a table, [[links]]")
    name = text(values, "name")
    if len(name) > MAX_NAME:
        raise BodyError(f"name is {shown(name)}; it has at most {MAX_NAME} characters")
    try:
        return _plan(name, values, folder)
    except ContactFPGAError as error:
        raise BodyError(f"link {shown(name)}: {error}") from None


def _plan(name: str, values: dict[str, Any], folder: Path) -> Plan:
    for key in values:
        if key not in KEYS:
            raise BodyError(f"unknown key {shown(key)}; {suggestion(key, KEYS)}")
    skin_path = folder / text(values, "skin")
    skin = Skin.load(skin_path)
    late_s = _number(values, "late_s", longest_pause_s(skin, skin) + MARGIN_S)
    mirrored = values.get("mirrored", False)
    if not isinstance(mirrored, bool):
        raise BodyError(f"mirrored is {shown(mirrored)}; it must be true or false")
    folds = Folds.load(folder / text(values, "folds")) if "folds" in values else None
    if folds is not None and folds.lines != (skin.rows, skin.columns):
        raise BodyError(f"folds are of {folds.lines} cells; the Skin has {(skin.rows, skin.columns)}")
    if folds is not None and skin.report != "cells":
        raise BodyError(f"report is {shown(skin.report)}; folds are marked cell by cell, with report = 'cells'")
    if folds is not None and folds.levels != skin.levels:
        has, needs = folds.levels, skin.levels
        raise BodyError(f"folds have {has} levels, the Skin {needs}; learn them again with `contactfpga body learn`")
    units = LoadCells.load(folder / text(values, "units")) if "units" in values else None
    if units is not None and len(units.units) != skin.units:
        raise BodyError(f"its file of units has {len(units.units)}; the Skin has units = {skin.units}")
    return Plan(
        name=name,
        frame=text(values, "frame", name),
        skin=skin,
        port=_port(values, skin_path),
        pose=Pose.of(_vector(values, "point_m"), _vector(values, "rpy_rad")),
        mirrored=mirrored,
        surface=_surface(values.get("surface"), skin, folder),
        units=units,
        friction=_number(values, "friction", 0.5),
        late_s=late_s,
        silent_s=_number(values, "silent_s", max(SILENT_S, late_s)),
        folds=folds,
        cover=(cover := load_cover(skin_path)),
        bias=_bias(skin, cover),
        trust=trusting(),
    )


def _bias(skin: Skin, cover: Cover | None) -> CoverBias | None:
    if cover is None or cover.model == "patch":
        return None
    return CoverBias(cover, 1e-3 * skin.pitch_x_mm, 1e-3 * skin.pitch_y_mm)


def _port(values: dict[str, Any], skin_path: Path) -> str | None:
    """Address of the port; a virtual board without a Skin gets the link's."""
    if "port" not in values:
        return None
    port = text(values, "port")
    if port.startswith("sim:"):
        sheet = SheetOf.parse(port)
        address = Sim.parse(port if sheet is None else sheet.port)
        if address.pace is not None:
            raise BodyError(f"port is {shown(port)}; virtual boards of a robot run in real time; leave out pace")
        if sheet is None and address.skin is None:
            return f"{port}{'&' if '?' in port else '?'}skin={quote(str(skin_path))}"
    return port


def _surface(values: Any, skin: Skin, folder: Path) -> PlaneSurface | CylinderSurface | Cone | Mesh:
    if values is None:
        return surfaces.of(skin.sheet)
    if isinstance(values, dict):
        if set(values) != {"radius_mm", "slope"}:
            raise BodyError(f"surface is {shown(values)}; a cone is {{radius_mm = ..., slope = ...}}")
        if skin.closed:
            raise BodyError(
                "surface is a cone, around which the ends of a closed sheet do not meet; leave it out, or make "
                "a table of the link's shape with `contactfpga body surface`"
            )
        return surfaces.Cone(**values)
    if not isinstance(values, str):
        raise BodyError(f"surface is {shown(values)}; it must be the name of a table, or a cone's radius_mm and slope")
    table = Mesh.load(folder / values)
    if table.lines != (skin.rows, skin.columns):
        raise BodyError(f"surface {shown(values)} is of {table.lines} cells; the Skin has {(skin.rows, skin.columns)}")
    if table.closed != skin.closed:
        ends = ("lie apart", "meet")
        raise BodyError(
            f"surface {shown(values)}: its ends {ends[table.closed]}, those of the Skin {ends[skin.closed]}"
        )
    return table


def text(values: Mapping[str, Any], key: str, usual: str | None = None) -> str:
    """The text of this key, or ``usual``. Raises :class:`BodyError` if it is missing or no text."""
    found = values.get(key, usual)
    if found is None:
        raise BodyError(f"{key} is missing")
    if not isinstance(found, str) or not found:
        raise BodyError(f"{key} is {shown(found)}; it must be a text")
    return found


def _number(values: dict[str, Any], key: str, usual: float) -> float:
    found = values.get(key, usual)
    if not is_finite(found) or not 0 <= found <= 1e3:
        raise BodyError(f"{key} is {shown(found)}; it must be a number from 0 to 1000")
    return float(found)


def _vector(values: dict[str, Any], key: str) -> tuple[float, float, float]:
    found = values.get(key, [0.0, 0.0, 0.0])
    if not isinstance(found, list) or len(found) != 3 or not all(is_finite(one) and abs(one) <= 1e3 for one in found):
        raise BodyError(f"{key} is {shown(found)}; it must be a list of three numbers, each at most 1000")
    x, y, z = (float(one) for one in found)
    return x, y, z
