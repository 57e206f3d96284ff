"""The line to the host: whose packet it takes next, where several sheets share it."""

from __future__ import annotations

import math
import threading
from typing import Protocol


class Sender(Protocol):
    """A sheet's link, as the line sees it."""

    def waits_from(self, cycle: int) -> int | None:
        """The cycle from which on something waits, as far as is known in ``cycle``; None: nothing does."""

    def take(self, taken: int, cycle: int) -> None:
        """Send what is next from the cycle ``taken`` on."""


class Line:
    """A turn goes round, a sheet per cycle, until one that has it sends a packet; then the next one has it.

    Each sheet's time moves forward by :meth:`advance`. What the line takes is known up to the cycle that all of them
    have reached, so whoever is ahead waits there for the threads of the others.
    """

    def __init__(self, sheets: int):
        self.links: dict[int, Sender] = {}
        """By the number of the sheet."""
        self.idle_from = 0
        """The cycle from which on a packet can be taken."""
        self.uart_from = 0
        """The cycle from which on a byte can be handed over."""
        self._sheets = sheets
        self._turn = 0
        """Whose it is in the cycle ``idle_from``."""
        self._reached = [-1.0] * sheets
        self._changed = threading.Condition()

    def advance(self, number: int, cycle: int) -> None:
        """Let the line take what it takes up to and including ``cycle``."""
        with self._changed:
            self._reach(number, cycle)
            while min(self._reached) < cycle:
                self._changed.wait()

    def leave(self, number: int) -> None:
        """A sheet's time is over: nobody waits for it any more."""
        with self._changed:
            self._reach(number, math.inf)

    def _reach(self, number: int, cycle: float) -> None:
        """Nobody but this sheet moves on to a cycle that is not yet reached by all, so their links stand still."""
        before, self._reached[number] = min(self._reached), cycle
        known = min(self._reached)
        if known > before or self._sheets == 1:
            self._take_to(known)
            self._changed.notify_all()

    def _take_to(self, cycle: float) -> None:
        if cycle == math.inf:
            return
        known = int(cycle)
        while waiting := [found for number in self.links if (found := self._first(number, known)) is not None]:
            taken, number = min(waiting)
            if taken > known:
                return
            self._turn = (number + 1) % self._sheets
            self.links[number].take(taken, known)

    def _first(self, number: int, known: int) -> tuple[int, int] | None:
        """When something of this sheet is taken, if nothing of another one is before; and the sheet."""
        wait = self.links[number].waits_from(known)
        if wait is None:
            return None
        cycle = max(self.idle_from, wait)
        turn = self._turn + cycle - self.idle_from
        return cycle + (number - turn) % self._sheets, number
