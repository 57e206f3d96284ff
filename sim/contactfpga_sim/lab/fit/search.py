"""The search: errors and times of all candidates, then the size of those that can be the answer or are cheaper."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Hashable, Iterable, Sequence
from concurrent.futures import Executor
from typing import Any

from contactfpga.skin import Skin
from contactfpga_sim.lab.fit.candidates import SHEET, Candidate
from contactfpga_sim.lab.fit.cost import cheapest, second
from contactfpga_sim.lab.fit.measuring import errors_of, speed_of
from contactfpga_sim.lab.fit.trial import Fit, FitTask, Measurement, SoFar, Step, Trial, gathered

CHECKED = 2
"""Of the answer's reported touches, this many go through the compiled gateware as well."""

ZONES_ON_HOST = "reports no zones: say with --host-us how long the host takes to find them"


def fit(
    task: FitTask,
    tried: Iterable[Candidate],
    executor: Executor,
    step: Step = lambda name, of: None,
    so_far: SoFar | None = None,
) -> Fit:
    """Choose; ``step(kind of work, pieces of that kind)`` is called after each piece. What was worked out before with
    the same code is kept. Neither the order of the candidates nor that of the sources makes a difference. ``so_far`` is
    there for those who end the search before it is done."""
    so_far = {} if so_far is None else so_far
    ordered = sorted(tried, key=lambda one: repr(one.settings))
    impossible = [Trial(one, refusals=(f"Skin refuses: {one.refusal}",)) for one in ordered if one.skin is None]
    trials = _judged(task, [one for one in ordered if one.skin is not None], executor, step, so_far)
    if all(trial.refusals for trial in trials):
        return _none(task, sorted(trials, key=lambda one: one.excess), impossible, executor, step)
    passed = cheapest("synthesis", [one for one in trials if not one.refusals], second, executor, step, so_far)
    answer, runner_up = passed[0], passed[1] if len(passed) > 1 else None
    reported = _reported(task, passed[:2], executor, step, CHECKED)
    refused = [] if task.quick else [one for one in trials if one.refusals]
    sized = cheapest("synthesis of the refused", refused, lambda _: answer.cost[0], executor, step, so_far)
    cheaper = tuple(one for one in sized if one.cost <= answer.cost)
    return Fit(
        task,
        answer,
        runner_up,
        cheaper,
        tuple(impossible),
        dearer=len(trials) - len(cheaper) - 1,
        reported=reported,
        broken=_words(task, reported[0], sure=False),
    )


def _none(task: FitTask, trials: list[Trial], impossible: list[Trial], executor: Executor, step: Step) -> Fit:
    nearest = trials[:1]
    return Fit(task, None, None, tuple(trials), tuple(impossible), 0, _reported(task, nearest, executor, step, 0), ())


def _judged(task: FitTask, tried: Sequence[Candidate], executor: Executor, step: Step, so_far: SoFar) -> list[Trial]:
    """All that were measured on the scenes to choose with, with the limits that they miss."""
    sheets: dict[Settings, dict[Settings, Skin]] = {}
    for one in tried:
        assert one.skin is not None
        sheets.setdefault(_sheet(one), {}).setdefault(_sees(one), one.skin)
    jobs: dict[Hashable, tuple[Any, ...]] = {}
    for source in task.sources:
        for sheet, skins in sheets.items():
            jobs[source, sheet] = (errors_of, task, source, list(skins.values()), False)
            same = [one.skin for one in tried if _sheet(one) == sheet]
            jobs |= {(source, skin): (speed_of, task, source, skin, False, 0) for skin in same}
    found: dict[Hashable, Any] = {}
    try:
        gathered("scenes", jobs, executor, step, found=found)
    finally:
        for one in tried:
            if all((source, part) in found for source in task.sources for part in (_sheet(one), one.skin)):
                so_far[one] = _trial(task, one, sheets, found)
    return [so_far[one] for one in tried]


def _trial(
    task: FitTask, one: Candidate, sheets: dict[Settings, dict[Settings, Skin]], found: dict[Hashable, Any]
) -> Trial:
    place = list(sheets[_sheet(one)]).index(_sees(one))
    measured = tuple(
        _with_host(task, one.skin, Measurement(found[source, _sheet(one)][place], found[source, one.skin]))
        for source in task.sources
    )
    trial = Trial(one, measured, _words(task, measured), max(map(task.goals.excess, measured)))
    if trial.skin.report == "cells" and task.host_us is None:
        return dataclasses.replace(trial, refusals=(ZONES_ON_HOST, *trial.refusals), excess=math.inf)
    return trial


Settings = tuple[tuple[str, Any], ...]


def _sheet(one: Candidate) -> Settings:
    return tuple((name, value) for name, value in one.settings if name in SHEET)


def _sees(one: Candidate) -> Settings:
    """The settings that decide what zones it finds."""
    return tuple((name, value) for name, value in one.settings if name not in ("scan", "baud"))


def _words(task: FitTask, measured: Sequence[Measurement], sure: bool = True) -> tuple[str, ...]:
    """The limits that are missed; of each source where there are several."""
    several = len(task.sources) > 1
    return tuple(
        f"{name}: {words}" if several else words
        for name, one in zip(task.names, measured, strict=True)
        for _, words in task.goals.misses(one, sure)
    )


def _with_host(task: FitTask, skin: Skin | None, found: Measurement) -> Measurement:
    """With the time that the host takes to find zones, where it has to."""
    if skin is None or skin.report != "cells" or task.host_us is None:
        return found
    later = {name: getattr(found.speed, name) + task.host_us for name in ("median_us", "worst_us", "bound_us")}
    return dataclasses.replace(found, speed=dataclasses.replace(found.speed, **later))


def _reported(
    task: FitTask, trials: Sequence[Trial], executor: Executor, step: Step, checked: int
) -> tuple[tuple[Measurement, ...], ...]:
    """Measured on the other scenes; touches of the first one are checked against the gateware."""
    jobs: dict[Hashable, tuple[Any, ...]] = {}
    for number, one in enumerate(trials):
        for source in task.sources:
            jobs[number, source, "errors"] = (errors_of, task, source, [one.skin], True)
            jobs[number, source, "speed"] = (speed_of, task, source, one.skin, True, 0 if number else checked)
    found = gathered("report", jobs, executor, step)
    return tuple(
        tuple(
            _with_host(task, one.skin, Measurement(found[number, source, "errors"][0], found[number, source, "speed"]))
            for source in task.sources
        )
        for number, one in enumerate(trials)
    )
