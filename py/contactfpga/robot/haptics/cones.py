"""Forces within friction's cones that exert a wrench, and the range of each push under the units' noise.

Forces are those of least squares if they lie in the cones, else those of a cone program (Clarabel, loaded on demand).

A range covers all forces within the cones whose misfit, in squares of noise with uncertain places, exceeds its minimum
by at most 3.84, the 95 % quantile of chi-square with one degree of freedom (profile likelihood: Meeker and Escobar, The
American Statistician 49, 1995). A push that the wrench alone determines, with both ends within the cones, has 1.96
standard deviations to either side.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contactfpga.errors import MissingExtra
from contactfpga.robot.haptics.contact import Interval
from contactfpga.robot.haptics.values import HapticsError
from contactfpga.surfaces.shapes import Floats

CHI2_1 = 3.841458820694124

KNOWN = 1e-9
"""Share below which a singular value, or an effect of the null space, is 0."""

FEW_COUNT, MANY_COUNT = 1e-7, 1e-2
"""Weights of a squared push against a squared force along the surface, among forces with the same wrench, for up to two
contacts and for more, which else squeeze the link hard to drag a little less."""

ROUNDING = 1e-12
"""Share of the squared wrench by which forces may fit worse than the best, and count as good."""

UNBOUNDED = 500.0
"""Push, in multiples of the measured force, that counts as unbounded."""

TOLERANCE = 1e-10
"""Relative tolerance of Clarabel."""


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
        surface; and False. Where friction is not enough: those of any friction at the contacts that push; and True."""
        shares = self._wanted @ self._space.left
        forces = self._least_squares()
        square = float(self._wanted @ self._wanted)
        worse = self.misfit(forces) > square - float(shares @ shares) + ROUNDING * square
        if not self._frictions.any():
            return forces if not worse or self._is_nearest(forces) else self._nearest(), False
        if not worse and self._allowed(forces):
            return forces, False
        found = self._smallest(shares / self._space.values) if len(self.null) else None
        return (forces, True) if found is None else (found, False)

    def _least_squares(self) -> Floats:
        """Forces of least squares, without the contacts that would pull."""
        pushing, space = np.ones(len(self._used), bool), self._space
        while True:
            forces = space.smallest(self._wanted @ space.left / space.values)
            pulls = np.repeat(forces[::3] < 0, 3)
            if not pulls.any():
                return forces
            pushing &= ~pulls
            if not pushing.any():
                return np.zeros(len(forces))
            space = _Space(self._matrix, self._used & pushing)

    def _allowed(self, forces: Floats) -> bool:
        pushes, sides = forces[::3], np.hypot(forces[1::3], forces[2::3])
        return bool(((pushes >= 0) & (sides <= self._frictions * pushes + KNOWN * (pushes + 1))).all())

    def _is_nearest(self, pushes: Floats) -> bool:
        slope = (self._matrix @ pushes - self._wanted) @ self._matrix[:, ::3]
        return bool((slope >= -KNOWN * np.abs(self._matrix).max() * (1 + np.abs(self._wanted).max())).all())

    def _nearest(self) -> Floats:
        """The forces in the cones nearest to the wrench."""
        matrix, wanted = self._matrix / self._space.values[0], self._wanted / self._space.values[0]
        size = max(1.0 / float(self._space.values[0]), float(np.linalg.norm(wanted)))
        found = _Program(self._frictions, size).least(matrix.T @ matrix, -wanted @ matrix)
        if found is None:
            raise HapticsError("no forces within friction's cones were found; do contacts lie in one point?")
        return found

    def _smallest(self, shares: Floats) -> Floats | None:
        """The forces in the cones with these shares and the smallest parts along the surface; None without any."""
        program = _Program(self._frictions, float(np.abs(shares).max()), same=(self._space.right, shares))
        return program.least(np.diag(_weights(len(self._frictions))), np.zeros(len(self._used)))

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
        ends = functools.cache(lambda: cones._ends(forces, exact))
        return [cones._determined(at, exact) or ends().of(3 * at) for at in range(len(frictions))]

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

    def _ends(self, forces: Floats, exact: bool) -> _Program:
        """What finds the ranges of pushes that the wrench alone does not determine."""
        felt = np.linalg.norm(self._matrix[:, ::3], axis=0)
        size = max(float(forces[::3].max()), 1 / float(felt[felt > KNOWN * felt.max()].min()))
        if exact:
            return _Program(self._frictions, size, same=(self._space.right, self._space.right @ forces))
        most = math.sqrt(self.misfit(self._nearest()) + CHI2_1)
        return _Program(self._frictions, size, near=(self._matrix, self._wanted, most))


