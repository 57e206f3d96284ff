"""A cover that folds at a joint and presses cells: folds that pass for touches, and touches that are found in them.

A crease grows across the sheet from one end with the angle, and presses hardest in its middle. Each fold differs from
the one before: all cells by one factor, each by one more, and by the place of the crease. A touch adds its forces. The
film's gains are drawn for each sheet. All of it is assumed but the finger's forces, which the cover's model gives.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import NamedTuple

import numpy as np

from contactfpga.design.cover import Cover, load_cover
from contactfpga.robot.body.folds import instants, learn
from contactfpga.skin import Skin
from contactfpga.skin.sheet import Sheet
from contactfpga.wire.protocol import Frame, no_records
from contactfpga.zones.zone import Zones
from contactfpga_sim.apps import light
from contactfpga_sim.model.scenes import contacts
from contactfpga_sim.model.scenes.scene import Contact, Scene

BEGINS_RAD, RANGE_RAD = 0.6, 2.0
ANGLES = np.linspace(BEGINS_RAD, RANGE_RAD, 57)
"""Angles in rad of the frames of a fold."""
OFF_RAD = 0.01
"""Standard deviation of the reported angle."""
SPREAD = 0.1
"""Standard deviations of the logarithms of a fold's force and of its share on each cell, from fold to fold."""
MOVED_MM = 1.0
"""Standard deviation of the crease's place, from fold to fold."""
SWEEPS, SHEETS = 20, 50
"""Folds that are learned, and sheets drawn."""
FINGER_MM, TOUCH_N = 9.0, 5.0


class Found(NamedTuple):
    """Outcomes of each trial: of ``folds`` whether any frame of a fold without a touch passes for one; of ``within``
    and ``joined`` whether a touch is found, all or some of whose cells the fold presses as well."""

    folds: list[bool]
    within: list[bool]
    joined: list[bool]


def folded(skin: Skin, most_n: float, rng: np.random.Generator) -> np.ndarray:
    """(frames, rows, columns) forces in N of a fold at :data:`ANGLES`, at most ``most_n`` on a cell of a usual one."""
    x, y = np.arange(skin.columns) * skin.pitch_x_mm, np.arange(skin.rows)[:, None] * skin.pitch_y_mm
    angles = ANGLES + OFF_RAD * rng.standard_normal(len(ANGLES))
    deep = np.maximum(0, (angles - BEGINS_RAD) / (RANGE_RAD - BEGINS_RAD))[:, None, None]
    along = np.abs(x - x.mean()) / (15 + 30 * deep)
    across = (y + skin.pitch_y_mm / 2 + MOVED_MM * rng.standard_normal()) / (10 + 25 * deep)
    differs = np.exp(SPREAD * (rng.standard_normal() + rng.standard_normal((skin.rows, skin.columns))))
    return np.asarray(most_n * deep * np.maximum(0, 1 - np.maximum(along, across) ** 2) * differs)


def touch(skin: Skin, cover: Cover, rng: np.random.Generator) -> np.ndarray:
    """(rows, columns) forces in N of a fingertip somewhere on the crease."""
    x_mm, y_mm = rng.uniform(0.1, 0.9) * skin.columns * skin.pitch_x_mm, rng.uniform(0, 30)
    finger = Contact(shape=contacts.disc(FINGER_MM), x_mm=x_mm, y_mm=y_mm, force_n=TOUCH_N)
    return Scene((finger,)).forces_n(0.0, skin, cover)


def levels_of(forces_n: np.ndarray, reading: light.Reading) -> np.ndarray:
    """Number of the reading's forces that each force reaches."""
    return np.asarray(sum((forces_n >= one).astype(np.int64) for one in reading.forces_n))


def trials(path: Path, most_n: float, folds: int = 1000, touches: int = 1000, seed: int = 1) -> dict[int, Found]:
    """Outcomes on sheets of the Skin in a file, with its lightest level alone and with all, by their number."""
    skin, cover, rng = Skin.load(path), load_cover(path), np.random.default_rng(seed)
    assert cover is not None
    assert cover.cell is not None
    usual, early = (light.reading_of(one, cover.cell) for one in (skin, skin.replace(harder=instants(skin))))
    outcomes, layout = {levels: Found([], [], []) for levels in (1, skin.levels)}, skin.sheet
    for sheet in range(SHEETS):
        gains, _ = cover.cell.drawn((skin.rows, skin.columns), seed + sheet)
        sweeps = [levels_of(folded(skin, most_n, rng) / gains, early) for _ in range(SWEEPS)]
        frames = (frame_of(one, layout) for one in np.concatenate(sweeps))
        known = learn("joint", zip(np.tile(ANGLES, SWEEPS).tolist(), frames))
        one = dataclasses.replace(known, levels=1, reached={step: most > 0 for step, most in known.reached.items()})
        explained = {
            each.levels: np.array([each.explained(angle) for angle in ANGLES.tolist()]) for each in (one, known)
        }
        for _ in range(folds // SHEETS):
            read = levels_of(folded(skin, most_n, rng) / gains, usual)
            for levels, found in outcomes.items():
                found.folds.append(bool((np.minimum(read, levels) > explained[levels]).any()))
        for _ in range(touches // SHEETS):
            at = rng.integers(len(ANGLES) // 8, len(ANGLES))
            alone, finger = folded(skin, most_n, rng)[at] / gains, touch(skin, cover, rng) / gains
            pressed, creased, read = (levels_of(each, usual) for each in (finger, alone, finger + alone))
            for levels, found in outcomes.items():
                kind = found.joined if (pressed > 0)[creased == 0].any() else found.within
                if (pressed > 0)[creased > 0].any():
                    kind.append(bool((np.minimum(read, levels) > explained[levels][at])[finger > 0].any()))
    return outcomes


def frame_of(levels: np.ndarray, sheet: Sheet) -> Zones:
    """A frame of a board that reads so."""
    frame = Frame(0, 0, frozenset(), 0, 0, 0, int((levels > 0).sum()), no_records(sheet), levels > 0, levels)
    return Zones(frame, sheet, 0)
