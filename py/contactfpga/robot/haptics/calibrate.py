"""Calibration by known loads: the matrix from readings to wrench, and what the loads leave open."""

from __future__ import annotations

import dataclasses

import numpy as np

from contactfpga.robot.haptics.answer import Floats, HapticsError
from contactfpga.robot.haptics.units import COMPONENTS, LoadCells, reduced

SEEN = 1e-6
"""Share of the largest load below which a direction was not loaded."""

NOISE = 5.0
"""Times its noise that a combination of readings must have varied to count as loaded."""


@dataclasses.dataclass(frozen=True)
class Calibration:
    """What known loads say of the units."""

    cells: LoadCells
    """With the matrix and the zeros found."""
    rank: int
    """Independent loads; 6 are all."""
    missing: tuple[str, ...]
    """What was never loaded, in words."""
    residual_n: float
    """Root mean square of what the loads' forces are off by, after calibration."""
    advice: str
    """What to do next."""


def rank_of(loads: Floats, length_m: float) -> tuple[int, Floats]:
    """Rank of (m, 6) wrenches, and (6 - rank, 6) directions that none has; moments count over ``length_m``."""
    scaled = np.atleast_2d(loads) / np.array([1, 1, 1, length_m, length_m, length_m])
    _, values, turned = np.linalg.svd(scaled)
    rank = int((values > SEEN * values[0]).sum())
    return rank, turned[rank:]


def calibrate(cells: LoadCells, readings: Floats, loads: Floats) -> Calibration:
    """The matrix and zeros with which (m, n) readings give (m, 6) loads best, by least squares.

    Where the loads leave directions open the matrix keeps what places and axes say there. Raises :class:`HapticsError`
    where there are too few loads.
    """
    read, known = np.atleast_2d(np.asarray(readings, float)), np.atleast_2d(np.asarray(loads, float))
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
    return Calibration(cells.changed(zeros, matrix), rank, missing, off, _advice(cells, rank, missing, off))


def _correction(cells: LoadCells, deviations: Floats, rest: Floats) -> Floats:
    """(6, n): the smallest change of the matrix that explains the rest; what only noise moved changes nothing."""
    sigma = np.array([unit.sigma_n / abs(unit.gain_n) for unit in cells.units])
    left, values, turned = np.linalg.svd(deviations / sigma, full_matrices=False)
    moved = values > NOISE * np.sqrt(len(deviations))
    return np.asarray((left[:, moved].T @ rest / values[moved, None]).T @ turned[moved] / sigma)


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
