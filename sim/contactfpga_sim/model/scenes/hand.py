"""A simulated hand for ``contactfpga bringup`` on a virtual sheet."""

from __future__ import annotations

import numpy as np

PRESS_S, MOVE_S = 1.0e-3, 0.4e-3
"""Least time of a finger on a switch, and time between switches."""
HOLD_S = 0.025
"""Time of a ruler on each column, enough to see that its switches stopped bouncing."""


class Hand:
    """Pressed cells as a function of simulated time in s."""

    def __init__(self, rows: int, columns: int, frame_s: float = 0.0):
        """``frame_s``: time of a frame, all of which a finger stays on a switch."""
        self._shape, self._press_s = (rows, columns), max(PRESS_S, 1.5 * frame_s)
        self._does, self._force_n = "nothing", ""
        self._since_s: float | None = None

    def does(self, what: str) -> float:
        """Set the action from the next sample on: ``nothing``; ``finger`` or ``ruler``: one switch or column after the
        other; ``card``: the first half of the columns; ``plate``: all; ``weight`` and a number: so many N on each
        resistive cell. Returns its duration in s; 0 for a constant action."""
        what, _, self._force_n = what.partition(" ")
        if what not in DOES:
            raise ValueError(f"a hand cannot do {what!r}; take one of {', '.join(DOES)}")
        self._does, self._since_s = what, None
        rows, columns = self._shape
        return {"finger": rows * columns * (self._press_s + MOVE_S), "ruler": (columns + 1) * HOLD_S}.get(what, 0.0)

    def __call__(self, seconds: float) -> np.ndarray:
        if self._since_s is None:
            self._since_s = seconds
        columns = self._shape[1]
        cells, past_s = np.zeros(self._shape, bool), seconds - self._since_s
        if self._does == "finger":
            number, within_s = divmod(past_s, self._press_s + MOVE_S)
            cells.flat[int(number) % cells.size] = within_s < self._press_s
        elif self._does == "ruler":
            column = int(past_s / HOLD_S) % (columns + 1)
            cells[:, column : column + 1] = True
        elif self._does == "card":
            cells[:, : columns // 2] = True
        elif self._does in ("plate", "weight"):
            cells[:] = True
        return cells

    def force_n(self, usual_n: float) -> float:
        """Force on each pressed cell: that of the weight, or ``usual_n``."""
        return float(self._force_n or usual_n)


DOES = ("nothing", "finger", "ruler", "card", "plate", "weight")
