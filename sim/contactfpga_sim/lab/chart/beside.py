"""Limits that no method passes, and rival sensors, for the chart."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from concurrent.futures import Executor

import numpy as np

from contactfpga.skin import Skin
from contactfpga_sim.lab.chart import errors, floor
from contactfpga_sim.lab.chart.compute import Point, Task
from contactfpga_sim.lab.chart.errors import Interval, Quantile
from contactfpga_sim.lab.chart.methods import EXTENT_MM
from contactfpga_sim.lab.chart.rivals import RIVALS
from contactfpga_sim.lab.covers import COVERS
from contactfpga_sim.model.scenes.families import touches

PITCH_MM = 6.4
"""Pitch of the rivals' tiles."""

TOUCHES = 50


@dataclasses.dataclass(frozen=True)
class RivalMethod:
    """A modeled rival, not one of the chart's methods."""

    name: str
    family: str
    touch_us: Quantile
    """Median time from the foam's first touch."""
    errors: dict[str, Interval]


def least_mm(task: Task) -> Interval | None:
    """Lower bound in mm of any method's mean barycenter error on these cells; None for several contacts, or none
    felt."""
    if task.family not in floor.ONE:
        return None
    try:
        return floor.floor(task.family, task.skin, task.cover, task.count, task.seed).lower_mm
    except ValueError:
        return None


def bounded(points: Sequence[Point], executor: Executor) -> list[Point]:
    least = executor.map(least_mm, [point.task for point in points])
    return [dataclasses.replace(point, least_mm=value) for point, value in zip(points, least, strict=True)]


def rivals(families: Sequence[str], count: int, seed: int) -> list[RivalMethod]:
    lines, cover = round(EXTENT_MM / PITCH_MM), COVERS["tiles"](PITCH_MM)
    skin = Skin(rows=lines, columns=lines, pitch_x_mm=PITCH_MM, pitch_y_mm=PITCH_MM, connectivity=4)
    found = []
    for family, (name, rival) in itertools.product(families, RIVALS.items()):
        scenes, rng = touches(family, count, seed, skin, cover), np.random.default_rng(seed)
        each = [rival.errors(scene, skin, cover) for scene in scenes]
        times = [rival.time_us(scene, skin, cover, rng) for scene in scenes]
        means = {metric: errors.interval([float(getattr(one, metric)) for one in each]) for metric in errors.METRICS}
        found.append(RivalMethod(name, family, errors.quantile(times, 0.5), means))
    return found


def bits_us(points: Sequence[Point]) -> float:
    """Microseconds of the shortest frame's bits, at the most common baud rate."""
    bauds = [point.task.skin.baud for point in points]
    usual = max(dict.fromkeys(bauds), key=bauds.count)
    return min(point.times.lower_bound_us for point in points if point.task.skin.baud == usual)
