"""The driver on pseudo-terminals: every frame in order, the newest one, restarts, queues, threads, the end."""

import asyncio
import gc
import threading
import time

import pytest
from fake_board import background, wait_until

import contactfpga

pytestmark = pytest.mark.usefixtures("_closed_ports", "_asks_once")

SKIN = contactfpga.Skin()
LONG = 60.0  # s; what has to come comes at once, but for a machine that is busy


# ---- every frame


def test_iteration_gives_every_frame_in_order_and_counts_what_is_missing(board):
    with contactfpga.open(board.path, timeout=LONG) as opened:
        frames = iter(opened)
        assert next(frames).sequence == 1
        for _ in range(252):
            board.frame()
        stream = board.frame(overwritten=30) + board.frame(overwritten=30)
        board.frame()
        stream += board.frame(overwritten=37)
        board.send(stream)
        assert [next(frames).sequence for _ in range(3)] == [254, 255, 1]
        assert opened.stats.lost == 252 + 1
        assert opened.stats.overwritten == 30 + 7
        assert opened.stats.frames == 5


def test_next_with_no_timeout_takes_what_waits(board):
    with contactfpga.open(board.path, timeout=LONG) as opened:
        assert opened.next(0).sequence == 1
        for _ in range(2):
            with pytest.raises(contactfpga.ReadTimeout, match=r": no frame waits$") as caught:
                opened.next(timeout=0)
            assert type(caught.value) is contactfpga.ReadTimeout, "nothing is said of the board"
        sent = board.sent
        board.send(b"".join(board.frame() for _ in range(3)))
        wait_until(lambda: opened.stats.frames == sent + 3)
        assert [opened.next(0).sequence, opened.latest(0).sequence] == [sent, sent + 2]
        for call in (opened.read, opened.batch):
            with pytest.raises(ValueError, match="timeout is 0; it must be a positive number of seconds"):
                call(timeout=0)
    with pytest.raises(contactfpga.BoardClosed):
        opened.next(0)


def test_latest_waits_when_none_is_there(board):
    with contactfpga.open(board.path, timeout=LONG) as opened:
        opened.latest(LONG)
        sent = board.sent
        with background(lambda: (time.sleep(0.1), board.send(board.frame()))):
            assert opened.latest(LONG).sequence == sent
        with pytest.raises(contactfpga.BoardSilent):
            opened.latest(0.1)


# ---- a queue for each


def test_a_slow_program_loses_the_oldest_frames_and_is_told(board, monkeypatch):
    monkeypatch.setattr(contactfpga.driver.board, "QUEUE", 10)
    with contactfpga.open(board.path, timeout=LONG) as opened:
        opened.latest(LONG)
        frames, sent = opened.stats.frames, board.sent
        board.send(b"".join(board.frame() for _ in range(25)))
        wait_until(lambda: opened.stats.frames == frames + 25)
        assert [opened.next(LONG).sequence for _ in range(10)] == [sent + index for index in range(15, 25)]
        assert opened.stats.dropped == 15


def test_subscribers_each_get_every_frame(board):
    with contactfpga.open(board.path, timeout=LONG) as opened:
        opened.latest(LONG)
        sent = board.sent
        first, second, short = opened.subscribe(), opened.subscribe(), opened.subscribe(maxsize=2)
        board.send(b"".join(board.frame() for _ in range(5)))
        numbers = [sent + index for index in range(5)]
        for queue in (first, second, opened):
            assert [queue.next(LONG).sequence for _ in range(5)] == numbers
        assert [short.next(LONG).sequence for _ in range(2)] == numbers[-2:]
        assert (first.dropped, short.dropped) == (0, 3)


def test_a_subscription_that_was_closed_says_so(board):
    with contactfpga.open(board.path, timeout=LONG) as opened:
        with opened.subscribe() as queue:
            board.send(board.frame())
            queue.next(LONG)
        with pytest.raises(contactfpga.BoardClosed, match="subscribe again"):
            queue.next(LONG)


@pytest.mark.parametrize("maxsize", [0, -1, 1.5, True, None])
def test_a_queue_holds_a_whole_number_of_frames(board, maxsize):
    with contactfpga.open(board.path, timeout=LONG) as opened, pytest.raises(ValueError, match="maxsize is"):
        opened.subscribe(maxsize)


