"""The place of a sheet on its link, from a few known points that were pressed."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import is_finite, shown
from contactfpga.robot.body.kinematics import Pose
from contactfpga.robot.body.plan import Plan
from contactfpga.robot.body.state import BodyError
from contactfpga.surfaces import Surface
from contactfpga.surfaces.shapes import Floats, Vector
from contactfpga.zones.around import across
from contactfpga.zones.zone import Zones

KEYS = ("point_m", "normal", "pressed_mm")
CLEARER = 2.0
"""Least ratio of residuals between the two ways of mounting."""
LARGEST_RAD = 0.35
"""Largest accepted standard deviation of the angles."""
HELD_S = 0.3
"""Time for which a point must be pressed with one constant zone."""


@dataclasses.dataclass(frozen=True)
class Press:
    """A known point of the link, and its press."""

    point_m: tuple[float, float, float]
    """Point in the link's frame."""
    normal: tuple[float, float, float] | None = None
    """Outward unit normal; None if unknown."""
    pressed_mm: tuple[float, float] | None = None
    """x and y of the zone; None before the press."""


@dataclasses.dataclass(frozen=True, eq=False)
class Registration:
    """The place of the sheet."""

    pose: Pose
    """Pose of the sheet's own frame in the link's, for `robot.toml`."""
    mirrored: bool
    residuals_mm: tuple[float, ...]
    """Distance of each point from the place of its press."""
    other_mm: float
    """RMS residual of the other way of mounting."""
    sigma_mm: float
    """Standard deviation of the sheet's middle."""
    sigma_rad: float
    """Standard deviation of the least certain angle."""
    turned_rad: float
    """Rotation against the pose in `robot.toml`."""

    @property
    def rms_mm(self) -> float:
        """RMS of the residuals."""
        return math.sqrt(sum(one * one for one in self.residuals_mm) / len(self.residuals_mm))

    def to_toml(self) -> str:
        """Lines for the link's table in `robot.toml`."""
        point, rpy = (
            "[" + ", ".join(f"{value + 0.0:.6g}" for value in values) + "]"
            for values in (self.pose.point_m.tolist(), self.pose.rpy_rad)
        )
        return f"point_m = {point}\nrpy_rad = {rpy}\nmirrored = {str(self.mirrored).lower()}\n"


def register(plan: Plan, presses: Sequence[Press]) -> Registration:
    """The best-fitting pose and way of mounting. Raises :class:`BodyError` for ambiguous points."""
    if len(presses) < 3:
        raise BodyError(f"{len(presses)} points were pressed; a pose takes at least 3")
    fits = {mirrored: _fit(plan, presses, mirrored) for mirrored in (False, True)}
    mirrored = min(fits, key=lambda one: _rms(fits[one][1]))
    pose, residuals, levers = fits[mirrored]
    other = _rms(fits[not mirrored][1])
    cell_mm = plan.sigma_mm
    sigma_rad = cell_mm / max(1e-9, levers)
    if sigma_rad > LARGEST_RAD:
        raise BodyError(
            f"the points lie so nearly in a line that the angle is known to {math.degrees(sigma_rad):.0f} degrees "
            "only; press others, farther apart"
        )
    worst = max(_rms(residuals), cell_mm)
    if other < CLEARER * worst:
        raise BodyError(
            f"mounted as it is or mirrored, the points fit to {_rms(residuals):.1f} and {other:.1f} mm, which does not "
            "tell the two apart; give normals, or press points that do not lie in a plane"
        )
    between = plan.pose.rotation.T @ pose.rotation
    turned = math.acos(min(1.0, max(-1.0, (float(np.trace(between)) - 1) / 2)))
    spread = cell_mm / math.sqrt(len(presses))
    return Registration(pose, mirrored, tuple(residuals.tolist()), other, spread, sigma_rad, turned)


