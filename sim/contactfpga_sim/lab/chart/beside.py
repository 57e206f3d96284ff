"""What the chart draws beside its points: walls that no method passes, and rivals that are no method of ours."""

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
"""Of the tiles under which other ways to read a sheet are drawn."""

TOUCHES = 50
"""The most of each family for such a point; a page has a table of them in its place."""


@dataclasses.dataclass(frozen=True)
class RivalMethod:
    """A modeled way to read contacts that is not one of the chart's methods."""

    name: str
    family: str
    touch_us: Quantile
    """Median from the first touch of the foam to what the method's points count, too."""
    errors: dict[str, Interval]
    """By metric, against the contacts."""


def least_mm(task: Task) -> Interval | None:
    """The least mean error of the barycenter in mm that any method can have from this task's cells, from below; None
    for families of several contacts, and where no contact is felt."""
    if task.family not in floor.ONE:
        return None
    try:
        return floor.floor(task.family, task.skin, task.cover, task.count, task.seed).lower_mm
    except ValueError:
        return None


def bounded(points: Sequence[Point], executor: Executor) -> list[Point]:
    """The same points, with the least error that any method can have from their cells."""
    least = executor.map(least_mm, [point.task for point in points])
    return [dataclasses.replace(point, least_mm=value) for point, value in zip(points, least, strict=True)]


def rivals(families: Sequence[str], count: int, seed: int) -> list[RivalMethod]:
    """Each other way to read a sheet, on each family, under tiles of :data:`PITCH_MM`; drawn with the word "model"."""
    lines, cover = round(EXTENT_MM / PITCH_MM), COVERS["tiles"](PITCH_MM)
    skin = Skin(rows=lines, columns=lines, pitch_x_mm=PITCH_MM, pitch_y_mm=PITCH_MM, connectivity=4)
    found = []
    for family, (name, rival) in itertools.product(families, RIVALS.items()):
        scenes, rng = touches(family, count, seed, skin), np.random.default_rng(seed)
        each = [rival.errors(scene, skin, cover) for scene in scenes]
        times = [rival.time_us(scene, skin, cover, rng) for scene in scenes]
        means = {metric: errors.interval([float(getattr(one, metric)) for one in each]) for metric in errors.METRICS}
        found.append(RivalMethod(name, family, errors.quantile(times, 0.5), means))
    return found


def bits_us(points: Sequence[Point]) -> float:
    """Microseconds that the bits of the shortest frame take that one of these points sends, at the baud rate that most
    of them have."""
    bauds = [point.task.skin.baud for point in points]
    usual = max(dict.fromkeys(bauds), key=bauds.count)
    return min(point.times.lower_bound_us for point in points if point.task.skin.baud == usual)
