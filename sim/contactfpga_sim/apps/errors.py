"""Distances of a method's zones from contacts and from pressed cells."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.stats import binom

from contactfpga.design.cover import Cover
from contactfpga.skin import Skin
from contactfpga_sim.model.golden import label, zones
from contactfpga_sim.model.golden.frame import barycenter
from contactfpga_sim.model.scenes.scene import Scene
from contactfpga_sim.model.scenes.truth import Truth

Z95 = 1.959963984540054


@dataclasses.dataclass(frozen=True)
class Blob:
    area_mm2: float
    x_mm: float
    y_mm: float


Look = tuple[np.ndarray, list[Blob]]
"""(R, C) bool pressed cells, and true contacts."""


@dataclasses.dataclass(frozen=True)
class Errors:
    """Errors of the blobs found in a scene."""

    miscounted: bool
    missed: float
    barycenter_mm: float
    """Mean distance of matched pairs; NaN without pairs."""
    area: float
    """Mean area difference over the true area; NaN without pairs."""


METRICS = tuple(field.name for field in dataclasses.fields(Errors))


def errors(found: Sequence[Blob], there: Sequence[Blob]) -> Errors:
    """Errors for the pairing with the least sum of distances."""
    pairs = _pairs(found, there)
    distances = [math.dist((one.x_mm, one.y_mm), (other.x_mm, other.y_mm)) for one, other in pairs]
    areas = [abs(one.area_mm2 - other.area_mm2) / other.area_mm2 for one, other in pairs]
    return Errors(
        miscounted=len(found) != len(there),
        missed=1 - len(pairs) / len(there) if there else 0.0,
        barycenter_mm=float(np.mean(distances)) if pairs else math.nan,
        area=float(np.mean(areas)) if pairs else math.nan,
    )


def _pairs(found: Sequence[Blob], there: Sequence[Blob]) -> list[tuple[Blob, Blob]]:
    if not found or not there:
        return []
    places = [np.array([(one.x_mm, one.y_mm) for one in blobs]) for blobs in (found, there)]
    distance = np.linalg.norm(places[0][:, None] - places[1][None], axis=2)
    return [(found[i], there[j]) for i, j in zip(*linear_sum_assignment(distance), strict=True)]


def contacts(truth: Truth) -> list[Blob]:
    return [Blob(one.area_mm2, one.x_mm, one.y_mm) for one in truth.contacts]


def look(scene: Scene, seconds: float, skin: Skin, cover: Cover | None = None) -> Look:
    return scene.pressed(seconds, skin, cover), contacts(scene.truth(seconds, skin))


def exact_zones(cells: np.ndarray, skin: Skin) -> list[Blob]:
    """Connected pieces of (R, C) bool cells, by the Skin's connectivity."""
    return [_blob(moments, skin) for moments in zones(cells, skin.connectivity)]


def method_zones(cells: np.ndarray, skin: Skin) -> list[Blob]:
    """Zones by the labeller, or the host's with ``report = "cells"``; rounded if the board divides."""
    if skin.report == "cells":
        return exact_zones(cells, skin)
    work = label.labelling(cells, skin.connectivity, skin.labeller)
    blob = _rounded if skin.report == "barycenter" else _blob
    return [blob((zone.area, zone.sum_x, zone.sum_y), skin) for zone in work.departures]


def _blob(moments: tuple[int, int, int], skin: Skin) -> Blob:
    area, sum_x, sum_y = moments
    cell = skin.pitch_x_mm * skin.pitch_y_mm
    return Blob(area * cell, sum_x / area * skin.pitch_x_mm, sum_y / area * skin.pitch_y_mm)


def _rounded(moments: tuple[int, int, int], skin: Skin) -> Blob:
    area, *sums = moments
    x, y = (barycenter(total, area, skin.barycenter_bits) / 2**skin.barycenter_bits for total in sums)
    return Blob(area * skin.pitch_x_mm * skin.pitch_y_mm, x * skin.pitch_x_mm, y * skin.pitch_y_mm)


@dataclasses.dataclass(frozen=True)
class Interval:
    """A mean with its 95 % interval."""

    mean: float
    low: float
    high: float
    count: int


def interval(values: Sequence[float]) -> Interval:
    """Interval of values without NaN: normal, or Wilson's for shares 0 or 1."""
    known = np.array([value for value in values if not math.isnan(value)], float)
    n = len(known)
    if not n:
        return Interval(math.nan, math.nan, math.nan, 0)
    mean = float(known.mean())
    if np.isin(known, (0.0, 1.0)).all():
        center = (mean + Z95**2 / (2 * n)) / (1 + Z95**2 / n)
        half = Z95 / (1 + Z95**2 / n) * math.sqrt(mean * (1 - mean) / n + Z95**2 / (4 * n**2))
        return Interval(mean, max(0.0, center - half), min(1.0, center + half), n)
    half = Z95 * float(known.std(ddof=1)) / math.sqrt(n) if n > 1 else math.inf
    return Interval(mean, mean - half, mean + half, n)


@dataclasses.dataclass(frozen=True)
class Quantile:
    value: float
    low: float
    high: float
    """Upper end of the interval; infinite if there are too few values."""
    count: int


def quantile(values: Sequence[float], share: float) -> Quantile:
    """Least value that at least this share does not exceed; infinite values count. The interval is by ranks
    (binomial), for any distribution."""
    ordered = sorted(values)
    n = len(ordered)
    if not n:
        return Quantile(math.nan, math.nan, math.nan, 0)
    lower, upper = (int(binom.ppf(end, n, share)) for end in (0.025, 0.975))
    low = ordered[lower - 1] if lower else 0.0  # times are not negative
    high = ordered[upper] if upper < n else math.inf
    return Quantile(ordered[max(1, math.ceil(share * n - 1e-9)) - 1], low, high, n)
