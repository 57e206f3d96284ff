"""The process that reads a port: it ends with its owner, gives everything back, and says what a thread says."""

import asyncio
import contextlib
import dataclasses
import gc
import os
import random
import signal
import subprocess
import sys
import threading
import time

import pytest
from byte_histories import SKINS, History
from child_processes import alive, reader_processes
from fake_board import FakeBoard, background, wait_until
from sample import sample
from terminals import environment

import contactfpga
from contactfpga import Skin
from contactfpga.driver import remote
from contactfpga.driver.reader import MEMORY_BYTES
from contactfpga.driver.ringqueue import RingQueue

pytestmark = pytest.mark.skipif(bool(remote.unavailable()), reason="this system has no reader process")
LONG = 30.0


def opened(board, **options):
    return contactfpga.open(board.path, reader="process", timeout=LONG, **options)


def test_frames_come_through_the_memory(board):
    with opened(board) as host:
        assert len(host.next(LONG)) == 1
        first, second = host.read(LONG), host.read(LONG)
        assert second.time_us > first.time_us
        assert second.host_sigma_s < 1.0
        assert host.stats.frames == board.asked
        board.stream = board.frame
        board.hello_s = 0.1
        frames = host.subscribe()
        numbers = [frames.next(LONG).sequence for _ in range(50)]
        assert numbers == [(numbers[0] + step) % 256 for step in range(50)]
        assert isinstance(frames._frames, RingQueue), "this tests a thread"
        newest = host.latest(LONG)
        assert host.clock() - newest.arrived_s < LONG
        assert len(host.batch(timeout=LONG)) > 0
        assert host.stats.lost == 0
    with pytest.raises(contactfpga.BoardClosed):
        host.latest()


@pytest.mark.slow
def test_a_task_gets_every_frame(board):
    board.stream = board.frame
    board.hello_s = 0.1

    async def work():
        numbers = []
        async with opened(board) as host:
            async for zones in host:
                numbers.append(zones.sequence)
                if len(numbers) == 30:
                    await host.latest(LONG)
                    break
        return numbers

    numbers = asyncio.run(work())
    assert numbers == [(numbers[0] + step) % 256 for step in range(30)]


def test_a_board_that_is_unplugged_is_told_of_after_its_frames(board):
    with opened(board) as host:
        board.send(board.frame())
        wait_until(lambda: host.stats.frames >= 2)
        board.unplug()
        with pytest.raises(contactfpga.PortLost, match=r"is gone .*; plug the board in and open it again"):
            list(iter(lambda: host.next(LONG), None))
        with pytest.raises(contactfpga.PortLost):
            host.read(LONG)


@pytest.mark.slow
def test_the_process_ends_with_the_board(board):
    host = opened(board)
    (number,) = reader_processes(board.path)
    host.close()
    assert not alive(number)
    with opened(board):
        assert reader_processes(board.path) != [number]


OWNER = """
import sys, time, contactfpga
board = contactfpga.open(sys.argv[1], reader="process", timeout=30)
board.read(30)
if len(sys.argv) > 2:
    exec(sys.argv[2])
print("ready", flush=True)
time.sleep(60)
"""


@contextlib.contextmanager
def owner(board, *more):
    """A program that has a board open, and its reader's number."""
    command = [sys.executable, "-c", OWNER, board.path, *more]
    env = environment(PYTHONPATH=os.pathsep.join(sys.path))
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=env) as process:
        try:
            assert process.stdout.readline() == "ready\n"
            (number,) = reader_processes(board.path, process.pid)
            yield process, number
        finally:
            process.kill()


@pytest.mark.parametrize("how", sample([signal.SIGKILL, signal.SIGTERM], quick=[signal.SIGKILL], slow=[signal.SIGTERM]))
def test_it_ends_with_its_owner_however_that_ends(board, how):
    with owner(board) as (process, number):
        process.send_signal(how)
        process.wait()
        wait_until(lambda: not alive(number), 10)
    with opened(board) as host:  # the port is free
        assert len(host.read(LONG)) == 1


@pytest.mark.slow
def test_it_ends_with_a_killed_owner_that_has_a_child_of_its_own(board):
    """The child has the other end of the reader's socket, and goes on."""
    with owner(board, "import os\nif not os.fork(): os.close(1), time.sleep(10), os._exit(0)") as (process, number):
        process.kill()
        process.wait()
        wait_until(lambda: not alive(number), 5)
        assert not alive(number)


def test_its_end_is_told_of(board):
    with opened(board) as host:
        (number,) = reader_processes(board.path)
        os.kill(number, signal.SIGKILL)
        with pytest.raises(contactfpga.PortLost, match="its reader process has ended; open it again"):
            list(iter(lambda: host.latest(LONG), None))
        with pytest.raises(contactfpga.PortLost):
            host.read(LONG)


@pytest.mark.slow
def test_in_a_child_the_board_is_closed(board):
    with opened(board) as host:
        frames = host.subscribe()
        child = os.fork()
        if not child:
            status = 0
            for call in (host.read, host.latest, host.next, frames.next, host.clock, lambda: host.sheet):
                try:
                    call()
                except contactfpga.BoardClosed as error:
                    status |= "was opened in another process; open it anew in this one" not in str(error)
                else:
                    status = 1
            host.close()
            os._exit(status)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
        assert len(host.read(LONG)) == 1


def descriptors():
    return sorted(os.listdir("/proc/self/fd"))


def memory_kb():
    with open("/proc/self/status") as file:
        return next(int(line.split()[1]) for line in file if line.startswith("VmSize"))


