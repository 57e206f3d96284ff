"""Zones and cells of a sheet without diodes that other pressed switches may have made.

Without diodes a current takes every path through pressed switches: a selected row reads pressed in all columns joined
with it, also over other rows. In a frame without changes the rows and columns so joined read pressed in all of their
crossings, a *block*; blocks share no row or column. The really pressed cells of a block are unknown: any of its
crossings that join it. So

- a cell may be a ghost if its block has another row and another column, that is, if it is a corner of a rectangle whose
  other corners are pressed, too;
- with 4-connectivity a zone is a run of a block's rows times a run of its columns, and it may be wholly made of ghosts
  if the block has another run of rows and another run of columns. Zones of one run of rows have the same y, others
  never do, as two runs with one middle would overlap; likewise columns and x.

Both hold exactly, in both directions. Zones of one block may also have grown, or been joined, by ghosts; they are found
by their common x or y. Invisible is a block that is one zone: contacts may hide in it whose rows and columns, taken
together, have no gap.

If a switch changes during the scan, the rows before it do not show it yet, and corners may be hidden in that frame. A
row itself is read at once, so a ghost's own row shows another cell. So in a frame that differs from the previous one,
everything that may have a neighbor in its row is suspect: no ghost is missed unless a switch changes twice between two
frames.
"""

from __future__ import annotations

import dataclasses
import math
from collections import Counter

import numpy as np

from contactfpga.wire.protocol import Frame
from contactfpga.zones import labels


def cells(frame: Frame, before: Frame | None = None) -> np.ndarray:
    """(rows, columns) bool: cells of a frame with ``report = "cells"`` that may be ghosts; ``before``: the previous
    frame, or None."""
    assert frame.bitmap is not None
    pressed = frame.bitmap.astype(np.int64)
    in_row = pressed.sum(axis=1, keepdims=True)
    if before is None or before.bitmap is None or not np.array_equal(before.bitmap, frame.bitmap):
        return np.asarray(frame.bitmap & (in_row > 1))
    in_column = pressed.sum(axis=0, keepdims=True)
    # Ways of three pressed cells from a row to a column, less those that go back in the cell's own row or column.
    corners = pressed @ pressed.T @ pressed - in_row - in_column + 1
    return np.asarray(frame.bitmap & (corners > 0))


def zones(frame: Frame, before: Frame | None = None) -> list[bool]:
    """For each zone of a frame with ``report = "moments"`` and 4-connectivity whether it may be wholly made of ghosts.

    If zones are missing or wrong (``overflow``, ``mismatch``), each may be.
    """
    moments = frame.moments.tolist()
    if frame.flags & {"overflow", "mismatch"}:
        return [True] * len(moments)
    if before is None or sorted(before.moments.tolist()) != sorted(moments):
        return [len(moments) > 1] * len(moments)
    xs, ys = _middles(moments)
    return [ys[_reduced(y, area)] > 1 and xs[_reduced(x, area)] > 1 for area, x, y in moments]


def labelled(frame: Frame, before: Frame | None, numbers: np.ndarray) -> list[bool]:
    """For each zone of a frame with ``report = "cells"`` whether it may be wholly made of ghosts; ``numbers``: zone
    numbers by cell, from 1.

    With 8-connectivity a zone may be so made if all its edge-connected parts may.
    """
    assert frame.bitmap is not None
    parts = labels.label(frame.bitmap, 4)
    found = zones(_as_moments(frame, parts), None if before is None else _as_moments(before))
    real = ~np.array([False, *found])[parts] & (numbers > 0)
    return [not real[numbers == number].any() for number in range(1, int(numbers.max(initial=0)) + 1)]


def _as_moments(frame: Frame, parts: np.ndarray | None = None) -> Frame:
    """The frame with the 4-connected zones of its bitmap."""
    if frame.bitmap is None:
        return frame
    return dataclasses.replace(frame, moments=labels.moments(labels.label(frame.bitmap, 4) if parts is None else parts))


def spread(frame: Frame, before: Frame | None = None) -> bool:
    """Whether some zones of such a frame may include ghosts made by switches elsewhere."""
    suspects = zones(frame, before)
    return any(suspects) or (
        len(suspects) > 1
        and any(number > 1 for middles in _middles(frame.moments.tolist()) for number in middles.values())
    )


def _middles(moments: list[list[int]]) -> list[Counter[tuple[int, int]]]:
    """Number of zones with each x, and each y."""
    return [Counter(_reduced(sums[axis], sums[0]) for sums in moments) for axis in (1, 2)]


def _reduced(total: int, area: int) -> tuple[int, int]:
    """total / area as a reduced fraction, for exact comparison."""
    shared = math.gcd(total, area)
    return total // shared, area // shared
