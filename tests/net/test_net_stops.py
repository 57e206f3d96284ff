"""Processes that stand still (SIGSTOP) and go on: nothing that waited is taken for news, and each loss is counted."""

import contextlib
import os
import random
import signal
import time

import pytest
from fake_board import wait_until
from net_processes import Reader, Relay, Streaming, free_endpoint, publish, router

import contactfpga

pytest.importorskip("zenoh")

SKIN = contactfpga.Skin(name="left forearm")
MOST_S = 0.1
"""The age that the reader allows."""
SLOW_S = 0.35
"""By how much more a frame may be late before this test counts it as old: how well the clocks are known."""
LEASE_S = 1.0
"""Silence after which Zenoh takes a process for gone, as outside of tests."""


def stand_still(child, seconds):
    os.kill(child.process.pid, signal.SIGSTOP)
    try:
        time.sleep(seconds)
    finally:
        os.kill(child.process.pid, signal.SIGCONT)


def unknown(board, reader):
    """Frames that the board has sent and the reader does not know of."""
    return board.sent - reader.sights[-1].seen


def settle(board, reader):
    """Have all that is on its way come, and a hello after it, which says how much has been sent."""
    more, board.stream = board.stream, b""
    time.sleep(0.3)
    hellos = reader.sights[-1].hellos
    # Over and over, as the line loses what a publisher that has to wait does not take.
    wait_until(lambda: board.send(board.hello()) or reader.sights[-1].hellos > hellos, pause_s=0.3)
    return more


def go_on(board, reader, since_s):
    """Wait until fresh frames come again; nothing of what was seen meanwhile was old."""
    wait_until(lambda: sum(one.at_s > since_s and one.time_us is not None for one in reader.sights) > 20)
    for one in reader.sights:
        if one.at_s > since_s and one.time_us is not None:
            assert one.time_us in board.sent_us
            assert abs(one.at_s - (board.begun_s + one.time_us / 1e6)) < MOST_S + SLOW_S


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(4))
def test_random_histories_of_processes(seed):
    """Killed and started again, standing still, cut off: one thing after the other, some before the last is over."""
    rng, endpoint = random.Random(seed), free_endpoint()
    with Streaming(SKIN, every_s=0.01) as board, Relay(endpoint) as cable, contextlib.ExitStack() as stack:
        routing = stack.enter_context(router(endpoint, LEASE_S))
        publishing = stack.enter_context(publish(board.path, "--connect", endpoint, lease_s=LEASE_S))
        port = f"zenoh://contactfpga/left-forearm?connect={cable.endpoint}&wait=600"
        reader = stack.enter_context(Reader(port, MOST_S, LEASE_S))
        board.stream = settle(board, reader)
        before = unknown(board, reader)
        publishers = 1
        for _ in range(25):
            what = rng.choice(["publisher", "router", "cable", "stop", "stop"])
            if what == "publisher":
                publishing.end()
                publishing = stack.enter_context(publish(board.path, "--connect", endpoint, lease_s=LEASE_S))
                publishers += 1
            elif what == "router":
                routing.end()
                time.sleep(rng.choice([0.0, 1.5]))
                routing = stack.enter_context(router(endpoint, LEASE_S))
            elif what == "cable":
                cable.cut()
                time.sleep(rng.choice([0.1, 1.5]))
                cable.mend()
            else:
                stand_still(rng.choice([publishing, routing, reader]), rng.choice([0.2, 0.8, 2.5]))
            if rng.random() < 0.6:
                go_on(board, reader, time.monotonic())
        go_on(board, reader, time.monotonic())
        settle(board, reader)
        wait_until(lambda: unknown(board, reader) == before)
        last = reader.sights[-1]
    assert last.restarts == 0
    assert last.net["publishers"] <= publishers
