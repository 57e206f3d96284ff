"""How well pressing a few points finds where a sheet sits."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np

from contactfpga.robot.body import BodyError, registration
from contactfpga.robot.body.kinematics import Pose
from contactfpga.robot.body.plan import Plan, read
from contactfpga.robot.body.registration import Press
from contactfpga.skin import Skin
from contactfpga_sim.model.scenes import contacts
from contactfpga_sim.model.scenes.scene import Contact, Scene

FINGER_MM = 9.0
MARGIN_MM = 15.0
PLACED_MM = 1.0
"""Standard deviation, along each of two directions, of a finger from the point that it is to press."""
SKINS = {
    "plane, 16x16, 10 mm": Skin(),
    "cylinder, radius 45 mm": Skin(surface="cylinder", radius_mm=45.0, pitch_x_mm=17.0),
}


@dataclasses.dataclass(frozen=True)
class Registered:
    """Of many registrations."""

    refused: float
    """Share that was refused."""
    wrong: float
    """Share of the rest with the wrong way of mounting."""
    middle_mm: float
    """Error of the sheet's middle, RMS."""
    turned_deg: float
    """Error of its angles, RMS."""
    residual_mm: float
    """That was told, RMS."""


def study(skin: Skin, points: int, folder: Path, *, normals: bool, count: int = 200, seed: int = 1) -> Registered:
    """Random poses and mountings, random points, a finger that is off by a millimeter or so."""
    (folder / "skin.toml").write_text(skin.to_toml(), encoding="utf-8")
    plan = read({"name": "link", "skin": "skin.toml"}, folder)
    rng = np.random.default_rng(seed)
    refused = wrong = 0
    errors: list[tuple[float, float, float]] = []
    for _ in range(count):
        mirrored = bool(rng.integers(2))
        pose = Pose.of(tuple(rng.uniform(-0.5, 0.5, 3)), tuple(rng.uniform(-1.5, 1.5, 3)))
        true = dataclasses.replace(plan, pose=pose, mirrored=mirrored)
        try:
            found = registration.register(plan, [_pressed(true, rng, normals) for _ in range(points)])
        except BodyError:
            refused += 1
            continue
        if found.mirrored != mirrored:
            wrong += 1
            continue
        errors.append(_errors(true, found.pose, found.rms_mm))
    middle, turned, residual = np.sqrt(np.mean(np.square(errors), axis=0)) if errors else (math.nan,) * 3
    return Registered(refused / count, wrong / max(1, count - refused), middle, turned, residual)


def _pressed(true: Plan, rng: np.random.Generator, normals: bool) -> Press:
    """A point of the link that a finger is to press, and the zone that it makes."""
    skin = true.skin
    wide, high = (skin.columns - 1) * skin.pitch_x_mm, (skin.rows - 1) * skin.pitch_y_mm
    while True:
        x, y = rng.uniform(MARGIN_MM, wide - MARGIN_MM), rng.uniform(MARGIN_MM, high - MARGIN_MM)
        point, normal = true.place(x, y)
        dx, dy = PLACED_MM * rng.standard_normal(2)
        disc = Contact(shape=contacts.disc(FINGER_MM), x_mm=x + dx, y_mm=y + dy, force_n=10.0)
        rows, columns = np.nonzero(Scene((disc,)).pressed(0.0, skin))
        if len(rows):  # between switches that lie far apart a finger may press none; who presses tries another point
            zone = columns.mean() * skin.pitch_x_mm, rows.mean() * skin.pitch_y_mm
            return Press(point, normal if normals else None, zone)


def _errors(true: Plan, found: Pose, rms_mm: float) -> tuple[float, float, float]:
    skin = true.skin
    point_mm, _ = true.surface.place((skin.columns - 1) * skin.pitch_x_mm / 2, (skin.rows - 1) * skin.pitch_y_mm / 2)
    middle = np.array(point_mm) / 1000
    away = 1000 * float(np.linalg.norm(found.apply(middle) - true.pose.apply(middle)))
    between = found.rotation @ true.pose.rotation.T
    return away, math.degrees(math.acos(min(1.0, (float(np.trace(between)) - 1) / 2))), rms_mm