def test_frames_come_in_async_for(board):
    async def take(queue, count):
        found = []
        async for zones in queue:
            found.append(zones.sequence)
            if len(found) == count:
                break
        return found

    async def both(opened):
        queue = opened.subscribe()
        tasks = [asyncio.create_task(take(one, 50)) for one in (queue, opened)]
        await asyncio.sleep(0.05)
        await asyncio.to_thread(board.send, b"".join(board.frame() for _ in range(50)))
        return await asyncio.gather(*tasks)

    with contactfpga.open(board.path, timeout=LONG) as opened:
        opened.latest(LONG)
        numbers = [board.sent + index for index in range(50)]
        assert asyncio.run(both(opened)) == [numbers, numbers]


def test_a_board_is_awaited(board):
    """Others go on while a task waits, and nobody waits in the loop's own thread."""

    async def use():
        ticks = 0

        async def tick():
            nonlocal ticks
            while True:
                ticks += 1
                await asyncio.sleep(0.001)

        async with contactfpga.open(board.path, timeout=LONG) as opened:
            beside = asyncio.create_task(tick())
            found = [(await opened.next(LONG)).sequence, (await opened.read(LONG)).sequence]
            waiting = asyncio.create_task(opened.next(LONG))
            while ticks < 50:
                await asyncio.sleep(0.01)
            assert not waiting.done()
            await asyncio.to_thread(board.send, b"".join(board.frame() for _ in range(6)))
            found.append((await waiting).sequence)
            while opened.stats.frames < len(found) + 5:
                await asyncio.sleep(0.01)
            found += (await opened.batch(0.0, LONG)).frames["sequence"].tolist()
            with pytest.raises(contactfpga.ReadTimeout, match="no frame waits"):
                await opened.next(timeout=0)
            with pytest.raises(contactfpga.ReadTimeout, match=r"no frame within 0\.05 s"):
                await opened.next(timeout=0.05)
            await asyncio.to_thread(board.send, board.frame() + board.frame())
            while opened.stats.frames < len(found) + 2:
                await asyncio.sleep(0.01)
            found.append((await opened.latest()).sequence)
            beside.cancel()
            assert (opened.sheet.rows, opened.stats.lost, opened.board.sheet) == (16, 0, opened.sheet)
        with pytest.raises(contactfpga.BoardClosed):
            await opened.next()
        return found

    found = asyncio.run(use())
    assert found == [*range(found[0], found[0] + 8), found[0] + 9]


def test_a_canceled_next_takes_no_frame(board):
    async def use():
        async with contactfpga.open(board.path, timeout=LONG) as opened:
            await opened.next(LONG)
            with pytest.raises(TimeoutError):
                await asyncio.wait_for(opened.next(LONG), 0.05)
            sent = board.sent
            await asyncio.to_thread(board.send, board.frame())
            assert (await opened.next(LONG)).sequence == sent

    asyncio.run(use())


# ---- threads, and the end


@pytest.mark.parametrize("call", ["next", "read", "latest", "batch", "clock", "subscribe", "hello", "sheet", "skin"])
def test_a_closed_board_says_so_every_time(board, call):
    opened = contactfpga.open(board.path, timeout=LONG)
    queue = opened.subscribe()
    opened.close()
    opened.close()
    for _ in range(2):
        with pytest.raises(contactfpga.BoardClosed, match="was closed; open it again"):
            getattr(opened, call)()
        with pytest.raises(contactfpga.BoardClosed):
            queue.next()


@pytest.mark.parametrize("call", ["next", "read", "latest", "batch"])
def test_close_wakes_a_call_that_waits_in_another_thread(board, call):
    opened = contactfpga.open(board.path, timeout=LONG)
    opened.latest(LONG)
    board.answers = False
    with background(lambda: (time.sleep(0.1), opened.close())), pytest.raises(contactfpga.BoardClosed):
        getattr(opened, call)(timeout=LONG)


def test_a_board_that_is_closed_or_held_by_nobody_gives_its_port_back(board):
    def readers():
        return [thread for thread in threading.enumerate() if board.path in thread.name]

    for close in (contactfpga.Board.close, lambda opened: None):
        opened = contactfpga.open(board.path, timeout=LONG)  # refused while the port is held
        opened.next(LONG)
        assert len(readers()) == 1
        close(opened)
        del opened
        gc.collect()
        wait_until(lambda: not readers())


def test_a_board_that_was_dropped_is_opened_again_at_once(board):
    ports = [contactfpga.open(board.path, timeout=LONG).port for _ in range(5)]
    assert ports == [board.path] * 5