@pytest.mark.slow
def test_descriptors_and_memory_stay_as_they_were(board):
    def once():
        with opened(board) as host:
            for _ in range(3):
                host.read(LONG)
            with background(lambda: host.latest(LONG)):
                board.send(board.frame())
            asyncio.run(asyncio.wait_for(asyncio.to_thread(host.read, LONG), LONG))

    once()
    gc.collect()
    before, threads, most = descriptors(), threading.active_count(), 0
    for turn in range(12):
        once()
        gc.collect()
        if turn == 4:
            most = memory_kb()
    assert len(descriptors()) == len(before)
    assert threading.active_count() == threads
    assert memory_kb() - most < 3 * MEMORY_BYTES / 1024
    assert not reader_processes(board.path)


@pytest.mark.slow
def test_a_port_is_open_once(board):
    with opened(board):
        for reader in ("thread", "process"):
            with pytest.raises(contactfpga.PortBusy, match="this program opened it already"):
                contactfpga.open(board.path, reader=reader, timeout=LONG)
    with contactfpga.open(board.path, timeout=LONG), pytest.raises(contactfpga.PortBusy, match="opened it already"):
        opened(board)


@pytest.mark.slow
def test_what_the_process_records_is_what_a_thread_records(board, tmp_path):
    file = tmp_path / "bytes.rec"
    with opened(board, record=file) as host:
        times = [host.next(LONG).time_us] + [host.read(LONG).time_us for _ in range(5)]
        count = host.stats.bytes
    assert file.stat().st_size == count
    with contactfpga.open(f"replay://{file}") as played:
        assert [zones.time_us for zones in played][-len(times) :] == times


@pytest.mark.parametrize(
    ("port", "why"),
    [
        ("sim://", "sim://: a virtual board is simulated while it is read, in the process that reads it; "),
        ("replay://x", "replay://x: a recording is read as fast as it is asked for, which no other process helps; "),
        ("/dev/x#1", "/dev/x#1: the sheets of one port are read together, in one process; "),
    ],
)
def test_what_no_other_process_can_read_is_refused(port, why):
    with pytest.raises(contactfpga.AddressError) as caught:
        contactfpga.open(port, reader="process")
    assert str(caught.value) == why + "leave reader='process' out"


def test_a_reader_that_there_is_not_is_refused(board):
    with pytest.raises(ValueError, match="reader is 'fast'; it must be one of thread, process"):
        contactfpga.open(board.path, reader="fast")


def test_a_port_that_is_not_there_is_told_of_as_ever():
    with pytest.raises(contactfpga.PortNotFound, match="/dev/nothing cannot be opened: No such file"):
        contactfpga.open("/dev/nothing", reader="process")


@pytest.mark.slow
def test_losses_and_restarts_are_logged(board, caplog):
    caplog.set_level("INFO", "contactfpga")
    with opened(board) as host:
        board.power_up()
        board.send(board.hello())
        wait_until(lambda: host.stats.restarts == 1)
        host.read(LONG)
    assert [record.getMessage() for record in caplog.records if "Skin" not in record.getMessage()] == [
        f"{board.path}: the board was restarted"
    ]


def stream_of(name, seed):
    """A history of bytes, all of which a board sends by itself."""
    history = History(SKINS[name], random.Random(seed))
    return b"".join(history.more(60) for _ in range(6)) + history.board.hello()


@pytest.mark.slow
@pytest.mark.parametrize("name", SKINS)
def test_over_a_port_both_readers_count_and_see_the_same(name):
    """With the same bytes on two pseudo-terminals; only when they came differs."""
    stream, said = stream_of(name, 3), []
    for reader in ("thread", "process"):
        with FakeBoard(SKINS[name]) as board:
            with contactfpga.open(board.path, reader=reader, timeout=LONG) as host, host.events(10_000) as events:
                board.answers = False
                end = host.stats.bytes + len(stream)
                board.send(stream)
                events.settle(lambda count, end=end: count >= end, LONG)
                found = []
                while len(events._frames):
                    try:
                        found.append(told(events.next(LONG)))
                    except contactfpga.ContactFPGAError as error:
                        found.append(str(error).replace(board.path, "port"))
                said.append((found, dataclasses.asdict(host.stats)))
    assert said[0] == said[1]
    assert len(said[0][0]) > 100


def told(item):
    if not isinstance(item, contactfpga.Zones):
        return repr(item)
    values = item.to_dict()
    return {name: value for name, value in values.items() if not name.startswith(("host", "arrived"))}


@pytest.mark.slow
def test_the_newest_frame_needs_no_other_thread(board):
    """While a thread holds the lock that all calls of a thread's reader share."""
    board.stream = board.frame
    board.hello_s = 0.1
    with opened(board) as host:
        first = host.latest(LONG)
        time.sleep(0.05)  # in which this process does nothing
        second = host.latest(LONG)
        assert second.arrived_s > first.arrived_s
        assert not [thread for thread in threading.enumerate() if board.path in thread.name]


@pytest.mark.slow
def test_several_threads_read_one_board(board):
    board.stream = board.frame
    board.hello_s = 0.05
    counts = [0] * 4
    with opened(board) as host:
        done = time.monotonic() + 1.0

        def work(number, call):
            while time.monotonic() < done:
                call(LONG)
                counts[number] += 1

        calls = [host.read, host.next, host.latest, host.subscribe().next]
        threads = [threading.Thread(target=work, args=one) for one in enumerate(calls)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert min(counts) > 5
        assert host.stats.lost == 0


@pytest.mark.slow
def test_a_skin_is_expected_of_the_board(board):
    with pytest.raises(contactfpga.SkinMismatch, match="was built from"):
        opened(board, skin=Skin(rows=8))
