"""Number, size and place of contacts, from their continuous shapes alone.

Overlapping or touching parts are one contact. A row of constant y cuts each convex part in one interval; the union of
intervals is integrated over y by Gauss-Legendre between all beginnings, ends, corners and crossings of outlines. The
error is at most 1e-7 of the area, unless two outlines cross twice between adjacent :data:`SAMPLES`.

A closed sheet, laid flat, repeats, as do its contacts.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from contactfpga.design.cover import Load, Part

TOUCH_M = 1e-9
"""Largest gap of parts that count as one contact, in spite of rounding."""

SAMPLES = 65
"""Heights per stretch compared for crossings of outlines."""

NODES = 24
"""Gauss-Legendre nodes per stretch without a crossing."""


class TrueContact(NamedTuple):
    """One contact."""

    area_mm2: float
    x_mm: float
    """Barycenter along the columns; column 0 is at 0. NaN for a contact all around."""
    y_mm: float
    """Barycenter along the rows; row 0 is at 0."""


@dataclasses.dataclass(frozen=True)
class Truth:
    """Contacts at one instant, ordered by y, x and area like :class:`contactfpga.Zones`."""

    contacts: tuple[TrueContact, ...]

    @property
    def count(self) -> int:
        """Number of contacts."""
        return len(self.contacts)

    @property
    def area_mm2(self) -> float:
        """Total area of the contacts."""
        return math.fsum(contact.area_mm2 for contact in self.contacts)


class Box(NamedTuple):
    """A rectangle along the axes, in m."""

    left: float = -math.inf
    right: float = math.inf
    top: float = -math.inf
    bottom: float = math.inf


def truth_of(parts: Sequence[Part], box: Box = Box()) -> Truth:  # noqa: B008, a tuple that cannot change
    """Contacts of these parts within the box."""
    groups = _groups([part for part in parts if lies_in(part, box)], box)
    return in_order(measured(group, box) for group in groups)


def in_order(contacts: Iterable[tuple[float, float, float]]) -> Truth:
    """Truth of contacts with these areas in m2 and barycenters in m."""
    found = [TrueContact(area * 1e6, x * 1e3, y * 1e3) for area, x, y in contacts if area > 0]
    return Truth(tuple(sorted(found, key=lambda one: (one.y_mm, one.x_mm, one.area_mm2))))


def _heights(part: Part, box: Box) -> tuple[float, float]:
    half = part.half_box_m[1]
    return max(part.y_m - half, box.top), min(part.y_m + half, box.bottom)


def widths(part: Part, box: Box) -> tuple[float, float]:
    """Extent along the columns, in m."""
    half = part.half_box_m[0]
    return max(part.x_m - half, box.left), min(part.x_m + half, box.right)


def lies_in(part: Part, box: Box) -> bool:
    """Whether any of a part is in the box."""
    return distance_m([part], box) < 0


def _groups(parts: Sequence[Part], box: Box) -> list[list[Part]]:
    groups: list[list[Part]] = []
    for part in parts:
        joined = [group for group in groups if any(distance_m([part, other], box) <= TOUCH_M for other in group)]
        groups = [group for group in groups if not any(group is one for one in joined)]
        groups.append([part, *(other for group in joined for other in group)])
    return groups


def distance_m(parts: Sequence[Part], box: Box) -> float:
    """Below 0 if all parts share a point in the box; else a distance along x or y in m.

    The distance is convex over y, so bisection finds its minimum.
    """
    low = max(_heights(part, box)[0] for part in parts)
    high = min(_heights(part, box)[1] for part in parts)
    beside = max(widths(part, box)[0] for part in parts) - min(widths(part, box)[1] for part in parts)
    if low - high > TOUCH_M or beside > TOUCH_M:
        return max(low - high, beside)
    if low > high:
        low = high = (low + high) / 2
    while True:
        y = np.linspace(low, high, 33)
        gaps = _gaps(parts, box, y)
        best = int(gaps.argmin())
        low, high = y[max(best - 1, 0)], y[min(best + 1, len(y) - 1)]
        if gaps[best] < 0 or high - low < 1e-15:
            return float(gaps[best])


def _gaps(parts: Sequence[Part], box: Box, y: np.ndarray) -> np.ndarray:
    left, right = np.full(y.shape, box.left), np.full(y.shape, box.right)
    for part in parts:
        half = part.half_box_m[1]
        enters, leaves = part.span(np.clip(y, part.y_m - half * (1 - 1e-15), part.y_m + half * (1 - 1e-15)))
        left, right = np.maximum(left, enters), np.minimum(right, leaves)
    return left - right


def measured(parts: Sequence[Part], box: Box) -> tuple[float, float, float]:
    """Area in m2 and barycenter in m of the union of these parts within the box."""
    if len(parts) == 1 and _holds(box, parts[0]):
        return parts[0].area_m2, parts[0].x_m, parts[0].y_m
    low = min(_heights(part, box)[0] for part in parts)
    high = max(_heights(part, box)[1] for part in parts)
    ends = [y for part in parts for y in (*_heights(part, box), *part.kinks_m())]
    breaks = sorted({low, high, *(y for y in ends if low < y < high)})
    sums = np.zeros(3)
    for start, end in itertools.pairwise(breaks):
        inner = [start, *_crossings(parts, box, start, end), end]
        for lower, upper in itertools.pairwise(inner):
            sums += _stretch(parts, box, lower, upper)
    area, x, y = map(float, sums)
    return (area, x / area, y / area) if area > 0 else (0.0, 0.0, 0.0)


def _holds(box: Box, part: Part) -> bool:
    half_x, half_y = part.half_box_m
    across = box.left <= part.x_m - half_x and part.x_m + half_x <= box.right
    return across and box.top <= part.y_m - half_y and part.y_m + half_y <= box.bottom


def _outlines(parts: Sequence[Part], box: Box, y: np.ndarray) -> np.ndarray:
    """(curves, heights): beginning and end of each part, and the box's sides if any."""
    curves = [curve for part in parts for curve in part.span(y)]
    curves += [np.full(y.shape, side) for side in (box.left, box.right) if math.isfinite(side)]
    return np.array(curves)


