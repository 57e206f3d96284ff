"""The search: from cheap to dear. Each sheet's candidates race, and the first that meets all limits is the answer."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Executor
from typing import Any

from contactfpga_sim.apps import stats
from contactfpga_sim.apps.fit import cost
from contactfpga_sim.apps.fit.candidates import SHEET, Candidate
from contactfpga_sim.apps.fit.faces import pressing
from contactfpga_sim.apps.fit.measuring import FIRST, Values, decided, felt, speed_of, values_of
from contactfpga_sim.apps.fit.sources import RecordingSource, Source
from contactfpga_sim.apps.fit.trial import Fit, FitTask, Measurement, SoFar, Step, Trial, gathered
from contactfpga_sim.apps.score import interval

CHECKED = 2
"""Touches of the answer that also go through the gateware."""

PIECE = 160
"""Most scenes of a piece of work."""


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
    possible = sorted((one for one in ordered if one.skin is not None), key=lambda one: one.cost)
    answer, pieces = None, 0
    for _, alike in itertools.groupby(possible, key=lambda one: one.wires):
        race = _Race(task, list(alike), executor, step, so_far, pieces)
        answer, pieces = race.answer(), race.pieces
        if answer:
            break
    refused = [one for one in so_far.values() if one.refusals and (not answer or one.cost < answer.cost)]
    refused.sort(key=lambda one: (one.candidate.wires if answer else 0, one.excess, one.cost))
    shown = answer or (refused[0] if refused else None)
    reported, luts = _reported(task, shown, bool(answer), executor, step) if shown else ((), None)
    broken = _words(task, reported, sure=False) if answer else ()
    impossible = tuple(one for one in ordered if one.skin is None)
    return Fit(task, answer, luts, tuple(refused), impossible, reported, broken)


class _Race:
    """Candidates with as many wires, which all get more scenes until each is refused, or is no cheaper than one that
    meets all limits."""

    def __init__(
        self, task: FitTask, tried: Sequence[Candidate], executor: Executor, step: Step, so_far: SoFar, pieces: int
    ):
        self._task, self._executor, self._step, self._so_far = task, executor, step, so_far
        self._left = [one for one in tried if not self._late(one)]
        self._values: dict[tuple[Source, Candidate], Values] = {}
        self.pieces = pieces
        """Pieces of work so far."""

    def _late(self, one: Candidate) -> bool:
        """Whether a scan alone is too long for a touch just after its row was read."""
        assert one.skin is not None
        scan_us = 1e6 * one.skin.derived.frame_clocks / one.skin.clock_hz
        limit = self._task.goals.latency_us
        late = limit is not None and not one.skin.derived.scan.waits and scan_us > limit
        if late:
            refusal = f"a scan takes {scan_us:.0f} us, limit {limit:.0f} us"
            self._so_far[one] = Trial(one, refusals=(refusal,), excess=scan_us / (limit or scan_us))
        return late

    def answer(self) -> Trial | None:
        task, best = self._task, None
        most = {source: source.most(task.count) for source in task.sources}
        ends = {
            source: [count] if isinstance(source, RecordingSource) else stats.looks(FIRST, count)
            for source, count in most.items()
        }
        looks = max(map(len, ends.values()))
        for look in range(looks):
            self._draw({source: (0, *at)[look : look + 2] for source, at in ends.items() if look < len(at)}, looks)
            passed = []
            for one in self._left.copy():
                verdicts = [decided(task.goals, self._values[source, one], looks) for source in task.sources]
                if False not in verdicts and None in verdicts and look < looks - 1:
                    continue
                self._left.remove(one)
                values = (self._values[source, one] for source in task.sources)
                measured = [Measurement({name: interval(each) for name, each in of.items()}) for of in values]
                trial = _trial(task, one, measured)
                if trial.refusals:
                    self._so_far[one] = trial
                else:
                    passed.append(trial)
            best = self._first_in_time(passed) or best
            self._left = [one for one in self._left if not best or one.cost < best.cost]
            if not self._left:
                break
        return best

    def _draw(self, ranges: dict[Source, Sequence[int]], looks: int) -> None:
        """Add the values of the scenes from the first to before the second number of each source."""
        alike: dict[object, list[Candidate]] = {}
        for one in self._left:
            sheet = tuple(value for name, value in one.settings if name in SHEET)
            alike.setdefault((sheet, repr(pressing(one.cover))), []).append(one)
        jobs: dict[Any, tuple[Any, ...]] = {
            (source, group, numbers.start): (values_of, self._task, source, tuple(tried), numbers, feel)
            for source, ends in ranges.items()
            for group, tried in alike.items()
            for feel in (not all(felt(self._task.goals, self._values.get((source, one), {}), looks) for one in tried),)
            for numbers in _pieces(*ends)
        }
        found = gathered("scenes", jobs, self._executor, self._step, self.pieces)
        self.pieces += len(jobs)
        for source, group, start in jobs:
            for one, values in zip(alike[group], found[source, group, start], strict=True):
                for metric, more in values.items():
                    self._values.setdefault((source, one), {}).setdefault(metric, []).extend(more)

    def _first_in_time(self, passed: Sequence[Trial]) -> Trial | None:
        """The cheapest whose time meets its limit; of equals that with the least errors."""
        task = self._task
        for trial in sorted(passed, key=lambda one: (one.cost, one.margin)):
            one = trial.candidate
            jobs = {source: (speed_of, task, source, one, _timed(task, source, 0), 0) for source in task.sources}
            times = gathered("times", jobs, self._executor, self._step)
            measured = [
                dataclasses.replace(each, speed=times[source])
                for source, each in zip(task.sources, trial.measured, strict=True)
            ]
            self._so_far[one] = _trial(task, one, measured)
            if not self._so_far[one].refusals:
                return self._so_far[one]
        return None


def _pieces(first: int, last: int) -> Iterator[range]:
    for start in range(first, last, PIECE):
        yield range(start, min(start + PIECE, last))


def _timed(task: FitTask, source: Source, first: int) -> list[int]:
    count = min(task.count, source.most(task.count))
    timed = min(task.timed, count)
    return [first + index * count // timed for index in range(timed)]


def _trial(task: FitTask, one: Candidate, measured: Sequence[Measurement]) -> Trial:
    goals = task.goals
    excess, margin = (max(map(rule, measured)) for rule in (goals.excess, goals.margin))
    return Trial(one, tuple(measured), _words(task, measured), excess, margin)


def _words(task: FitTask, measured: Sequence[Measurement], sure: bool = True) -> tuple[str, ...]:
    several = len(task.sources) > 1
    return tuple(
        f"{name}: {words}" if several else words
        for name, one in zip(task.names, measured, strict=True)
        for _, words in task.goals.misses(one, sure)
    )


def _reported(
    task: FitTask, trial: Trial, met: bool, executor: Executor, step: Step
) -> tuple[tuple[Measurement, ...], int | None]:
    """Errors and times on scenes that chose nothing and, if all limits were ``met``, LUT4."""
    one = trial.candidate
    jobs: dict[Any, tuple[Any, ...]] = {"luts": (cost.luts_of, one.skin)} if met else {}
    for source in task.sources:
        first = source.most(task.count)
        jobs[source] = (speed_of, task, source, one, _timed(task, source, first), CHECKED * met)
        for numbers in _pieces(first, first + min(task.count, first)):
            jobs[source, numbers.start] = (values_of, task, source, (one,), numbers, True)
    found = gathered("report", jobs, executor, step)
    measured = []
    for source in task.sources:
        pieces = [found[key][0] for key in jobs if isinstance(key, tuple) and key[0] == source]
        errors = {name: interval([value for piece in pieces for value in piece[name]]) for name in pieces[0]}
        measured.append(Measurement(errors, found[source]))
    return tuple(measured), found.get("luts")
