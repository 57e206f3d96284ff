"""The driver on pseudo-terminals: every frame in order, the newest one, restarts."""

import threading
import time

import pytest
from fake_board import FakeBoard, background, wait_until

import contactfpga

pytestmark = pytest.mark.usefixtures("_closed_ports")

SKIN = contactfpga.Skin()
LONG = 60.0  # s; what has to come comes at once, but for a machine that is busy


# ---- every frame


def test_iteration_gives_every_frame_in_order_and_counts_what_is_missing(board):
    with contactfpga.open(board.path, timeout=LONG) as opened:
        frames = iter(opened)
        assert next(frames).sequence == 0
        board.sequence = 254
        stream = board.frame(overwritten=30) + board.frame(overwritten=30)
        board.sequence = 257
        stream += board.frame(overwritten=37)
        board.send(stream)
        wait_until(lambda: board.waiting() == len(stream))
        assert [next(frames).sequence for _ in range(3)] == [254, 255, 1]
        assert opened.stats.lost == 253 + 1
        assert opened.stats.overwritten == 30 + 7
        assert opened.stats.frames == 4


def test_latest_is_the_newest_of_those_that_wait(board):
    with contactfpga.open(board.path, timeout=LONG) as opened:
        opened.next(LONG)
        stream = b"".join(board.frame() for _ in range(20))
        board.send(stream)
        wait_until(lambda: board.waiting() == len(stream))
        assert opened.latest(LONG).sequence == 20
        assert opened.stats.frames == 21


def test_latest_waits_when_none_is_there(board):
    with contactfpga.open(board.path, timeout=LONG) as opened:
        opened.next(LONG)
        with background(lambda: (time.sleep(0.1), board.send(board.frame()))):
            assert opened.latest(LONG).sequence == 1
        with pytest.raises(contactfpga.BoardSilent):
            opened.latest(0.1)


def test_latest_takes_nothing_from_a_buffer_that_may_have_been_full(board):
    with contactfpga.open(board.path, timeout=LONG) as opened:
        opened.next(LONG)
        stream = b"".join(board.frame() for _ in range(4080 // 17))
        board.send(stream)
        wait_until(lambda: board.waiting() == len(stream))
        board.moments = [(200, 0, 0)]
        read = threading.Event()

        def go_on():
            while not read.wait(0.01):
                board.send(board.frame())

        with background(go_on):
            try:
                assert opened.latest(LONG)[0].area_cells == 200
            finally:
                read.set()


def test_restarted_board_is_no_loss(board):
    with contactfpga.open(board.path, timeout=LONG) as opened:
        board.sequence, board.time_us = 100, 5_000_000
        board.send(board.frame() + board.frame())
        board.sequence = board.time_us = 0
        board.send(board.hello() + board.frame() + board.frame())
        times = [opened.next(LONG).time_us for _ in range(5)]
    assert times == [0, 5_000_000, 5_000_096, 0, 96]
    assert opened.stats.restarts == 1
    assert opened.stats.lost == 99


def test_bitmap_comes_as_cells():
    with FakeBoard(contactfpga.Skin(rows=3, columns=11, report="cells", settle_us=10.0)) as board:
        zones = contactfpga.read_zones(board.path, timeout=LONG)
    assert len(zones) == 0
    assert zones.cells.shape == (3, 11)
    assert (zones.cells == [[column % 2 for column in range(11)]] * 3).all()
    assert zones.pressed == 15
