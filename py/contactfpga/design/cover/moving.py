"""Forces on the switches under a body that moves: computed once for places and depths, and taken between them."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence

import numpy as np

from contactfpga.design.cover.answer import positive
from contactfpga.design.cover.cells import BEYOND, NEIGHBORS, Cells
from contactfpga.design.cover.layers import Body
from contactfpga.design.cover.numerics import Floats
from contactfpga.design.cover.patch import Part
from contactfpga.design.cover.press import Cover, Load

PLACES = 48
"""Places per pitch in each direction."""

FINE, SHALLOW_M = 1.1, 1e-6
"""Ratio of successive depths, and the first of them."""

GROWN = 1.6
"""Half axes of the largest patch, over those at the body's depth."""


class MovingBody:
    """A body on a sheet of ``shape`` (rows, columns) switches; ``closed``: whether the last column is a neighbor of the
    first. Caps at an edge give way as if the sheet went on. Raises CoverError like
    :meth:`~contactfpga.design.cover.press.Cover.indentation`."""

    def __init__(
        self,
        cover: Cover,
        shape: tuple[int, int],
        pitches_m: tuple[float, float],
        parts: Sequence[Part],
        body: Body,
        closed: bool = False,
    ):
        pitch_x_m, pitch_y_m = pitches_m
        self.indentation = cover.indentation(parts, body, pitch_x_m, pitch_y_m)
        self._shape, self._pitches, self._closed = shape, (pitch_y_m, pitch_x_m), closed
        reach_m = GROWN * max(max(part.half_box_m) for part in parts) + BEYOND * cover.thickness_m * (not cover.cut)
        more = 1 + NEIGHBORS * cover.gives_way
        self._around = math.ceil(reach_m / min(positive("pitch", one, "m") for one in pitches_m)) + more
        across = 2 * self._around + 1
        self._cells = Cells(cover, across, across, pitch_x_m, pitch_y_m)
        self._shares = functools.lru_cache(maxsize=8192)(self._computed)

    def forces_n(self, x_m: float, y_m: float, force_n: float) -> Floats:
        """(rows, columns) force on each switch, of the body's force at a place, 0 or above."""
        found = np.zeros(self._shape)
        if not force_n > 0:
            return found
        depth = max(SHALLOW_M, self.indentation.depth_m(force_n))
        level, deeper = math.floor(place := math.log(depth / SHALLOW_M) / math.log(FINE)), place % 1
        (row, down), (column, across) = (divmod(at / pitch * PLACES, 1) for at, pitch in zip((y_m, x_m), self._pitches))
        first = np.round(row / PLACES), np.round(column / PLACES)
        total = np.zeros(self._cells.shape)
        for i, j, k in itertools.product((0, 1), repeat=3):
            weight = abs(1 - i - down) * abs(1 - j - across) * abs(1 - k - deeper)
            if weight:
                place_of = int(row + i - PLACES * first[0]), int(column + j - PLACES * first[1])
                total += weight * self._shares(*place_of, level + k)
        reach = np.arange(-self._around, self._around + 1)
        rows, columns = int(first[0]) + reach, int(first[1]) + reach
        columns = columns % self._shape[1] if self._closed else columns
        there = np.ix_((rows >= 0) & (rows < self._shape[0]), (columns >= 0) & (columns < self._shape[1]))
        np.add.at(found, np.ix_(rows[there[0].ravel()], columns[there[1].ravel()]), force_n * total[there])
        return found

    def _computed(self, row: int, column: int, level: int) -> Floats:
        """Shares on the switches around one, at a place in parts of a pitch from it."""
        parts = self.indentation.parts_at(SHALLOW_M * FINE**level)
        y_m, x_m = (pitch * (self._around + at / PLACES) for pitch, at in zip(self._pitches, (row, column)))
        return self._cells.forces_n([Load(tuple(part.placed(x_m, y_m, 0.0) for part in parts), 1.0)])
