"""When the labeller that takes a cell per clock emits its zones: the column rule of docs/timing.md."""

from __future__ import annotations

import numpy as np

from contactfpga_sim.model.golden.zones import flood


def cluster_clocks(strip: np.ndarray, connectivity: int) -> tuple[np.ndarray, int, int]:
    """For the (2, C) cells of two adjacent rows, all in clocks after the one in which the lower was handed over:
    when a zone leaves whose last cluster is that of the cell, when the next row can come, and when an end mark leaves.

    The first is a (2, C) int array, 0 where nothing is pressed.
    """
    labels, count = flood(strip, connectivity)
    columns = [np.nonzero(labels == cluster)[1] for cluster in range(1, count + 1)]
    first, last = [column.min() for column in columns], [column.max() for column in columns]
    clocks = np.ones(strip.shape[1], int)
    for x in range(strip.shape[1]):
        begins = strip[:, x] & ~(strip[:, x - 1] if x else np.zeros(2, bool))
        right_behind = x in first and x - 1 in last
        clocks[x] += begins[0] or (begins[1] and right_behind)
    done = np.cumsum(clocks)  # the clock of a column's last cell or run
    leaves = np.zeros(strip.shape, int)
    for cluster in range(count):
        leaves[labels == cluster + 1] = done[last[cluster]] + 1
    over = int(done[-1]) + 2
    return leaves, over, over


def closed_cluster_clocks(strip: np.ndarray, connectivity: int) -> tuple[np.ndarray, int, int]:
    """The same where the ends meet: two clocks more after the last column if cells are joined over the seam."""
    leaves, busy, end = cluster_clocks(strip, connectivity)
    first, last = strip[:, 0], strip[:, -1]
    seam = 2 if (first.any() and last.any() if connectivity == 8 else (first & last).any()) else 0
    leaves[:, -1][last] += seam
    return leaves, busy + seam, end + seam


def strip_clocks(frames: np.ndarray, connectivity: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same for every row of (N, R, C) bool frames at once: (N, R, C), (N, R) and (N, R) int64."""
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


def closed_strip_clocks(frames: np.ndarray, connectivity: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """:func:`strip_clocks` where the ends meet."""
    leaves, busy, end = strip_clocks(frames, connectivity)
    before = np.concatenate([np.zeros_like(frames[:, :1]), frames[:, :-1]], axis=1)
    ends = np.stack([before[..., [0, -1]], frames[..., [0, -1]]])  # row before or new row, N, R, first or last column
    seam = 2 * (ends.any(axis=0).all(axis=-1) if connectivity == 8 else ends.all(axis=-1).any(axis=0))
    leaves[..., -1] += seam * (before | frames)[..., -1]
    return leaves, busy + seam, end + seam
