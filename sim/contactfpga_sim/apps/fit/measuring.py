"""Errors and times of a Skin on one source, cached by inputs."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from contactfpga.choices import labellers
from contactfpga.design.cover import Cover
from contactfpga.skin import Skin
from contactfpga_sim.apps import errors, light, result_cache, speed, stats
from contactfpga_sim.apps.errors import METRICS
from contactfpga_sim.apps.fit import faces
from contactfpga_sim.apps.fit.candidates import Candidate
from contactfpga_sim.apps.fit.sources import Look, Source
from contactfpga_sim.apps.fit.trial import SHARES, FitTask, Goals
from contactfpga_sim.apps.light import Sensed
from contactfpga_sim.apps.speed import Speed

FIRST = 20
"""Scenes in the first look; looks double them."""

ERR = 0.025
"""Error probability of a side, over all looks."""

Values = dict[str, list[float]]
"""Value per scene or fingertip touch, by metric."""


def values_of(
    task: FitTask, source: Source, tried: Sequence[Candidate], numbers: Sequence[int], feel: bool
) -> list[Values]:
    """Errors by metric of each candidate's zones on these scenes and, to ``feel``, on fingertips. All are on one sheet,
    whose cells take the same forces."""
    skins, covers = zip(*((one.skin, one.cover) for one in tried))
    force_n = task.goals.felt_n if feel and task.goals.unfelt is not None and faces.feels(covers[0]) else None
    key = _key(task, source, skins, covers, numbers, force_n)
    found: list[Values] = result_cache.cached(
        "fit-errors", key, lambda: _values(task, source, skins, covers, numbers, force_n)
    )
    return found


def _values(
    task: FitTask,
    source: Source,
    skins: Sequence[Skin],
    covers: Sequence[Cover | None],
    numbers: Sequence[int],
    force_n: float | None,
) -> list[Values]:
    pressing = faces.pressing(covers[0])
    looks = source.looks(skins[0], task.base, numbers, source.most(task.count), pressing)
    pitch = (skins[0].pitch_x_mm, skins[0].pitch_y_mm)
    touches = faces.touches(pressing, pitch, force_n, numbers) if pressing and force_n is not None else None
    seen: dict[object, Values] = {}
    tips: dict[Cover | None, Values] = {}
    found = []
    for skin, cover in zip(skins, covers, strict=True):
        sees = (cover, skin.levels, skin.connectivity if exact(skin) else skin.replace(scan="raster", baud=Skin().baud))
        if sees not in seen:
            seen[sees] = _compared(looks, skin, cover)
        if cover not in tips:
            tips[cover] = {"unfelt": faces.unfelt(cover, pitch, touches)} if cover and touches is not None else {}
        found.append(seen[sees] | tips[cover])
    return found


def decided(goals: Goals, values: Values, looks: int) -> bool | None:
    """Whether all limits are met; None: more scenes are needed. Each side errs with at most :data:`ERR`, shared by all
    looks."""
    verdicts = [_met(goals, values, looks, name) for name, _ in goals.limits() if name in values]
    return False if False in verdicts else None if None in verdicts else True


def felt(goals: Goals, values: Values, looks: int) -> bool:
    """Whether fingertips have decided; then they need no more draws."""
    return goals.unfelt is not None and "unfelt" in values and _met(goals, values, looks, "unfelt") is not None


def _met(goals: Goals, values: Values, looks: int, name: str) -> bool | None:
    limit = getattr(goals, name)
    low, high = stats.bounds(values[name], ERR / looks, name in SHARES)
    return False if low > limit else True if high <= limit else None


def _compared(looks: Sequence[Look], skin: Skin, cover: Cover | None) -> Values:
    zones = light.zones if skin.levels > 1 else errors.exact_zones if exact(skin) else errors.method_zones
    found = [errors.errors(zones(_cells(taken, skin, cover), skin), there) for taken, there in looks]
    return {metric: [float(getattr(one, metric)) for one in found] for metric in METRICS}


def _cells(taken: np.ndarray | Sensed, skin: Skin, cover: Cover | None) -> np.ndarray:
    """(rows, columns) bool pressed cells, or integers: their levels."""
    if isinstance(taken, np.ndarray):
        return taken
    assert cover is not None
    assert cover.cell is not None
    read = taken.levels(light.reading_of(skin, cover.cell))
    return read if skin.levels > 1 else read > 0


def exact(skin: Skin) -> bool:
    """Whether zones are exactly the connected pieces: connectivity alone decides."""
    return skin.report == "cells" or (skin.report == "moments" and labellers.find(skin.labeller).exact)


def speed_of(task: FitTask, source: Source, one: Candidate, numbers: Sequence[int], checked: int) -> Speed:
    """Times of touches in these scenes, ``checked`` of them also through the gateware. Light cells count as switches:
    a real one falls later in its row time, which the last row's sample ends anyway."""
    skin, cover = one.skin, one.cover
    assert skin is not None

    def new() -> dict[str, float]:
        looks = source.looks(skin, task.base, numbers, source.most(task.count), faces.pressing(cover))
        frames = [cells > 0 for taken, _ in looks if (cells := _cells(taken, skin, cover)).any()]
        if not frames:
            return dict.fromkeys((field.name for field in dataclasses.fields(Speed)), math.nan)
        return dataclasses.asdict(speed.measure(skin, frames, checked))

    found = Speed(**result_cache.cached("fit-speed", _key(task, source, [skin], [cover], numbers, checked), new))
    if skin.report != "cells" or not task.host_us:
        return found
    later = {name: getattr(found, name) + task.host_us for name in ("median_us", "worst_us", "bound_us")}
    return dataclasses.replace(found, **later)


def _key(task: FitTask, source: Source, skins: Sequence[Skin], covers: Sequence[Cover | None], *more: object) -> str:
    made = result_cache.made_by(__name__, *skins, task.base)
    return "\n".join((made, repr(source), repr(source.most(task.count)), repr(covers), repr(more)))