class _Program:
    """Forces (3k,) in cones, near ``size_n``. ``same`` is a matrix with its product, ``near`` one with the product's
    target and the largest distance from it.

    The problem is so sparse that 64 contacts need no longer each than three.
    """

    def __init__(
        self,
        frictions: Floats,
        size_n: float,
        same: tuple[Floats, Floats] | None = None,
        near: tuple[Floats, Floats, float] | None = None,
    ):
        try:
            import clarabel
            from scipy import sparse
        except ModuleNotFoundError:
            raise MissingExtra("The forces at two contacts or more", "haptics") from None
        self._clarabel, self._sparse = clarabel, sparse
        self._size, self._used = size_n, _used(frictions)
        count = int(self._used.sum())
        scales = np.stack([np.where(frictions > 0, frictions, 1.0), *np.ones((2, len(frictions)))], axis=1).ravel()
        sides, starts = [-sparse.diags(scales[self._used])], [np.zeros(count)]
        self._cones: list[Any] = [
            clarabel.SecondOrderConeT(3) if friction else clarabel.NonnegativeConeT(1) for friction in frictions
        ]
        if same is not None:
            sides.append(sparse.csc_matrix(same[0][:, self._used]))
            starts.append(same[1] / size_n)
            self._cones.append(clarabel.ZeroConeT(len(same[1])))
        if near is not None:
            matrix, target, most = near
            sides += [sparse.csc_matrix((1, count)), sparse.csc_matrix(size_n * matrix[:, self._used])]
            starts += [np.array([most]), target]
            self._cones.append(clarabel.SecondOrderConeT(1 + len(target)))
        self._sides = sparse.vstack(sides, format="csc")
        self._start = np.concatenate(starts)

    def of(self, at: int) -> Interval:
        """The least and the largest force ``at``; None if unbounded."""
        ends = []
        for sign in (1.0, -1.0):
            slope = np.zeros(len(self._used))
            slope[at] = sign
            solution = self._run(np.zeros((len(slope),) * 2), slope)
            status = str(solution.status)
            if "Solved" not in status and "DualInfeasible" not in status:
                raise HapticsError(f"the interval of a push was not found ({status}); do contacts lie in one point?")
            ends.append(sign * float(solution.obj_val) if "Solved" in status else math.inf)
        return self._size * ends[0], None if ends[1] > UNBOUNDED else self._size * ends[1]

    def least(self, square: Floats, slope: Floats) -> Floats | None:
        """The forces x with the least x' square x / 2 + slope x; None if none are found."""
        solution = self._run(square, slope / self._size)
        if "Solved" not in str(solution.status):
            return None
        found = np.zeros(len(self._used))
        found[self._used] = solution.x
        return self._size * found

    def _run(self, square: Floats, slope: Floats) -> Any:
        settings = self._clarabel.DefaultSettings()
        settings.verbose = False
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = TOLERANCE
        square = self._sparse.csc_matrix(np.triu(square[np.ix_(self._used, self._used)]))
        given = (square, slope[self._used], self._sides, self._start, self._cones, settings)
        return self._clarabel.DefaultSolver(*given).solve()
