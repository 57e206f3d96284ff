"""What the chart draws beside its points: walls that no method passes, and rivals that are no method of ours."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from concurrent.futures import Executor

from contactfpga_sim.lab.chart.compute import Point, Task
from contactfpga_sim.lab.chart.errors import Interval, Quantile


@dataclasses.dataclass(frozen=True)
class Rival:
    """A modeled way to read contacts that is not one of the chart's methods."""

    name: str
    family: str
    touch_us: Quantile
    """Median from the first touch of the foam to what the method's points count, too."""
    errors: dict[str, Interval]
    """By metric, against the contacts."""


def least_mm(task: Task) -> Interval | None:
    """The least mean error of the barycenter in mm that any method can have from this task's cells; None where it is
    not known."""
    # HOOK: floor(task.family, task.skin, task.cover, task.count, task.seed).barycenter_mm of chart.floor goes here.
    return None


def bounded(points: Sequence[Point], executor: Executor) -> list[Point]:
    """The same points, with the least error that any method can have from their cells."""
    least = executor.map(least_mm, [point.task for point in points])
    return [dataclasses.replace(point, least_mm=value) for point, value in zip(points, least, strict=True)]


def rivals(families: Sequence[str], count: int, seed: int) -> list[Rival]:
    """Points of another kind, each drawn with the word "model"."""
    # HOOK: those of chart.rivals go here.
    return []


def bits_us(points: Sequence[Point]) -> float:
    """Microseconds that the bits of the shortest frame take that one of these points sends, at the baud rate that most
    of them have."""
    bauds = [point.task.skin.baud for point in points]
    usual = max(dict.fromkeys(bauds), key=bauds.count)
    return min(point.times.lower_bound_us for point in points if point.task.skin.baud == usual)
