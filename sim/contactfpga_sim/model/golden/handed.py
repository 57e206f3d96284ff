"""Line reversal: which rows of a frame are handed over."""

from __future__ import annotations

import numpy as np

from contactfpga_sim.model.golden.facts import Facts
from contactfpga_sim.model.golden.scan import Rows


class Handed:
    """Which rows of a frame are offered: where zones are found those that were driven, each with an empty one after it
    whose neighbor is not; otherwise all."""

    def __init__(self, facts: Facts, rows: Rows):
        self.taken = 0
        """The cycle in which the last one was taken."""
        self._facts = facts
        self._rows = rows
        self._place = 0
        self._nothing = np.zeros(facts.columns, bool)

    def driven(self, row: int, cells: np.ndarray, offered: int, following: int | None) -> None:
        if self._facts.zones:
            self._offer(row, cells, offered, True, following is None)
            if following is not None and following != row + 1:
                self._offer(row + 1, self._nothing, self.taken + 1, False, False)
            return
        self._all_until(row, offered)
        self._offer(row, cells, max(offered, self.taken + 1), True, row == self._facts.rows - 1)
        if following is None:
            self._all_until(self._facts.rows, offered)

    def nothing(self, offered: int) -> None:
        if self._facts.zones:
            self._offer(0, self._nothing, offered, False, True)
        else:
            self._all_until(self._facts.rows, offered)

    def _all_until(self, end: int, offered: int) -> None:
        while self._place < end:
            last = self._place == self._facts.rows - 1
            self._offer(self._place, self._nothing, max(offered, self.taken + 1), False, last)

    def _offer(self, place: int, cells: np.ndarray, offered: int, alone: bool, last: bool) -> None:
        self.taken = self._rows.take(place, cells, offered, alone, last)
        self._place = place + 1
