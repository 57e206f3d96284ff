"""Spread of stress from the cover's face to the switches, by medium.

A point force F on the otherwise free face gives the normal stress F/h^2 g(rho/h) at depth h and distance rho, positive
in compression. With k the wave number in the plane and t = k h,

    g(s) = 1/(2 pi) int_0^inf t G(t) J0(t s) dt.

``halfspace``: the cover continues below the switches (paper (9), Johnson 3.2): G = (1 + t) exp(-t), g = 3/(2 pi) (1 +
s^2)^(-5/2).

``bonded``: an incompressible cover glued to a rigid base. The stream function obeys (D^2 - 1)^2 W = 0 over the depth,
without shear on the face or displacement at the base: G = (cosh t + t sinh t) / (cosh^2 t + t^2).

``frictionless``: a cover that slides on a rigid base, for any Poisson ratio: G = (sinh t + t cosh t) / (sinh t cosh t +
t).
"""

from __future__ import annotations

import functools

import numpy as np

from contactfpga.design.cover.answer import CoverError
from contactfpga.design.cover.numerics import Floats
from contactfpga.inputs.values import shown

MEDIA = ("halfspace", "bonded", "frictionless")

POISSON = 0.2
"""Poisson's ratio of foam."""

HIGHEST_T = 30.0
"""Wave number times thickness beyond which nothing passes: 2 t^2 exp(-t) is 2e-10 there."""

FARTHEST = 16.0
"""Distance over thickness beyond which a layer's stress, below 1e-7 of the axis value, counts as 0."""

STEP = 0.025
"""Distance over thickness between two integrals of a layer's table."""

FINER = 32
"""Linear pieces per step of the table, to 1e-6 of the stress on the axis."""


def transfer(name: str, t: Floats) -> Floats:
    """G(t) of a medium, for t from 0 to some hundred; dimensionless."""
    t = np.asarray(t, float)
    if name == "halfspace":
        return np.asarray((1 + t) * np.exp(-t))
    # Both fractions are divided by cosh t through, so that nothing overflows.
    tanh, sech = np.tanh(t), 2 * np.exp(-t) / (1 + np.exp(-2 * t))
    if name == "bonded":
        return np.asarray(sech * (1 + t * tanh) / (1 + (t * sech) ** 2))
    if name == "frictionless":
        moving = t > 0
        return np.where(moving, sech * (tanh + t) / np.where(moving, tanh + t * sech**2, 1.0), 1.0)
    raise CoverError(f"medium is {shown(name)}; it must be one of {', '.join(MEDIA)}")


def foam(t: Floats) -> Floats:
    """G(t) of foam glued to a rigid base, for t from 0 to some hundred.

    With q = 3 - 4 nu, G = (1 + q) ((1 + q) cosh t + 2 t sinh t) / (2 q cosh 2t + 4 t^2 + 1 + q^2); ``bonded`` is this
    at nu = 0.5.
    """
    q, tanh, sech = 3 - 4 * POISSON, np.tanh(t), 2 * np.exp(-t) / (1 + np.exp(-2 * t))
    below = 2 * q * (1 + tanh**2) + (1 + q**2 + 4 * t**2) * sech**2
    return np.asarray((1 + q) * (1 + q + 2 * t * tanh) * sech / below)


def spread(name: str, s: Floats | float) -> Floats:
    """g(s) of a medium: normal stress at the switches times h^2/F; ``s`` is distance over thickness."""
    s = np.abs(np.asarray(s, float))
    if name == "halfspace":
        square = 1 + s * s
        return np.asarray(1.5 / np.pi / (square * square * np.sqrt(square)))  # a power takes five times as long
    values, rises = _table(name)
    place = np.minimum(s, FARTHEST) * (FINER / STEP)
    index = place.astype(np.intp)
    return np.asarray(values[index] + (place - index) * rises[index])


def exact_spread(name: str, s: Floats | float) -> Floats:
    """g(s) by the integral, to 1e-9 up to s = :data:`FARTHEST`; far slower than :func:`spread`."""
    transfer(name, np.zeros(1))
    return _integral(name, np.atleast_1d(np.abs(np.asarray(s, float))))[0].reshape(np.shape(s))


@functools.cache
def first_zero(name: str) -> float | None:
    """Distance over thickness at which the stress under a point force first becomes tensile; None if never.

    Beyond 1.9076 a bonded layer presses again, with at most 0.29 % of the stress on the axis.
    """
    if name == "halfspace":
        return None
    low, high = 1.0, 2.0 if name == "frictionless" else 1.8
    while high - low > 1e-13:
        middle = (low + high) / 2
        low, high = (middle, high) if exact_spread(name, middle) > 0 else (low, middle)
    return low


@functools.cache
def _table(name: str) -> tuple[Floats, Floats]:
    """g every STEP / FINER and its increment to the next, by the cubic through values and slopes; from FARTHEST on both
    are 0."""
    transfer(name, np.zeros(1))
    values, slopes = _integral(name, np.arange(0, FARTHEST + STEP / 2, STEP))
    part = np.arange(FINER) / FINER
    rest = 1 - part
    near = np.outer(values[:-1], rest**2 * (1 + 2 * part)) + np.outer(slopes[:-1], rest**2 * part * STEP)
    far = np.outer(values[1:], part**2 * (1 + 2 * rest)) - np.outer(slopes[1:], part**2 * rest * STEP)
    table = np.append((near + far).ravel(), 0.0)
    return table, np.append(np.diff(table), 0.0)


@functools.cache
def _nodes() -> tuple[Floats, Floats]:
    nodes, weights = np.polynomial.legendre.leggauss(320)
    return HIGHEST_T / 2 * (nodes + 1), HIGHEST_T / 2 * weights


def _integral(name: str, s: Floats) -> tuple[Floats, Floats]:
    """(g, dg/ds) at (n,) distances; J0, which numpy lacks, is the mean of cos(x sin a) by the midpoint rule."""
    t, weights = _nodes()
    weighted = weights * t * transfer(name, t) / (2 * np.pi)
    values = np.array([_at(weighted, t, float(one)) for one in s])
    return values[:, 0], values[:, 1]


def _at(weighted: Floats, t: Floats, s: float) -> tuple[float, float]:
    count = 40 + round(8 * s)
    sines = np.sin((np.arange(count) + 0.5) * (np.pi / 2 / count))
    phase = np.multiply.outer(sines * s, t)
    return float((np.cos(phase) @ weighted).mean()), -float((sines * (np.sin(phase) @ (weighted * t))).mean())
