"""Zones and labeller timing of very many frames at once, for volume tests.

The rules of :mod:`zones` and :mod:`label`, written independently for (N, R, C) bool frames.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from contactfpga.choices import labellers
from contactfpga.choices.labellers import Labeller, LabellerName
from contactfpga_sim.model.golden.zones import LabellerRule

_AT_ONCE = 1 << 21  # cells worked at a time: bounds the memory


@dataclasses.dataclass(frozen=True)
class Departures:
    """n zones of N frames: frame i owns the places ``offsets[i]`` to ``offsets[i + 1] - 1``."""

    offsets: np.ndarray
    """(N + 1,) int64."""
    row: np.ndarray
    """(n,) int64: the row in work when the zone leaves."""
    clock: np.ndarray
    """(n,) int64: clock of departure after that row's handover."""
    moments: np.ndarray
    """(n, 3) int64: area, sum x, sum y in cells, by departure within a frame. For a sheet whose ends meet (n, 4), with
    :func:`contactfpga_sim.model.golden.zones.turned`."""

    def sorted_moments(self) -> np.ndarray:
        """The moments, sorted by area, sum x, sum y within each frame."""
        area, sum_x, sum_y = self.moments.T[:3]
        return self.moments[np.lexsort((sum_y, sum_x, area, self.frame))]

    @property
    def frame(self) -> np.ndarray:
        """(n,) int64: the frame of each zone."""
        return np.repeat(np.arange(len(self.offsets) - 1), np.diff(self.offsets))


def all_departures(
    frames: np.ndarray, connectivity: int, labeller: LabellerName | Labeller = "run", closed: bool = False
) -> Departures:
    """Every zone of (N, R, C) bool frames, and when it leaves."""
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
    )


def row_clocks(
    frames: np.ndarray, connectivity: int, labeller: LabellerName | Labeller = "run", closed: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """(N, R) int64 each for (N, R, C) bool frames: clocks from a row to the next handover, and to the end mark if it is
    the last."""
    return _clocks(np.asarray(frames, bool), connectivity, labeller, closed)[1:]


def last_record_clocks(
    frames: np.ndarray, connectivity: int, labeller: LabellerName | Labeller = "run", closed: bool = False
) -> np.ndarray:
    """(N,) int64: clocks from a frame's last row to the last record that leaves with it; 0 without any."""
    found = all_departures(frames, connectivity, labeller, closed)
    result = np.zeros(len(frames), int)
    final = found.row == frames.shape[1] - 1
    np.maximum.at(result, found.frame[final], found.clock[final])
    return result


def min_labels(frames: np.ndarray, connectivity: int) -> np.ndarray:
    """(N, R, C) int64: for a pressed cell the least index, over all frames, of its zone's cells, else -1.

    The least label spreads to neighbors until nothing changes; after every round each cell takes the label of the cell
    that its label names, which doubles the range.
    """
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
    owner = roots // (rows * columns)
    order = np.lexsort((clock, leaves, owner))
    offsets = np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=count))])
    return Departures(offsets, leaves[order], clock[order], moments.astype(int)[order])


