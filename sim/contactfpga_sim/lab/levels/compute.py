"""One light level of force and several: fitted on the cover's model, judged on it and on finite elements."""

from __future__ import annotations

import functools
import itertools
import math
import tempfile
import zlib
from collections.abc import Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import NamedTuple

import numpy as np

from contactfpga.skin import Skin
from contactfpga_sim.apps import pool, result_cache, score
from contactfpga_sim.apps.covers import sheet
from contactfpga_sim.apps.light import Reading, Sensed
from contactfpga_sim.apps.score import MODELS, Entry, Interval, Scores
from contactfpga_sim.lab.benchmark import bounds, entries, scenes
from contactfpga_sim.lab.benchmark.pressed import Pressed
from contactfpga_sim.lab.benchmark.scenes import Work

MOST = 4
"""Most levels."""
SEVERAL = ("fingers", "pair", "palm")
"""Families that decide the forces: those of several contacts or peaks."""
ROUNDS = ((50, 4), (400, 1))
"""Scenes of a family for each round of the choice of forces, and how many readings of each number of levels it keeps.
With 100 scenes alone another seed chose three levels at 5 mm that had 18.5 % of wrong counts in place of 12.0."""


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


def outcome(sensed: Sensed, reading: Reading, there: Pressed, pitch_mm: float) -> tuple[bool, bool, float]:
    """What :func:`~contactfpga_sim.apps.score.judged` says of a scene that is read so."""
    found = entries.places(sensed.levels(reading), pitch_mm, reading.lasts)
    return score.judged(found, *(scenes.places(blobs, pitch_mm) for blobs in (there.contacts, there.joined)))


class Task(NamedTuple):
    """Scenes of a family, and how they are read."""

    scenes: Work
    readings: tuple[Reading, ...]


Outcomes = list[list[tuple[bool, bool, float]]]
"""Of each scene, by each reading."""


def outcomes(task: Task) -> Outcomes:
    key = f"{result_cache.made_by(__name__, sheet(task.scenes.pitch_mm))} {task}"
    found: Outcomes = result_cache.cached("levels", key, functools.partial(_outcomes, task))
    return found


def _outcomes(task: Task) -> Outcomes:
    work, name, found = task.scenes, zlib.crc32(task.scenes.family.encode()), []
    for number, there in enumerate(scenes.drawn(work), work.first):
        sensed = Sensed(there.forces_n, name, work.seed, number)
        found.append([outcome(sensed, reading, there, work.pitch_mm) for reading in task.readings])
    return found


class Judged(NamedTuple):
    """A reading on a pitch, and its scores on the benchmark's scenes."""

    pitch_mm: float
    reading: Reading
    scores: Scores

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
        family = score.worst(self.scores, model)
        return family, self.scores[family, model].wrong

    def beats(self, other: Judged) -> bool:
        """Whether it counts better in its worst family, beyond the intervals of both, by each model."""
        return all(self.worst(model)[1].high < other.worst(model)[1].low for model in MODELS)


class Found(NamedTuple):
    designs: list[Judged]
    """For each pitch the best reading of one to :data:`MOST` levels, by pitch and number of levels."""
    entries: list[tuple[Entry, Scores]]
    """The benchmark's own entries."""
    bounds: list[tuple[Entry, Scores]]


def compute() -> Found:
    with pool.executor() as workers, tempfile.TemporaryDirectory() as name:
        scenes.write(Path(name), scenes.SEED, scenes.COUNT, workers)
        best = {pitch: fitted(pitch, workers) for pitch in scenes.PITCHES_MM}
        designs = [(pitch, reading) for pitch, readings in best.items() for reading in readings]
        methods = {str(one): entries.light(one[0], one[1].forces_n, one[1].lasts) for one in designs}
        found = entries.judged({**methods, **entries.METHODS}, Path(name), workers)
        return Found([Judged(*one, found.pop(0)[1]) for one in designs], found, bounds.least(workers))


def fitted(pitch_mm: float, workers: Executor) -> tuple[Reading, ...]:
    """For each number of levels the reading with the fewest wrong counts in its worst family, by the cover's model; of
    equals the best placed."""
    readings = tuple(reading for count in range(1, MOST + 1) for reading in candidates(count))
    begun = 0
    for number, kept in ROUNDS:
        tasks = [
            Task(Work(pitch_mm, "model", family, scenes.OTHERS, first, scenes.PIECE), readings)
            for family in SEVERAL
            for first in range(begun, begun + number, scenes.PIECE)
        ]
        found = list(workers.map(outcomes, tasks))
        readings = choices(readings, [task.scenes.family for task in tasks], found, kept)
        begun += number
    return readings


def choices(
    readings: Sequence[Reading], families: Sequence[str], found: Sequence[Outcomes], kept: int
) -> tuple[Reading, ...]:
    """The ``kept`` best readings of each number of levels, by outcomes of each scene in pieces of these families."""
    wrong = {family: np.zeros(len(readings)) for family in families}
    for family, piece in zip(families, found, strict=True):
        wrong[family] += np.array([[wrong for wrong, *_ in scene] for scene in piece]).mean(axis=0)
    misplaced = [[place for *_, place in scene] for piece in found for scene in piece]
    places = np.ma.masked_invalid(misplaced).mean(axis=0).filled(np.inf)
    best: dict[int, list[Reading]] = {}
    for place in np.lexsort([places, np.max(list(wrong.values()), axis=0)]).tolist():
        best.setdefault(len(readings[place].forces_n), []).append(readings[place])
    return tuple(one for count in sorted(best) for one in best[count][:kept])
