"""One light level of force and several: fitted on the cover's model, judged on it and on finite elements."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
import zlib
from collections.abc import Sequence
from concurrent.futures import Executor
from typing import NamedTuple

import numpy as np

from contactfpga.design.cover import Part, Switch, cells_of
from contactfpga.skin import Skin
from contactfpga.zones import levels
from contactfpga_sim.apps import errors, pool, result_cache
from contactfpga_sim.apps.covers import FOAM_M, tiled
from contactfpga_sim.apps.errors import Blob
from contactfpga_sim.apps.stats import Interval, interval
from contactfpga_sim.lab.chart.methods import sheet
from contactfpga_sim.lab.levels.pressed import Pressed, pressed
from contactfpga_sim.model.scenes import scene
from contactfpga_sim.model.scenes.families import placements
from contactfpga_sim.model.scenes.scene import Scene
from contactfpga_sim.model.scenes.truth import truth_of

PITCHES_MM = (4.0, 5.0, 6.4, 8.0)
FAMILIES = ("bumper", "fingers", "pair", "palm", "edge")
MODELS = ("model", "elements")

SPREAD = 0.2
"""Standard deviation of the logarithm of a cell's gain."""
PRELOAD_N = 0.02
"""Root mean square of the preload that a glued cover leaves on a cell."""
CREEP = 0.05
"""Part of the gain at 1 s that a decade of time adds."""
TOUCHED, OLDER = (-1.0, 3.0), 3.0
"""Decades of a touch's time in s; most decades by which a preload is older than the reading at rest."""
GUARD = 0.8
"""Part of a level's force from which a cell at rest counts as at that level: then its sample is taken later."""

MOST = 4
"""Most levels."""
SEVERAL = ("fingers", "pair", "palm")
"""Families that decide the forces: those of several contacts or peaks."""
FITTED, JUDGED, PIECE = 100, 400, 50
"""Scenes of a family, for the choice of forces and for the judgment; scenes per piece of work."""


class Reading(NamedTuple):
    """Forces of the levels, and by how many levels a part must last (:func:`contactfpga.zones.levels.label`)."""

    forces_n: tuple[float, ...]
    lasts: int = 1

    @property
    def bits(self) -> int:
        """Bits of a cell in a map of the levels."""
        return len(self.forces_n).bit_length()


class Outcome(NamedTuple):
    """Reading of one scene."""

    wrong: bool
    """Whether the number of contacts is neither that with narrow gaps nor that without."""
    apart: bool
    """Whether it is not the number of contacts that are apart by any gap."""
    place_mm: float
    """Mean error of place; NaN if the number is wrong."""


LIGHTEST_N = tuple(0.05 * 2 ** (half / 2) for half in range(7))
FIRST, FURTHER = (4.0, 8.0), (2.0, 4.0)
"""Ratios of the second force to the lightest, and of any further one to the one before."""


def candidates(count: int) -> list[Reading]:
    """Readings of so many levels. Parts last by the levels above the lightest, or by one less of three."""
    ratios = [[1.0, *pair[:1], *pair[1:] * (count - 2)] for pair in itertools.product(FIRST, FURTHER)]
    shapes = dict.fromkeys(tuple(one[:count]) for one in ratios)
    return [
        Reading(tuple((lightest * np.cumprod(shape)).round(2).tolist()), lasts)
        for lightest in LIGHTEST_N
        for shape in shapes
        for lasts in range(min(2, max(1, count - 1)), max(2, count))
    ]


def modeled(drawn: Scene, skin: Skin) -> Pressed:
    """A scene pressed on tiles by the cover's model, beside :func:`~contactfpga_sim.lab.levels.pressed.pressed`."""
    cover = tiled(skin.pitch_x_mm, Switch(travel_m=0.0))
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


class Sensed:
    """Forces on the cells of a scene's sheet as they are read, at rest and touched."""

    def __init__(self, forces_n: np.ndarray, *seeds: int):
        rng = np.random.default_rng(seeds)
        gain = np.exp(SPREAD * rng.standard_normal(forces_n.shape))
        preload = PRELOAD_N * np.abs(rng.standard_normal(forces_n.shape))
        self._rest_n = gain * preload
        touch, older = 1 + CREEP * rng.uniform(*TOUCHED), 1 + CREEP * rng.uniform(0, OLDER)
        self._touched_n = gain * (np.maximum(forces_n, 0) * touch + preload * older)

    def levels(self, reading: Reading) -> np.ndarray:
        """(rows, columns) level of each cell; 0 unless it is above the cell's own level at rest."""
        forces, read = reading.forces_n, (self._rest_n / GUARD, self._touched_n)
        rest, touched = (np.searchsorted(forces, one, "right") for one in read)
        return np.where(touched > rest, touched, 0)


def outcome(sensed: Sensed, reading: Reading, there: Pressed, skin: Skin) -> Outcome:
    read, pitch = sensed.levels(reading), skin.pitch_x_mm
    sums = levels.moments(read, levels.label(read, skin.connectivity, reading.lasts)).tolist()
    found = [Blob(area * pitch**2, pitch * x / weight, pitch * y / weight) for area, weight, x, y in sums]
    least, most = len(there.joined), len(there.contacts)
    true = there.contacts if len(found) == most else there.joined
    place = errors.errors(found, true).barycenter_mm if len(found) == len(true) else math.nan
    return Outcome(not least <= len(found) <= most, len(found) != most, place)


