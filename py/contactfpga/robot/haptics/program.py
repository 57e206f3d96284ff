"""Cone programs: the least of a convex quadratic over second-order cones, under linear equations.

The method is a primal-dual interior-point method with the scaling of Nesterov and Todd and the steps of Mehrotra
(Andersen, Dahl and Vandenberghe, in Optimization for Machine Learning, 2011). The equations are few at any number of
cones, and many programs with the same cones and equations run at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from contactfpga.surfaces.shapes import Floats

STEPS = 40

ENOUGH = 1e-10
"""Error of the equations and of the optimum, relative to the least value and at least 1, at which a program ends."""

LATE = 1e-7
"""Error from which on a program ends also if a step makes it worse, as rounding does."""

BACK = 0.99
"""Share of the way to the nearest cone's boundary that a step takes."""

ROUNDING = 1e-15
"""Regularization of a matrix with unit diagonal."""

FAR = 1e6
"""Size of x up to which none is left out where a program has no solution."""


class Program:
    """x in cones with x A = ``wanted``, each about 1.

    Args:
        columns: A, (n, d, r) for n cones of d parts, of which the first is at least the norm of the others.
        wanted: (r,).
        square: (n, d) at least 0, or None: 0.
    """

    def __init__(self, columns: Floats, wanted: Floats, square: Floats | None = None):
        self._columns, self._wanted, self._square = columns, wanted, square
        self._flip = np.ones(columns.shape[1])
        self._flip[1:] = -1.0

    @property
    def shape(self) -> tuple[int, int]:
        """n and d."""
        return len(self._columns), len(self._flip)

    def least(self, slopes: Floats) -> tuple[Floats, Floats, Floats]:
        """The x with the least slope x + square x^2 / 2 for each of (m, n, d) slopes; (m, n, d) gains per x that leaves
        a cone by 1; (m,) errors."""
        with np.errstate(all="ignore"):
            return self._followed(slopes)

    def _followed(self, slopes: Floats) -> tuple[Floats, Floats, Floats]:
        x = np.zeros(slopes.shape)
        x[:, :, 0] = 1.0
        z, y = x.copy(), np.zeros((len(x), len(self._wanted)))
        best, gains, errors = x, z, np.full(len(x), np.inf)
        for _ in range(STEPS):
            off, rest = self._exerted(x) - self._wanted, slopes + self._curved(x) - self._pulled(y) - z
            gap = (x * z).sum(axis=(1, 2)) / len(self._columns)
            error = np.maximum(gap, np.maximum(np.abs(off).max(axis=1), np.abs(rest).max(axis=(1, 2))))
            error = error / (1 + np.abs((slopes * x).sum(axis=(1, 2))))
            better = error < errors
            going = (better | (error > LATE)) & (error > ENOUGH) & ~self._hopeless(z, y)
            best, gains = (np.where(better[:, None, None], *both) for both in ((x, best), (z, gains)))
            errors = np.where(better, error, errors)
            if not going.any():
                break
            dx, dz, dy, share = self._step(x, z, off, rest, gap)
            share = np.where(going & np.isfinite(share), share, 0.0)[:, None, None]
            x, z, y = x + _part(share, dx), z + _part(share, dz), y + _part(share[:, 0], dy)
        return best, gains, errors

    def _exerted(self, x: Floats) -> Floats:
        return np.asarray(x.reshape(len(x), -1) @ self._columns.reshape(-1, len(self._wanted)))

    def _pulled(self, y: Floats) -> Floats:
        return np.asarray(y @ self._columns.reshape(-1, len(self._wanted)).T).reshape(-1, *self._columns.shape[:2])

    def _hopeless(self, z: Floats, y: Floats) -> NDArray[np.bool_]:
        """(m,): whether y proves that x A, for x in the cones, comes no nearer to ``wanted`` than by ten times LATE.

        For x A = ``wanted`` - e, x z >= 0 and hence ``wanted`` y <= e y + x (A y + z).
        """
        off = np.abs(self._pulled(y) + z).max(axis=(1, 2))
        return np.asarray(y @ self._wanted > FAR * off + 10 * LATE * np.abs(y).sum(axis=1))

    def _curved(self, x: Floats) -> Floats | float:
        return 0.0 if self._square is None else self._square * x

    def _step(self, x: Floats, z: Floats, off: Floats, rest: Floats, gap: Floats) -> tuple[Floats, ...]:
        """Changes of x, z and y, and their largest share up to 1 that keeps x and z in their cones."""
        out, back, even = self._scaling(x, z)
        way = out @ out
        if self._square is not None:
            way = out @ _inverses(np.eye(len(self._flip)) + out * self._square[:, None] @ out) @ out
        flat = self._columns.reshape(-1, len(self._wanted))
        system = flat.T @ (way @ self._columns).reshape(len(x), *flat.shape)
        over = 1 / np.sqrt(np.diagonal(system, axis1=1, axis2=2))
        scale = over[:, :, None] * over[:, None]
        inverse = scale * _inverses(scale * system + ROUNDING * np.eye(len(self._wanted)))

        def moved(wanted: Floats) -> tuple[Floats, Floats, Floats]:
            dx, dy = _times(way, _times(back, wanted) - rest), np.zeros(off.shape)
            for _ in range(2):  # the second time for what rounding left
                more = _times(inverse, -off - self._exerted(dx))
                dx, dy = dx + _times(way, self._pulled(more)), dy + more
            return dx, self._curved(dx) - self._pulled(dy) + rest, dy

        dx, dz, _ = moved(-even)
        share = np.minimum(1.0, self._room(x, z, dx, dz))
        aim = -_product(even, even) - _product(_times(back, dx), _times(out, dz))
        aim[:, :, 0] += ((1 - share) ** 3 * gap)[:, None]
        dx, dz, dy = moved(_divided(aim, even))
        return dx, dz, dy, np.minimum(1.0, BACK * self._room(x, z, dx, dz))

    def _scaling(self, x: Floats, z: Floats) -> tuple[Floats, Floats, Floats]:
        """(m, n, d, d) W and its inverse, and (m, n, d) W z, which is the inverse times x."""
        long, wide = (np.sqrt(_level(one))[:, :, None] for one in (x, z))
        x, z = x / long, z / wide
        middle = (x + self._flip * z) / np.sqrt(2 + 2 * (x * z).sum(axis=2, keepdims=True))
        middle[:, :, 0] += 1
        middle /= np.sqrt(middle[:, :, :1])
        other, size, turn = self._flip * middle, np.sqrt(long / wide)[..., None], np.diag(self._flip)
        out = size * (middle[..., None] * middle[..., None, :] - turn)
        return out, (other[..., None] * other[..., None, :] - turn) / size, _times(out, z * wide)

    def _room(self, x: Floats, z: Floats, dx: Floats, dz: Floats) -> Floats:
        """(m,): the largest share of a step, at most 1 / BACK, that stays in all cones."""
        start, way = np.concatenate([x, z], axis=1), np.concatenate([dx, dz], axis=1)
        level, slope = _level(start), (start * way * self._flip).sum(axis=2)
        # The share is 1 / t at the largest root of level t^2 + 2 slope t + the level of the way.
        most = (np.sqrt(np.maximum(0.0, slope * slope - level * _level(way))) - slope) / level
        return np.asarray(1 / np.maximum(most.max(axis=1), BACK))


