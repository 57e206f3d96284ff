"""The search: errors and times of all candidates, then the size of those that can be the answer or are cheaper."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Hashable, Iterable, Sequence
from concurrent.futures import Executor, Future, as_completed
from typing import Any

from contactfpga.skin import Skin
from contactfpga_hdl import sizes
from contactfpga_hdl.top import Top
from contactfpga_sim import kept, size
from contactfpga_sim.chart import speed
from contactfpga_sim.chart.errors import Interval
from contactfpga_sim.chart.speed import Speed
from contactfpga_sim.chart.study import compared, intervals
from contactfpga_sim.fit.candidates import Candidate
from contactfpga_sim.fit.goals import Goals, Measured
from contactfpga_sim.fit.sources import Source

DEVICE = sizes.UP5K
"""For which LUT4 are counted."""

TIMED = 48
"""Touches of each source whose time is worked out."""

CHECKED = 2
"""Of the answer's reported touches, so many go through the compiled gateware as well."""

ZONES_ON_HOST = "reports no zones: say with --host-us how long the host takes to find them"


@dataclasses.dataclass(frozen=True)
class Task:
    """What is asked."""

    sources: tuple[Source, ...]
    names: tuple[str, ...]
    """Of the sources, to be shown."""
    base: Skin
    goals: Goals
    count: int
    """Scenes of each source to choose with; as many others are reported."""
    host_us: float | None = None
    """How long the host takes to find zones in a bitmap; None: it does not."""
    quick: bool = False
    """Only those that meet the goals are synthesised; which of the refused ones are cheaper is not said."""
    timed: int = TIMED


@dataclasses.dataclass(frozen=True)
class Trial:
    """A candidate with what was found."""

    candidate: Candidate
    measured: tuple[Measured, ...] = ()
    """One for each source."""
    refusals: tuple[str, ...] = ()
    excess: float = math.inf
    """How many times the limit that is missed most is exceeded."""
    luts: int | None = None
    """On the :data:`DEVICE`; None where it was not worked out."""

    @property
    def skin(self) -> Skin:
        """The Skin that was tried."""
        assert self.candidate.skin is not None
        return self.candidate.skin

    @property
    def wires(self) -> int:
        """Lines of the sheet."""
        return self.skin.rows + self.skin.columns

    @property
    def bytes(self) -> float:
        """Median of a frame's bytes, of the source with the longest frames."""
        return max((one.speed.bytes for one in self.measured), default=math.nan)

    @property
    def cost(self) -> tuple[float, ...]:
        """LUT4, then wires, then bytes."""
        return (math.inf if self.luts is None else self.luts, self.wires, self.bytes)


@dataclasses.dataclass(frozen=True)
class Fit:
    """What came of it."""

    task: Task
    answer: Trial | None
    runner_up: Trial | None
    cheaper: tuple[Trial, ...]
    """Those refused that cost less than the answer, the cheapest first; or, without an answer, the nearest first."""
    impossible: tuple[Trial, ...]
    """Those for which there is no Skin."""
    dearer: int
    """Candidates that cost more than the answer."""
    reported: tuple[tuple[Measured, ...], ...]
    """Of the answer and the runner-up, or of the nearest: measured on scenes that were not used to choose."""
    broken: tuple[str, ...]
    """Limits that the answer misses there."""


Step = Callable[[str, int], None]


def fit(task: Task, tried: Iterable[Candidate], executor: Executor, step: Step = lambda name, of: None) -> Fit:
    """Choose; ``step(kind of work, pieces of that kind)`` is called after each piece. What was worked out before with
    the same code is kept. Neither the order of the candidates nor that of the sources makes a difference."""
    ordered = sorted(tried, key=lambda one: repr(one.settings))
    impossible = [Trial(one, refusals=(f"Skin refuses: {one.refusal}",)) for one in ordered if one.skin is None]
    trials = _judged(task, [one for one in ordered if one.skin is not None], executor, step)
    if all(trial.refusals for trial in trials):
        return _none(task, sorted(trials, key=lambda one: one.excess), impossible, executor, step)
    wanted = [one for one in trials if not (task.quick and one.refusals)]
    luts = _gathered("synthesis", {one.skin: (_luts, one.skin) for one in wanted}, executor, step)
    sized = sorted((dataclasses.replace(one, luts=luts[one.skin]) for one in wanted), key=lambda one: one.cost)
    passed = [one for one in sized if not one.refusals]
    answer, runner_up = passed[0], passed[1] if len(passed) > 1 else None
    reported = _reported(task, passed[:2], executor, step)
    cheaper = tuple(one for one in sized if one.refusals and one.cost <= answer.cost)
    return Fit(
        task,
        answer,
        runner_up,
        cheaper,
        tuple(impossible),
        dearer=len(sized) - len(cheaper) - 1,
        reported=reported,
        broken=_words(task, reported[0], sure=False),
    )


