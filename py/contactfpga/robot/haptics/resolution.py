"""How near a barycenter comes to the contact when nothing else is known, and what the set of consistent places gains.

A contact at a random place closes the switches within its reach. Both are computed from all places of a cell.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
from numpy.typing import NDArray

from contactfpga.robot.haptics.answer import Floats

FINENESS = 256
"""Places along each side of a cell."""


@dataclasses.dataclass(frozen=True)
class Static:
    """Errors over all places at which a contact closes a switch, in pitches."""

    barycenter_rms: float
    barycenter_95: float
    """What 95 % of the errors stay below."""
    set_rms: float
    """Of the middle of the set of places that close exactly the same switches."""
    missed: float
    """Share of contacts that close no switch."""


@functools.lru_cache(maxsize=256)
def static(reach: float, pitch_x: float = 1.0, pitch_y: float = 1.0, fineness: int = FINENESS) -> Static:
    """Errors at a reach, in the unit in which reach and pitches are given."""
    places = (np.arange(fineness) + 0.5) / fineness - 0.5
    x, y = (axis.ravel() for axis in np.meshgrid(places * pitch_x, places * pitch_y))
    columns, rows = (int(np.ceil(reach / pitch + 0.5)) for pitch in (pitch_x, pitch_y))
    cells = [
        (column * pitch_x, row * pitch_y) for row in range(-rows, rows + 1) for column in range(-columns, columns + 1)
    ]
    closed = np.stack([(x - cx) ** 2 + (y - cy) ** 2 <= reach * reach for cx, cy in cells])
    count = closed.sum(axis=0)
    hit = count > 0
    x, y, closed, count = x[hit], y[hit], closed[:, hit], count[hit]
    if not len(x):
        return Static(np.nan, np.nan, np.nan, 1.0)
    all_x, all_y = (np.array(axis) for axis in zip(*cells))
    off_x, off_y = all_x @ closed / count - x, all_y @ closed / count - y
    errors = np.hypot(off_x, off_y)
    gained = _of_sets(closed, all_x, all_y, x, y)
    return Static(_rms(errors), float(np.quantile(errors, 0.95)), _rms(gained), float(1 - hit.mean()))


def _of_sets(closed: NDArray[np.bool_], all_x: Floats, all_y: Floats, x: Floats, y: Floats) -> Floats:
    """Distance of each place to the middle of those that close the same switches, also those across a cell's rim: a
    pattern is the same wherever it lies, so places are taken from its first switch."""
    first = closed.argmax(axis=0)
    x, y = x - all_x[first], y - all_y[first]
    # Rows of cells are as long everywhere, so a shifted pattern is the same bits from its first one on.
    length = len(closed)
    from_first = (np.arange(length)[:, None] + first) % length
    patterns = np.take_along_axis(closed, from_first, axis=0)
    packed = np.ascontiguousarray(np.packbits(patterns, axis=0).T)
    keys = packed.view([("", packed.dtype)] * packed.shape[1]).ravel()
    _, group = np.unique(keys, return_inverse=True)
    size = np.bincount(group)
    mean_x, mean_y = np.bincount(group, x) / size, np.bincount(group, y) / size
    return np.hypot(x - mean_x[group], y - mean_y[group])


def _rms(errors: Floats) -> float:
    return float(np.sqrt((errors**2).mean()))


@functools.lru_cache(maxsize=64)
def worst_95(pitch_x: float, pitch_y: float) -> float:
    """A bound in the unit of the pitches: at every reach 95 % of a barycenter's errors stay below it."""
    pitch = max(pitch_x, pitch_y)
    found = [static(pitch * share, pitch_x, pitch_y, 64).barycenter_95 for share in (0.5, 0.6, 0.7, 0.71, 0.8, 1.0)]
    return float(np.nanmax(found))
