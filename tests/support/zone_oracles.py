"""Zones by scipy: of sheets, of closed sheets on many turns of the sheet side by side, and of labellers that are not
exact."""

import math
from fractions import Fraction

import numpy as np
from scipy import ndimage

from contactfpga import Skin
from contactfpga.choices.labellers import LABELLERS

RULES = [
    (connectivity, name, closed)
    for name, labeller in LABELLERS.items()
    if labeller.exact
    for connectivity in (8, 4)
    for closed in (False, True)[: 1 + labeller.closed]
]
"""(connectivity, labeller, whether the sheet's ends meet) of each exact rule."""
RING, WOUND = -1, -2
"""In place of the sum of the columns."""


def cells_of(picture):
    """(R, C) bool of a line per row, in which # is a pressed cell."""
    return np.array([[mark == "#" for mark in line] for line in picture.split()])


def labeled(frames, connectivity):
    """Labels of the zones in (N, R, C) frames from 1 on, and the number of zones."""
    structure = np.zeros((3, 3, 3), bool)
    structure[1] = ndimage.generate_binary_structure(2, 1 if connectivity == 4 else 2)
    return ndimage.label(frames, structure)


def zones_of_frames(frames, connectivity):
    """Sorted (frame, area, sum x, sum y) of the zones in (N, R, C) frames."""
    labels, count = labeled(frames, connectivity)
    frame, y, x = np.nonzero(labels)
    number = labels[frame, y, x]
    area, frames_of, sum_x, sum_y = (np.bincount(number, each, count + 1)[1:] for each in (None, frame, x, y))
    return sorted(zip(*(column.astype(int).tolist() for column in (frames_of / area, area, sum_x, sum_y)), strict=True))


def zones_by_scipy(cells, connectivity=8):
    """Sorted (area, sum x, sum y) of the zones in a frame."""
    return [zone[1:] for zone in zones_of_frames(cells[None], connectivity)]


def nearest(total, area, bits):
    """The nearest step of 1/2^bits to a zone's sum over its area, half a step upward."""
    return math.floor(Fraction(total * 2**bits, area) + Fraction(1, 2))


def skin_of(rows, columns, connectivity, labeller, closed=False, extent=False):
    around = {"surface": "cylinder", "radius_mm": 20.0, "closed": True} if closed else {}
    rule = {"connectivity": connectivity, "labeller": labeller, "extent": extent}
    return Skin(rows=rows, columns=columns, settle_us=100, zone_capacity=1, **rule, **around)


def zones(frames, connectivity, turns=7):
    """(n, 4) int64, sorted: frame, area, sum of the columns counted on past the seam, sum of the rows, of each zone in
    (N, R, C) frames. Where a zone may not fit on as many turns, its frame is looked at again on twice as many."""
    count, rows, columns = frames.shape
    labels, pieces = labeled(np.tile(frames, turns), connectivity)
    frame, y, x = np.nonzero(labels)
    label, turn, x = labels[frame, y, x], x // columns, x % columns
    cell, middle = y * columns + x, turns // 2
    # Each zone is there many times. It is looked at where its first cell, by rows, lies on the middle turn.
    first = np.full(pieces + 1, frames.size)
    np.minimum.at(first, label, cell)
    chosen = (turn == middle) & (cell == first[label])
    number = np.full(pieces + 1, -1)
    number[label[chosen]] = np.arange(chosen.sum())
    ring = labels[frame[chosen], y[chosen], x[chosen] + (middle + 1) * columns] == label[chosen]
    zone = number[label]
    counts = (zone >= 0) & (~ring[zone] | (turn == middle))  # a ring's cells repeat on each turn
    repeats = (zone >= 0) & ring[zone]
    of_ring = np.unique(zone[repeats] * rows * columns + cell[repeats]) // (rows * columns)
    of_frame, y, x, turn, zone = frame[chosen], y[counts], x[counts], turn[counts], zone[counts]
    lowest, highest = np.full(len(ring), turns), np.full(len(ring), -1)
    np.minimum.at(lowest, zone, turn)
    np.maximum.at(highest, zone, turn)
    area = np.bincount(zone, minlength=len(ring))
    total = np.bincount(zone, x + columns * (turn > lowest[zone]), len(ring)).astype(int)
    place = np.where(ring, RING, np.where(highest - lowest > 1, WOUND, total % (columns * np.maximum(area, 1))))
    found = np.stack([of_frame, area, place, np.bincount(zone, y, len(ring)).astype(int)], axis=1)
    # A tail that winds away from a ring may end on another turn than it does on the middle one.
    cut_off = ring & (np.bincount(of_ring, minlength=len(ring)) != area)
    tight = np.isin(np.arange(count), of_frame[cut_off | ~ring & ((lowest == 0) | (highest == turns - 1))])
    if tight.any():
        again = zones(frames[tight], connectivity, 2 * turns + 1)
        again[:, 0] = np.nonzero(tight)[0][again[:, 0]]
        found = np.concatenate([found[~tight[found[:, 0]]], again])
    return in_order(found)


