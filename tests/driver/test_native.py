"""The thread in C that reads ports: it gives everything back, waits for no Python thread, and says what a thread in
Python says."""

import ctypes
import gc
import itertools
import os
import signal
import subprocess
import sys
import threading

import pytest
from fake_board import background

import contactfpga
import hatch_build
from contactfpga.driver import health, native
from contactfpga.driver.native_link import NativeLink

pytestmark = [
    pytest.mark.skipif(bool(native.missing()), reason=native.missing()),
    pytest.mark.usefixtures("_asks_once"),
]
LONG = 60.0


def opened(board, **options):
    return contactfpga.open(board.path, reader="native", timeout=LONG, **options)


def test_the_port_is_free_when_its_program_is_killed(board, python):
    code = f"""
import contactfpga, os, signal, threading
board = contactfpga.open({board.path!r}, reader="native", timeout=60)
board.read(60)
threading.Thread(target=lambda: board.read(60), daemon=True).start()
os.kill(os.getpid(), signal.SIGKILL)
"""
    assert python(code).returncode == -signal.SIGKILL
    with opened(board) as host:
        assert len(host.read(LONG)) == 1


@pytest.mark.slow
@pytest.mark.skipif(not os.path.exists("/proc/self/fd"), reason="this system has no /proc")
def test_descriptors_and_threads_do_not_grow(board):
    def once():
        with opened(board) as host:
            host.read(LONG)
            with background(lambda: host.latest(LONG)):
                board.send(board.frame())
        gc.collect()

    once()
    before, threads = len(os.listdir("/proc/self/fd")), threading.active_count()
    for _ in range(3):
        once()
    assert len(os.listdir("/proc/self/fd")) <= before, "fewer, where an earlier test's are given back meanwhile"
    assert threading.active_count() <= threads


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
    with contactfpga.open(board.path, timeout=LONG) as host:
        assert isinstance(host._link, NativeLink)
        assert [found.sentence for found in health.reader(host)] == [
            f"{board.path} is read in C, which waits for no Python thread"
        ]
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


def test_the_newest_frame_does_not_wait_for_a_thread_that_works_through_frames(board):
    """`latest` is quick while a thread works through old frames, even if each frame starts another piece of the clock's
    fit."""
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


def test_a_library_of_older_sources_is_not_used(monkeypatch, tmp_path):
    (tmp_path / "older.c").write_text("int cfpga_open(void) { return 0; }")
    command = [*hatch_build.compiler(), "-shared", "-fPIC", "-o", str(tmp_path / "older.so"), str(tmp_path / "older.c")]
    subprocess.run(command, check=True)
    monkeypatch.setattr(native, "LIBRARY", tmp_path / "older.so")
    monkeypatch.setattr(native, "library", lambda: native.Library(native.LIBRARY))
    assert native.missing().endswith("install the package again")
