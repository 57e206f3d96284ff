"""The closing force of a cover's switches from measured forces, and the law of its film from resistances."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from contactfpga.design.cover.answer import CoverError

LEAST = 3
DRAWS = 200_000
WITHIN = 0.1
"""Share by which the force on all cells may differ from what a weight should give: it is uneven, or there is a
preload."""
ODD = 4.0
"""Factor from the usual resistance beyond which a cell does not count for the law."""


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


class Fitted(NamedTuple):
    """A value of ``[cover.cell]`` with its 95 % interval, by cells that differ and weights that are not exact."""

    name: str
    value: float
    low: float
    high: float


@dataclasses.dataclass(frozen=True)
class Film:
    """The film's law on this sheet."""

    values: tuple[Fitted, ...]
    factors: np.ndarray
    """(rows, columns) resistance of each cell over the usual one; NaN for a cell that never reads pressed."""

    def csv(self) -> str:
        """The factors, a row of the sheet in each line; nothing stands for a cell that never reads pressed."""
        lines = (",".join("" if np.isnan(one) else f"{one:.3f}" for one in row) for row in self.factors.tolist())
        return "\n".join(lines) + "\n"


def fit_film(ohm: np.ndarray, forces_n: Sequence[float]) -> Film:
    """The law R = R1 (F / 1 N)^-k by medians, from (2, rows, columns) resistances in ohm under a light and a heavy
    force on each cell; NaN: open."""
    logs, forces = np.log(ohm), np.log(forces_n)
    away = np.ma.masked_invalid(logs - np.nanmedian(logs, axis=(1, 2), keepdims=True))
    factors = np.exp(away.mean(axis=0)).filled(np.nan)
    sound = (factors < ODD) & (factors > 1 / ODD) & np.isfinite(logs).all(axis=0)
    each = -np.diff(logs[:, sound], axis=0)[0] / np.diff(forces)[0]
    exponent, near = _median(each, np.sqrt(2) * WITHIN / np.diff(forces)[0])
    usual, about = _median((logs[:, sound] + exponent * forces[:, None]).mean(axis=0), exponent * WITHIN)
    spread = float(np.log(factors[sound]).std())
    wide = 1.96 * spread / np.sqrt(2 * sound.sum())
    values = (
        Fitted("ohm_at_1n", *np.exp((usual, usual - about, usual + about)).tolist()),
        Fitted("exponent", exponent, exponent - near, exponent + near),
        Fitted("spread", spread, spread - wide, spread + wide),
    )
    return Film(values, factors)


def _median(values: np.ndarray, within: float) -> tuple[float, float]:
    """The median, and half of its 95 % interval for values that are drawn from a normal distribution, with what else
    may move them all."""
    return float(np.median(values)), float(np.hypot(1.96 * 1.253 * values.std() / np.sqrt(len(values)), within))
