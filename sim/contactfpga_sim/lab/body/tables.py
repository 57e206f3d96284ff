"""Registration by pressing points; tables of docs/body.md."""

from __future__ import annotations

import dataclasses
import itertools
import math
import tempfile
from pathlib import Path

import numpy as np

from contactfpga.robot.body import BodyError, registration
from contactfpga.robot.body.kinematics import Pose
from contactfpga.robot.body.plan import Plan, read
from contactfpga.robot.body.registration import Press
from contactfpga.shipped import examples
from contactfpga.skin import Skin
from contactfpga_sim.apps.score import wilson
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.body import folding, outages
from contactfpga_sim.model.scenes import contacts
from contactfpga_sim.model.scenes.scene import Contact, Scene

FINGER_MM = 9.0
MARGIN_MM = 15.0
PLACED_MM = 1.0
"""Standard deviation of the finger, by axis."""
SKINS = {
    "plane, 16x16, 10 mm": Skin(),
    "cylinder, radius 45 mm": Skin(surface="cylinder", radius_mm=45.0, pitch_x_mm=17.0),
}


@dataclasses.dataclass(frozen=True)
class RegistrationErrors:
    refused: float
    wrong: float
    """Share of accepted ones with the wrong mounting."""
    middle_mm: float
    turned_deg: float
    residual_mm: float


def placement_errors(
    skin: Skin, points: int, folder: Path, *, normals: bool, count: int = 200, seed: int = 1
) -> RegistrationErrors:
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
    return RegistrationErrors(refused / count, wrong / max(1, count - refused), middle, turned, residual)


def _pressed(true: Plan, rng: np.random.Generator, normals: bool) -> Press:
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


POINTS = (3, 4, 6, 10)
SHOWN = (3, 6)
FOLDS_N = (2.0, 1.0, 0.5)
"""Force of a fold on the cell that it presses most."""
BOARDS = ("kits/soft/skin.toml", "levels.toml")
"""Examples of Skins."""


def outages_table() -> str:
    rows = [("fault", "states of the link", "reported after, s", "ok again after, s")]
    with tempfile.TemporaryDirectory() as folder:
        for outage in outages.OUTAGES:
            seen = outages.play(outage, Path(folder))
            states = ", ".join(f"`{one}`" for one in seen.statuses)
            rows.append((outage.name, states, _seconds(seen.noticed_s), _seconds(seen.back_s)))
    return writer.table_of(rows)


def _seconds(value: float) -> str:
    return "at once" if value < 0.0005 else f"{value:.3f}"


def registration_table() -> writer.Table:
    columns = ("sheet", "points", "refused, %", "middle off by, mm", "turned by, degrees")
    rows, shown = [], []
    with tempfile.TemporaryDirectory() as folder:
        for name, skin in SKINS.items():
            for normals, points in itertools.product((True, False), POINTS):
                if skin.radius_mm is None and not normals:  # in a plane they have to be known
                    continue
                found = placement_errors(skin, points, Path(folder), normals=normals)
                first = f"{name}, {'with' if normals else 'without'} normals" if points == POINTS[0] else ""
                shares = (f"{100 * found.refused:.0f}", f"{100 * found.wrong:.0f}")
                values = (found.middle_mm, found.turned_deg, found.residual_mm)
                errors = ("" if math.isnan(value) else f"{value:.2f}" for value in values)
                rows.append((first, str(points), *shares, *errors))
                shown += [rows[-1]] if normals and points in SHOWN else []
    head = (*columns[:3], "wrongly mirrored, %", *columns[3:], "residual, mm")
    return writer.Table(head, rows, lambda row: row in shown, columns)


def folds_table() -> str:
    head = ("board", "a fold presses", "folds taken for a touch", "of one level", "touches within it found")
    rows = [(*head, "with one level", "touches over its edge found")]
    return writer.table_of([*rows, *(_folds(board, most_n) for most_n in FOLDS_N for board in BOARDS)])


def folds_sample() -> str:
    return writer.line(_folds(BOARDS[0], FOLDS_N[0]))


def _folds(board: str, most_n: float) -> tuple[str, ...]:
    one, three = folding.trials(examples() / board, most_n).values()
    shares = (three.folds, one.folds, three.within, one.within, three.joined)
    return (f"`{board}`", f"{most_n:g} N", *map(_share, shares))


def _share(hits: list[bool]) -> str:
    low, high = (100 * end for end in wilson(sum(hits), len(hits)))
    return f"{100 * np.mean(hits):.1f} % ({low:.1f} to {high:.1f})"
