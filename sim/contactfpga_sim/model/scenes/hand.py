"""A simulated hand for ``contactfpga bringup`` on a virtual sheet."""

from __future__ import annotations

import numpy as np

PRESS_S, MOVE_S = 1.0e-3, 0.4e-3
"""Time of a finger on a switch, and between switches."""
HOLD_S = 0.025
"""Time of a ruler on each column, enough to see that its switches stopped bouncing."""


class Hand:
    """Pressed cells as a function of simulated time in s."""

    def __init__(self, rows: int, columns: int):
        self._shape = rows, columns
        self._does = "nothing"
        self._since_s: float | None = None

    def does(self, what: str) -> float:
        """Set the action from the next sample on: ``nothing``; ``finger`` or ``ruler``: one switch or column after the
        other; ``card``: the first half of the columns; ``plate``: all. Returns its duration in s; 0 for a constant
        action."""
        if what not in DOES:
            raise ValueError(f"a hand cannot do {what!r}; take one of {', '.join(DOES)}")
        self._does, self._since_s = what, None
        rows, columns = self._shape
        return {"finger": rows * columns * (PRESS_S + MOVE_S), "ruler": (columns + 1) * HOLD_S}.get(what, 0.0)

    def __call__(self, seconds: float) -> np.ndarray:
        if self._since_s is None:
            self._since_s = seconds
        columns = self._shape[1]
        cells, past_s = np.zeros(self._shape, bool), seconds - self._since_s
        if self._does == "finger":
            number, within_s = divmod(past_s, PRESS_S + MOVE_S)
            cells.flat[int(number) % cells.size] = within_s < PRESS_S
        elif self._does == "ruler":
            column = int(past_s / HOLD_S) % (columns + 1)
            cells[:, column : column + 1] = True
        elif self._does == "card":
            cells[:, : columns // 2] = True
        elif self._does == "plate":
            cells[:] = True
        return cells


DOES = ("nothing", "finger", "ruler", "card", "plate")
