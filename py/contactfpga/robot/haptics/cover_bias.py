"""Distance of a zone's barycenter from the indentation body under a known cover, by the number of cells and the push.

The same push closes one switch in the middle of a cell, and several between cells.
"""

from __future__ import annotations

import math

import numpy as np

from contactfpga.design.cover import BODIES, Cells, Cover, Load

RADII_M = (0.005, 0.01, 0.02)
"""R* of indentation balls, equally often: a pencil's end, a fingertip, a thumb."""

SIDE = 6
"""Places along each side of a quarter cell."""

LINES = 9
"""Rows and columns of the computed sheet, pressed in its middle."""

STEP = 1.25
"""Ratio of successive pushes in the table."""


class CoverBias:
    """Barycenters under one cover. Raises :class:`~contactfpga.cover.CoverError` for a cover that knows no force or
    does not fit the pitch."""

    def __init__(self, cover: Cover, pitch_x_m: float, pitch_y_m: float):
        self._cells = Cells(cover, LINES, LINES, pitch_x_m, pitch_y_m)
        self._pitches_m = pitch_x_m, pitch_y_m
        rigid = BODIES["rigid"]
        self._balls = [self._cells.indentation([rigid.ball(radius)], rigid) for radius in RADII_M]
        self._tables: dict[int, dict[int, float]] = {}

    def sigma_m(self, cells: int, force_n: float) -> float | None:
        """Standard deviation of each coordinate, over all places where a ball with about this push closes this many
        switches; None if no such place is known."""
        if not force_n > 0:
            return None
        step = round(math.log(force_n) / math.log(STEP))
        if step not in self._tables:
            self._tables[step] = self._table(STEP**step)
        return self._tables[step].get(cells)

    def _table(self, force_n: float) -> dict[int, float]:
        squares: dict[int, list[float]] = {}
        for ball in self._balls:
            (part,) = ball.parts_at(ball.depth_m(force_n))
            for x, y in self._places():
                rows, columns = np.nonzero(self._cells.closed([Load((part.placed(x, y, 0.0),), force_n)]))
                if len(rows):
                    off_x, off_y = columns.mean() * self._pitches_m[0] - x, rows.mean() * self._pitches_m[1] - y
                    squares.setdefault(len(rows), []).append(float(off_x * off_x + off_y * off_y) / 2)
        return {count: math.sqrt(sum(each) / len(each)) for count, each in squares.items()}

    def _places(self) -> list[tuple[float, float]]:
        shares = (np.arange(SIDE) + 0.5) / SIDE / 2
        x, y = (((LINES // 2 + shares) * pitch).tolist() for pitch in self._pitches_m)
        return [(one, other) for one in x for other in y]
