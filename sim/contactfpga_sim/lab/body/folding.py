"""A cover that folds at a joint and presses switches: shares of folds and touches marked."""

from __future__ import annotations

import dataclasses

import numpy as np

from contactfpga.robot.body.folds import STEP_RAD, Folds, learn
from contactfpga.skin import Skin
from contactfpga.wire.protocol import Frame, no_records
from contactfpga.zones.zone import Zones
from contactfpga_sim.model.scenes import contacts
from contactfpga_sim.model.scenes.scene import Contact, Scene

SKIN = Skin(report="cells")
BEGINS_RAD, RANGE_RAD = 0.6, 2.0
OFF_RAD = 0.01
"""Standard deviation of the reported angle."""
FLICKER = 0.3
"""Chance that a cell at a fold's rim is open."""
FINGER_MM = 9.0


def fold(angle_rad: float, rng: np.random.Generator | None = None) -> np.ndarray:
    """(rows, columns) bool crease across rows 0 to 3, from 0.6 rad on, growing with the angle. Without ``rng``: all
    cells it can press."""
    cells = np.zeros((SKIN.rows, SKIN.columns), bool)
    if rng is not None:
        angle_rad += OFF_RAD * rng.standard_normal()
    deep = (angle_rad - BEGINS_RAD) / (RANGE_RAD - BEGINS_RAD)
    if deep <= 0:
        return cells
    half, rows = 2 + 4 * deep, 1 + 3 * deep
    y, x = np.mgrid[: SKIN.rows, : SKIN.columns]
    distance = np.maximum(np.abs(x - 7.5) / half, (y + 0.5) / rows)
    cells |= distance <= 1
    if rng is None:
        return cells
    rim = cells & (distance > 0.75)
    return cells & ~(rim & (rng.random(cells.shape) < FLICKER))


def touch(x_mm: float, y_mm: float) -> np.ndarray:
    disc = Contact(shape=contacts.disc(FINGER_MM), x_mm=x_mm, y_mm=y_mm, force_n=10.0)
    return np.asarray(Scene((disc,)).pressed(0.0, SKIN), bool)


def frame_of(cells: np.ndarray, skin: Skin = SKIN) -> Zones:
    frame = Frame(0, 0, frozenset(), 0, 0, 0, int(cells.sum()), no_records(skin.sheet), cells, None)
    return Zones(frame, skin.sheet, 0)


def learned(sweeps: int, rng: np.random.Generator, frames: int = 400) -> Folds:
    angles = np.tile(np.linspace(0, RANGE_RAD, frames), sweeps)
    return learn("joint", ((angle, frame_of(fold(angle, rng))) for angle in angles.tolist()))


@dataclasses.dataclass(frozen=True)
class Rates:
    """Shares of zones and touches, from 0 to 1."""

    folds: float
    """Fold-only zones marked, as they should be."""
    apart: float
    """Separate touches marked by mistake while the cover is folded."""
    joined: float
    """Touches joined to the fold's zone, marked by mistake."""
    within: float
    """Touches marked whose cells the fold can all press: no switch can tell."""
    straight: float
    """Touches marked by mistake with the joint straight."""


def rates(sweeps: int, count: int = 400, seed: int = 1) -> Rates:
    rng = np.random.default_rng(seed)
    known = learned(sweeps, rng)
    seen: dict[str, list[bool]] = {name: [] for name in ("folds", "apart", "joined", "within", "straight")}
    for _ in range(count):
        angle = float(rng.uniform(BEGINS_RAD + 2 * STEP_RAD, RANGE_RAD - STEP_RAD))
        seen["folds"] += _marks(known, angle, fold(angle, rng))
        # Half of the touches come near the crease, where they are hardest to tell from it.
        high = 40.0 if rng.integers(2) else 150.0
        finger = touch(float(rng.uniform(0, 150)), float(rng.uniform(0, high)))
        if not finger.any():
            continue
        seen["straight"] += _marks(known, float(rng.uniform(0, BEGINS_RAD - 2 * STEP_RAD)), finger)
        creased = fold(angle, rng)
        both = frame_of(creased | finger)
        mine = [cells for cells in _zones(both) if (cells & finger).any()]
        beyond = bool((finger & ~fold(angle)).any())
        for cells in mine:
            kind = "within" if not beyond else "joined" if (cells & creased).any() else "apart"
            seen[kind].append(known.share(angle, cells) == 1)
    return Rates(**{name: float(np.mean(marks)) if marks else float("nan") for name, marks in seen.items()})


def _zones(zones: Zones) -> list[np.ndarray]:
    return [cells for zone in zones if (cells := zones.cells_of(zone)) is not None]


def _marks(known: Folds, angle: float, cells: np.ndarray) -> list[bool]:
    return [known.share(angle, each) == 1 for each in _zones(frame_of(cells))]
