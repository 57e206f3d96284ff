"""The thread in C that reads ports: it gives everything back, waits for no Python thread, and says what a thread in
Python says."""

import asyncio
import contextlib
import ctypes
import dataclasses
import gc
import itertools
import os
import random
import signal
import subprocess
import sys
import threading
import time
import tty

import pytest
from byte_histories import SKINS, History
from fake_board import FakeBoard, background, wait_until
from sample import sample
from terminals import environment

import contactfpga
from contactfpga import Skin
from contactfpga.driver import driver, health, native
from contactfpga.driver.native_link import NativeLink

pytestmark = [
    pytest.mark.skipif(bool(native.missing()), reason=native.missing()),
    pytest.mark.usefixtures("_asks_once"),
]
LONG = 60.0


def opened(board, **options):
    return contactfpga.open(board.path, reader="native", timeout=LONG, **options)


def test_frames_come_in_every_way(board):
    with opened(board) as host:
        assert isinstance(host._link, NativeLink), "this tests a thread in Python"
        assert [found.sentence for found in health.reader(host)] == [
            f"{board.path} is read in C, which waits for no Python thread"
        ]
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
        times = [host.latest(LONG).time_us for _ in range(50)]
        assert sorted(set(times)) == times
        newest = host.latest(LONG, max_age_s=LONG)
        assert newest.time_us > times[-1]
        assert host.clock() - newest.arrived_s < LONG
        assert host.next(LONG).time_us > newest.time_us
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
        host.next(LONG)
        board.send(board.frame())
        wait_until(lambda: host.stats.frames >= 2)
        board.unplug()
        assert len(host.next(LONG)) == 1
        for call in (host.next, host.latest, host.read, host.batch):
            with pytest.raises(contactfpga.PortLost, match=r"is gone .*; plug the board in and open it again"):
                call(timeout=LONG)


CHILD = """
import sys, threading, time, contactfpga
board = contactfpga.open(sys.argv[1], reader="native", timeout=60)
board.read(60)
threading.Thread(target=lambda: board.read(60), daemon=True).start()
print("ready", flush=True)
time.sleep(100)
"""


@pytest.mark.parametrize("how", sample([signal.SIGKILL, signal.SIGINT], quick=[signal.SIGKILL], slow=[signal.SIGINT]))
def test_the_port_is_free_when_its_program_ends(board, how):
    env = environment(PYTHONPATH=os.pathsep.join(sys.path))
    command = [sys.executable, "-c", CHILD, board.path]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=env) as process:
        try:
            assert process.stdout.readline() == "ready\n"
            process.send_signal(how)
            process.wait(LONG)
        finally:
            process.kill()
    with opened(board) as host:
        assert len(host.read(LONG)) == 1


@pytest.mark.slow
def test_in_a_child_the_board_is_closed_and_another_can_be_opened(board):
    with opened(board) as host, FakeBoard(Skin()) as other:
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
                    status |= 2
            host.close()
            with opened(other) as own:
                status |= 4 * (len(own.read(LONG)) != 1)
            os._exit(status)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
        assert len(host.read(LONG)) == 1


def memory_kb():
    with open("/proc/self/status") as file:
        return next(int(line.split()[1]) for line in file if line.startswith("VmSize"))


@pytest.mark.slow
@pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="this system has no /proc")
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
    before, threads, most = len(os.listdir("/proc/self/fd")), threading.active_count(), 0
    for turn in range(24):
        once()
        gc.collect()
        if turn == 12:
            most = memory_kb()
    assert len(os.listdir("/proc/self/fd")) == before
    assert threading.active_count() == threads
    assert memory_kb() - most < 4096


@pytest.mark.slow
def test_a_port_is_open_once(board):
    with opened(board):
        for reader in driver.READERS:
            with pytest.raises(contactfpga.PortBusy, match="this program opened it already"):
                contactfpga.open(board.path, reader=reader, timeout=LONG)
    with contactfpga.open(board.path, reader="thread", timeout=LONG):
        with pytest.raises(contactfpga.PortBusy, match="opened it already"):
            opened(board)


@pytest.mark.slow
def test_what_is_recorded_is_what_a_thread_in_python_records(board, tmp_path):
    file = tmp_path / "bytes.rec"
    with opened(board, record=file) as host:
        times = [host.next(LONG).time_us] + [host.read(LONG).time_us for _ in range(5)]
        count = host.stats.bytes
    assert file.stat().st_size == count
    with contactfpga.open(f"replay://{file}") as played:
        assert [zones.time_us for zones in played][-len(times) :] == times


@pytest.mark.parametrize("port", ["sim://", "replay://x", "/dev/x#1", "zenoh://x"])
def test_what_it_cannot_read_is_refused(port):
    with pytest.raises(contactfpga.AddressError) as caught:
        contactfpga.open(port, reader="native")
    assert str(caught.value) == (
        f"{port}: reader='native' cannot read it: only the bytes of a serial port come by themselves, "
        "from a descriptor that C can read; leave reader out"
    )


