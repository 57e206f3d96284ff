"""The closing force of a cover's switches from measured forces."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from contactfpga.design.cover.answer import CoverError

LEAST = 3
DRAWS = 200_000


@dataclasses.dataclass(frozen=True)
class FittedForce:
    """Median closing force of a switch in N, and its interval."""

    value: float
    low: float
    high: float


def fit_force(force_n: float, pairs: Sequence[tuple[float, float]], probability: float = 0.95) -> FittedForce:
    """The switch force that fits predicted to measured closing forces.

    ``force_n`` is the switch force of the predictions; ``pairs`` are predicted and measured forces in N, which scatter
    by a factor. Raises :class:`CoverError` for fewer than three pairs and for forces not above 0.
    """
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
