"""The benchmark's scenes: contacts with their truth, and the force on each cell, as one NPZ file per family."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import NamedTuple

import numpy as np

from contactfpga.design.cover import Cover, Part, Switch, cells_of
from contactfpga.inputs.files import replaced
from contactfpga.skin import Skin
from contactfpga_sim.apps import errors
from contactfpga_sim.apps.covers import FOAM_M, sheet, tiled
from contactfpga_sim.apps.errors import Blob
from contactfpga_sim.apps.score import MODELS, Truth
from contactfpga_sim.lab.benchmark.pressed import Pressed, pressed
from contactfpga_sim.model.scenes import scene
from contactfpga_sim.model.scenes.families import placements, touches
from contactfpga_sim.model.scenes.scene import Scene
from contactfpga_sim.model.scenes.truth import truth_of

FAMILIES = ("bumper", "fingers", "pair", "palm", "edge")
PITCHES_MM = (4.0, 5.0, 6.4, 8.0)
COUNT, PIECE = 400, 25
"""Usual number of scenes of a family, and scenes per piece of work."""
SEED, OTHERS = 2, 1
"""Seed of the scenes that judge, and of those to choose a method with."""
STEPS = 40
"""Moments of an approach. They are the denser the earlier, as a light level is reached early."""

Arrays = dict[str, np.ndarray]


class Work(NamedTuple):
    """``number`` scenes of a family, from ``first`` on, under one model."""

    pitch_mm: float
    model: str
    family: str
    seed: int
    first: int
    number: int


def cover_of(skin: Skin) -> Cover:
    """Tiles over cells without travel."""
    return tiled(skin.pitch_x_mm, Switch(travel_m=0.0))


def pressed_by(model: str, drawn: Scene, skin: Skin) -> Pressed:
    """A scene pressed on tiles by the cover's model, or by finite elements."""
    if model == "elements":
        return pressed(drawn, skin)
    cover = cover_of(skin)
    on, pitch = drawn.on_cover(skin, cover), skin.pitch_x_mm * 1e-3
    loads = on.loads(0.0)
    wider = [_wider(part) for load in loads for part in load.parts]
    return Pressed(
        cells_of(cover, skin.rows, skin.columns, pitch, pitch).forces_n(loads),
        errors.contacts(on.truth(0.0, skin)),
        errors.contacts(truth_of(wider, scene.sheet(skin))),
    )


def _wider(part: Part) -> Part:
    """A part with a rim of half the foam's thickness; parts whose rims meet are closer than the foam is thick."""
    assert dataclasses.is_dataclass(part)
    return dataclasses.replace(part, half_x_m=part.half_x_m + FOAM_M / 2, half_y_m=part.half_y_m + FOAM_M / 2)


def places(blobs: Iterable[Blob], pitch_mm: float) -> np.ndarray:
    """(k, 2) x and y in mm from the sheet's corner, half a pitch before the first cell."""
    return np.array([(one.x_mm, one.y_mm) for one in blobs]).reshape(-1, 2) + pitch_mm / 2


def padded(found: Sequence[np.ndarray]) -> np.ndarray:
    """(n, most, 2) of n arrays of places, with NaN beyond each one's number."""
    out = np.full((len(found), max(map(len, found), default=0), 2), np.nan)
    for scene_places, at in zip(found, out):
        at[: len(scene_places)] = scene_places
    return out


def drawn(work: Work) -> list[Pressed]:
    skin = sheet(work.pitch_mm)
    scenes = placements(work.family, work.number, work.seed, skin, work.first)
    return [pressed_by(work.model, one, skin) for one in scenes]


def rising(work: Work) -> np.ndarray:
    """(n, 2, STEPS + 1) for each approach: seconds since the touch, and the largest force on a cell by then in N."""
    skin, found = sheet(work.pitch_mm), []
    cover, pitch = cover_of(skin), skin.pitch_x_mm * 1e-3
    cells = cells_of(cover, skin.rows, skin.columns, pitch, pitch)
    for one in touches(work.family, work.number, work.seed, skin, cover, work.first):
        seconds = one.settled_s * np.linspace(0, 1, STEPS + 1) ** 2
        most = [float(cells.forces_n(one.loads(at)).max()) for at in seconds.tolist()]
        found.append([seconds, np.maximum.accumulate(most)])
    return np.array(found)


def arrays(family: str, seed: int, count: int, workers: Executor) -> Arrays:
    """All arrays of a family's file, as ``docs/benchmark.md`` lists them."""
    found: Arrays = {}
    starts = range(0, count, PIECE)
    todo = {
        (pitch, model): [Work(pitch, model, family, seed, at, min(PIECE, count - at)) for at in starts]
        for pitch, model in itertools.product(PITCHES_MM, MODELS)
    }
    pending = {key: [workers.submit(drawn, one) for one in works] for key, works in todo.items()}
    rises = {pitch: [workers.submit(rising, one) for one in todo[pitch, "model"]] for pitch in PITCHES_MM}
    for (pitch, model), pieces in pending.items():
        scenes, head = [one for piece in pieces for one in piece.result()], f"{model}_{pitch:g}mm"
        found[f"{head}_forces"] = np.array([one.forces_n for one in scenes]).round(4).astype(np.float32)
        for name in Truth._fields:
            found[f"{head}_{name}"] = padded([places(getattr(one, name), pitch) for one in scenes])
    for pitch, parts in rises.items():
        both = np.concatenate([part.result() for part in parts]).astype(np.float32)
        found[f"{pitch:g}mm_rise_s"], found[f"{pitch:g}mm_rise_n"] = both[:, 0], both[:, 1]
    return found


def write(folder: Path, seed: int, count: int, workers: Executor) -> list[Path]:
    """Write a file per family."""
    return [save(folder / f"{family}.npz", arrays(family, seed, count, workers)) for family in FAMILIES]


def save(path: Path, values: Arrays) -> Path:
    """Write arrays; equal arrays give an equal file."""
    with replaced(path) as new, open(new, "wb") as file:
        np.savez_compressed(file, allow_pickle=False, **values)
    return path