def _inverses(matrices: Floats) -> Floats:
    """(m, ..., n, n) inverses; NaN for each of the m that has a singular matrix, as rounding makes it near the end."""
    try:
        return np.asarray(np.linalg.inv(matrices), float)
    except np.linalg.LinAlgError:
        if len(matrices) == 1:
            return np.full(matrices.shape, np.nan)
        return np.concatenate([_inverses(one[None]) for one in matrices])


def _level(x: Floats) -> Floats:
    side = np.sqrt((x[:, :, 1:] ** 2).sum(axis=2))
    return np.asarray((x[:, :, 0] - side) * (x[:, :, 0] + side))


def _part(share: Floats, way: Floats) -> Floats:
    return np.where(share > 0, share * way, 0.0)


def _times(matrix: Floats, x: Floats) -> Floats:
    return np.asarray((matrix @ x[..., None])[..., 0])


def _product(a: Floats, b: Floats) -> Floats:
    found = a[:, :, :1] * b + b[:, :, :1] * a
    found[:, :, 0] = (a * b).sum(axis=2)
    return np.asarray(found)


def _divided(b: Floats, a: Floats) -> Floats:
    """The x whose product with ``a`` is ``b``."""
    found = b / a[:, :, :1]
    first = (a[:, :, 0] * b[:, :, 0] - (a[:, :, 1:] * b[:, :, 1:]).sum(axis=2)) / _level(a)
    found[:, :, 0] = first
    found[:, :, 1:] -= first[:, :, None] * a[:, :, 1:] / a[:, :, :1]
    return found
