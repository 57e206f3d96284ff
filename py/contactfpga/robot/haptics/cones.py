"""Forces within friction's cones that exert a wrench, and the range of each push under the units' noise.

Forces are those of least squares if they lie in the cones, else those of a cone program.

A range covers all forces within the cones whose misfit, in squares of noise with uncertain places, exceeds its minimum
by at most 3.84, the 95 % quantile of chi-square with one degree of freedom (profile likelihood: Meeker and Escobar, The
American Statistician 49, 1995). A push that the wrench alone determines, with both ends within the cones, has 1.96
standard deviations to either side.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from contactfpga.robot.haptics.contact import Interval
from contactfpga.robot.haptics.program import Program
from contactfpga.robot.haptics.values import HapticsError
from contactfpga.surfaces.shapes import Floats

CHI2_1 = 3.841458820694124

KNOWN = 1e-9
"""Share below which a singular value, or an effect of the null space, is 0."""

FEW_COUNT, MANY_COUNT = 1e-7, 0.03
"""Weights of a squared push against a squared force along the surface, among forces with the same wrench, for up to two
contacts and for more, which else squeeze the link hard to drag a little less."""

ROUNDING = 1e-12
"""Share of the squared wrench by which forces may fit worse than the best, and count as good."""

UNBOUNDED = 500.0
"""Push, in multiples of the measured force, that counts as unbounded."""

LARGEST = 1e3
"""Mean push, in multiples of the measured force, up to which programs search."""

ANY_FRICTION = 100.0
"""Friction whose cones leave out hardly any force that pushes."""

SMALLEST = 1e-11
"""Weight of the squared forces against their squared misfit, where both count."""

FOUND = 1e-6
"""Error of a cone program up to which it has forces that exert the wrench."""

USABLE = 1e-4
"""Error of a cone program, as a share of the result, up to which there is a result; without one a range is 0 to any
push."""


class _Space:
    """The forces that a matrix to the wrench tells apart, and those without wrench."""

    def __init__(self, matrix: Floats, used: NDArray[np.bool_]):
        left, values, right = np.linalg.svd(matrix[:, used])
        rank = int((values > KNOWN * values[0]).sum())
        self.left, self.values = left[:, :rank], values[:rank]
        forces = right
        if not used.all():
            forces = np.zeros((len(right), len(used)))
            forces[:, used] = right
        self.right, self.null = forces[:rank], forces[rank:]
        """(rank, 3k) and (n, 3k) orthonormal forces."""

    def smallest(self, shares: Floats) -> Floats:
        """(3k,): the forces with these (rank,) shares of ``right`` and the smallest parts along the surface."""
        if not len(self.null):
            return np.asarray(shares @ self.right)
        weighted = self.right / _weights(self.right.shape[1] // 3)
        return np.asarray(np.linalg.solve(weighted @ self.right.T, shares) @ weighted)


def _used(frictions: Floats) -> NDArray[np.bool_]:
    """(3k,): which forces may differ from 0."""
    used = np.repeat(frictions > 0, 3)
    used[::3] = True
    return used


def _weights(contacts: int) -> Floats:
    return np.tile([FEW_COUNT if contacts <= 2 else MANY_COUNT, 1.0, 1.0], contacts)


class Cones:
    """Forces at k contacts, each a push and two parts along the surface, (3k,) in N.

    Args:
        matrix: (r, 3k) from forces to the wrench in standard deviations.
        wanted: (r,) wrench.
        frictions: largest part along the surface over the push, for each contact; 0: a push alone.
    """

    def __init__(self, matrix: Floats, wanted: Floats, frictions: Sequence[float]):
        self._matrix, self._wanted, self._frictions = matrix, wanted, np.array(frictions)
        self._used = _used(self._frictions)
        sides = np.where(self._frictions > 0, self._frictions, 1.0)
        self._scales = np.stack([np.ones(len(sides)), sides, sides], axis=1).ravel()
        self._space = _Space(matrix, self._used)
        self.rank = len(self._space.values)

    @property
    def null(self) -> Floats:
        """(n, 3k) orthonormal forces without wrench."""
        return self._space.null

    @property
    def root(self) -> Floats:
        """(3k, rank): a root of the forces' covariance, without the null space."""
        return np.asarray(self._space.right.T / self._space.values)

    def misfit(self, forces: Floats) -> float:
        """The misfit in squares of noise."""
        rest = self._matrix @ forces - self._wanted
        return float(rest @ rest)

    def nearest(self) -> tuple[Floats, bool]:
        """The forces within the cones nearest to the wrench, of equal ones those with the smallest parts along the
        surface; and False. Where friction is not enough: True, and those of any friction if they fit significantly
        better."""
        shares = self._wanted @ self._space.left
        forces, all_push = self._least_squares()
        square = float(self._wanted @ self._wanted)
        worse = self.misfit(forces) > square - float(shares @ shares) + ROUNDING * square
        if not self._frictions.any():
            return forces if not worse or self._is_nearest(forces) else self._nearest(), False
        allowed = not worse and self._allowed(forces)
        found = self._smallest(shares / self._space.values) if len(self.null) and not (allowed and all_push) else None
        if found is not None or allowed:
            return forces if found is None else found, False
        if not all_push:
            frictions = np.where(self._frictions > 0, ANY_FRICTION, 0.0).tolist()
            pushing = Cones(self._matrix, self._wanted, frictions)._nearest()
            forces = pushing if self.misfit(pushing) < self.misfit(forces) else forces
        found = self._nearest()
        return (found if self.misfit(found) < self.misfit(forces) + CHI2_1 else forces), True

    def _least_squares(self) -> tuple[Floats, bool]:
        """Forces of least squares, without the contacts that would pull; whether none would."""
        pushing, space = np.ones(len(self._used), bool), self._space
        while True:
            forces = space.smallest(self._wanted @ space.left / space.values)
            pulls = np.repeat(forces[::3] < min(0.0, forces[::3].min() / 2), 3)
            if not pulls.any():
                return forces, bool(pushing.all())
            pushing &= ~pulls
            if not pushing.any():
                return np.zeros(len(forces)), False
            space = _Space(self._matrix, self._used & pushing)

    def _allowed(self, forces: Floats) -> bool:
        pushes, sides = forces[::3], np.hypot(forces[1::3], forces[2::3])
        return bool(((pushes >= 0) & (sides <= self._frictions * pushes + KNOWN * (pushes + 1))).all())

    def _is_nearest(self, pushes: Floats) -> bool:
        slope = (self._matrix @ pushes - self._wanted) @ self._matrix[:, ::3]
        return bool((slope >= -KNOWN * np.abs(self._matrix).max() * (1 + np.abs(self._wanted).max())).all())

    def _nearest(self) -> Floats:
        """The forces in the cones nearest to the wrench."""
        space, shares = self._space, self._wanted @ self._space.left
        length = float(np.linalg.norm(shares)) or 1.0
        square = SMALLEST * _weights(len(self._frictions))
        rows = space.values[:, None] * space.right / space.values[0]
        found, error = self._least(rows, shares / length, length / float(space.values[0]), 1.0, square)
        if not error < USABLE:
            raise HapticsError(f"pushes are known to {error:.2g} of their size only; do contacts lie in one point?")
        return found

    def _smallest(self, shares: Floats) -> Floats | None:
        """The forces in the cones with these shares and the smallest parts along the surface; None without any."""
        size = float(np.abs(shares).max()) or 1.0
        found, error = self._least(self._space.right, shares / size, size, 0.0, _weights(len(self._frictions)))
        return found if error < FOUND else None

    def _least(self, rows: Floats, wanted: Floats, size_n: float, rest: float, square: Floats) -> tuple[Floats, float]:
        """The (3k,) forces with the least square forces^2, and their error. ``rest`` is 1 if what they miss of
        ``wanted`` counts as well, or 0 if they miss nothing."""
        program = self._program(rows, wanted, size_n, 2.0 * rest, square)
        found, _, errors = program.least(np.zeros((1, *program.shape)))
        return size_n * self._scales * found[0, : len(self._frictions), :3].ravel(), float(errors[0])

    def _program(
        self, rows: Floats, wanted: Floats, size_n: float, most: float, square: Floats | None = None
    ) -> Program:
        """Forces over ``size_n`` in their cones, ``rows`` forces that miss ``wanted`` by at most ``most``, and a bound
        of the sum of all pushes.

        Cones of contacts have sides over friction. The last two are that of the rest, and what is left to the bound.
        """
        count, rank = len(self._frictions), len(rows)
        columns, squares = np.zeros((count + 2, max(3, rank + 1), rank + 2)), None
        columns[:count, :3, :rank] = (rows * self._scales).T.reshape(count, 3, rank)
        columns[:count, 0, -1], columns[-1, 0, -1], columns[-2, 0, -2] = 1 / (LARGEST * count), 1.0, 1.0
        if most:
            columns[-2, 1 : rank + 1, :rank] = most * np.eye(rank)
        if square is not None:
            squares = np.zeros(columns.shape[:2])
            squares[:count, :3], squares[-2, 1:] = (square * self._scales**2).reshape(count, 3), most**2
        return Program(columns, np.array([*wanted, 1.0, 1.0]), squares)

    def ranges(self, forces: Floats, frictions: Sequence[float], beyond: bool, exact: bool) -> list[Interval]:
        """Least and largest of each push; None if unbounded.

        Args:
            forces: of :meth:`nearest`.
            frictions: of each contact; they may be larger than those of the forces.
            beyond: friction bounds nothing.
            exact: the forces exert exactly the wrench, which has no noise.
        """
        wanted = self._matrix @ forces if exact else self._wanted
        cones = self._of_any_friction(wanted) if beyond else Cones(self._matrix, wanted, frictions)
        if cones is None:
            return [(0.0, None)] * len(self._frictions)
        known = [cones._determined(at, exact) for at in range(len(frictions))]
        asked = [at for at, one in enumerate(known) if one is None]
        found = iter(cones._ends(asked, forces, exact) if asked else ())
        return [next(found) if one is None else one for one in known]

    def _of_any_friction(self, wanted: Floats) -> Cones | None:
        """The pushes alone, for the wrenches that parts along the surface do not exert; None if these exert all."""
        sides = self._used.copy()
        sides[::3] = False
        left, values, _ = np.linalg.svd(self._matrix[:, sides])
        rest = left[:, int((values > KNOWN * values[0]).sum()) :].T
        matrix = np.where(sides, 0.0, rest @ self._matrix)
        matrix *= np.linalg.norm(matrix, axis=0) > KNOWN * float(self._space.values[0])
        return Cones(matrix, rest @ wanted, [0.0] * len(self._frictions)) if matrix.any() else None

    def _determined(self, at: int, exact: bool) -> tuple[float, float] | None:
        """The range of a push that the wrench alone determines, if both ends lie within the cones."""
        if float(np.abs(self.null[:, 3 * at]).max(initial=0.0)) > KNOWN:
            return None
        space, row, best = self._space, self.root[3 * at], self._wanted @ self._space.left
        way = row * math.sqrt(CHI2_1 / float(row @ row))
        ends = [space.smallest((best + side * way) / space.values) for side in (-1, 1)]
        if exact or not all(self._allowed(end) for end in ends):
            return (float(row @ best),) * 2 if exact else None
        return float(ends[0][3 * at]), float(ends[1][3 * at])

    def _ends(self, asked: Sequence[int], forces: Floats, exact: bool) -> list[Interval]:
        """The ranges of pushes that the wrench alone does not determine."""
        space, felt = self._space, np.linalg.norm(self._matrix[:, ::3], axis=0)
        size = max(float(forces[::3].max()), 1 / float(felt[felt > KNOWN * felt.max()].min()))
        if exact:
            program = self._program(space.right, space.right @ forces / size, size, 0.0)
        else:
            shares = self._wanted @ space.left
            best = space.values * (space.right @ self._nearest()) - shares
            most = math.sqrt(float(best @ best) + CHI2_1)
            rows = size / most * space.values[:, None] * space.right
            program = self._program(rows, shares / most, size, 1.0)
        slopes = np.zeros((2 * len(asked), *program.shape))
        for number, at in enumerate(asked):
            slopes[2 * number, at, 0], slopes[2 * number + 1, at, 0] = 1.0, -1.0
        found, gains, errors = program.least(slopes)
        least, most = size * (slopes * found).sum(axis=(1, 2)).reshape(-1, 2).T * [[1], [-1]]
        more = gains[1::2, -1, 0]  # of the largest, per doubled bound
        bounded = (most <= UNBOUNDED * size) & (more <= 1) & (errors[1::2] < USABLE)
        least = np.where(errors[::2] < USABLE, least, 0.0)
        return [(low, high if end else None) for low, high, end in zip(least.tolist(), most.tolist(), bounded.tolist())]
