"""Intervals of quantiles, and a sequential test: it draws until shares decide."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from statistics import NormalDist
from typing import TypeVar

import numpy as np
from scipy.stats import binom

from contactfpga_sim.apps.score import Z95, wilson

ENOUGH = 30
"""Values whose mean counts as normally distributed."""

Draw = TypeVar("Draw")


@dataclasses.dataclass(frozen=True)
class Quantile:
    value: float
    low: float
    high: float
    """Upper end of the interval; infinite if there are too few values."""
    count: int


@dataclasses.dataclass(frozen=True)
class Rate:
    """Hits of so many draws."""

    hits: int
    of: int

    def interval(self, z: float = Z95) -> tuple[float, float]:
        return wilson(self.hits, self.of, z)

    def reaches(self, level: float, z: float) -> bool | None:
        """Whether the share reaches this level; None while the interval contains it."""
        low, high = self.interval(z)
        return True if low >= level else False if high < level else None


def quantile(values: Sequence[float], share: float) -> Quantile:
    """Least value that at least this share does not exceed; infinite values count. The interval is by ranks
    (binomial), for any distribution."""
    ordered = sorted(values)
    n = len(ordered)
    if not n:
        return Quantile(math.nan, math.nan, math.nan, 0)
    lower, upper = (int(binom.ppf(end, n, share)) for end in (0.025, 0.975))
    low = ordered[lower - 1] if lower else 0.0  # times are not negative
    high = ordered[upper] if upper < n else math.inf
    return Quantile(ordered[max(1, math.ceil(share * n - 1e-9)) - 1], low, high, n)


# ---- the sequential test


def looks(first: int, most: int, factor: int = 2) -> list[int]:
    """Numbers of draws at which to look: each ``factor`` times the one before, the last ``most``."""
    found = []
    reach = first
    while reach < most:
        found.append(reach)
        reach *= factor
    return [*found, most]


def drawn(
    draw: Callable[[int], Sequence[Draw]], at: Sequence[int], decided: Callable[[Sequence[Draw]], bool | None]
) -> tuple[list[Draw], bool | None]:
    """All draws until ``decided`` at one of these numbers of draws, and its answer; ``draw`` returns so many more."""
    found: list[Draw] = []
    answer = None
    for number in at:
        found += draw(number - len(found))
        answer = decided(found)
        if answer is not None:
            break
    return found, answer


def bounds(values: Sequence[float], err: float, share: bool) -> tuple[float, float]:
    """Bounds of a mean, each wrong with at most probability ``err``: Chernoff's for values from 0 to 1, valid for any
    count, else normal ones."""
    known = np.array([value for value in values if not math.isnan(value)], float)
    if not len(known):
        return -math.inf, math.inf
    mean = float(known.mean())
    if share:
        low, high = (chernoff(mean, len(known), err, end) for end in (0.0, 1.0))
        return low, high
    if len(known) < ENOUGH:
        return -math.inf, math.inf
    half = NormalDist().inv_cdf(1 - err) * float(known.std(ddof=1)) / math.sqrt(len(known))
    return mean - half, mean + half


def chernoff(mean: float, count: int, err: float, end: float) -> float:
    """Value between ``mean`` and ``end``, 0 or 1, with relative entropy ln(1/err)/count: the mean is beyond it with
    probability at most ``err`` (Hoeffding 1963, theorem 1)."""
    most = math.log(1 / err) / count
    near, far = mean, end
    for _ in range(60):
        middle = (near + far) / 2
        near, far = (near, middle) if _entropy(mean, middle) > most else (middle, far)
    return far


def _entropy(p: float, q: float) -> float:
    parts = ((p, q), (1 - p, 1 - q))
    return sum(one * math.log(one / other) if other else math.inf for one, other in parts if one)
