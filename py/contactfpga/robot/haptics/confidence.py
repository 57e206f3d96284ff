"""The range of each push under the units' noise.

It covers all forces within friction's cones whose misfit, in squares of noise with uncertain places, exceeds its
minimum by at most 3.84, the 95 % quantile of chi-square with one degree of freedom (profile likelihood: Meeker and
Escobar, The American Statistician 49, 1995).

A push that the wrench alone determines, with both ends within the cones, has 1.96 standard deviations to either side.
Else Newton's method finds the ends of one or two contacts with a logarithmic barrier for each cone and for the misfit
(Boyd and Vandenberghe, Convex Optimization, 11.3), and Clarabel those of more
(:mod:`contactfpga.robot.haptics.system`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from contactfpga.robot.haptics.contact import Interval
from contactfpga.surfaces.shapes import Floats

CHI2_1 = 3.841458820694124

LARGEST = 1e4
"""Largest push searched, in multiples of the measured force."""

UNBOUNDED = 500.0
"""Push, in multiples of the measured force, that counts as unbounded."""

GAP = 1e-4
"""Accuracy of an interval's end as a share of the measured force."""

LEAST = 1e-4
"""Accuracy of the least misfit, in squares of noise."""

STEEPER = 30.0

CENTERED = 1e-3
"""Gain of a step, as a share of the barrier's value, that calls for another."""

STEPS = 80
"""Most Newton steps per barrier, and halvings of a step."""

ROUNDING = 1e-13
"""Regularization of a matrix with unit diagonal."""

KNOWN = 1e-9
"""Share below which a singular value, or an effect of the null space, is 0."""


class Fit:
    """Forces x in N in cones, with ``matrix`` x, in standard deviations of the wrench, fitted to ``wanted``.

    Args:
        firsts: indexes of the pushes; with friction, both forces along the surface follow.
        frictions: of each contact; 0: a push alone.
        size_n: approximate size of the pushes.
    """

    def __init__(
        self, matrix: Floats, wanted: Floats, firsts: Sequence[int], frictions: Sequence[float], size_n: float
    ):
        felt = np.linalg.norm(matrix, axis=0)
        matrix = np.where(felt > KNOWN * felt.max(), matrix, 0.0)
        self._size = max(size_n, 1 / float(felt[matrix.any(axis=0)].min()))  # at least a standard deviation
        self.matrix, self.wanted, self.frictions, self.firsts = matrix * self._size, wanted, frictions, list(firsts)
        self.square = self.matrix.T @ self.matrix
        """(n, n): half the second derivative of the misfit."""
        self._cones = np.zeros((len(self.firsts), matrix.shape[1]))
        """Factors of the squares of x: push squared, less the rest squared over friction squared, is above 0 inside a
        cone."""
        for cone, first, friction in zip(self._cones, self.firsts, frictions):
            cone[first] = 1.0
            if friction:
                cone[first + 1 : first + 3] = -1 / friction**2
        left, values, right = np.linalg.svd(self.matrix)
        rank = int((values > KNOWN * values[0]).sum())
        self._null = right[rank:].T
        self._root = right[:rank].T / values[:rank]
        """(n, rank): a root of the covariance."""
        self._best = self._root @ (left[:, :rank].T @ wanted)

    def intervals(self, ends_of: Ends | None = None) -> list[Interval]:
        """Least and largest of each push; None if unbounded. ``ends_of`` finds those that the wrench alone does not
        determine."""
        found = {first: self._alone(first) for first in self.firsts}
        rest = [first for first, both in found.items() if both is None]
        ends = {first: both for first, both in found.items() if both is not None}
        if rest:
            ends |= (ends_of or ends_of_few)(self, rest)
        scaled = [(self._size * ends[first][0], self._size * ends[first][1]) for first in self.firsts]
        most = UNBOUNDED * self._size
        return [(max(0.0, low), None if high > most else max(0.0, high)) for low, high in scaled]

    def _alone(self, first: int) -> tuple[float, float] | None:
        if float(np.abs(self._null[first]).max(initial=0.0)) > KNOWN:
            return None
        row = self._root[first]
        half = float(np.sqrt(CHI2_1 * (row @ row)))
        way = self._root @ row * (CHI2_1 / half)
        ends = np.array([self._straightened(end) for end in (self._best - way, self._best + way)])
        if not self._inside(ends).all():
            return None
        return float(self._best[first]) - half, float(self._best[first]) + half

    def _straightened(self, x: Floats) -> Floats:
        """Forces with the same wrench and the smallest parts along the surface."""
        sides = (self._cones < 0).any(axis=0)
        if not sides.any() or not self._null.shape[1]:
            return x
        return np.asarray(x - self._null @ np.linalg.lstsq(self._null[sides], x[sides], rcond=None)[0])

    def _inside(self, x: Floats) -> NDArray[np.bool_]:
        pushes = x[:, self.firsts]
        within = (pushes > 0) & (pushes < LARGEST) & (x * x @ self._cones.T > 0)
        return np.asarray(within.all(axis=1))

    def misfit(self, x: Floats) -> Floats:
        """(m,) misfits in squares of noise, of (m, n) rows."""
        rest = x @ self.matrix.T - self.wanted
        return np.asarray((rest * rest).sum(axis=1))

    def half_slope(self, x: Floats) -> Floats:
        """(m, n): half the derivative of the misfit."""
        return np.asarray((x @ self.matrix.T - self.wanted) @ self.matrix)

    @property
    def contacts(self) -> int:
        return len(self.firsts)

    @property
    def walls(self) -> int:
        """Weight of the barrier's walls."""
        return 3 * len(self.firsts) + 1

    def barrier(self, x: Floats) -> Floats:
        """(m,) barriers, infinite outside the cones."""
        inside = self._inside(x)
        rooms, left = x * x @ self._cones.T, LARGEST - x[:, self.firsts]
        with np.errstate(invalid="ignore", divide="ignore"):
            value = -np.log(rooms).sum(axis=1) - np.log(left).sum(axis=1)
        return np.where(inside, value, np.inf)

    def barrier_slopes(self, x: Floats) -> tuple[Floats, Floats]:
        """(m, n) and (m, n, n): first and second derivatives of the barrier."""
        over = 1 / (x * x @ self._cones.T)
        ways = 2 * self._cones * x[:, None] * over[:, :, None]
        slope, curve = -ways.sum(axis=1), ways.transpose(0, 2, 1) @ ways
        left = 1 / (LARGEST - x[:, self.firsts])
        slope[:, self.firsts] += left
        diagonal = -2 * over @ self._cones
        diagonal[:, self.firsts] += left * left
        at = np.arange(x.shape[1])
        curve[:, at, at] += diagonal
        return np.asarray(slope), np.asarray(curve)


