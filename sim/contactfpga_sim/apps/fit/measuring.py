"""Errors and times of a Skin on one source, cached by inputs."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence
from typing import Any

from contactfpga.choices import labellers
from contactfpga.design.cover import Cover
from contactfpga.skin import Skin
from contactfpga_sim.apps import errors, result_cache, speed, stats
from contactfpga_sim.apps.errors import METRICS, Look
from contactfpga_sim.apps.fit import faces
from contactfpga_sim.apps.fit.sources import RecordingSource, Source
from contactfpga_sim.apps.fit.trial import SHARES, FitTask, Goals
from contactfpga_sim.apps.score import Interval, interval
from contactfpga_sim.apps.speed import Speed

FIRST = 20
"""Scenes in the first batch; looks double them."""

ERR = 0.025
"""Error probability of a side, over all looks."""

Values = dict[str, list[float]]
"""Value per scene or fingertip touch, by metric."""


def errors_of(
    task: FitTask, source: Source, skins: Sequence[Skin], cover: Cover | None, others: bool
) -> list[dict[str, Interval]]:
    """Errors by metric of each Skin's zones, on one sheet and cover. ``others``: on all scenes reserved for the
    report, else on as many as a decision needs. All frames of a recording count."""
    count = source.most(task.count)
    ends = [count] if others or isinstance(source, RecordingSource) else stats.looks(FIRST, count)
    values: list[Values] = [{} for _ in skins]
    left = list(range(len(skins)))
    for first, last in itertools.pairwise([0, *ends]):
        numbers = range(first + others * count, last + others * count)
        batch = _batch(task, source, [skins[one] for one in left], cover, numbers, count)
        for one, found in zip(left, batch, strict=True):
            for metric, more in found.items():
                values[one].setdefault(metric, []).extend(more)
        left = [one for one in left if decided(task.goals, values[one], len(ends)) is None]
        if not left:
            break
    return [{metric: interval(each) for metric, each in one.items()} for one in values]


def decided(goals: Goals, values: Values, looks: int) -> bool | None:
    """Whether all limits are met; None: more scenes are needed. Each side errs with at most :data:`ERR`, shared by all
    looks."""
    met = True
    for name, limit in goals.limits():
        if name not in values:
            continue
        low, high = stats.bounds(values[name], ERR / looks, name in SHARES)
        if low > limit:
            return False
        met &= high <= limit
    return True if met else None


def _batch(
    task: FitTask, source: Source, skins: Sequence[Skin], cover: Cover | None, numbers: Sequence[int], count: int
) -> list[Values]:
    force_n = task.goals.felt_n if task.goals.unfelt is not None and faces.feels(cover) else None

    def new() -> list[Values]:
        looks = source.looks(skins[0], task.base, numbers, count, cover)
        values = [_compared(looks, skin) for skin in skins]
        if force_n is None:
            return values
        assert cover is not None
        pitch = (skins[0].pitch_x_mm, skins[0].pitch_y_mm)
        felt = {"unfelt": faces.unfelt(cover, pitch, force_n, numbers)}
        return [one | felt for one in values]

    key = _key(task, source, skins, cover, numbers, count, force_n)
    found: list[Values] = result_cache.cached("fit-errors", key, new)
    return found


def _compared(looks: Sequence[Look], skin: Skin) -> Values:
    zones = errors.exact_zones if exact(skin) else errors.method_zones
    found = [errors.errors(zones(cells, skin), there) for cells, there in looks]
    return {metric: [float(getattr(one, metric)) for one in found] for metric in METRICS}


def exact(skin: Skin) -> bool:
    """Whether zones are exactly the connected pieces: connectivity alone decides."""
    return skin.report == "cells" or (skin.report == "moments" and labellers.find(skin.labeller).exact)


def speed_of(task: FitTask, source: Source, skin: Skin, cover: Cover | None, others: bool, checked: int) -> Speed:
    """Times of touches over the scenes, ``checked`` of them also through the gateware."""

    def new() -> dict[str, float]:
        frames = [cells for cells in source.cells(skin, task.base, numbers, count, cover) if cells.any()]
        if not frames:
            return dict.fromkeys((field.name for field in dataclasses.fields(Speed)), math.nan)
        return dataclasses.asdict(speed.measure(skin, frames, checked))

    count = source.most(task.count)
    timed = min(task.timed, count)
    numbers = [others * count + index * count // timed for index in range(timed)]
    return Speed(**result_cache.cached("fit-speed", _key(task, source, [skin], cover, numbers, count, checked), new))


def _key(task: FitTask, source: Source, skins: Sequence[Skin], cover: Cover | None, *more: Any) -> str:
    return "\n".join((result_cache.made_by(__name__, *skins, task.base), repr(source), repr(cover), repr(more)))
