"""Zones of very many frames of a sheet whose ends meet, for volume tests: the rules of :mod:`cylinder` for arrays."""

from __future__ import annotations

import numpy as np


def labels(frames: np.ndarray, connectivity: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of (N, R, C) bool frames, (N, R, C) int64 each: for a pressed cell the least index, over all frames, of its
    zone's cells, else -1; on which turn it lies, seen from that cell; and 1 where a neighbor disagrees about that.

    The least label spreads to neighbors, and the turn with it, until nothing changes.
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
    """(n,) int64, of all pressed cells the number of their zone, from 0 to n - 1, and what :func:`labels` says of them:
    what the records say of the turns. ``most``: the sheet's cells."""
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
    """What lies a step further, above the first and below the last row ``outside``."""
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
