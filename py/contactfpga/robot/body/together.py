"""Virtual boards on one clock: each runs in simulated time of its own, which passes only while it is read."""

from __future__ import annotations

import threading
from collections.abc import Callable

STEP_S = 0.005
"""None of them is ahead of another one by more simulated time."""
LAG_S = 0.02
"""Where the computer is too slow for real time, no more than this is made up for."""


class Together:
    """Says how much simulated time may pass for each board: as much as real time does, and no board leaves another one
    behind. Safe for several threads."""

    def __init__(self, clock: Callable[[], float]):
        self._clock = clock
        self._lock = threading.Lock()
        self._began_s = clock()
        self._joined_s: dict[str, float] = {}  # by link, what to add to a board's clock for the common one
        self._now_s: dict[str, float] = {}  # on the common clock, of each board

    def join(self, link: str, board_s: float) -> None:
        """A board is there whose own clock says this; for it the common time begins where the others are."""
        with self._lock:
            now_s = min(self._now_s.values(), default=self._clock() - self._began_s)
            self._joined_s[link], self._now_s[link] = now_s - board_s, now_s

    def leave(self, link: str) -> None:
        """Nobody waits for it any more."""
        with self._lock:
            self._joined_s.pop(link, None)
            self._now_s.pop(link, None)

    def due_s(self, link: str, board_s: float) -> float:
        """How many seconds may pass now for this board, whose clock says ``board_s``; 0 or less: none."""
        with self._lock:
            mine_s = self._now_s[link] = self._joined_s[link] + board_s
            last_s = min(self._now_s.values())
            real_s = self._clock() - self._began_s
            lag_s = real_s - last_s - LAG_S
            if lag_s > 0:
                self._began_s += lag_s
                real_s -= lag_s
            return min(real_s, last_s + STEP_S) - mine_s
