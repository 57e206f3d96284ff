"""The least mean barycenter error of any method that sees only closed cells.

Each scene has one contact away from the edge. Scenes with the same cells, up to moves, mirrors and turns, are
indistinguishable: the best estimate is their geometric median, and its mean distance is the floor. Judged on its own
scenes a median gives a lower bound, on others, as a usable method, an upper one. Methods know the spread of closing
forces, not each switch's own.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np

from contactfpga.design.cover import Cover
from contactfpga.skin import Skin
from contactfpga.zones.places import PlaceTable
from contactfpga_sim.lab.chart import errors
from contactfpga_sim.lab.chart.errors import Interval
from contactfpga_sim.model.scenes.contacts import Contact
from contactfpga_sim.model.scenes.families import placements
from contactfpga_sim.model.scenes.scene import Scene

ONE = ("finger", "bumper")
"""Families of one contact that are symmetric under turns and mirrors."""

INNER = 12
"""Side in pitches of the contacts' square."""

FOLDS = 10

DOUBT = 4.0
"""Weight, in scenes, of the barycenter in a median for other scenes."""

ROUNDS = 40

LEAST = 1e-6
"""Distance in pitches below which a median's pull stops growing."""

_MIRRORED = [np.diag(signs) for signs in ((1, 1), (-1, 1), (1, -1), (-1, -1))]
_TURNED = _MIRRORED + [turn[::-1] for turn in _MIRRORED]


@dataclasses.dataclass(frozen=True)
class Floor:
    """Limits on a family of scenes, in mm, over scenes with a closed switch."""

    felt: Interval
    """Share of scenes with a closed switch."""
    barycenter_mm: Interval
    lower_mm: Interval
    upper_mm: Interval
    table_mm: Interval
    """Error of a :class:`PlaceTable` of other scenes, from area and sums."""
    patterns: int


@dataclasses.dataclass(frozen=True)
class Seen:
    """n scenes with a closed switch, in all T turns and mirrors."""

    offsets: np.ndarray
    """(n, T, 2) from the barycenter of closed cells to the contact's, in pitches."""
    patterns: np.ndarray
    """(n, T) int pattern numbers."""
    moments: np.ndarray
    """(n, T, 3) int: area, and column and row sums modulo the area."""


def floor(family: str, skin: Skin, cover: Cover | None, count: int, seed: int, **options: Any) -> Floor:
    """Floor of ``count`` scenes of a family in :data:`ONE`, by the Skin's pitch and connectivity; cover None is a
    bare sheet. Raises ValueError."""
    sheet, scenes = inner(family, skin, cover, count, seed, **options)
    pitch = np.array([skin.pitch_x_mm, skin.pitch_y_mm])
    cells = [scene.pressed(scene.settled_s, sheet, cover) for scene in scenes]
    felt = [(scene, one) for scene, one in zip(scenes, cells, strict=True) if one.any()]
    if not felt:
        raise ValueError(f"none of the {count} scenes closes a switch; there is nothing to place")
    found = seen(felt, sheet)
    barycenters = [
        errors.errors(errors.exact_zones(one, sheet), errors.contacts(scene.truth(scene.settled_s))).barycenter_mm
        for scene, one in felt
    ]
    return Floor(
        felt=errors.interval([float(one.any()) for one in cells]),
        barycenter_mm=errors.interval(barycenters),
        lower_mm=_distances(found.offsets, found.patterns, pitch, 1),
        upper_mm=_distances(found.offsets, found.patterns, pitch, FOLDS),
        table_mm=_distances(found.offsets, numbered(found.moments), pitch, FOLDS),
        patterns=int(found.patterns.max()) + 1,
    )


def place_table(family: str, skin: Skin, cover: Cover | None, count: int, seed: int, **options: Any) -> PlaceTable:
    """The table of :func:`floor`'s scenes, by which a host places zones."""
    sheet, scenes = inner(family, skin, cover, count, seed, **options)
    cells = [(scene, scene.pressed(scene.settled_s, sheet, cover)) for scene in scenes]
    found = seen([(scene, one) for scene, one in cells if one.any()], sheet)
    if not len(found.offsets):
        raise ValueError(f"none of the {count} scenes closes a switch; there is nothing to place")
    keys = np.unique(found.moments.reshape(-1, 3), axis=0)
    pitch = np.array([skin.pitch_x_mm, skin.pitch_y_mm])
    return PlaceTable(pitch, keys, _learned(found.offsets * pitch, numbered(found.moments), len(keys)))


