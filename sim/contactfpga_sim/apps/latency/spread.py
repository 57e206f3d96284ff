"""Varying times as an exact distribution."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterable, Sequence

import numpy as np

MEDIAN, MOST = 0.5, 0.99


@dataclasses.dataclass(frozen=True)
class Spread:
    """Times in us: half are at most ``median``, 99 % at most ``p99``, all at most ``worst``."""

    median: float
    p99: float
    worst: float


class MixedTimes:
    """A mixture of times in us, each uniform from ``low`` to ``high``, with weights that sum to 1."""

    def __init__(self, low: np.ndarray, high: np.ndarray, weight: np.ndarray):
        self.low, self.high, self.weight = low, high, weight

    @classmethod
    def of(cls, times: Sequence[float]) -> MixedTimes:
        """Equally likely times."""
        found = np.array(times, float)
        return cls(found, found, np.full(len(found), 1 / len(found)))

    @classmethod
    def mixed(cls, parts: Iterable[MixedTimes]) -> MixedTimes:
        """A mixture of equally likely parts."""
        parts = list(parts)
        low, high, weight = (
            np.concatenate([getattr(one, name) for one in parts]) for name in ("low", "high", "weight")
        )
        return cls(low, high, weight / len(parts))

    def later(self, us: float) -> MixedTimes:
        return MixedTimes(self.low + us, self.high + us, self.weight)

    def share(self, us: np.ndarray) -> np.ndarray:
        """Share of times at most each of these."""
        edges, left, right = self._shares
        at = np.searchsorted(edges, us, "right")
        before, after = np.maximum(at - 1, 0), np.minimum(at, len(edges) - 1)
        wide = np.maximum(edges[after] - edges[before], np.finfo(float).tiny)
        inside = right[before] + (left[after] - right[before]) * (us - edges[before]) / wide
        found: np.ndarray = np.select([at == 0, at == len(edges)], [0.0, 1.0], inside)
        return found

    def quantile(self, share: float) -> float:
        """Time that this share is at most; in a gap, its middle."""
        return (self._at(share, 1e-12) + self._at(share, -1e-12)) / 2

    def _at(self, share: float, slack: float) -> float:
        edges, left, right = self._shares
        wanted = share - slack
        at = int(np.searchsorted(right, wanted))
        if at == len(edges) or at == 0 or left[at] < wanted:
            return float(edges[min(at, len(edges) - 1)])
        part = (wanted - right[at - 1]) / (left[at] - right[at - 1])
        return float(edges[at - 1] + min(1.0, max(0.0, part)) * (edges[at] - edges[at - 1]))

    @property
    def worst(self) -> float:
        return float(self.high.max())

    def spread(self) -> Spread:
        return Spread(self.quantile(MEDIAN), self.quantile(MOST), self.worst)

    @functools.cached_property
    def _shares(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points of slope changes and jumps, with shares below and up to."""
        edges, places = np.unique(np.concatenate([self.low, self.high]), return_inverse=True)
        first, last = np.split(places, 2)
        single = first == last
        jumps, slopes = np.zeros(len(edges)), np.zeros(len(edges))
        np.add.at(jumps, first[single], self.weight[single])
        dense = self.weight[~single] / (self.high - self.low)[~single]
        np.add.at(slopes, first[~single], dense)
        np.add.at(slopes, last[~single], -dense)
        grown = np.append(0.0, np.cumsum(np.cumsum(slopes)[:-1] * np.diff(edges)))
        right = grown + np.cumsum(jumps)
        return edges, right - jumps, right


def summed(one: MixedTimes, other: MixedTimes, share: float) -> float:
    """Quantile of a sum of two independent times; ``other`` are single times."""
    low, high = float(one.low.min() + other.low.min()), one.worst + other.worst
    while high - low > 1e-6:
        middle = (low + high) / 2
        found = float(np.dot(one.share(middle - other.low), other.weight))
        low, high = (low, middle) if found >= share - 1e-12 else (middle, high)
    return high