def _crossings(parts: Sequence[Part], box: Box, start: float, end: float) -> list[float]:
    """Heights between which outlines keep their order; each part is cut from start to end or nowhere."""
    middle, half = (start + end) / 2, (end - start) / 2
    active = [part for part in parts if np.isfinite(part.span(np.array(middle))[0])]
    if not active:  # between two parts that hardly touch
        return []
    # Close together at both ends, where round outlines run fast, and just off them, where some begin in one point.
    y = middle - half * np.cos(np.linspace(1e-6, math.pi - 1e-6, SAMPLES))
    curves = _outlines(active, box, y)
    first, second = np.triu_indices(len(curves), 1)
    ahead = curves[first] < curves[second]
    pair, place = np.nonzero(ahead[:, 1:] != ahead[:, :-1])
    if not len(pair):
        return []
    one, other, was = first[pair], second[pair], ahead[pair, place]
    low, high = y[place], y[place + 1]
    column = np.arange(len(pair))
    for _ in range(36):
        tried = (low + high) / 2
        now = _outlines(active, box, tried)
        same = (now[one, column] < now[other, column]) == was
        low, high = np.where(same, tried, low), np.where(same, high, tried)
    return sorted({float(height) for height in (low + high) / 2})


@functools.cache
def _nodes() -> tuple[np.ndarray, np.ndarray]:
    """Heights from -1 to 1 and weights, by a cosine that smooths an ellipse's ends."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    angle = math.pi / 2 * (nodes + 1)
    return -np.cos(angle), math.pi / 2 * weights * np.sin(angle)


def _stretch(parts: Sequence[Part], box: Box, low: float, high: float) -> np.ndarray:
    nodes, weights = _nodes()
    y = (low + high) / 2 + (high - low) / 2 * nodes
    spans = [part.span(y) for part in parts]
    left = np.maximum(np.array([enters for enters, _ in spans]), box.left)
    right = np.minimum(np.array([leaves for _, leaves in spans]), box.right)
    hit = left < right
    order = np.argsort(np.where(hit, left, np.inf), axis=0)
    left, right, hit = (np.take_along_axis(ends, order, axis=0) for ends in (left, right, hit))
    reached = np.maximum.accumulate(np.where(hit, right, -np.inf), axis=0)
    left[1:] = np.maximum(left[1:], reached[:-1])
    hit &= left < right
    left, right = np.where(hit, left, 0), np.where(hit, right, 0)
    length, moment = (right - left).sum(axis=0), ((right - left) * (right + left) / 2).sum(axis=0)
    return (high - low) / 2 * np.array([weights @ length, weights @ moment, weights @ (length * y)])


def all_loads(loads: Sequence[Load], left_m: float, around_m: float) -> list[Load]:
    """Loads on the sheet that begins at ``left_m``, on all turns within a turn of it."""
    box = Box(left_m - around_m, left_m + 2 * around_m)
    return [
        Load(tuple(_moved(part, turn * around_m) for part in load.parts), load.force_n)
        for load in loads
        for turn in sorted({turn for part in load.parts for turn in _turns(part, box, around_m)})
    ]


def truth_around(parts: Sequence[Part], box: Box, around_m: float) -> Truth:
    """Contacts of these parts on a closed sheet that fills the box.

    The x of a contact is from 0 to the circumference; NaN for a contact all around.
    """
    band = Box(top=box.top, bottom=box.bottom)
    return in_order(
        _around(group, box, around_m) if ring else _unrolled(group, band, around_m)
        for group, ring in _groups_around([part for part in parts if lies_in(part, band)], band, around_m)
    )


def on_all_turns(parts: Sequence[Part], box: Box, around_m: float) -> list[Part]:
    """These parts on every turn where they are in the box, or touch its left or right."""
    return [_moved(part, turn * around_m) for part in parts for turn in _turns(part, box, around_m)]


def _unrolled(group: Sequence[Part], band: Box, around_m: float) -> tuple[float, float, float]:
    area, x, y = measured(group, band)
    return area, x % around_m % around_m, y  # what is just below 0 is rounded up to a whole turn


def _around(group: Sequence[Part], box: Box, around_m: float) -> tuple[float, float, float]:
    area, _, y = measured(on_all_turns(group, box, around_m), box)
    return area, math.nan, y


def _groups_around(parts: Sequence[Part], band: Box, around_m: float) -> Iterator[tuple[list[Part], bool]]:
    turns: dict[int, int] = {}
    for seed in range(len(parts)):
        if seed in turns:
            continue
        turns[seed], found, ring = 0, [seed], False
        for one in found:
            for other in range(len(parts)):
                for turn in _meetings(parts[one], parts[other], band, around_m):
                    if other not in turns:
                        turns[other] = turns[one] + turn
                        found.append(other)
                    ring |= turns[other] != turns[one] + turn
        yield [_moved(parts[one], turns[one] * around_m) for one in found], ring


def _meetings(one: Part, other: Part, band: Box, around_m: float) -> list[int]:
    near = _turns(other, Box(*widths(one, band)), around_m)
    return [turn for turn in near if distance_m([one, _moved(other, turn * around_m)], band) <= TOUCH_M]


def _turns(part: Part, box: Box, around_m: float) -> range:
    left, right = widths(part, Box())
    first, last = (box.left - right - TOUCH_M) / around_m, (box.right - left + TOUCH_M) / around_m
    return range(math.ceil(first), math.floor(last) + 1)


def _moved(part: Part, by_m: float) -> Part:
    return part.placed(by_m, 0.0, 0.0)
