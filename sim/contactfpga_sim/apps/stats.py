"""Sequential test: a Skin that surely misses a limit is dropped, one that surely meets all is kept.

Ends of confidence intervals decide after each batch of scenes; each side errs with at most 2.5 %, shared by all looks.
Shares have Chernoff's interval, valid for any count; other errors the normal one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import NormalDist

import numpy as np

from contactfpga_sim.apps.fit.trial import SHARES, Goals

FIRST = 20
"""Scenes in the first batch; looks double them."""

ENOUGH = 30
"""Values whose mean counts as normally distributed."""

ERR = 0.025
"""Error probability of a side, over all looks."""


def ends(count: int) -> list[int]:
    """Scenes after each batch."""
    found = []
    reach = FIRST
    while reach < count:
        found.append(reach)
        reach *= 2
    return [*found, count]


def decided(goals: Goals, values: dict[str, list[float]], looks: int) -> bool | None:
    """Whether all limits are met; None: more scenes are needed. ``values``: by metric."""
    met = True
    for name, limit in goals.limits():
        if name not in values:
            continue
        low, high = bounds(name, values[name], ERR / looks)
        if low > limit:
            return False
        met &= high <= limit
    return True if met else None


def bounds(name: str, values: Sequence[float], err: float) -> tuple[float, float]:
    """Bounds of a metric's mean, each wrong with at most probability ``err``."""
    known = np.array([value for value in values if not math.isnan(value)], float)
    if not len(known):
        return -math.inf, math.inf
    mean = float(known.mean())
    if name in SHARES:
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
