"""Knobs: parameters, with results at their values.

A scene that is drawn is judged by :class:`RateTest`: draws go on until it is clear whether enough of them are right.
"""

from __future__ import annotations

import dataclasses
import importlib
import re
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import as_completed

import numpy as np

from contactfpga_sim.apps import pool
from contactfpga_sim.apps.stats import Rate, drawn

Place = tuple[float, float]
"""Column and row in cells."""


@dataclasses.dataclass(frozen=True, eq=False)
class Outcome:
    right: bool
    told: tuple[str, ...] = ()
    """Flags, counters and errors."""
    what: str = ""
    amount: float = 0.0
    """Size of the effect, or the share of draws that are right."""
    cells: np.ndarray | None = None
    """(rows, columns) bool."""
    zones: tuple[Place, ...] = ()
    rate: str = ""
    """Share of correct draws, if several."""

    @property
    def verdict(self) -> str:
        """``right``, ``told`` (wrong and reported) or ``silent`` (wrong and unreported)."""
        return "right" if self.right else "told" if self.told else "silent"


@dataclasses.dataclass(frozen=True)
class Knob:
    name: str
    title: str
    axis: str
    """The quantity with its unit."""
    values: tuple[float, ...]
    runs: Mapping[str, Callable[[float], Outcome]]
    """Outcome at a value, by method or setting."""
    helps: str
    format: str = "{:,g}"
    unnoticed: str = ""
    """Why nothing reports a ``silent`` fault."""
    closed: Mapping[str, float] = dataclasses.field(default_factory=dict)
    """Break points by closed form, by method."""

    def sweep(self) -> dict[str, Sweep]:
        """Outcomes of all values, by method."""
        return {name: Sweep(self.values, tuple(map(run, self.values))) for name, run in self.runs.items()}


@dataclasses.dataclass(frozen=True)
class Sweep:
    values: tuple[float, ...]
    outcomes: tuple[Outcome, ...]

    @property
    def broken(self) -> int | None:
        """Index of the first wrong value, or None."""
        return next((index for index, outcome in enumerate(self.outcomes) if not outcome.right), None)

    @property
    def breaks_at(self) -> float | None:
        return None if self.broken is None else self.values[self.broken]

    @property
    def holds_until(self) -> float | None:
        """Last value up to which all are right, or None."""
        last = len(self.values) if self.broken is None else self.broken
        return self.values[last - 1] if last else None

    @property
    def warns_at(self) -> float | None:
        """First value with a warning, if still right."""
        first = next((index for index, outcome in enumerate(self.outcomes) if outcome.told), None)
        return self.values[first] if first is not None and self.outcomes[first].right else None

    @property
    def silent_at(self) -> float | None:
        """The first ``silent`` value."""
        return next((value for value, outcome in zip(self.values, self.outcomes) if outcome.verdict == "silent"), None)

    @property
    def verdicts(self) -> tuple[str, ...]:
        return tuple(outcome.verdict for outcome in self.outcomes)


def sweeps(module: str) -> dict[str, dict[str, Sweep]]:
    """Sweeps of the ``KNOBS`` of a module, by knob and method; each knob in a process."""
    names = list(importlib.import_module(module).KNOBS)
    with pool.executor() as workers, pool.progress() as step:
        pending = {name: workers.submit(_swept, module, name) for name in names}
        for one in as_completed(pending.values()):
            one.result()
            step("knobs", len(names))
        return {name: one.result() for name, one in pending.items()}


def _swept(module: str, name: str) -> dict[str, Sweep]:
    knob: Knob = importlib.import_module(module).KNOBS[name]
    return knob.sweep()


LEVEL = 0.95
"""Share that must be right for a value to hold."""
LOOKS = (30, 120, 480, 1920)
"""Draws before each test. At least 120, all right, show :data:`LEVEL`."""
Z = 2.5
"""z of Wilson's interval at each of four tests, for 95 % overall."""

Draws = Callable[[float, np.random.Generator, int], Sequence[Outcome]]
"""Outcomes by value, random numbers and draws."""


@dataclasses.dataclass(frozen=True)
class RateTest:
    """A knob's method in as many draws as the decision needs.

    A value holds if the interval is above the level; it fails if below, or still undecided after ``most`` draws. All
    values share a seed.
    """

    draws: Draws
    seed: int | tuple[int, ...] = 0
    most: int = LOOKS[-1]
    level: float = LEVEL
    telling: float = 1.0
    """Share of wrong draws that must be reported, else the fault is unnoticed."""

    def __call__(self, value: float) -> Outcome:
        """The rate at a value. Words and sheet are of a right draw if it holds, else of a wrong one, unreported if
        possible."""
        rng = np.random.default_rng(self.seed)
        at = [look for look in LOOKS if look < self.most] + [self.most]
        found, holds = drawn(lambda count: self.draws(value, rng, count), at, self._holds)
        return _together(found, rate(found), bool(holds), self.telling)

    def _holds(self, found: Sequence[Outcome]) -> bool | None:
        return rate(found).reaches(self.level, Z)


def rate(found: Sequence[Outcome]) -> Rate:
    return Rate(sum(one.right for one in found), len(found))


def words(rate: Rate) -> str:
    """A rate in percent with its interval by :data:`Z`."""
    low, high = (100 * share for share in rate.interval(Z))
    return f"{100 * rate.hits / rate.of:.3g} % ({low:.1f} to {high:.1f})"


def _together(found: Sequence[Outcome], rate: Rate, holds: bool, telling: float) -> Outcome:
    """One outcome of all draws, with the reports of half the draws if the value holds, else of a share ``telling`` of
    wrong ones."""
    wrong = [one for one in found if not one.right]
    each = [{re.sub(r"\d+", "N", word) for word in one.told} for one in (found if holds else wrong)]
    told = set().union(*each) if holds or sum(map(bool, each)) >= telling * len(each) else set()
    if holds:
        told = {word for word in told if 2 * sum(word in said for said in each) >= len(each)}
    right = (one for one in found if one.right)
    shown = next(right) if holds else next((one for one in wrong if not one.told), wrong[0])
    return dataclasses.replace(
        shown, right=holds, told=tuple(sorted(told)), amount=rate.hits / rate.of, rate=words(rate)
    )
