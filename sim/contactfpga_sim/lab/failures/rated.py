"""How often a method is right, by a sequential test."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Sequence

import numpy as np

from contactfpga_sim.lab.flips.campaign import wilson
from contactfpga_sim.lab.knobs import Outcome

LEVEL = 0.95
"""Share that must be right for a value to hold."""
LOOKS = (30, 120, 480, 1920)
"""Draws before each test. At least 120, all right, show :data:`LEVEL`."""
Z = 2.5
"""z of Wilson's interval at each of four tests, for 95 % overall."""

SHARE = "share of draws that are right"
"""Meaning of :attr:`contactfpga_sim.lab.knobs.Outcome.amount` here."""

Draws = Callable[[float, np.random.Generator, int], Sequence[Outcome]]
"""Outcomes by value, random numbers and draws."""


@dataclasses.dataclass(frozen=True)
class Rate:
    right: int
    of: int

    @property
    def interval(self) -> tuple[float, float]:
        return wilson(self.right, self.of, Z)

    def reaches(self, level: float) -> bool | None:
        """Whether the share reaches this level; None while the interval contains it."""
        low, high = self.interval
        return True if low >= level else False if high < level else None

    def __str__(self) -> str:
        low, high = (100 * share for share in self.interval)
        return f"{100 * self.right / self.of:.3g} % ({low:.1f} to {high:.1f})"


@dataclasses.dataclass(frozen=True)
class Rated:
    """A knob's method in as many draws as the decision needs.

    A value holds if the interval is above the level; it fails if below, or still undecided after ``most`` draws. All
    values share a seed.
    """

    draws: Draws
    seed: int = 0
    most: int = LOOKS[-1]
    level: float = LEVEL
    telling: float = 1.0
    """Share of wrong draws that must be reported, else the fault is unnoticed."""

    def __call__(self, value: float) -> Outcome:
        """The rate at a value. Words and sheet are of a right draw if it holds, else of a wrong one, unreported if
        possible."""
        rng = np.random.default_rng(self.seed)
        found: list[Outcome] = []
        for look in LOOKS:
            found += self.draws(value, rng, look - len(found))
            rate = Rate(sum(one.right for one in found), len(found))
            holds = rate.reaches(self.level)
            if holds is not None or look >= self.most:
                break
        return _together(found, rate, bool(holds), self.telling)


def _together(found: Sequence[Outcome], rate: Rate, holds: bool, telling: float) -> Outcome:
    """One outcome of all draws, with the reports of half the draws if the value holds, else of a share ``telling`` of
    wrong ones."""
    wrong = [one for one in found if not one.right]
    each = [{re.sub(r"\d+", "N", word) for word in one.told} for one in (found if holds else wrong)]
    told = set().union(*each) if holds or sum(map(bool, each)) >= telling * len(each) else set()
    if holds:
        told = {word for word in told if 2 * sum(word in words for words in each) >= len(each)}
    right = (one for one in found if one.right)
    shown = next(right) if holds else next((one for one in wrong if not one.told), wrong[0])
    return dataclasses.replace(
        shown, right=holds, told=tuple(sorted(told)), amount=rate.right / rate.of, rate=str(rate)
    )
