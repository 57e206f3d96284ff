"""Ghosts: zones and cells that read pressed on a sheet without diodes because of other pressed switches.

Current takes every path through pressed switches, so a selected row reads pressed in all columns joined with it, also
over other rows. In a frame without changes the joined rows and columns read pressed in all their crossings, a *block*;
blocks share no row or column. Any crossings that join a block may be the really pressed ones. So

- a cell may be a ghost if its block has another row and another column: it is a corner of a rectangle of pressed cells;
- with 4-connectivity a zone is a run of a block's rows times a run of its columns. It may be wholly ghosts if the block
  has another run of rows and another run of columns. Two runs of rows never have one middle, so only zones of one run
  have the same y; likewise columns and x.

Both hold exactly, in both directions. Zones of one block may also have grown or joined by ghosts. A block that is one
zone may hide contacts whose rows and columns, taken together, have no gap.

If a switch changes during the scan, rows scanned before lack the change, and corners may be hidden. But a row is read
at once, so a ghost's own row shows another cell. So in a frame that differs from the previous one every cell or zone
with another in its row is suspect; a ghost is missed only if a switch changes twice between two frames.
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
    frame."""
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
    """Whether each zone of a frame with ``report = "moments"`` and 4-connectivity may be wholly ghosts.

    After ``overflow`` or ``mismatch``, each zone may be.
    """
    moments = frame.moments.tolist()
    if frame.flags & {"overflow", "mismatch"}:
        return [True] * len(moments)
    if before is None or sorted(before.moments.tolist()) != sorted(moments):
        return [len(moments) > 1] * len(moments)
    xs, ys = _middles(moments)
    return [ys[_reduced(y, area)] > 1 and xs[_reduced(x, area)] > 1 for area, x, y in moments]


def labelled(frame: Frame, before: Frame | None, numbers: np.ndarray) -> list[bool]:
    """Whether each zone of a frame with ``report = "cells"`` may be wholly ghosts; ``numbers``: zone of each cell, from
    1.

    With 8-connectivity a zone may be wholly ghosts if each of its edge-connected parts may.
    """
    assert frame.bitmap is not None
    parts = labels.label(frame.bitmap, 4)
    found = zones(_as_moments(frame, parts), None if before is None else _as_moments(before))
    real = ~np.array([False, *found])[parts] & (numbers > 0)
    return [not real[numbers == number].any() for number in range(1, int(numbers.max(initial=0)) + 1)]


def _as_moments(frame: Frame, parts: np.ndarray | None = None) -> Frame:
    if frame.bitmap is None:
        return frame
    return dataclasses.replace(frame, moments=labels.moments(labels.label(frame.bitmap, 4) if parts is None else parts))


def spread(frame: Frame, before: Frame | None = None) -> bool:
    """Whether zones of a frame with ``report = "moments"`` may include ghosts."""
    suspects = zones(frame, before)
    return any(suspects) or (
        len(suspects) > 1
        and any(number > 1 for middles in _middles(frame.moments.tolist()) for number in middles.values())
    )


def _middles(moments: list[list[int]]) -> list[Counter[tuple[int, int]]]:
    return [Counter(_reduced(sums[axis], sums[0]) for sums in moments) for axis in (1, 2)]


def _reduced(total: int, area: int) -> tuple[int, int]:
    shared = math.gcd(total, area)
    return total // shared, area // shared
