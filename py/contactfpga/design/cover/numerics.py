"""Roots and integrals to full precision, without scipy."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

NODES = 16
DEEPEST = 60
"""Bisections after which an integral is abandoned."""


def root(function: Callable[[float], float], low: float, high: float) -> float:
    """The root of ``function`` between two places of different sign, to full precision, by Chandrupatla's method.
    Raises ValueError for equal signs."""
    b, fb = low, function(low)
    a, fa = high, function(high)
    if fa == 0 or fb == 0:
        return a if fa == 0 else b
    if (fa > 0) == (fb > 0):
        raise ValueError(f"no change of sign between {low} and {high}")
    c, fc = a, fa
    share = 0.5
    for _ in range(400):
        x = a + share * (b - a)
        fx = function(x)
        if (fx > 0) == (fa > 0):
            c, fc = a, fa
        else:
            c, b, fc, fb = b, a, fb, fa
        a, fa = x, fx
        best = a if abs(fa) < abs(fb) else b
        width = abs(b - a)
        if fa == 0 or width <= 4e-16 * abs(best):
            return best
        least = min(0.5, 2e-16 * abs(best) / width)
        xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
        if phi**2 < xi and (1 - phi) ** 2 < 1 - xi:
            share = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        else:
            share = 0.5
        share = min(1 - least, max(least, share))
    return best


def integral(function: Callable[[Floats], Floats], low: float, high: float, tolerance: float = 1e-13) -> float | None:
    """The integral of a vectorized ``function`` to relative ``tolerance``, by Gauss-Legendre and bisection; None if it
    diverges."""
    whole = gauss(function, low, high)
    if not math.isfinite(whole):
        return None
    total = abs(whole)
    done = 0.0
    todo = [(low, high, whole, 0)]
    while todo:
        left, right, coarse, depth = todo.pop()
        middle = (left + right) / 2
        halves = gauss(function, left, middle), gauss(function, middle, right)
        fine = halves[0] + halves[1]
        if not math.isfinite(fine):
            return None
        total = max(total, abs(done) + abs(fine))
        if abs(fine - coarse) <= tolerance * total:
            done += fine
        elif depth == DEEPEST:
            return None
        else:
            todo += [(left, middle, halves[0], depth + 1), (middle, right, halves[1], depth + 1)]
    return done


def gauss(function: Callable[[Floats], Floats], low: float, high: float, nodes: int = NODES) -> float:
    """Gauss-Legendre integral with a fixed number of nodes."""
    x, weights = legendre(nodes)
    half = (high - low) / 2
    return half * float(weights @ function(low + half * (1 + x)))


@functools.cache
def legendre(nodes: int) -> tuple[Floats, Floats]:
    """Gauss-Legendre nodes and weights on -1 to 1."""
    return np.polynomial.legendre.leggauss(nodes)
