"""A hand that does on a virtual sheet what `contactfpga bringup` asks a person to do."""

from __future__ import annotations

import numpy as np

PRESS_S, MOVE_S = 1.0e-3, 0.4e-3
"""A finger on each switch, and on its way to the next one."""
HOLD_S = 0.025
"""A ruler on each column: as long as it takes to tell that its switches have stopped bouncing."""


class Hand:
    """Pressed cells as a function of the simulated time in s, as :class:`~contactfpga_sim.VirtualBoard` takes them."""

    def __init__(self, rows: int, columns: int):
        self._shape = rows, columns
        self._does = "nothing"
        self._since_s: float | None = None

    def does(self, what: str) -> float:
        """From the next look on the hand does this: ``nothing``; ``finger``: it presses one switch after the other;
        ``ruler``: one column after the other; ``card``: the first half of the columns; ``plate``: all. Returns the
        seconds that it takes for all of it; 0 for what it keeps doing."""
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
