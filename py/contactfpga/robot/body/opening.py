"""Opens the boards of links, of all bodies of this program."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator

from contactfpga.driver import driver, finding
from contactfpga.driver.board import Board
from contactfpga.robot.body.plan import Plan


def open_board(plan: Plan, timeout: float = 1.0) -> Board:
    """The board of a link; ``timeout``: seconds for its hello. Raises what :func:`contactfpga.open` does."""
    with _turn(plan.port):
        return driver.open(plan.port, plan.skin, timeout=timeout, trust=plan.trust)


def _turn(port: str | None) -> contextlib.AbstractContextManager[None]:
    if finding.searched(port):
        return _TURNS.alone()
    elsewhere = port is not None and "://" in port  # virtual, or on the network: no search opens it
    return contextlib.nullcontext() if elsewhere else _TURNS.together()


class _Turns:
    """A search listens to every port that nobody has: meanwhile no other link can open its own, nor search."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._together = self._waiting = 0
        self._alone = False

    @contextlib.contextmanager
    def together(self) -> Iterator[None]:
        """For links with a port. A search that waits goes first, or it might wait forever."""
        with self._changed:
            self._changed.wait_for(lambda: not self._alone and not self._waiting)
            self._together += 1
        try:
            yield
        finally:
            with self._changed:
                self._together -= 1
                self._changed.notify_all()

    @contextlib.contextmanager
    def alone(self) -> Iterator[None]:
        """For a search."""
        with self._changed:
            self._waiting += 1
            self._changed.wait_for(lambda: not self._alone and not self._together)
            self._waiting -= 1
            self._alone = True
        try:
            yield
        finally:
            with self._changed:
                self._alone = False
                self._changed.notify_all()


_TURNS = _Turns()