def inner(
    family: str, skin: Skin, cover: Cover | None, count: int, seed: int, **options: Any
) -> tuple[Skin, list[Scene]]:
    if family not in ONE:
        raise ValueError(f"family {family!r} has no floor here; take one of {', '.join(ONE)}")
    contacts = [scene.contacts[0] for scene in placements(family, count, seed, skin, **options)]
    reach = 1e3 * max((part.half_x_m for one in contacts if not callable(one.shape) for part in one.shape), default=0)
    pitch = np.array([skin.pitch_x_mm, skin.pitch_y_mm])
    margin = np.ceil(reach / pitch).astype(int) + 2
    columns, rows = (int(2 * beside + INNER) for beside in margin)
    sheet = Skin(
        rows=rows, columns=columns, pitch_x_mm=skin.pitch_x_mm, pitch_y_mm=skin.pitch_y_mm,
        connectivity=skin.connectivity, settle_us=20.0,
    )  # fmt: skip
    places = (margin - 0.5 + INNER * np.random.default_rng([seed, 1]).random((count, 2))) * pitch
    moved = (_moved(one, *map(float, place)) for one, place in zip(contacts, places, strict=True))
    return sheet, [scene.on_cover(sheet, cover) for scene in moved]


def _moved(contact: Contact, x_mm: float, y_mm: float) -> Scene:
    return Scene((dataclasses.replace(contact, x_mm=x_mm, y_mm=y_mm),))


def seen(felt: Sequence[tuple[Scene, np.ndarray]], skin: Skin) -> Seen:
    """Observations of scenes with (R, C) bool cells, some closed in each."""
    turns = np.array(_TURNED if skin.pitch_x_mm == skin.pitch_y_mm else _MIRRORED)
    pitch = np.array([skin.pitch_x_mm, skin.pitch_y_mm])
    offsets, patterns, moments = [], [], []
    known: dict[Hashable, int] = {}
    for scene, cells in felt:
        contact = scene.truth(scene.settled_s).contacts[0]
        at = np.argwhere(cells)[:, ::-1]
        offset = np.array([contact.x_mm, contact.y_mm]) / pitch - at.mean(axis=0)
        offsets.append(turns @ offset)
        patterns.append([known.setdefault(_pattern(at @ turn.T), len(known)) for turn in turns])
        moments.append([(len(at), *(turn @ at.sum(axis=0) % len(at))) for turn in turns])
    shape = (len(felt), len(turns))
    return Seen(
        np.array(offsets).reshape(*shape, 2), np.array(patterns).reshape(shape), np.array(moments).reshape(*shape, 3)
    )


def _pattern(at: np.ndarray) -> bytes:
    """Key of (n, 2) int cells that ignores position and order."""
    moved = at - at.min(axis=0)
    return np.sort(moved[:, 0] * 1000 + moved[:, 1]).tobytes()


def numbered(values: np.ndarray) -> np.ndarray:
    """(n, T) int number of each distinct value of (n, T, k)."""
    _, numbers = np.unique(values.reshape(-1, values.shape[-1]), axis=0, return_inverse=True)
    return np.reshape(numbers, values.shape[:-1])


def _distances(offsets: np.ndarray, numbers: np.ndarray, pitch_mm: np.ndarray, folds: int) -> Interval:
    places, found = offsets * pitch_mm, np.zeros(len(offsets))
    count = int(numbers.max()) + 1
    if folds == 1:
        medians = geometric_medians(places.reshape(-1, 2), numbers.ravel(), count)
        return errors.interval(np.linalg.norm(places[:, 0] - medians[numbers[:, 0]], axis=1).tolist())
    fold = np.arange(len(offsets)) % folds
    for one in range(folds):
        here = fold == one
        medians = _learned(places[~here], numbers[~here], count)
        found[here] = np.linalg.norm(places[here, 0] - medians[numbers[here, 0]], axis=1)
    return errors.interval(found.tolist())


def _learned(places: np.ndarray, numbers: np.ndarray, count: int) -> np.ndarray:
    """(count, 2) medians of (n, T, 2) places by (n, T) number, shrunk to the barycenter."""
    scenes = np.bincount(numbers.ravel(), minlength=count) / numbers.shape[1]
    medians = geometric_medians(places.reshape(-1, 2), numbers.ravel(), count)
    return medians * (scenes / (scenes + DOUBT))[:, None]


def geometric_medians(places: np.ndarray, numbers: np.ndarray, count: int) -> np.ndarray:
    """(count, 2) geometric medians (Weiszfeld) of (n, 2) places by number; 0 if unused."""
    weights = np.ones(len(places))
    medians = np.zeros((count, 2))
    for _ in range(ROUNDS):
        total = np.bincount(numbers, weights, count)
        sums = np.stack([np.bincount(numbers, weights * along, count) for along in places.T], axis=1)
        medians = np.divide(sums, total[:, None], out=np.zeros((count, 2)), where=total[:, None] > 0)
        weights = 1 / np.maximum(np.linalg.norm(places - medians[numbers], axis=1), LEAST)
    return medians
