"""Where a contact may lie, given what is known of it: a probability on a grid that is made finer where it is not 0."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np

from contactfpga.robot.haptics.answer import Floats

SIDE = 36
"""Points of the grid along each axis."""

LEVELS = 12
NEGLIGIBLE = 12.0
"""Of the logarithm of probability, below its largest."""

Evidence = Callable[[Floats, Floats, float], tuple[Floats, Floats]]
"""Of points x, y and their distance on the grid: logarithm of probability, and how badly the point fits, in squares of
noise."""

Box = tuple[float, float, float, float]
"""Least x, largest x, least y, largest y in m."""


@dataclasses.dataclass(frozen=True)
class Posterior:
    """Mean and spread of a probability over places."""

    x_m: float
    y_m: float
    covariance_m2: Floats
    radius_m: float
    """The contact lies this near to the middle in 95 of 100 cases."""
    misfit: float
    """Of the point that fits best, in squares of noise."""


def of(evidence: Evidence, box: Box) -> Posterior:
    """Mean and spread of the place, from the evidence at the points of a grid over the box; takes at most 12 grids."""
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
    """The box of the likely points and a step around it, within the old one."""
    return (
        max(box[0], float(x.min()) - 1.5 * steps[0]),
        min(box[1], float(x.max()) + 1.5 * steps[0]),
        max(box[2], float(y.min()) - 1.5 * steps[1]),
        min(box[3], float(y.max()) + 1.5 * steps[1]),
    )


def _area(box: Box) -> float:
    return (box[1] - box[0]) * (box[3] - box[2])


def radius_95(covariance: Floats) -> float:
    """The radius in m within which 95 % of a normal distribution lie."""
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