def _none(task: Task, trials: list[Trial], impossible: list[Trial], executor: Executor, step: Step) -> Fit:
    nearest = trials[:1]
    return Fit(task, None, None, tuple(trials), tuple(impossible), 0, _reported(task, nearest, executor, step, 0), ())


def _judged(task: Task, tried: Sequence[Candidate], executor: Executor, step: Step) -> list[Trial]:
    """All that were measured on the scenes to choose with, with the limits that they miss."""
    jobs: dict[Hashable, tuple[Any, ...]] = {}
    for source in task.sources:
        for one in tried:
            jobs.setdefault((source, _sees(one)), (_errors, task, source, one.skin, False))
            jobs[source, one.skin] = (_speed, task, source, one.skin, False, 0)
    found = _gathered("scenes", jobs, executor, step)
    trials = []
    for one in tried:
        measured = tuple(
            _with_host(task, one.skin, Measured(found[source, _sees(one)], found[source, one.skin]))
            for source in task.sources
        )
        trial = Trial(one, measured, _words(task, measured), max(map(task.goals.excess, measured)))
        if trial.skin.report == "cells" and task.host_us is None:
            trial = dataclasses.replace(trial, refusals=(ZONES_ON_HOST, *trial.refusals), excess=math.inf)
        trials.append(trial)
    return trials


def _sees(one: Candidate) -> tuple[tuple[str, Any], ...]:
    """The settings that decide what zones it finds."""
    return tuple((name, value) for name, value in one.settings if name not in ("scan", "baud"))


def _words(task: Task, measured: Sequence[Measured], sure: bool = True) -> tuple[str, ...]:
    """The limits that are missed; of each source where there are several."""
    several = len(task.sources) > 1
    return tuple(
        f"{name}: {words}" if several else words
        for name, one in zip(task.names, measured, strict=True)
        for _, words in task.goals.misses(one, sure)
    )


def _with_host(task: Task, skin: Skin | None, found: Measured) -> Measured:
    """With the time that the host takes to find zones, where it has to."""
    if skin is None or skin.report != "cells" or task.host_us is None:
        return found
    later = {name: getattr(found.speed, name) + task.host_us for name in ("median_us", "worst_us", "bound_us")}
    return dataclasses.replace(found, speed=dataclasses.replace(found.speed, **later))


def _reported(
    task: Task, trials: Sequence[Trial], executor: Executor, step: Step, checked: int = CHECKED
) -> tuple[tuple[Measured, ...], ...]:
    """Measured on the other scenes; touches of the first one are checked against the gateware."""
    jobs: dict[Hashable, tuple[Any, ...]] = {}
    for number, one in enumerate(trials):
        for source in task.sources:
            jobs[number, source, "errors"] = (_errors, task, source, one.skin, True)
            jobs[number, source, "speed"] = (_speed, task, source, one.skin, True, 0 if number else checked)
    found = _gathered("report", jobs, executor, step)
    return tuple(
        tuple(
            _with_host(task, one.skin, Measured(found[number, source, "errors"], found[number, source, "speed"]))
            for source in task.sources
        )
        for number, one in enumerate(trials)
    )


def _gathered(name: str, jobs: dict[Any, tuple[Any, ...]], executor: Executor, step: Step) -> dict[Any, Any]:
    """What each job, a function with its arguments, gives."""
    futures: dict[Hashable, Future[Any]] = {key: executor.submit(*job) for key, job in jobs.items()}
    for future in as_completed(futures.values()):
        future.result()
        step(name, len(jobs))
    return {key: future.result() for key, future in futures.items()}


def _errors(task: Task, source: Source, skin: Skin, others: bool) -> dict[str, Interval]:
    def new() -> dict[str, dict[str, list[float]]]:
        return compared(source.looks(skin, task.base, numbers, count), skin)

    count = source.most(task.count)
    numbers = range(count, 2 * count) if others else range(count)
    return intervals([kept.kept("fit-errors", _key(task, source, skin, numbers, count), new)])["total"]


def _speed(task: Task, source: Source, skin: Skin, others: bool, checked: int) -> Speed:
    def new() -> dict[str, float]:
        looks = source.looks(skin, task.base, numbers, count)
        frames = [cells for cells, _ in looks if cells.any()]
        if not frames:
            return dict.fromkeys((field.name for field in dataclasses.fields(Speed)), math.nan)
        return dataclasses.asdict(speed.measure(skin, frames, checked))

    count = source.most(task.count)
    timed = min(task.timed, count)
    numbers = [others * count + index * count // timed for index in range(timed)]
    return Speed(**kept.kept("fit-speed", _key(task, source, skin, numbers, count, checked), new))


def _luts(skin: Skin) -> int:
    key = f"{kept.sources()} {DEVICE} {skin.to_toml()}"  # spares looking at the netlist of the same Skin again
    found: int = kept.kept("fit-luts", key, lambda: size.luts(lambda: Top(skin), DEVICE))
    return found


def _key(task: Task, source: Source, skin: Skin, *more: Any) -> str:
    return "\n".join((kept.sources(), repr(source), skin.to_toml(), task.base.to_toml(), repr(more)))
