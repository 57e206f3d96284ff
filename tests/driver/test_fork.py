"""After `fork` an open board is the parent's: the child is told so, ends as usual, and leaves the parent's port alone.

Each test runs a program of its own, as a child of pytest would run pytest's ends.
"""

import os
import subprocess
import sys

import pytest
from fake_board import FakeBoard
from terminals import environment

from contactfpga import Skin

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")

HEAD = """
import contactfpga, os, sys, threading, time
from contactfpga import BoardClosed, ContactFPGAError, PortBusy
port = sys.argv[1]

def child(work, end=sys.exit):
    '''The status of a child that does this work; 99: it did not end.'''
    number = os.fork()
    if not number:
        work()
        end(0)
    until = time.monotonic() + 100
    while time.monotonic() < until:
        ended, status = os.waitpid(number, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.002)
    os.kill(number, 9)
    os.waitpid(number, 0)
    return 99

def refused(call):
    try:
        call()
    except BoardClosed as error:
        assert "was opened in another process; open it anew in this one" in str(error), error
    else:
        raise AssertionError(f"{call} was not refused")
"""


def run(program, *arguments):
    """Output of a program in a process of its own."""
    command = [sys.executable, "-c", HEAD + program, *map(str, arguments)]
    path = os.pathsep.join(sys.path)
    done = subprocess.run(command, capture_output=True, text=True, timeout=250, env=environment(PYTHONPATH=path))
    assert done.returncode == 0, done.stderr
    assert [line for line in done.stderr.splitlines() if not line.startswith("contactfpga: building")] == []
    return done.stdout


def test_a_child_has_no_board_and_ends_as_usual(board):
    board.hello_s = 0.1
    program = """
from contactfpga.driver.requests import Requests
Requests.retry_s = property(lambda self: 60.0, lambda self, seconds: None)  # it asks no second time for a late answer
board = contactfpga.open(port, timeout=60)
frames = board.subscribe()
calls = [board.read, board.next, board.latest, board.batch, board.clock, lambda: board.command(1), board.self_test,
         lambda: board.sheet, lambda: board.silence, board.subscribe, board.events, frames.next,
         board.__iter__().__next__]

def work():
    for call in calls:
        refused(call)
    assert board.port == port and board.live
    frames.close()
    board.close()
    with board:
        pass

print([child(work), child(work, os._exit), child(lambda: None)])
zones = board.read(60)
board.close()
print(len(zones), board.stats.lost, sum(board.stats.damaged.values()))
again = contactfpga.open(port, timeout=60)
"""
    assert run(program, board.path) == "[0, 0, 0]\n1 0 0\n"
    assert board.asked <= 6, "no child asked"


@pytest.mark.slow
def test_children_of_a_busy_board_end_at_any_moment(board):
    """Children end though other threads of the parent read, request and hold locks at the fork."""
    board.stream = board.frame
    board.hello_s = 0.05
    program = """
board = contactfpga.open(port, timeout=60)
done = threading.Event()

def keep(call):
    while not done.is_set():
        call(60.0)

def work():
    refused(board.read)
    refused(board.next)
    board.close()

threads = [threading.Thread(target=keep, args=(call,)) for call in (board.read, board.next, board.latest)]
for thread in threads:
    thread.start()
print({child(work) for _ in range(15)}, len(board.read(60)))
done.set()
for thread in threads:
    thread.join()
"""
    assert run(program, board.path) == "{0} 1\n"


def test_a_child_may_open_boards_of_its_own_but_not_a_port_that_the_parent_reads(board):
    program = """
contactfpga.read_zones(port, 60)

def work():
    try:
        contactfpga.read_zones(port)
    except PortBusy as error:
        assert "another program" in str(error), error
    else:
        raise AssertionError("the child reads the parent's port")
    with contactfpga.open("sim://") as board:
        board.read()
    with contactfpga.open(sys.argv[2], timeout=60) as board:
        board.read(60)

print(child(work), len(contactfpga.read_zones(port, 60)))
"""
    with FakeBoard(Skin()) as second:
        assert run(program, board.path, second.path) == "0 1\n"


def test_the_parents_port_is_given_back_though_a_child_goes_on(board):
    program = """
board = contactfpga.open(port, timeout=60)
(said, says), (out, into) = os.pipe(), os.pipe()
number = os.fork()
if not number:
    os.close(into)
    os.write(says, b"x")
    os.read(out, 1)  # until the parent ends
    os._exit(0)
os.read(said, 1)
board.close()
print(len(contactfpga.open(port, timeout=60).read(60)))
"""
    assert run(program, board.path) == "1\n"


def test_what_is_recorded_is_written_once(board, tmp_path):
    file = tmp_path / "bytes.rec"
    program = """
board = contactfpga.open(port, timeout=60, record=sys.argv[2])
for _ in range(20):
    board.read(60)
assert not os.path.getsize(sys.argv[2]), "nothing waits to be written, so that this test tests nothing"
print([child(lambda: None), child(board.close)])
board.read(60)
board.close()
print(board.stats.bytes)
"""
    status, count = run(program, board.path, file).splitlines()
    assert status == "[0, 0]"
    assert file.stat().st_size == int(count)