def _fit(plan: Plan, presses: Sequence[Press], mirrored: bool) -> tuple[Pose, Floats, float]:
    """Pose, residuals in mm, and lever in mm of the least certain angle."""
    surface = dataclasses.replace(plan, mirrored=mirrored).laid
    places = [_placed(surface, press) for press in presses]
    ours = np.array([place[0] for place in places]) / 1000
    known = np.array([press.point_m for press in presses], float)
    middle, there = ours.mean(axis=0), known.mean(axis=0)
    pairs_ours, pairs_known = [*(ours - middle)], [*(known - there)]
    lever = math.sqrt(float(((ours - middle) ** 2).sum() / len(ours)))
    for press, place in zip(presses, places):
        if press.normal is not None:  # a normal counts as a point on it, as far out as the others are apart
            pairs_ours.append(lever * np.array(place[1]))
            pairs_known.append(lever * np.array(press.normal))
    a, b = np.array(pairs_ours), np.array(pairs_known)
    left, _, right = np.linalg.svd(a.T @ b)
    flip = np.diag([1.0, 1.0, float(np.sign(np.linalg.det(right.T @ left.T)))])
    rotation = right.T @ flip @ left.T
    pose = Pose(rotation, there - rotation @ middle)
    residuals = 1000 * np.linalg.norm(b - a @ rotation.T, axis=1)
    inertia = (a**2).sum() * np.eye(3) - a.T @ a
    return pose, residuals, 1000 * math.sqrt(max(0.0, float(np.linalg.eigvalsh(inertia)[0])))


def _placed(surface: Surface, press: Press) -> tuple[Vector, Vector]:
    assert press.pressed_mm is not None
    return surface.place(*press.pressed_mm)


def _rms(residuals: Floats) -> float:
    return math.sqrt(float((residuals**2).mean()))


def load(path: str | Path) -> list[Press]:
    """The points in a TOML file, a [[point]] each. Raises :class:`BodyError`, OSError."""
    values = tomlfile.load(path, BodyError)
    points = values.get("point")
    if set(values) != {"point"} or not isinstance(points, list):
        raise BodyError(f"{path}: it holds no points; give a table [[point]] with point_m for each")
    return [_read(one, f"{path}: point {number}") for number, one in enumerate(points, 1)]


def _read(values: Any, where: str) -> Press:
    if not isinstance(values, dict) or "point_m" not in values or not set(values) <= set(KEYS):
        raise BodyError(f"{where} is {shown(values)}; it has point_m, and normal or pressed_mm where they are known")
    point, normal, pressed = (_numbers(values, key, 2 if key == "pressed_mm" else 3, where) for key in KEYS)
    assert point is not None
    if normal is not None:
        size = float(np.linalg.norm(normal))
        if size < 1e-9:
            raise BodyError(f"{where}: normal is {shown(values['normal'])}, which has no direction")
        normal = tuple(value / size for value in normal)
    return Press(point, normal, pressed)


def _numbers(values: dict[str, Any], key: str, count: int, where: str) -> Any:
    found = values.get(key)
    if found is None:
        return None
    if not isinstance(found, list) or len(found) != count or not all(map(is_finite, found)):
        raise BodyError(f"{where}: {key} is {shown(found)}; it must be {count} numbers")
    return tuple(map(float, found))


def held(frames: Iterable[Zones], skin_pitch_mm: float) -> tuple[float, float]:
    """Place in mm of a single zone that stayed for :data:`HELD_S`."""
    kept: list[tuple[int, float, float]] = []
    around_mm: float | None = None
    for zones in frames:
        if len(zones) != 1 or zones[0].x_mm is None or zones[0].y_mm is None:
            kept.clear()
            continue
        x, y = zones[0].x_mm, zones[0].y_mm
        around_mm = zones.sheet.around_mm
        if kept:
            x = kept[0][1] + across(x - kept[0][1], around_mm)  # counted on past the seam
            if zones.time_us < kept[-1][0] or math.hypot(x - kept[0][1], y - kept[0][2]) > skin_pitch_mm:
                kept.clear()
        kept.append((zones.time_us, x, y))
        if kept[-1][0] - kept[0][0] >= 1e6 * HELD_S:
            x, y = np.mean([one[1:] for one in kept], axis=0).tolist()
            return x if around_mm is None else x % around_mm, y
    raise BodyError("the frames ended before a point was pressed")
