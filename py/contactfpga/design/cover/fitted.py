"""The closing force of a cover's switches from forces that somebody measured at their closing."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from contactfpga.design.cover.answer import CoverError

LEAST = 3
"""Measured forces."""
DRAWS = 200_000


@dataclasses.dataclass(frozen=True)
class FittedForce:
    """The closing force of a switch in N, the median of all, and its interval."""

    value: float
    low: float
    high: float


def fit_force(force_n: float, pairs: Sequence[tuple[float, float]], probability: float = 0.95) -> FittedForce:
    """The force that makes predicted closing forces those that were measured.

    ``force_n``: the force of a switch that the predictions were computed with; ``pairs``: a predicted and a measured
    force in N each, of switches whose forces scatter by a factor. All forces of a cover go with that of its switches,
    so the factor between the two is one. Raises :class:`CoverError` for fewer than three pairs, and for forces that are
    not above 0."""
    if len(pairs) < LEAST:
        raise CoverError(f"{len(pairs)} closing forces were measured; {LEAST} are needed, each of another switch")
    if not all(value > 0 and math.isfinite(value) for pair in pairs for value in pair):
        raise CoverError("a closing force is not above 0 N; leave it out")
    factors = np.log([measured / predicted for predicted, measured in pairs])
    middle, sigma = float(factors.mean()), float(factors.std(ddof=1)) / math.sqrt(len(factors))
    rng = np.random.default_rng(0)
    student = float(np.quantile(np.abs(rng.standard_t(len(factors) - 1, DRAWS)), probability))
    low, high = (force_n * math.exp(middle + way * student * sigma) for way in (-1, 1))
    return FittedForce(force_n * math.exp(middle), low, high)