def ends_of_few(fit: Fit, firsts: Sequence[int]) -> dict[int, tuple[float, float]]:
    """The least and largest of each of these pushes."""
    start = np.zeros((1, fit.matrix.shape[1]))
    start[:, fit.firsts] = 1.0
    inner = _descended(_Goal(fit, None, None), start, LEAST)
    goals = np.zeros((2 * len(firsts), inner.shape[1]))
    for at, first in enumerate(firsts):
        goals[2 * at, first], goals[2 * at + 1, first] = 1.0, -1.0
    most = float(fit.misfit(inner)[0]) + CHI2_1
    found = _descended(_Goal(fit, goals, most), np.repeat(inner, len(goals), axis=0), GAP)
    return {
        first: (float(found[2 * at, first]) - GAP, float(found[2 * at + 1, first]) + GAP)
        for at, first in enumerate(firsts)
    }


class _Goal:
    """Half the misfit, or each row of ``goals`` at a misfit below ``most``, with barriers."""

    def __init__(self, fit: Fit, goals: Floats | None, most: float | None):
        self.fit, self._goals, self._most = fit, goals, most

    def value(self, x: Floats, weight: float) -> Floats:
        misfit, walls = self.fit.misfit(x), self.fit.barrier(x)
        if self._goals is None or self._most is None:
            return np.asarray(weight * misfit / 2 + walls)
        with np.errstate(invalid="ignore", divide="ignore"):
            inside = -np.log(self._most - misfit)
        goal = weight * (self._goals * x).sum(axis=1)
        return np.where(misfit < self._most, goal + walls + np.nan_to_num(inside), np.inf)

    def step(self, x: Floats, weight: float) -> tuple[Floats, Floats]:
        """(m, n): Newton steps; (m,): twice the predicted decrease."""
        (slope, curve), half = self.fit.barrier_slopes(x), self.fit.half_slope(x)
        if self._goals is None or self._most is None:
            slope, curve = slope + weight * half, curve + weight * self.fit.square
        else:
            room = (self._most - self.fit.misfit(x))[:, None]
            slope = slope + weight * self._goals + 2 * half / room
            edge = 2 * half / room
            curve = curve + 2 * self.fit.square / room[:, :, None] + edge[:, :, None] * edge[:, None]
        scale = 1 / np.sqrt(np.diagonal(curve, axis1=1, axis2=2))
        even = curve * scale[:, :, None] * scale[:, None] + ROUNDING * np.eye(x.shape[1])
        found = -scale * np.linalg.solve(even, (scale * slope)[:, :, None])[:, :, 0]
        return np.asarray(found), np.asarray(-(found * slope).sum(axis=1))


def _descended(goal: _Goal, x: Floats, gap: float) -> Floats:
    weight = 1.0
    while True:
        x = _centered(goal, x, weight)
        if goal.fit.walls / weight < gap:
            return x
        weight = min(STEEPER * weight, 1.001 * goal.fit.walls / gap)


def _centered(goal: _Goal, x: Floats, weight: float) -> Floats:
    for _ in range(STEPS):
        step, gain = goal.step(x, weight)
        going = gain > CENTERED
        if not going.any():
            break
        share, value = np.where(going, 1.0, 0.0), goal.value(x, weight)
        for _ in range(STEPS):
            far = ~(goal.value(x + share[:, None] * step, weight) <= value - 0.1 * share * gain)
            if not far.any():
                break
            share[far] /= 2
        x = np.where(far[:, None], x, x + share[:, None] * step)
    return x


def of_pushes(matrix: Floats, wanted: Floats, sides: Floats, size_n: float) -> Fit | None:
    """A fit of the pushes' columns in ``matrix``, for any forces along the surface with columns ``sides``; None if
    those alone exert every wrench."""
    if sides.shape[1]:
        left, values, _ = np.linalg.svd(sides)
        rest = left[:, int((values > KNOWN * values[0]).sum()) :].T
        matrix, wanted = rest @ matrix, rest @ wanted
    count = matrix.shape[1]
    return Fit(matrix, wanted, range(count), [0.0] * count, size_n) if matrix.any() else None


Ends = Callable[[Fit, Sequence[int]], dict[int, tuple[float, float]]]
"""The least and largest of these pushes, in units of the fit."""