def _flat(frames: np.ndarray, connectivity: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Labels of a plane, where all is on one turn."""
    turns = np.zeros(frames.shape, int)
    return min_labels(frames, connectivity), turns, turns


def _strips(frames: np.ndarray, connectivity: int) -> tuple[np.ndarray, np.ndarray]:
    """(N, R, C): last step of the cluster of each column; (N, R): all steps of a row."""
    before = np.concatenate([np.zeros_like(frames[:, :1]), frames[:, :-1]], axis=1)
    taken = frames | before
    none = np.zeros(taken.shape[:2], bool)
    steps, begun = np.zeros(none.shape, int), np.zeros(none.shape, int)
    above, new = begun.copy(), begun.copy()
    reached = np.zeros(frames.shape, int)
    joins = []
    for column in range(frames.shape[2]):
        a, b, here = before[..., column], frames[..., column], taken[..., column]
        a_left, b_left, here_left = (array[..., column - 1] if column else none for array in (before, frames, taken))
        joined = here & here_left if connectivity == 8 else (a & a_left) | (b & b_left)
        joins.append(joined)
        begun = np.where(joined, begun, steps)
        above = np.where(joined, above, 0) + (a & ~a_left)
        new = np.where(joined, new, 0) + (b & ~b_left)
        steps = np.where(here, begun + np.maximum(above, new), steps)
        reached[..., column] = steps
    for column in range(frames.shape[2] - 2, -1, -1):
        reached[..., column] = np.where(joins[column + 1], reached[..., column + 1], reached[..., column])
    return reached, steps


def run_clocks(frames: np.ndarray, connectivity: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """``LabellerRule.strips`` of ``run``, for every row of (N, R, C) bool frames."""
    last_step, steps = _strips(frames, connectivity)
    return last_step + 2, steps + 1, steps + 3


def closed_run_clocks(frames: np.ndarray, connectivity: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """:func:`run_clocks` for a sheet whose ends meet: one more step joins the last cluster with the first."""
    last_step, steps = _strips(frames, connectivity)
    before = np.concatenate([np.zeros_like(frames[:, :1]), frames[:, :-1]], axis=1)
    ends = np.stack([before[..., [0, -1]], frames[..., [0, -1]]])  # row before or new row, N, R, first or last column
    joined = ends.any(axis=0).all(axis=-1) if connectivity == 8 else ends.all(axis=-1).any(axis=0)
    steps = steps + joined
    last_step[..., -1] = np.where(joined, steps, last_step[..., -1])
    return last_step + 2, steps + 1, steps + 3


def closed_labels(frames: np.ndarray, connectivity: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For (N, R, C) bool frames, (N, R, C) int64 each: for a pressed cell the least index, over all frames, of its
    zone's cells, else -1; its turn relative to that cell; and 1 where a neighbor disagrees on the turn.

    The least label spreads to neighbors with its turn until nothing changes.
    """
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
    """(n,) int64: turns as in the records, for all pressed cells by zone number, 0 to n - 1, turn and disagreement of
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
    """Neighbors one step away, ``outside`` above the first and below the last row."""
    dy, dx = step
    found = np.roll(cells, -dx, axis=2).astype(int)
    if dy:
        found = np.roll(found, -dy, axis=1)
        found[:, -1 if dy > 0 else 0] = outside
    return found


def _crossed(frames: np.ndarray, step: tuple[int, int]) -> np.ndarray:
    """(C,) int64: 1 if the step crosses the seam to the next turn, -1 to the one before."""
    crossed = np.zeros(frames.shape[2], int)
    if step[1]:
        crossed[-1 if step[1] > 0 else 0] = step[1]
    return crossed


def serial_clocks(frames: np.ndarray, connectivity: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """``LabellerRule.strips`` of ``serial`` for (N, R, C) bool frames: (N, R, C), (N, R) and (N, R) int64."""
    above = np.zeros_like(frames)
    above[:, 1:] = frames[:, :-1]
    above_left, left = (np.pad(cells, ((0, 0), (0, 0), (1, 0)))[..., :-1] for cells in (above, frames))
    more = above & ~above_left
    if connectivity == 4:
        more |= frames & ~left & above_left & ~above
        joined = frames & left | above & above_left
    else:
        joined = (frames | above) & (left | above_left)
    leaves = np.cumsum(1 + more, axis=2) + 1
    busy = leaves[..., -1] + 1
    for column in range(frames.shape[2] - 2, -1, -1):
        leaves[..., column] = np.where(joined[..., column + 1], leaves[..., column + 1], leaves[..., column])
    return leaves * (frames | above), busy, busy


def closed_serial_clocks(frames: np.ndarray, connectivity: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """:func:`serial_clocks` for a sheet whose ends meet."""
    leaves, busy, end = serial_clocks(frames, connectivity)
    before = np.concatenate([np.zeros_like(frames[:, :1]), frames[:, :-1]], axis=1)
    ends = np.stack([before[..., [0, -1]], frames[..., [0, -1]]])  # row before or new row, N, R, first or last column
    seam = 2 * (ends.any(axis=0).all(axis=-1) if connectivity == 8 else ends.all(axis=-1).any(axis=0))
    leaves[..., -1] += seam * (before | frames)[..., -1]
    return leaves, busy + seam, end + seam
