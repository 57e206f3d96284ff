"""Uncertainty of a place.

A contact's place is a probability on a grid that is refined where it is not 0. Errors of barycenters and of sets of
consistent places follow from all places of a cell.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from contactfpga.surfaces.shapes import Floats

SIDE = 36

LEVELS = 12
NEGLIGIBLE = 12.0
"""Drop of the logarithm of probability that counts as 0."""

Likelihood = Callable[[Floats, Floats, float], tuple[Floats, Floats]]
"""From points x, y and their grid distance: logarithm of probability, and misfit in squares of noise."""

Box = tuple[float, float, float, float]
"""Least x, largest x, least y, largest y in m."""


@dataclasses.dataclass(frozen=True)
class Posterior:
    """Mean and spread of a probability over places."""

    x_m: float
    y_m: float
    covariance_m2: Floats
    radius_m: float
    """The contact is this near to the middle in 95 of 100 cases."""
    misfit: float
    """Misfit of the best point, in squares of noise."""


def of(evidence: Likelihood, box: Box) -> Posterior:
    """Mean and spread of the place, from the evidence on at most 12 grids."""
    for level in range(LEVELS):
        x, y, steps = _grid(box)
        chance, misfit = evidence(x, y, max(steps))
        likely = chance > chance.max() - NEGLIGIBLE
        shrunk = _around(x[likely], y[likely], steps, box)
        if level == LEVELS - 1 or _area(shrunk) > 0.5 * _area(box):
            break
        box = shrunk
    weights = np.exp(chance - chance.max())
    weights /= weights.sum()
    mid_x, mid_y = float(weights @ x), float(weights @ y)
    dx, dy = x - mid_x, y - mid_y
    covariance = np.array([[weights @ (dx * dx), weights @ (dx * dy)], [weights @ (dx * dy), weights @ (dy * dy)]])
    covariance += np.diag([step * step / 12 for step in steps])
    distance = np.hypot(dx, dy)
    order = np.argsort(distance)
    inside = int(np.searchsorted(np.cumsum(weights[order]), 0.95))
    radius = float(distance[order][min(inside, len(order) - 1)])
    return Posterior(mid_x, mid_y, covariance, radius, float(misfit.min()))


def _grid(box: Box) -> tuple[Floats, Floats, tuple[float, float]]:
    left, right, low, high = box
    steps = ((right - left) / SIDE, (high - low) / SIDE)
    along_x = left + (np.arange(SIDE) + 0.5) * steps[0]
    along_y = low + (np.arange(SIDE) + 0.5) * steps[1]
    x, y = np.meshgrid(along_x, along_y)
    return x.ravel(), y.ravel(), steps


def _around(x: Floats, y: Floats, steps: tuple[float, float], box: Box) -> Box:
    return (
        max(box[0], float(x.min()) - 1.5 * steps[0]),
        min(box[1], float(x.max()) + 1.5 * steps[0]),
        max(box[2], float(y.min()) - 1.5 * steps[1]),
        min(box[3], float(y.max()) + 1.5 * steps[1]),
    )


def _area(box: Box) -> float:
    return (box[1] - box[0]) * (box[3] - box[2])


def radius_95(covariance: Floats) -> float:
    """Radius within which 95 % of a normal distribution lie."""
    second, first = (math.sqrt(max(0.0, value)) for value in np.linalg.eigvalsh(covariance))
    if first == 0:
        return 0.0
    angles = (np.arange(256) + 0.5) * math.pi / 256
    # Along each direction of the distribution made round, its extent in ours.
    extents = (first * np.cos(angles)) ** 2 + (second * np.sin(angles)) ** 2
    low, high = first, 3 * first
    while high - low > 1e-9 * first:
        middle = (low + high) / 2
        outside = float(np.exp(-0.5 * middle * middle / extents).mean())
        low, high = (middle, high) if outside > 0.05 else (low, middle)
    return (low + high) / 2


FINENESS = 256


@dataclasses.dataclass(frozen=True)
class Static:
    """Errors over all places at which a contact closes a switch, in pitches."""

    barycenter_rms: float
    barycenter_95: float
    """95 % quantile of the errors."""
    set_rms: float
    """RMS error of the middle of the set of places that close the same switches."""
    missed: float
    """Share of contacts that close no switch."""


@functools.lru_cache(maxsize=256)
def static(reach: float, pitch_x: float = 1.0, pitch_y: float = 1.0, fineness: int = FINENESS) -> Static:
    """Errors at a reach, in the common unit of reach and pitches."""
    places = (np.arange(fineness) + 0.5) / fineness - 0.5
    x, y = (axis.ravel() for axis in np.meshgrid(places * pitch_x, places * pitch_y))
    columns, rows = (int(np.ceil(reach / pitch + 0.5)) for pitch in (pitch_x, pitch_y))
    cells = [
        (column * pitch_x, row * pitch_y) for row in range(-rows, rows + 1) for column in range(-columns, columns + 1)
    ]
    closed = np.stack([(x - cx) ** 2 + (y - cy) ** 2 <= reach * reach for cx, cy in cells])
    count = closed.sum(axis=0)
    hit = count > 0
    x, y, closed, count = x[hit], y[hit], closed[:, hit], count[hit]
    if not len(x):
        return Static(np.nan, np.nan, np.nan, 1.0)
    all_x, all_y = (np.array(axis) for axis in zip(*cells))
    off_x, off_y = all_x @ closed / count - x, all_y @ closed / count - y
    errors = np.hypot(off_x, off_y)
    gained = _of_sets(closed, all_x, all_y, x, y)
    return Static(_rms(errors), float(np.quantile(errors, 0.95)), _rms(gained), float(1 - hit.mean()))


def _of_sets(closed: NDArray[np.bool_], all_x: Floats, all_y: Floats, x: Floats, y: Floats) -> Floats:
    """Distance of each place from the middle of those with its pattern."""
    first = closed.argmax(axis=0)
    x, y = x - all_x[first], y - all_y[first]
    # Rows of cells are as long everywhere, so a shifted pattern is the same bits from its first one on.
    length = len(closed)
    from_first = (np.arange(length)[:, None] + first) % length
    patterns = np.take_along_axis(closed, from_first, axis=0)
    packed = np.ascontiguousarray(np.packbits(patterns, axis=0).T)
    keys = packed.view([("", packed.dtype)] * packed.shape[1]).ravel()
    _, group = np.unique(keys, return_inverse=True)
    size = np.bincount(group)
    mean_x, mean_y = np.bincount(group, x) / size, np.bincount(group, y) / size
    return np.hypot(x - mean_x[group], y - mean_y[group])


def _rms(errors: Floats) -> float:
    return float(np.sqrt((errors**2).mean()))


@functools.lru_cache(maxsize=64)
def worst_95(pitch_x: float, pitch_y: float) -> float:
    """A bound on the 95 % quantile of barycenter errors at every reach, in the unit of the pitches."""
    pitch = max(pitch_x, pitch_y)
    found = [static(pitch * share, pitch_x, pitch_y, 64).barycenter_95 for share in (0.5, 0.6, 0.7, 0.71, 0.8, 1.0)]
    return float(np.nanmax(found))
