"""Zones and labeller clocks of very many (N, R, C) bool frames at once."""

from __future__ import annotations

import dataclasses

import numpy as np

from contactfpga.choices import labellers
from contactfpga.choices.labellers import Labeller, LabellerName
from contactfpga_sim.model.golden.zones import LabellerRule

_AT_ONCE = 1 << 21  # cells worked at a time: bounds the memory


@dataclasses.dataclass(frozen=True)
class Departures:
    """Zones of N frames, n in all; those of frame i are at ``offsets[i]`` to ``offsets[i + 1] - 1``."""

    offsets: np.ndarray
    """(N + 1,) int64."""
    row: np.ndarray
    """(n,) int64: row worked while the zone leaves."""
    clock: np.ndarray
    """(n,) int64: clocks from that row's handover until the zone leaves."""
    moments: np.ndarray
    """(n, 3) int64: area, sum x, sum y in cells, in order of departure within a frame; on closed sheets (n, 4), with
    :func:`contactfpga_sim.model.golden.zones.turned`."""

    extents: np.ndarray
    """(n, 4) int64: smallest and largest column, smallest and largest row, in the same order; on closed sheets with
    the columns of :func:`contactfpga_sim.model.golden.zones.closed_pieces`."""

    def sorted_moments(self) -> np.ndarray:
        """Moments, sorted by area, sum x, sum y within each frame."""
        area, sum_x, sum_y = self.moments.T[:3]
        return self.moments[np.lexsort((sum_y, sum_x, area, self.frame))]

    @property
    def frame(self) -> np.ndarray:
        """(n,) int64: the frame of each zone."""
        return np.repeat(np.arange(len(self.offsets) - 1), np.diff(self.offsets))


def all_departures(
    frames: np.ndarray, connectivity: int, labeller: LabellerName | Labeller = "run", closed: bool = False
) -> Departures:
    """All zones of (N, R, C) bool frames, with their departures."""
    frames = np.asarray(frames, bool)
    count, rows, columns = frames.shape
    chunk = max(1, _AT_ONCE // (rows * columns))
    parts = [_departures(frames[i : i + chunk], connectivity, labeller, closed) for i in range(0, count, chunk)]
    numbers = [np.diff(part.offsets) for part in parts]
    return Departures(
        offsets=np.concatenate([[0], np.cumsum(np.concatenate(numbers or [np.zeros(0, int)]))]),
        row=np.concatenate([np.zeros(0, int), *(part.row for part in parts)]),
        clock=np.concatenate([np.zeros(0, int), *(part.clock for part in parts)]),
        moments=np.concatenate([np.zeros((0, 3 + closed), int), *(part.moments for part in parts)]),
        extents=np.concatenate([np.zeros((0, 4), int), *(part.extents for part in parts)]),
    )


def row_clocks(
    frames: np.ndarray, connectivity: int, labeller: LabellerName | Labeller = "run", closed: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """(N, R) int64 each: clocks from a row of (N, R, C) bool frames to the next one, and to the end mark after a last
    row."""
    return _clocks(np.asarray(frames, bool), connectivity, labeller, closed)[1:]


def last_record_clocks(
    frames: np.ndarray, connectivity: int, labeller: LabellerName | Labeller = "run", closed: bool = False
) -> np.ndarray:
    """(N,) int64: clocks from a frame's last row to its last later record; 0 without one."""
    found = all_departures(frames, connectivity, labeller, closed)
    result = np.zeros(len(frames), int)
    final = found.row == frames.shape[1] - 1
    np.maximum.at(result, found.frame[final], found.clock[final])
    return result


def min_labels(frames: np.ndarray, connectivity: int) -> np.ndarray:
    """(N, R, C) int64: for a pressed cell the least index, over all frames, of its zone's cells, else -1."""
    count, rows, columns = frames.shape
    index = np.arange(frames.size).reshape(frames.shape)
    nothing = frames.size
    padded = np.full((count, rows + 2, columns + 2), nothing)
    inner = padded[:, 1:-1, 1:-1]
    inner[...] = np.where(frames, index, nothing)
    steps = [(dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if connectivity == 8 or dy == 0 or dx == 0]
    while True:
        around = [padded[:, 1 + dy : 1 + dy + rows, 1 + dx : 1 + dx + columns] for dy, dx in steps]
        least = np.where(frames, np.minimum.reduce(around), nothing)
        if np.array_equal(least, inner):
            return np.where(frames, inner, -1)
        inner[...] = np.append(least.ravel(), nothing)[least]


def _clocks(
    frames: np.ndarray, connectivity: int, labeller: LabellerName | Labeller, closed: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rule: LabellerRule = labellers.find(labeller).load_golden()
    rule = rule.closed or rule if closed else rule
    assert rule.strips is not None, f"{labeller} has no rule for many frames at once"
    return rule.strips(frames, connectivity)


def _departures(frames: np.ndarray, connectivity: int, labeller: LabellerName | Labeller, closed: bool) -> Departures:
    count, rows, columns = frames.shape
    labels, turns, disagree = closed_labels(frames, connectivity) if closed else _flat(frames, connectivity)
    roots, zone = np.unique(labels[frames], return_inverse=True)
    frame, y, x = np.nonzero(frames)
    total = len(roots)
    last_row = np.zeros(total, int)
    np.maximum.at(last_row, zone, y)
    leaves = np.minimum(last_row + 1, rows - 1)
    last_clock = _clocks(frames, connectivity, labeller, closed)[0]
    clock = np.zeros(total, int)
    for place in (0, 1):  # the zone's cells in the row before the one worked, and in that row itself
        near = y == leaves[zone] - 1 + place
        np.maximum.at(clock, zone[near], last_clock[frame[near], leaves[zone[near]], x[near]])
    fields = [np.bincount(zone, weight, total) for weight in (np.ones(len(y)), x, y)]
    if closed:
        fields.append(turned(zone, turns[frames], disagree[frames], rows * columns))
    moments = np.stack(fields, axis=1)
    unwrapped = x + columns * turns[frames]
    left, right = _range(unwrapped, zone, total)
    whole = (right - left >= columns) | (np.bincount(zone, disagree[frames], total) > 0) & closed
    left, right = np.where(whole, 0, left % columns), np.where(whole, columns - 1, right % columns)
    extents = np.stack([left, right, *_range(y, zone, total)], axis=1)
    owner = roots // (rows * columns)
    order = np.lexsort((clock, leaves, owner))
    offsets = np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=count))])
    return Departures(offsets, leaves[order], clock[order], moments.astype(int)[order], extents[order])


