"""Points of the chart: every method on every family."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor, Future, as_completed
from typing import Any

import numpy as np

from contactfpga.design.cover import Cover
from contactfpga.skin import Skin
from contactfpga_hdl.board import sizes
from contactfpga_hdl.top import Top
from contactfpga_sim.apps import errors, result_cache, score, size, stats
from contactfpga_sim.apps.errors import METRICS
from contactfpga_sim.apps.score import Interval
from contactfpga_sim.lab.chart import times
from contactfpga_sim.lab.chart.times import Raw, Times
from contactfpga_sim.model.scenes.families import touches
from contactfpga_sim.model.scenes.scene import Scene

FAMILIES_DRAWN = ("bumper", "fingers", "pair", "palm", "edge")

FAMILY = "fingers"
"""The family that compares all methods."""

PIECE = 100

TIMED = 200
"""Most placements timed as touches."""

BAD = 0.1

NARROW = 0.15
"""Half of the median's interval over the median at which touches are enough."""

DEVICE = sizes.UP5K


@dataclasses.dataclass(frozen=True)
class Task:
    method: str
    skin: Skin
    cover: Cover | None
    family: str
    count: int
    seed: int
    checked: int = 2
    """Touches also through the gateware."""


KINDS = ("total", "labeller", "sensing")
"""Errors: zones against contacts, zones against connected cells, connected cells against contacts."""

Found = dict[str, dict[str, list[float]]]
"""A value per scene, by kind and metric."""


@dataclasses.dataclass(frozen=True)
class Point:
    task: Task
    errors: dict[str, dict[str, Interval]]
    times: Times
    luts: int | None
    host_us: float = 0.0


def study(
    tasks: Sequence[Task],
    executor: Executor,
    with_size: bool = True,
    step: Callable[[str, int], None] = lambda name, of: None,
    so_far: dict[Task, Point] | None = None,
) -> list[Point]:
    """Work out all tasks; ``step(kind of work, pieces of that kind)`` follows each piece. A point enters ``so_far``
    once its errors and times are known, before its size.

    Results are cached by code. ``executor`` can be Dask's.
    """
    skins = list(dict.fromkeys(task.skin for task in tasks)) if with_size else []
    parts: dict[Task, tuple[Future[list[Found]], Future[list[Raw]]]] = {
        task: (
            executor.submit(accuracies, task),
            executor.submit(timings, task),
        )
        for task in dict.fromkeys(tasks)
    }
    counted = {skin: executor.submit(_luts, skin) for skin in skins}
    names: dict[Future[Any], str] = {
        **dict.fromkeys((pieces for pieces, _ in parts.values()), "placements"),
        **dict.fromkeys((timed for _, timed in parts.values()), "times"),
        **dict.fromkeys(counted.values(), "synthesis"),
    }
    owners = {future: task for task, (pieces, timed) in parts.items() for future in (pieces, timed)}
    found = {} if so_far is None else so_far
    of = Counter(names.values())
    for future in as_completed(names):
        future.result()
        step(names[future], of[names[future]])
        task = owners.get(future)
        if task is None:
            continue
        pieces, timed = parts[task]
        if pieces.done() and timed.done():
            measured = intervals(pieces.result())
            passed = times.summed(timed.result(), task.skin)
            found[task] = Point(task, measured, passed, None)
    if not with_size:
        return [found[task] for task in tasks]
    return [dataclasses.replace(found[task], luts=counted[task.skin].result()) for task in tasks]


def intervals(pieces: Sequence[Found]) -> dict[str, dict[str, Interval]]:
    return {
        kind: {name: score.interval([value for piece in pieces for value in piece[kind][name]]) for name in METRICS}
        for kind in KINDS
    }


def accuracies(task: Task) -> list[Found]:
    """Errors of pieces of the scenes, until it is clear that more than :data:`BAD` of all are miscounted: then no more
    digit of the share matters."""
    found: list[Found] = []
    for first in range(0, task.count, PIECE):
        found.append(accuracy(task, first))
        wrong = [value for piece in found for value in piece["total"]["miscounted"]]
        if score.interval(wrong).low > BAD:
            break
    return found


def accuracy(task: Task, first: int) -> Found:
    """Errors by kind and metric of one piece, once all forces have risen."""

    def new() -> Found:
        scenes = _touches(task, first)
        return compared((errors.look(scene, scene.settled_s, task.skin, task.cover) for scene in scenes), task.skin)

    return result_cache.cached("accuracy", _key(task, "accuracy", first), new)


def timings(task: Task) -> list[Raw]:
    """Times of pieces of the touches, until the interval of the median is narrow."""
    found: list[Raw] = []
    for first in range(0, min(TIMED, task.count), PIECE):
        found.append(timing(task, first))
        median = stats.quantile([value for piece in found for value in piece["touch"]], 0.5)
        if median.high - median.low <= 2 * NARROW * median.value:
            break
    return found


def timing(task: Task, first: int) -> Raw:
    def new() -> Raw:
        return times.measured(_touches(task, first), task.skin, task.cover, first, task.checked)

    return result_cache.cached("timing", _key(task, "timing", first), new)


def _touches(task: Task, first: int) -> list[Scene]:
    return touches(task.family, min(PIECE, task.count - first), task.seed, task.skin, task.cover, first=first)


def compared(looks: Iterable[errors.Look], skin: Skin) -> Found:
    found: Found = {kind: {name: [] for name in METRICS} for kind in KINDS}
    for cells, there in looks:
        for kind, values in zip(KINDS, _scene_errors(cells, there, skin), strict=True):
            for name in METRICS:
                found[kind][name].append(float(getattr(values, name)))
    return found


def _scene_errors(
    cells: np.ndarray, there: list[errors.Blob], skin: Skin
) -> tuple[errors.Errors, errors.Errors, errors.Errors]:
    exact, found = errors.exact_zones(cells, skin), errors.method_zones(cells, skin)
    return errors.errors(found, there), errors.errors(found, exact), errors.errors(exact, there)


def _luts(skin: Skin) -> int:
    return size.luts(lambda: Top(skin), DEVICE)


def _key(task: Task, kind: str, number: int) -> str:
    parts = (kind, number, task.count, task.seed, task.checked, task.family, task.cover)
    return f"{result_cache.made_by(__name__, task.skin)} {' '.join(map(str, parts))}"


def front(points: Iterable[tuple[float, float]]) -> list[int]:
    """Indexes of Pareto-optimal (time, error) points, by rising time."""
    order = sorted(
        (time, error, index) for index, (time, error) in enumerate(points) if np.isfinite([time, error]).all()
    )
    best, found = math.inf, []
    for _, error, index in order:
        if error < best:
            best = error
            found.append(index)
    return found


def reached_us(point: Point) -> float:
    """Median time from the foam's first touch to the zones at the host, labelling included."""
    return point.times.touch_median_us.value + point.host_us


def covered(task: Task) -> bool:
    """Whether forces count: all but the bare sheet."""
    return not times.at_once(task.cover)


def in_all(points: Sequence[Point]) -> list[str]:
    """Methods with a point in every family of these."""
    families = {point.task.family for point in points}
    counts = Counter(point.task.method for point in points)
    return [method for method, count in counts.items() if count == len(families)]
