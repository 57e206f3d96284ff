"""The least error of place that a method can have, for single contacts under domes at the kits' pitch.

An estimator by Bayes knows the body, its force and its approach, and that its place is even within a pitch. It does not
know the closing force of each dome. No method knows more, so none has a smaller mean square error. It reads the cells
that are closed at rest, or the moment at which each one closed.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
import zlib
from collections.abc import Callable
from concurrent.futures import Executor
from typing import Any

import numpy as np
from scipy.special import log_ndtr

from contactfpga.design.cover import Load, cells_of
from contactfpga_sim.apps import score
from contactfpga_sim.apps.covers import DOME, sheet
from contactfpga_sim.apps.score import MODELS, Entry, Score, Scores
from contactfpga_sim.lab.benchmark import scenes
from contactfpga_sim.lab.benchmark.entries import KITS_MM
from contactfpga_sim.lab.benchmark.scenes import SEED
from contactfpga_sim.model.scenes.families import touches

FAMILIES, COUNT = ("bumper", "edge"), 40
"""Families of single contacts that domes seldom part, and touches of each."""
KIND = "bound"
NAMES = ("domes' least error, one frame", "domes' least error, closings")
MOMENTS, SIDE, ROUNDS = 6, 8, 4
"""Moments of an approach; places along a grid's side; grids, each around the place found before."""


class Touch:
    """A body's approach at any place within a pitch. Forces are shares of a dome's usual closing force."""

    def __init__(self, family: str, number: int):
        self.skin, pitch_m = sheet(KITS_MM), 1e-3 * KITS_MM
        cover = scenes.cover_of(self.skin)
        (scene,) = touches(family, 1, SEED, self.skin, cover, number)
        self._cells = cells_of(cover, self.skin.rows, self.skin.columns, pitch_m, pitch_m)
        self._none = np.zeros((self.skin.rows, self.skin.columns))
        self._loads = [scene.loads(at) for at in (scene.settled_s * np.linspace(0, 1, MOMENTS + 1) ** 2).tolist()]

    def forces(self, x_mm: float, y_mm: float, first: int = 0) -> np.ndarray:
        """(moments, rows, columns) largest forces so far, from moment ``first`` on."""

        @functools.cache  # a flat body's parts are the same all the time
        def under_1_n(parts: tuple[Any, ...]) -> np.ndarray:
            x, y = 1e-3 * x_mm, 1e-3 * y_mm
            moved = (dataclasses.replace(one, x_m=one.x_m + x, y_m=one.y_m + y) for one in parts)
            return self._cells.forces_n([Load(tuple(moved), 1.0)])

        found = [
            sum((load.force_n * under_1_n(load.parts) for load in loads), self._none) for loads in self._loads[first:]
        ]
        return np.maximum.accumulate(found) / DOME.force_n

    def off_mm(self, rng: np.random.Generator) -> tuple[float, float]:
        """Distances of both estimates from a drawn place, under drawn domes."""
        true = rng.uniform(-KITS_MM / 2, KITS_MM / 2, 2)
        closes = 1 + DOME.spread * rng.standard_normal((self.skin.rows, self.skin.columns))
        there = self.forces(*true.tolist())
        after = (there < closes).sum(axis=0)  # the first moment at which a dome is closed
        closed, at = after <= MOMENTS, np.clip(after, 1, MOMENTS)[None]

        def around(forces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            """The force before a closing, and its step over it."""
            before, then = (np.take_along_axis(forces, one, 0)[0] for one in (at - 1, at))
            return before, np.maximum(then - before, 1e-9)

        before, step = around(there)
        part = np.where(closed, (closes - before) / step, 0)

        def frame(x_mm: float, y_mm: float) -> float:
            z = (self.forces(x_mm, y_mm, MOMENTS)[0] - 1) / DOME.spread
            return float(log_ndtr(np.where(closed, z, -z)).sum())

        def closings(x_mm: float, y_mm: float) -> float:
            forces = self.forces(x_mm, y_mm)
            before, step = around(forces)
            z = (before + part * step - 1) / DOME.spread
            return float(np.where(closed, np.log(step) - z**2 / 2, log_ndtr((1 - forces[-1]) / DOME.spread)).sum())

        return math.dist(estimate(frame), true), math.dist(estimate(closings), true)


def estimate(log_likelihood: Callable[[float, float], float]) -> np.ndarray:
    """(2,) mean of the place in mm, even within a pitch before, by grids that close in on it."""
    middle, span = np.zeros(2), KITS_MM
    for _ in range(ROUNDS):
        axis = span * ((np.arange(SIDE) + 0.5) / SIDE - 0.5)
        grid = middle + np.array(list(itertools.product(axis, axis)))
        grid = grid[(np.abs(grid) <= KITS_MM / 2).all(axis=1)]
        logs = np.array([log_likelihood(*one) for one in grid.tolist()])
        weights = np.exp(logs - logs.max())
        middle = weights @ grid / weights.sum()
        spread = math.sqrt(float((weights @ (grid - middle) ** 2).max() / weights.sum()))
        span = min(span, max(6 * spread, 2 * span / SIDE))
    return middle


def _off_mm(family: str, number: int) -> tuple[float, float]:
    return Touch(family, number).off_mm(np.random.default_rng((zlib.crc32(family.encode()), SEED, number, 3)))


def least(workers: Executor) -> list[tuple[Entry, Scores]]:
    """Both estimates as entries that have errors of place alone."""
    found = {family: list(workers.map(_off_mm, itertools.repeat(family), range(COUNT))) for family in FAMILIES}
    found["all"] = [one for family in FAMILIES for one in found[family]]
    none = score.interval([])
    return [
        (
            Entry(name, KIND, KITS_MM, {}, {}),
            {
                (family, MODELS[0]): Score(none, none, score.interval([one[kind] for one in off]), none, none)
                for family, off in found.items()
            },
        )
        for kind, name in enumerate(NAMES)
    ]
