"""What each thing known of a contact says about its place."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from contactfpga.robot.haptics.answer import Floats
from contactfpga.robot.haptics.reach import Reach

if TYPE_CHECKING:
    from contactfpga.robot.haptics.locate import Place


ROUNDING = 1e-4
"""Share by which the table of forces may be off."""


CERTAIN = 10.0
"""Standard deviations beyond a threshold at which nothing is left to chance."""


@dataclasses.dataclass(frozen=True)
class Closing:
    """A switch that closed, and the push at that instant: the contact lies on the circle of that push's reach."""

    row: int
    column: int
    force_n: float


@dataclasses.dataclass(frozen=True)
class Known:
    """All that is known of one contact."""

    cells: Sequence[tuple[int, int]]
    force_n: float
    closings: Sequence[Closing]
    center: Place | None
    pitches_m: tuple[float, float]
    lines: tuple[int, int]
    """Rows and columns of the sheet."""
    reach: Reach
    spread: float
    force_sigma_n: float

    def evidence(self, x: Floats, y: Floats, step_m: float) -> tuple[Floats, Floats]:
        """Logarithm of probability and misfit at the places x, y of a grid with this step."""
        chance, misfit = np.zeros(len(x)), np.zeros(len(x))
        when = {(one.row, one.column): one.force_n for one in self.closings}
        for cell in self.cells:
            needed, sigma = self._needed(cell, x, y, step_m)
            if cell in when:
                off = ((when[cell] - needed) / sigma) ** 2
                chance -= 0.5 * off + np.log(sigma)
                misfit += off
            else:
                _one_side((self.force_n - needed) / sigma, chance, misfit)
        for cell in self._open():
            needed, sigma = self._needed(cell, x, y, step_m)
            if float(needed.min()) - self.force_n < CERTAIN * float(sigma.max()):
                _one_side((needed - self.force_n) / sigma, chance, misfit)
        if self.center is not None:
            off = self._from_center(x, y)
            chance -= 0.5 * off
            misfit += off
        return chance, misfit

    def _needed(self, cell: tuple[int, int], x: Floats, y: Floats, step_m: float) -> tuple[Floats, Floats]:
        """The force in N that closes the switch from each place, and its standard deviation, which includes how much
        the force varies within a step of the grid."""
        row, column = cell
        distance = np.hypot(x - column * self.pitches_m[0], y - row * self.pitches_m[1])
        needed = self.reach.closing_n(distance)
        farther = self.reach.closing_n(distance + step_m / 2)
        within = np.minimum(farther - needed, needed)
        sigma = np.sqrt(self.force_sigma_n**2 + (self.spread * needed) ** 2 + (within / 1.7) ** 2)
        return needed, np.maximum(sigma, ROUNDING * needed)

    def _open(self) -> list[tuple[int, int]]:
        """Open switches that the contact might have closed: those around the pressed ones."""
        far = self.reach.reach_m(self.force_n * (1 + 3 * self.spread) + 3 * self.force_sigma_n)
        wide, high = (math.ceil(far / pitch) for pitch in self.pitches_m)
        rows, columns = zip(*self.cells)
        return [
            (row, column)
            for row in range(min(rows) - high, max(rows) + high + 1)
            for column in range(min(columns) - wide, max(columns) + wide + 1)
            if (row, column) not in self.cells and 0 <= row < self.lines[0] and 0 <= column < self.lines[1]
        ]

    def _from_center(self, x: Floats, y: Floats) -> Floats:
        assert self.center is not None
        inverse = np.linalg.inv(self.center.covariance_m2)
        dx, dy = x - self.center.x_m, y - self.center.y_m
        return np.asarray(inverse[0, 0] * dx * dx + 2 * inverse[0, 1] * dx * dy + inverse[1, 1] * dy * dy)


def _one_side(standing: Floats, chance: Floats, misfit: Floats) -> None:
    """A switch that is on the right side of its threshold if ``standing``, in standard deviations, is above 0."""
    # The logistic curve is the normal one to 1 %, and needs no scipy.
    chance -= np.logaddexp(0.0, -1.702 * standing)
    misfit += np.minimum(standing, 0.0) ** 2
