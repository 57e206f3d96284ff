"""The search: sheets with the fewest wires first; size is computed for good ones alone."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Hashable, Iterable, Sequence
from concurrent.futures import Executor
from typing import Any

from contactfpga.design.cover import Cover
from contactfpga.skin import Skin
from contactfpga_sim.apps.fit.candidates import SHEET, Candidate
from contactfpga_sim.apps.fit.cost import sized
from contactfpga_sim.apps.fit.measuring import errors_of, exact, speed_of
from contactfpga_sim.apps.fit.trial import Fit, FitTask, Measurement, SoFar, Step, Trial, gathered

CHECKED = 2
"""Touches of the answer that also go through the gateware."""

ZONES_ON_HOST = "reports no zones: say with --host-us how long the host takes to find them"


def fit(
    task: FitTask,
    tried: Iterable[Candidate],
    executor: Executor,
    step: Step = lambda name, of: None,
    so_far: SoFar | None = None,
) -> Fit:
    """Choose a Skin, whatever the order of candidates and sources; ``step(kind of work, pieces of that kind)``
    follows each piece. Results are cached by code. ``so_far`` serves an interrupted search."""
    so_far = {} if so_far is None else so_far
    ordered = sorted(tried, key=lambda one: repr(one.settings))
    impossible = [Trial(one, refusals=(one.refusal,)) for one in ordered if one.skin is None]
    possible = [one for one in ordered if one.skin is not None]
    trials: list[Trial] = []
    good: list[Trial] = []
    before = 0
    for _, alike in itertools.groupby(sorted(possible, key=_wires), _wires):
        judged = _judged(task, list(alike), executor, step, so_far, before)
        trials += judged
        before += len(task.sources) * len({_sheet(one.candidate) for one in judged})
        passed = [one for one in judged if not one.refusals]
        good += sized("synthesis", passed, executor, step, so_far, len(good)) if passed else []
        if len(good) > 1:
            break
    if not good:
        return _none(task, sorted(trials, key=lambda one: one.excess), impossible, executor, step)
    answer, runner_up = good[0], good[1] if len(good) > 1 else None
    reported = _reported(task, good[:2], executor, step, CHECKED)
    refused = [one for one in trials if one.refusals and one.wires <= answer.wires]
    as_many = [] if task.quick else [one for one in refused if one.wires == answer.wires]
    looked = sized("synthesis of the refused", as_many, executor, step, so_far)
    fewer = sorted((one for one in refused if one.wires < answer.wires), key=lambda one: (one.wires, one.excess))
    cheaper = (*fewer, *(one for one in looked if one.cost[:2] <= answer.cost[:2]))
    return Fit(
        task,
        answer,
        runner_up,
        cheaper,
        tuple(impossible),
        dearer=len(possible) - len(cheaper) - 1,
        reported=reported,
        broken=_words(task, reported[0], sure=False),
    )


def _wires(one: Candidate) -> int:
    assert one.skin is not None
    return one.skin.rows + one.skin.columns


def _none(task: FitTask, trials: list[Trial], impossible: list[Trial], executor: Executor, step: Step) -> Fit:
    nearest = trials[:1]
    return Fit(task, None, None, tuple(trials), tuple(impossible), 0, _reported(task, nearest, executor, step, 0), ())


def _judged(
    task: FitTask, tried: Sequence[Candidate], executor: Executor, step: Step, so_far: SoFar, before: int
) -> list[Trial]:
    sheets: dict[Settings, dict[Settings, Candidate]] = {}
    for one in tried:
        sheets.setdefault(_sheet(one), {}).setdefault(_sees(one), one)
    jobs: dict[Hashable, tuple[Any, ...]] = {
        (source, sheet): (errors_of, task, source, [one.skin for one in seen.values()], _cover(seen), False)
        for source in task.sources
        for sheet, seen in sheets.items()
    }
    errors = gathered("scenes", jobs, executor, step, before)
    trials: dict[Candidate, Trial] = {}
    for one in tried:
        place = list(sheets[_sheet(one)]).index(_sees(one))
        found = tuple(Measurement(errors[source, _sheet(one)][place]) for source in task.sources)
        trials[one] = _trial(task, one, found)
    slow = [one for one in tried if not _without_host(trials[one].refusals)]
    timed = {(source, one): (speed_of, task, source, one.skin, one.cover, False, 0)
             for source in task.sources for one in slow}  # fmt: skip
    times: dict[Hashable, Any] = {}
    try:
        gathered("times", timed, executor, step, found=times)
    finally:
        for one in tried:
            if one not in slow:
                so_far[one] = trials[one]
            elif all((source, one) in times for source in task.sources):
                so_far[one] = _trial(task, one, _timed(task, trials[one], times))
    return [so_far[one] for one in tried]


def _cover(seen: dict[Settings, Candidate]) -> Cover | None:
    return next(iter(seen.values())).cover


def _without_host(refusals: Sequence[str]) -> tuple[str, ...]:
    return tuple(one for one in refusals if one != ZONES_ON_HOST)


def _timed(task: FitTask, trial: Trial, times: dict[Hashable, Any]) -> tuple[Measurement, ...]:
    return tuple(
        _with_host(task, trial.skin, dataclasses.replace(one, speed=times[source, trial.candidate]))
        for source, one in zip(task.sources, trial.measured, strict=True)
    )


def _trial(task: FitTask, one: Candidate, measured: tuple[Measurement, ...]) -> Trial:
    goals = task.goals
    trial = Trial(
        one, measured, _words(task, measured), max(map(goals.excess, measured)), max(map(goals.margin, measured))
    )
    if trial.skin.report == "cells" and task.host_us is None:
        return dataclasses.replace(trial, refusals=(ZONES_ON_HOST, *trial.refusals), excess=math.inf)
    return trial


Settings = tuple[tuple[str, Any], ...]


def _sheet(one: Candidate) -> Settings:
    return tuple((name, value) for name, value in one.settings if name in (*SHEET, "cover"))


def _sees(one: Candidate) -> Settings:
    assert one.skin is not None
    if exact(one.skin):
        return (("connectivity", one.skin.connectivity),)
    return tuple((name, value) for name, value in one.settings if name not in ("scan", "baud"))


def _words(task: FitTask, measured: Sequence[Measurement], sure: bool = True) -> tuple[str, ...]:
    several = len(task.sources) > 1
    return tuple(
        f"{name}: {words}" if several else words
        for name, one in zip(task.names, measured, strict=True)
        for _, words in task.goals.misses(one, sure)
    )


def _with_host(task: FitTask, skin: Skin | None, found: Measurement) -> Measurement:
    if skin is None or skin.report != "cells" or task.host_us is None:
        return found
    assert found.speed is not None
    later = {name: getattr(found.speed, name) + task.host_us for name in ("median_us", "worst_us", "bound_us")}
    return dataclasses.replace(found, speed=dataclasses.replace(found.speed, **later))


def _reported(
    task: FitTask, trials: Sequence[Trial], executor: Executor, step: Step, checked: int
) -> tuple[tuple[Measurement, ...], ...]:
    jobs: dict[Hashable, tuple[Any, ...]] = {}
    for number, one in enumerate(trials):
        for source in task.sources:
            jobs[number, source, "errors"] = (errors_of, task, source, [one.skin], one.candidate.cover, True)
            jobs[number, source, "speed"] = (
                speed_of,
                task,
                source,
                one.skin,
                one.candidate.cover,
                True,
                0 if number else checked,
            )
    found = gathered("report", jobs, executor, step)
    return tuple(
        tuple(
            _with_host(task, one.skin, Measurement(found[number, source, "errors"][0], found[number, source, "speed"]))
            for source in task.sources
        )
        for number, one in enumerate(trials)
    )
