"""The points of the chart: every method on every family of scenes, worked out in pieces by any executor."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor, Future, as_completed
from typing import Any

import numpy as np

from contactfpga.skin import Skin
from contactfpga_hdl import sizes
from contactfpga_hdl.top import Top
from contactfpga_sim import kept, size
from contactfpga_sim.chart import errors, speed
from contactfpga_sim.chart.errors import METRICS, Interval
from contactfpga_sim.chart.speed import Speed
from contactfpga_sim.families import placements
from contactfpga_sim.scenes import Scene

PIECE = 125
"""Placements that are worked out together."""

DEVICE = sizes.UP5K
"""For which LUT4 and clock are given."""


@dataclasses.dataclass(frozen=True)
class Task:
    """A method on a family of scenes."""

    method: str
    skin: Skin
    family: str
    count: int
    seed: int
    timed: int = 48
    """Touches whose time is worked out."""
    checked: int = 2
    """Of these so many go through the gateware, too."""


KINDS = ("total", "labeller", "sensing")
"""Errors: of the method's zones against the contacts; of these zones against the connected pieces of the pressed cells;
of these pieces against the contacts."""

Found = dict[str, dict[str, list[float]]]
"""By kind and metric, a value a scene."""


@dataclasses.dataclass(frozen=True)
class Point:
    """What came of a task."""

    task: Task
    errors: dict[str, dict[str, Interval]]
    """By kind and metric."""
    speed: Speed
    luts: int | None
    fmax_mhz: float | None
    host_us: float = 0.0
    """What the host takes to label the cells, where it does; of the machine at hand, so of two runs never the same."""


def study(
    tasks: Sequence[Task],
    executor: Executor,
    with_size: bool = True,
    step: Callable[[str, int], None] = lambda name, of: None,
) -> list[Point]:
    """Work out all tasks; ``step(name, number of all)`` is called after each piece.

    What was worked out before with the same code is taken from the cache. ``executor`` is that of a process pool, or
    any other with the same interface, a Dask cluster's for instance.
    """
    jobs = [(task, first) for task in tasks for first in range(0, task.count, PIECE)]
    skins = list(dict.fromkeys(task.skin for task in tasks)) if with_size else []
    pieces = [executor.submit(accuracy, task, first) for task, first in jobs]
    times = [executor.submit(timing, task) for task in tasks]
    places = [executor.submit(_size, skin) for skin in skins]
    names: dict[Future[Any], str] = {
        **dict.fromkeys(pieces, "placements"),
        **dict.fromkeys(times, "times"),
        **dict.fromkeys(places, "place and route"),
    }
    for future in as_completed(names):
        future.result()
        step(names[future], len(names))
    sizes_by_skin = {skin: future.result() for skin, future in zip(skins, places, strict=True)}
    return [
        Point(
            task,
            _intervals([piece.result() for (owner, _), piece in zip(jobs, pieces, strict=True) if owner == task]),
            Speed(**time.result()),
            sizes_by_skin[task.skin].luts if with_size else None,
            sizes_by_skin[task.skin].fmax_mhz if with_size else None,
        )
        for task, time in zip(tasks, times, strict=True)
    ]


def _intervals(pieces: Sequence[Found]) -> dict[str, dict[str, Interval]]:
    return {
        kind: {name: errors.interval([value for piece in pieces for value in piece[kind][name]]) for name in METRICS}
        for kind in KINDS
    }


def accuracy(task: Task, first: int) -> Found:
    """Errors of one piece of a task's placements, by kind and metric."""

    def new() -> dict:
        found: Found = {kind: {name: [] for name in METRICS} for kind in KINDS}
        last = min(first + PIECE, task.count)
        for scene in placements(task.family, last - first, task.seed, task.skin, first=first):
            for kind, values in zip(KINDS, _scene_errors(scene, task.skin), strict=True):
                for name in METRICS:
                    found[kind][name].append(float(getattr(values, name)))
        return found

    return kept.kept("accuracy", _key(task, "accuracy", first), new)


def _scene_errors(scene: Scene, skin: Skin) -> tuple[errors.Errors, errors.Errors, errors.Errors]:
    cells = scene.pressed(0.0, skin)
    there = errors.contacts(scene.truth(0.0, skin))
    exact, found = errors.exact_zones(cells, skin), errors.method_zones(cells, skin)
    return errors.errors(found, there), errors.errors(found, exact), errors.errors(exact, there)


def timing(task: Task) -> dict[str, float]:
    """The fields of a task's :class:`Speed`."""

    def new() -> dict[str, float]:
        scenes = placements(task.family, task.timed, task.seed + 1, task.skin)
        frames = [cells for cells in (scene.pressed(0.0, task.skin) for scene in scenes) if cells.any()]
        if not frames:
            return dict.fromkeys((field.name for field in dataclasses.fields(Speed)), math.nan)
        return dataclasses.asdict(speed.measure(task.skin, frames, task.checked))

    return kept.kept("timing", _key(task, "timing", task.timed), new)


def _size(skin: Skin) -> sizes.Size:
    return size.measure(lambda: Top(skin), DEVICE, seeds=1)


def _key(task: Task, kind: str, number: int) -> str:
    skin = json.dumps(dataclasses.asdict(task.skin), sort_keys=True)
    return f"{kept.sources()} {kind} {number} {task.count} {task.seed} {task.checked} {task.family} {skin}"


def front(points: Iterable[tuple[float, float]]) -> list[int]:
    """Numbers of the (time, error) points that no other one beats in one and equals in the other, by rising time."""
    order = sorted(
        (time, error, index) for index, (time, error) in enumerate(points) if np.isfinite([time, error]).all()
    )
    best, found = math.inf, []
    for _, error, index in order:
        if error < best:
            best = error
            found.append(index)
    return found