def _range(places: np.ndarray, zone: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    least, most = np.full(count, places.max(initial=0)), np.full(count, places.min(initial=0))
    np.minimum.at(least, zone, places)
    np.maximum.at(most, zone, places)
    return least, most


def _flat(frames: np.ndarray, connectivity: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    turns = np.zeros(frames.shape, int)
    return min_labels(frames, connectivity), turns, turns


def closed_labels(frames: np.ndarray, connectivity: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """:func:`min_labels` on a closed sheet; the turn of the cell with that label, seen from each cell; and 1 where a
    neighbor disagrees. (N, R, C) int64 each."""
    nothing = frames.size
    least = np.where(frames, np.arange(nothing).reshape(frames.shape), nothing)
    turns = np.zeros(frames.shape, int)
    steps = [(dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if connectivity == 8 or (dy == 0) != (dx == 0)]
    changes = True
    while changes:
        changes = False
        for step in steps:
            other, turn = _beside(least, step, nothing), _beside(turns, step, 0) - _crossed(frames, step)
            nearer = frames & (other < least)
            if nearer.any():
                changes = True
                least, turns = np.where(nearer, other, least), np.where(nearer, turn, turns)
    disagree = np.zeros(frames.shape, int)
    for step in steps:
        turn = _beside(turns, step, 0) - _crossed(frames, step)
        disagree |= frames & _beside(frames, step, 0).astype(bool) & (turn != turns)
    return np.where(frames, least, -1), turns, disagree


def turned(zone: np.ndarray, turns: np.ndarray, disagree: np.ndarray, most: int) -> np.ndarray:
    """(n,) int64: turns of each zone as in its record, from the pressed cells' zones, 0 to n - 1, and other results of
    :func:`closed_labels`. ``most``: the sheet's cells."""
    count = int(zone.max(initial=-1)) + 1
    lowest, highest = np.full(count, len(turns)), np.full(count, -len(turns))
    np.minimum.at(lowest, zone, turns)
    np.maximum.at(highest, zone, turns)
    area = np.bincount(zone, minlength=count)
    upper = np.bincount(zone, turns > lowest[zone], count).astype(int)
    upper[highest - lowest > 1] = (1 << most.bit_length()) - 1
    ring = np.bincount(zone, disagree, count) > 0
    upper[ring] = area[ring]
    return upper


def _beside(cells: np.ndarray, step: tuple[int, int], outside: int) -> np.ndarray:
    dy, dx = step
    found = np.roll(cells, -dx, axis=2).astype(int)
    if dy:
        found = np.roll(found, -dy, axis=1)
        found[:, -1 if dy > 0 else 0] = outside
    return found


def _crossed(frames: np.ndarray, step: tuple[int, int]) -> np.ndarray:
    """(C,) int64: 1 where the step goes over the seam to the next turn, -1 where it goes to the one before."""
    crossed = np.zeros(frames.shape[2], int)
    if step[1]:
        crossed[-1 if step[1] > 0 else 0] = step[1]
    return crossed
