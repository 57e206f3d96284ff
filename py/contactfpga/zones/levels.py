"""Contacts in a map of force levels, found on the host.

The level of a cell is the number of its force thresholds that are reached: 0 at rest. Cells above 0 that touch are a
zone, as on a sheet of switches. A zone is several contacts if parts of it last: followed down from the highest level,
two parts meet at some level, and each rises above that one by a stated number of levels. All other parts belong to one
contact, however many peaks it has.
"""

from __future__ import annotations

import numpy as np

from contactfpga.zones import labels

LASTS = 2
"""Levels by which parts of a zone rise above the level at which they meet, so that they are contacts of their own."""


def label(levels: np.ndarray, connectivity: int, lasts: int) -> np.ndarray:
    """(rows, columns) int64: contact of each cell, from 1; 0 at level 0.

    ``levels``: (rows, columns) integers of at least 0. ``connectivity``: as in :func:`contactfpga.zones.labels.label`.
    ``lasts``: levels, at least 1, by which each of two parts rises above the level at which they meet, so that they
    count as two. With levels of 0 and 1 the contacts are the zones.
    """
    parts = np.zeros(np.shape(levels), np.int64)
    for level in range(int(np.max(levels, initial=0)), 0, -1):
        parts = _grown(labels.label(levels >= level, connectivity), parts, levels, level + lasts)
    return np.unique(np.append(0, parts), return_inverse=True)[1][1:].reshape(parts.shape)


def _grown(zones: np.ndarray, parts: np.ndarray, levels: np.ndarray, least: int) -> np.ndarray:
    """Parts one level lower, whose ``zones`` these are: a zone that holds several parts with a peak of ``least`` is
    shared among them by distance, and any other is one part."""
    peaks = np.zeros(parts.max() + 1, np.int64)
    np.maximum.at(peaks, parts, levels)
    lasting = (parts > 0) & (peaks[parts] >= least)
    owners = np.unique(zones[lasting] * len(peaks) + parts[lasting]) // len(peaks)  # the zone of each lasting part
    grown = zones.copy()
    for zone in np.unique(owners[1:][owners[1:] == owners[:-1]]):
        y, x = np.nonzero(zones == zone)
        box = slice(y.min(), y.max() + 1), slice(x.min(), x.max() + 1)
        within = zones[box] == zone
        grown[box][within] = zones.max() + parts[box].flat[_nearest(within & lasting[box])[within]]
    return grown


def _nearest(seeds: np.ndarray) -> np.ndarray:
    """(rows, columns) int64: place of the nearest seed in row-major order, the first of equally near ones.

    First along each column, then along each row, so that the time is rows x columns x (rows + columns).
    """
    (rows, columns), size = seeds.shape, seeds.size
    y, x = np.arange(rows), np.arange(columns)
    along = np.square(y[:, None] - y) * size + y * columns  # squared distance, then place
    by_column = np.where(seeds, along[:, :, None], size**3).min(axis=1)
    nearest: np.ndarray = (by_column[:, None] + np.square(x[:, None] - x) * size + x).min(axis=2) % size
    return nearest


def moments(levels: np.ndarray, contacts: np.ndarray) -> np.ndarray:
    """(n, 4) int64 of each contact of :func:`label`: area in cells, and the sums over its levels of area, x and y.

    Each level is a layer with the area and sums of a zone of switches. The barycenter of all layers together is the
    second sum, or the third, over the first.
    """
    y, x = np.nonzero(contacts)
    level, sums = levels[y, x], np.zeros((int(np.max(contacts, initial=0)), 4), np.int64)
    np.add.at(sums, contacts[y, x] - 1, np.column_stack([np.ones_like(x), level, level * x, level * y]))
    return sums
