"""Errors and times of one Skin on the scenes of one source, kept by all that they depend on."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

from contactfpga.skin import Skin
from contactfpga_sim.lab import kept
from contactfpga_sim.lab.chart import speed
from contactfpga_sim.lab.chart.compute import Found, compared, intervals
from contactfpga_sim.lab.chart.errors import Interval
from contactfpga_sim.lab.chart.speed import Speed
from contactfpga_sim.lab.fit.sources import Source
from contactfpga_sim.lab.fit.trial import FitTask


def errors_of(task: FitTask, source: Source, skins: Sequence[Skin], others: bool) -> list[dict[str, Interval]]:
    """By metric, of each Skin's zones against what there is; all of them have the same sheet. ``others``: on the scenes
    that are not used to choose."""

    def new() -> list[Found]:
        looks = source.looks(skins[0], task.base, numbers, count)
        return [compared(looks, skin) for skin in skins]

    count = source.most(task.count)
    numbers = range(count, 2 * count) if others else range(count)
    found = kept.kept("fit-errors", _key(task, source, skins, numbers, count), new)
    return [intervals([one])["total"] for one in found]


def speed_of(task: FitTask, source: Source, skin: Skin, others: bool, checked: int) -> Speed:
    """Of touches spread over the same scenes; ``checked`` of them go through the compiled gateware as well."""

    def new() -> dict[str, float]:
        frames = [cells for cells in source.cells(skin, task.base, numbers, count) if cells.any()]
        if not frames:
            return dict.fromkeys((field.name for field in dataclasses.fields(Speed)), math.nan)
        return dataclasses.asdict(speed.measure(skin, frames, checked))

    count = source.most(task.count)
    timed = min(task.timed, count)
    numbers = [others * count + index * count // timed for index in range(timed)]
    return Speed(**kept.kept("fit-speed", _key(task, source, [skin], numbers, count, checked), new))


def _key(task: FitTask, source: Source, skins: Sequence[Skin], *more: Any) -> str:
    return "\n".join((kept.made_by(__name__, *skins, task.base), repr(source), repr(more)))