def test_a_reader_that_there_is_not_is_refused(board):
    with pytest.raises(ValueError, match="reader is 'fast'; it must be one of native, thread"):
        contactfpga.open(board.path, reader="fast")


def test_without_the_library_a_thread_in_python_reads(board, monkeypatch, tmp_path):
    monkeypatch.setattr(native, "LIBRARY", tmp_path / "none.so")
    with contactfpga.open(board.path, timeout=LONG) as host:
        assert not isinstance(host._link, NativeLink)
        assert len(host.read(LONG)) == 1
        (found,) = health.reader(host)
        assert found.verdict == "note"
        assert found.sentence.startswith(
            f"{board.path} is read in Python, not in C: it was installed without a C compiler"
        )
    with pytest.raises(contactfpga.AddressError, match="installed without a C compiler; install one, then the package"):
        opened(board)


@pytest.mark.slow
def test_losses_and_restarts_are_logged(board, caplog):
    caplog.set_level("INFO", "contactfpga")
    with opened(board):
        board.power_up()
        board.send(board.hello())
        wait_until(lambda: len(caplog.records) > 1)  # though nobody calls
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
    for reader in driver.READERS:
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


SENDER = """
import os, sys, time
data = bytes.fromhex(sys.argv[2])
for start in range(0, len(data), 1000):
    os.write(int(sys.argv[1]), data[start:start + 1000])
    time.sleep(0.001)
"""


def test_frames_come_while_no_python_thread_runs(board):
    """A call that keeps the interpreter's lock, as an extension may, costs no frame, though the line holds few."""
    sleep = ctypes.PyDLL(None).usleep
    with opened(board) as host:
        first = host.read(LONG)
        count = 3000
        data = b"".join(board.frame() for _ in range(count))
        os.set_blocking(board._master, True)
        command = [sys.executable, "-c", SENDER, str(board._master), data.hex()]
        sender = subprocess.Popen(command, pass_fds=[board._master])
        board.answers = False
        frames = host.stats.frames
        for _ in range(600):
            sleep(100_000)
            if host.stats.frames >= frames + count:
                break
        newest = host.latest(LONG)
        sender.wait(LONG)
        assert newest.time_us == first.time_us + count * 96
        assert host.stats.lost == 0


def test_packets_that_only_python_decodes_wait_in_the_system_as_without_c():
    """So a board that sends more than Python decodes fills no ring with frames that grow old."""
    master, slave = os.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)
    packets = 20 * (99 * b"\x55" + b"\0")

    def fill(least):
        """Number of bytes that the port takes, at least ``least``, until it takes none for a while."""
        total, begun = 0, time.monotonic()
        until = begun + 1.0
        while time.monotonic() < until or (total < least and time.monotonic() < begun + LONG):
            with contextlib.suppress(BlockingIOError):
                total += os.write(master, packets)
                until = time.monotonic() + 1.0
            assert total < 1_000_000, "nothing holds it back"
            time.sleep(1e-4)
        return total

    port = native.Port(slave, time.monotonic())
    try:
        held = fill(native.CHUNK // 2 + 1)
        assert native.CHUNK < 2 * held < 6 * native.CHUNK
        reads, _, missing = port.take()
        assert (missing, len(reads.data_of(0, len(reads))) > 4000) == (0, True)
        assert fill(4001) > 4000
    finally:
        port.close()
        os.close(master)
        os.close(slave)


def test_the_newest_frame_does_not_wait_for_a_thread_that_works_through_frames(board):
    """Even where it tells more of the clocks: each comes in another piece of their fit."""
    with opened(board) as host:
        host.read(LONG)
        board.answers = False
        board.send(board.frame())
        times, others, count = [host.latest(LONG).time_us], host.subscribe(), host.stats.frames
        with host._link.changed:
            for _ in range(3):
                board.time_us += 300_000
                board.send(board.frame())
                thread = threading.Thread(target=lambda: times.append(host.latest(LONG).time_us), daemon=True)
                thread.start()
                thread.join(LONG)
                assert not thread.is_alive(), "it waits for the lock"
        assert [after - before for before, after in itertools.pairwise(times)] == [300_096] * 3
        assert [others.next(LONG).time_us for _ in range(3)] == times[1:]
        with pytest.raises(contactfpga.ReadTimeout):
            host.next(0.01)
        assert host.stats.frames == count + 3


@pytest.mark.slow
def test_several_threads_read_one_board(board):
    board.stream = board.frame
    board.hello_s = 0.05
    counts = [0] * 5
    with opened(board) as host:
        done = time.monotonic() + LONG

        def work(number, call):
            while min(counts) < 50 and time.monotonic() < done:
                call(LONG)
                counts[number] += 1

        calls = [host.read, host.next, host.latest, host.subscribe().next, host.latest]
        threads = [threading.Thread(target=work, args=one) for one in enumerate(calls)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert min(counts) >= 50
        assert host.stats.lost == 0


@pytest.mark.slow
def test_a_skin_is_expected_of_the_board(board):
    with pytest.raises(contactfpga.SkinMismatch, match="was built from"):
        opened(board, skin=Skin(rows=8))
