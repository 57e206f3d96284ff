"""Distances of a method's zones from contacts and from pressed cells."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from contactfpga.design.cover import Cover
from contactfpga.skin import Skin
from contactfpga_sim.model.golden import label, zones
from contactfpga_sim.model.golden.frame import barycenter
from contactfpga_sim.model.scenes.scene import Scene
from contactfpga_sim.model.scenes.truth import Truth


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
    on = scene.on_cover(skin, cover)
    return on.pressed(seconds, skin, cover), contacts(on.truth(seconds, skin))


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
