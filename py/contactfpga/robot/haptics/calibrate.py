"""Calibration of units by known loads, and the drift of their zeros while nothing touches."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from contactfpga.robot.haptics.units import COMPONENTS, LoadCells, reduced
from contactfpga.robot.haptics.values import HapticsError, array, number, positive, within
from contactfpga.surfaces.shapes import Floats

SEEN = 1e-6
"""Share of the largest load below which a direction counts as not loaded."""

NOISE = 5.0
"""Variation of a combination of readings that counts as loaded, in multiples of its noise."""


PER_UNIT = 10
"""Loads per unit from which the noise covariance is estimated."""


@dataclasses.dataclass(frozen=True)
class Calibration:
    """Result of known loads."""

    cells: LoadCells
    """Units with the fitted matrix and zeros, and from :data:`PER_UNIT` loads a unit on with the noise covariance."""
    rank: int
    """Independent loads; 6 are complete."""
    missing: tuple[str, ...]
    """Directions never loaded, in words."""
    residual_n: float
    """RMS error of the loads' forces after calibration."""
    advice: str
    """The next step."""


def rank_of(loads: Floats, length_m: float) -> tuple[int, Floats]:
    """Rank of (m, 6) wrenches, and (6 - rank, 6) directions orthogonal to all; ``length_m`` divides moments."""
    scaled = np.atleast_2d(loads) / np.array([1, 1, 1, length_m, length_m, length_m])
    _, values, right = np.linalg.svd(scaled)
    rank = int((values > SEEN * values[0]).sum())
    return rank, right[rank:]


def calibrate(cells: LoadCells, readings: Floats, loads: Floats) -> Calibration:
    """The matrix and zeros with which (m, n) readings best give (m, 6) loads, by least squares.

    Undetermined directions are those of places and axes. Raises :class:`HapticsError` for too few loads.
    """
    read, known = np.atleast_2d(array("readings", readings)), np.atleast_2d(array("loads", loads))
    count = len(cells.units)
    if read.shape != (len(known), count) or known.shape[1] != 6:
        raise HapticsError(
            f"readings are {read.shape} and loads {known.shape}; each load needs {count} readings and 6 numbers"
        )
    if len(known) < count + 1:
        raise HapticsError(f"{len(known)} loads are too few; {count} units and their zeros take at least {count + 1}")
    deviations = read - cells.zeros
    rest = known - deviations @ cells.matrix.T
    matrix = cells.matrix + _correction(cells, deviations - deviations.mean(axis=0), rest - rest.mean(axis=0))
    offset = (known - deviations @ matrix.T).mean(axis=0)
    zeros = cells.zeros - np.linalg.lstsq(matrix, offset, rcond=None)[0]
    after = known - deviations @ matrix.T - offset
    points = np.array([unit.point_m for unit in cells.units])
    length = float(np.sqrt(((points - points.mean(axis=0)) ** 2).sum() / len(points))) or 1.0
    rank, open_ones = rank_of(known, length)
    missing = tuple(" with ".join(_named(one)) for one in reduced(open_ones))
    off = _rms(after)
    noise = _noise_n2(cells, deviations, known) if len(known) >= PER_UNIT * count else cells.noise_n2
    return Calibration(cells.changed(zeros, matrix, noise), rank, missing, off, _advice(cells, rank, missing, off))


def _noise_n2(cells: LoadCells, deviations: Floats, loads: Floats) -> Floats:
    """(n, n): covariance of readings beyond loads and zeros."""
    explains = np.column_stack([loads, np.ones(len(loads))])
    found, _, rank, _ = np.linalg.lstsq(explains, deviations, rcond=SEEN)
    rest = (deviations - explains @ found) * np.array([unit.gain_n for unit in cells.units])
    return np.asarray(rest.T @ rest / (len(loads) - rank))


def _correction(cells: LoadCells, deviations: Floats, rest: Floats) -> Floats:
    """(6, n): smallest change of the matrix beyond noise that explains the rest."""
    sigma = np.array([unit.sigma_n / abs(unit.gain_n) for unit in cells.units])
    left, values, right = np.linalg.svd(deviations / sigma, full_matrices=False)
    moved = values > NOISE * np.sqrt(len(deviations))
    return np.asarray((left[:, moved].T @ rest / values[moved, None]).T @ right[moved] / sigma)


def _named(wrench: Floats) -> list[str]:
    return [name for name, value in zip(COMPONENTS, wrench) if abs(value) > 0.1]


def _rms(rest: Floats) -> float:
    return float(np.sqrt((rest[:, :3] ** 2).sum(axis=1).mean()))


def _advice(cells: LoadCells, rank: int, missing: tuple[str, ...], residual_n: float) -> str:
    if rank < cells.rank:
        return (
            f"the loads have rank {rank}, the units see {cells.rank}: nothing had {'; '.join(missing)}. Hang a "
            "weight from three points that lie on no line, in several poses"
        )
    quiet = max(unit.sigma_n for unit in cells.units) * np.sqrt(len(cells.units))
    if residual_n > 3 * quiet:
        return (
            f"the loads are off by {residual_n:.3g} N, more than noise is: look for a load that was written down wrong"
        )
    return "the loads suffice"


@dataclasses.dataclass(frozen=True)
class Drift:
    """Drift of the zeros."""

    deviations_n: Floats
    """(n,): averaged deviation of each unit from its zero."""
    drifted: tuple[int, ...]
    """Indexes of units beyond the limit, whose zeros must be read again."""
    since_s: float
    """Averaging time without touch."""


class DriftWatch:
    """Averages readings while no zone is pressed: a push that the sheet misses is short, a drift stays.

    Args:
     limit_n: deviation that counts as drift; None: four times its noise.
     over_s: time constant of the average, and time without a touch before any report.
    """

    def __init__(self, cells: LoadCells, limit_n: float | None = None, over_s: float = 10.0):
        positive("over_s", over_s, "s")
        if limit_n is not None:
            number("limit_n", limit_n, 0, unit="N")
        self._cells = cells
        gains = np.array([unit.gain_n for unit in cells.units])
        self._gains = gains
        self._limits = np.array([4 * unit.sigma_n if limit_n is None else limit_n for unit in cells.units])
        self._over_s = over_s
        self._mean = np.zeros(len(gains))
        self._since_s = 0.0
        self._last_s: float | None = None

    def update(self, time_s: float, readings: Sequence[float] | Floats, zones: int) -> Drift:
        """Add one reading per unit, with the number of pressed zones; returns the drift."""
        within("time_s", (time_s,), "s")
        last, self._last_s = self._last_s, time_s
        if zones or last is None or time_s <= last:
            return self._drift()
        passed = time_s - last
        self._since_s += passed
        share = passed / min(self._over_s, self._since_s) if self._since_s else 1.0
        deviations = (array("readings", readings) - self._cells.zeros) * self._gains
        self._mean += min(1.0, share) * (deviations - self._mean)
        return self._drift()

    def _drift(self) -> Drift:
        known = self._since_s >= self._over_s
        drifted = (np.abs(self._mean) > self._limits).nonzero()[0].tolist() if known else []
        return Drift(self._mean.copy(), tuple(drifted), self._since_s)
