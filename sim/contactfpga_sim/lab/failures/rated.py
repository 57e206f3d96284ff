"""How often a method is right at a value of a knob, by a test that ends as soon as its answer is known."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Sequence

import numpy as np

from contactfpga_sim.lab.failures.knob import Outcome
from contactfpga_sim.lab.flips.campaign import wilson

LEVEL = 0.95
"""The share that has to be right for a value to hold."""
LOOKS = (30, 120, 480, 1920)
"""Draws after which the interval is looked at. 120 right ones are the fewest that show :data:`LEVEL`."""
Z = 2.5
"""Of Wilson's interval at one look, so that it holds at all four looks with 95 %."""

SHARE = "share of draws that are right"
"""What :attr:`contactfpga_sim.lab.failures.knob.Outcome.amount` is here."""

Draws = Callable[[float, np.random.Generator, int], Sequence[Outcome]]
"""A function of the knob's value, random numbers and a count: it gives the outcomes of that many draws."""


@dataclasses.dataclass(frozen=True)
class Rate:
    """A share of draws that are right, with its interval."""

    right: int
    of: int

    @property
    def interval(self) -> tuple[float, float]:
        """The least and the largest share that are likely."""
        return wilson(self.right, self.of, Z)

    def reaches(self, level: float) -> bool | None:
        """Whether the share is this level or more; None while the level lies within the interval."""
        low, high = self.interval
        return True if low >= level else False if high < level else None

    def __str__(self) -> str:
        low, high = (100 * share for share in self.interval)
        return f"{100 * self.right / self.of:.3g} % ({low:.1f} to {high:.1f})"


@dataclasses.dataclass(frozen=True)
class Rated:
    """A knob's method that is tried in as many draws as it takes to say whether enough of them are right.

    A value holds if the interval lies above the level. It does not if the interval lies below, or if it does not leave
    the level within ``most`` draws. The draws of all values begin with the same seed.
    """

    draws: Draws
    seed: int = 0
    most: int = LOOKS[-1]
    level: float = LEVEL
    telling: float = 1.0
    """The share of wrong draws that have to tell something, else it counts as not noticed."""

    def __call__(self, value: float) -> Outcome:
        """The rate at a value. Its words and its sheet are those of a right draw where the value holds, else of a wrong
        one, that is not told if there is such a one."""
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
    """One outcome of all. Where the value holds, it tells what half of the draws do. Where it does not, it tells what
    its wrong draws do, and nothing if fewer than ``telling`` of them tell anything."""
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
