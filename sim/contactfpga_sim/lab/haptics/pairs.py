"""Limits of two fingers' pushes by their uncertain places along the line through both.

Three units on a plane measure the push and two moments. A finger is a disc that closes the switches under it.
"""

from __future__ import annotations

import numpy as np

from contactfpga.surfaces.shapes import Floats
from contactfpga_sim.lab.haptics.felt import FINGER_MM, SETTINGS, pair

METHODS = ("barycenters", "mean of all places that fit", "one place known")
PUSH_N = 12.0
STEP_MM = 0.4
DRAWN = 2000
"""Pairs of places drawn per pair of fingers."""


def errors(apart_mm: float, count: int, seed: int = 1) -> dict[str, Floats]:
    """(2 count,) errors of pushes in N, by method, of ``count`` pairs that each close a switch."""
    rng, setting = np.random.default_rng([seed, 3]), SETTINGS[0]
    middle, noise = -1e3 * setting.cells.sheet_m[0], setting.cells.noise.covariance
    covariance = noise[np.ix_((2, 3, 4), (2, 3, 4))] * np.outer((1, 1e3, 1e3), (1, 1e3, 1e3))  # in mm
    found: dict[str, list[float]] = {method: [] for method in METHODS}
    done = 0
    while done < count:
        true = np.array(pair(setting, apart_mm, np.inf, rng))
        fits = [_fitting(setting.pitch_mm, place) for place in true]
        if any(not len(each) for each in fits):
            continue
        done += 1
        wrench = rng.multivariate_normal(_exert(true[None] - middle)[0] @ (PUSH_N, PUSH_N), covariance)
        closed = [_closed(setting.pitch_mm, place).mean(axis=0) for place in true]
        drawn = np.stack([each[rng.integers(len(each), size=DRAWN)] for each in fits], axis=1)
        known = np.array(drawn)
        known[:, 0] = true[0]
        for method, places in zip(METHODS, (np.array([closed]), drawn, known)):
            found[method] += list(_pushes(places - middle, wrench, covariance) - PUSH_N)
    return {method: np.array(values) for method, values in found.items()}


def _exert(places: Floats) -> Floats:
    """(n, 3, 2): force along z in N, moments about x and y in N mm, by pushes at (n, 2, 2) places in mm."""
    return np.stack([-np.ones(places.shape[:2]), -places[:, :, 1], places[:, :, 0]], axis=1)


def _pushes(places: Floats, wrench: Floats, covariance: Floats) -> Floats:
    """(2,) pushes: least squares at pairs of places, averaged by the wrench's likelihood."""
    weight, matrix = np.linalg.inv(covariance), _exert(places)
    normal = matrix.transpose(0, 2, 1) @ weight @ matrix
    pushes = np.linalg.solve(normal, matrix.transpose(0, 2, 1) @ (weight @ wrench)[:, None])[:, :, 0]
    rest = wrench - (matrix @ pushes[:, :, None])[:, :, 0]
    misfit = ((rest @ weight) * rest).sum(axis=1)
    likely = np.exp(-0.5 * (misfit - misfit.min())) / np.sqrt(np.linalg.det(normal))
    return np.asarray(likely @ pushes / likely.sum())


def _closed(pitch_mm: float, place_mm: Floats) -> Floats:
    """(n, 2): switches under a finger, in mm."""
    near = pitch_mm * np.round(place_mm / pitch_mm)
    around = near + pitch_mm * np.stack(np.meshgrid((-1, 0, 1), (-1, 0, 1)), axis=-1).reshape(-1, 2)
    return np.asarray(around[np.hypot(*(around - place_mm).T) <= FINGER_MM])


def _fitting(pitch_mm: float, place_mm: Floats) -> Floats:
    """(m, 2): grid places with the same closed switches; none if none closes."""
    closed = {tuple(each) for each in _closed(pitch_mm, place_mm)}
    if not closed:
        return np.empty((0, 2))
    steps = np.arange(-2 * FINGER_MM, 2 * FINGER_MM, STEP_MM)
    tried = np.mean(list(closed), axis=0) + np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    switches = pitch_mm * np.round(place_mm / pitch_mm) + pitch_mm * np.stack(
        np.meshgrid(range(-3, 4), range(-3, 4)), axis=-1
    ).reshape(-1, 2)
    under = np.hypot(*(tried[:, None] - switches).transpose(2, 0, 1)) <= FINGER_MM
    same = under == [tuple(each) in closed for each in switches]
    return np.asarray(tried[same.all(axis=1)])