def of_records(frame, records, columns):
    """The same of (n, 4) records (area, sum x, sum y, turned) and their (n,) frames."""
    area, sum_x, sum_y, turned = np.asarray(records).reshape(-1, 4).T
    place = (sum_x + columns * turned) % (columns * area)
    place = np.where(turned == area, RING, np.where(turned > area, WOUND, place))
    return in_order(np.stack([np.broadcast_to(frame, area.shape), area, place, sum_y], axis=1))


def in_order(found):
    return found[np.lexsort(found.T[::-1])]


def every_frame(rows, columns, first=0, count=None):
    cells = rows * columns
    numbers = np.arange(first, first + (count or 1 << cells), dtype=np.uint32)
    return (numbers[:, None] >> np.arange(cells, dtype=np.uint32) & 1).astype(bool).reshape(-1, rows, columns)


def mazes(rng, rows, columns, count):
    """(count, rows, columns) bool: dots joined at random, in which zones nest deep, and sheared, so that ways wind
    around a cylinder."""
    frames = np.zeros((count, rows, columns), bool)
    for frame in frames:
        across, down, dots = rng.uniform(0.2, 0.6), rng.uniform(0.5, 0.95), rng.uniform(0.8, 1.0)
        chance = np.zeros((rows, columns))
        chance[::2, ::2], chance[::2, 1::2], chance[1::2, ::2] = dots, across, down
        frame[:] = rng.random((rows, columns)) < chance
        lean = rng.choice([-2, -1, 0, 0, 0, 1, 2])
        for y in range(rows):
            frame[y] = np.roll(frame[y], y * lean // 2)
        frame |= rng.random((rows, columns)) < rng.choice([0.0, 0.05])
    return frames


def noise(rng, rows, columns, count):
    """(count, rows, columns) bool: noise of every density."""
    return rng.random((count, rows, columns)) < rng.uniform(0.02, 0.98, (count, 1, 1))


def moments(cells):
    y, x = np.nonzero(cells)
    return len(x), int(x.sum()), int(y.sum())


def zones_by_image_tools(cells, labeller):
    """The zones of a frame by scipy's runs: of the row shadow, and of the column shadow of each."""
    if labeller == "single":
        return [moments(cells)] if cells.any() else []
    bands, count = ndimage.label(cells.any(axis=1))
    found = []
    for band in range(1, count + 1):
        inside = cells & (bands == band)[:, None]
        runs, number = ndimage.label(inside.any(axis=0))
        found += [moments(inside & (runs == run)) for run in range(1, number + 1)]
    return found


# ---- maps of levels

STRUCTURES = {4: ndimage.generate_binary_structure(2, 1), 8: np.ones((3, 3))}


def count(where, levels, floor, lasts, structure):
    """Contacts in the cells ``where``, which are connected from the level ``floor`` on."""
    parts, number = ndimage.label(where & (levels > floor), structure)
    each = [parts == part for part in range(1, number + 1)]
    lasting = [one for one in each if levels[one].max() >= floor + lasts]
    return max(1, sum(count(one, levels, floor + 1, lasts, structure) for one in lasting))


def counted(levels, connectivity, lasts):
    """Contacts in a map of levels, by the tree of its parts."""
    zones, number = ndimage.label(levels > 0, STRUCTURES[connectivity])
    return sum(count(zones == zone, levels, 1, lasts, STRUCTURES[connectivity]) for zone in range(1, number + 1))
