"""A board for nodes of other processes: on a pseudo-terminal, with a frame each millisecond of its own clock."""

import contextlib
import time

from fake_board import FakeBoard

from contactfpga import Skin

SKIN = Skin(name="forearm")


@contextlib.contextmanager
def flowing(link=None):
    """Its path."""
    begun = time.monotonic()

    def sent():
        time.sleep(0.001)
        board.time_us = round((time.monotonic() - begun) * 1e6)
        return (board.hello() if board.sent % 400 == 0 else b"") + board.frame()

    with FakeBoard(SKIN, link) as board:
        board.stream = sent
        yield board.path