class Task(NamedTuple):
    """:data:`PIECE` scenes of a family, and how they are read."""

    pitch_mm: float
    model: str
    family: str
    seed: int
    first: int
    readings: tuple[Reading, ...]


def outcomes(task: Task) -> list[list[Outcome]]:
    """Outcomes of each scene by each reading."""
    key = f"{result_cache.made_by(__name__, sheet(task.pitch_mm))} {task}"
    found = result_cache.cached("levels", key, functools.partial(_outcomes, task))
    return [[Outcome(*one) for one in scene] for scene in found]


def _outcomes(task: Task) -> list[list[Outcome]]:
    skin, name, found = sheet(task.pitch_mm), zlib.crc32(task.family.encode()), []
    for number, drawn in enumerate(placements(task.family, PIECE, task.seed, skin, task.first), task.first):
        there = modeled(drawn, skin) if task.model == "model" else pressed(drawn, skin)
        sensed = Sensed(there.forces_n, name, task.seed, number)
        found.append([outcome(sensed, reading, there, skin) for reading in task.readings])
    return found


class Judged(NamedTuple):
    """A reading on a pitch, with intervals by model and family."""

    pitch_mm: float
    reading: Reading
    wrong: dict[tuple[str, str], Interval]
    apart: dict[tuple[str, str], Interval]
    place_mm: dict[tuple[str, str], Interval]

    @property
    def skin(self) -> Skin:
        return sheet(self.pitch_mm)

    @property
    def map_bytes(self) -> int:
        """Bytes of a map of levels."""
        return math.ceil(self.skin.rows * self.skin.columns * self.reading.bits / 8)

    @property
    def wires(self) -> int:
        return self.skin.rows + self.skin.columns

    @property
    def row_time(self) -> float:
        """Time of a row over that of 0.1 N: a cell's resistance falls as 1/F, and the lightest level sets the time."""
        return 0.1 / self.reading.forces_n[0]

    def worst(self, model: str) -> tuple[str, Interval]:
        """Family with the most wrong counts, and their share."""
        return max(((family, self.wrong[model, family]) for family in FAMILIES), key=lambda one: one[1].mean)

    def beats(self, other: Judged) -> bool:
        """Whether it counts better in its worst family, beyond the intervals of both, by each model."""
        return all(self.worst(model)[1].high < other.worst(model)[1].low for model in MODELS)


def compute() -> list[Judged]:
    """For each pitch the best reading of one to :data:`MOST` levels, by pitch and number of levels."""
    with pool.executor() as workers:
        return judged({pitch: fitted(pitch, workers) for pitch in PITCHES_MM}, workers)


def fitted(pitch_mm: float, workers: Executor) -> tuple[Reading, ...]:
    """For each number of levels the reading with the fewest wrong counts in its worst family, by the cover's model; of
    equals the best placed."""
    readings = tuple(reading for count in range(1, MOST + 1) for reading in candidates(count))
    tasks = [
        Task(pitch_mm, "model", family, 1, first, readings) for family in SEVERAL for first in range(0, FITTED, PIECE)
    ]
    return choices(readings, [task.family for task in tasks], list(workers.map(outcomes, tasks)))


def choices(
    readings: Sequence[Reading], families: Sequence[str], found: Sequence[list[list[Outcome]]]
) -> tuple[Reading, ...]:
    """The best reading of each number of levels, by outcomes of each scene in pieces of these families."""
    wrong = {family: np.zeros(len(readings)) for family in families}
    for family, piece in zip(families, found, strict=True):
        wrong[family] += np.array([[one.wrong for one in scene] for scene in piece]).mean(axis=0)
    misplaced = [[one.place_mm for one in scene] for piece in found for scene in piece]
    places = np.ma.masked_invalid(misplaced).mean(axis=0).filled(np.inf)
    best: dict[int, Reading] = {}
    for place in np.lexsort([places, np.max(list(wrong.values()), axis=0)]).tolist():
        best.setdefault(len(readings[place].forces_n), readings[place])
    return tuple(best[count] for count in sorted(best))


def judged(best: dict[float, tuple[Reading, ...]], workers: Executor) -> list[Judged]:
    """Readings by pitch, on new scenes of each family in both models."""
    tasks = [
        Task(pitch, model, family, 2, first, readings)
        for model in MODELS
        for pitch, readings in best.items()
        for family in FAMILIES
        for first in range(0, JUDGED, PIECE)
    ]
    rows: dict[tuple[float, str, str], list[list[Outcome]]] = {}
    for task, piece in zip(tasks, workers.map(outcomes, tasks), strict=True):
        rows.setdefault((task.pitch_mm, task.model, task.family), []).extend(piece)
    return [
        _judged(pitch, reading, {key[1:]: [scene[at] for scene in rows[key]] for key in rows if key[0] == pitch})
        for pitch, readings in best.items()
        for at, reading in enumerate(readings)
    ]


def _judged(pitch_mm: float, reading: Reading, rows: dict[tuple[str, str], list[Outcome]]) -> Judged:
    wrong, apart, place = (
        {key: interval([float(one[field]) for one in found]) for key, found in rows.items()} for field in range(3)
    )
    return Judged(pitch_mm, reading, wrong, apart, place)
