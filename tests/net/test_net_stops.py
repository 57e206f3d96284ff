"""Processes that stand still (SIGSTOP) and go on: nothing that waited is taken for news, and each loss is counted."""

import contextlib
import os
import signal
import time

import pytest
from fake_board import wait_until
from net_processes import Reader, Streaming, free_endpoint, publish, router

import contactfpga

pytest.importorskip("zenoh")

SKIN = contactfpga.Skin(name="left forearm")
LONG = 60.0
MOST_S = 0.1
"""The age that the reader allows."""
SLOW_S = 0.15
"""By how much more a frame may be late before this test counts it as old: a busy machine."""


@contextlib.contextmanager
def standing_still(process, seconds):
    os.kill(process.pid, signal.SIGSTOP)
    try:
        time.sleep(seconds)
    finally:
        os.kill(process.pid, signal.SIGCONT)
    yield


def counted(board, reader):
    """Frames that the board has sent and the reader does not know of, once all that was on its way has come."""
    more, board.stream = board.stream, b""
    time.sleep(0.3)
    hellos = reader.sights[-1].hellos
    board.send(board.hello())
    wait_until(lambda: reader.sights[-1].hellos > hellos, LONG)
    unknown = board.sent - reader.sights[-1].seen
    board.stream = more
    return unknown


def goes_on(reader, since_s):
    """Wait until fresh frames come again; what was seen meanwhile."""
    wait_until(lambda: sum(one.at_s > since_s and one.time_us is not None for one in reader.sights) > 20, LONG)
    return [one for one in reader.sights if one.at_s > since_s]


def test_whoever_stands_still_nothing_old_is_new_and_every_frame_is_counted():
    """Shortly, so that Zenoh does not notice, and for so long that it closes connections."""
    endpoint = free_endpoint()
    port = f"zenoh://contactfpga/left-forearm?connect={endpoint}&wait=60"
    with (
        Streaming(SKIN, every_s=0.01) as board,
        router(endpoint) as one_router,
        publish(board, "--connect", endpoint) as publisher,
        Reader(port, MOST_S) as reader,
    ):
        before = counted(board, reader)
        for process, seconds in (
            (reader.process, 0.6),
            (one_router.process, 0.6),
            (publisher.process, 0.6),
            (reader.process, 2.5),
            (one_router.process, 2.5),
            (publisher.process, 2.5),
        ):
            with standing_still(process, seconds):
                after = goes_on(reader, time.monotonic())
            for one in after:
                if one.time_us is not None:
                    assert one.time_us in board.sent_us
                    assert one.at_s - (board.begun_s + one.time_us / 1e6) < MOST_S + SLOW_S
        assert counted(board, reader) == before, "every frame that did not come is counted"
        last = reader.sights[-1]
    assert last.restarts == 0
    assert last.net["publishers"] == 1
    assert last.net["breaks"] >= 1
