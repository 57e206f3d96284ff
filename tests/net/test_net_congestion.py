"""A network that is slower than the board: with `drop` messages are dropped, with `block` the board's port runs over.
Either way the reader knows how much did not come."""

import threading
import time

import pytest
from fake_board import wait_until
from model_board import ModelBoard
from net_processes import Relay, free_endpoint

import contactfpga
from contactfpga.driver import transport
from contactfpga.net import port as net_port
from contactfpga.net import session
from contactfpga.net.message import Message
from contactfpga.net.publisher import Publisher

pytest.importorskip("zenoh")

LONG = 60.0
RATE_HZ = 2000
BYTES_S = 15_000
"""Less than half of what the board sends then."""
PORT_BYTES = 4096


class SmallPort(ModelBoard):
    """A board behind a port with little memory: what does not find room is lost, frame by frame."""

    threaded = True

    def __init__(self):
        super().__init__(contactfpga.Skin())
        self.busy = False
        self.overflowed = 0
        self._kept, self._begun_s = b"", time.monotonic()
        self._due_s = self._hello_due_s = 0.0
        self._lock = threading.Lock()

    def _fill(self):
        now_s = time.monotonic()
        while self.busy and self._due_s < now_s:
            self._due_s = max(self._due_s + 1 / RATE_HZ, now_s - 0.5)
            self._send(1)

    def _send(self, count):
        self.time_us = max(self.time_us, round((time.monotonic() - self._begun_s) * 1e6))
        data = b"".join(self.frame() for _ in range(count))
        if len(self._kept) + len(data) <= PORT_BYTES:
            self._kept += data
        else:
            self.overflowed += count

    def say_hello(self):
        with self._lock:
            self._kept += self.hello()

    def write(self, data):
        with self._lock:
            for _, hello in self.hear(data):
                self._kept += self.hello() if hello else b""
                self._send(1)

    def read(self, timeout_s):
        until_s = time.monotonic() + timeout_s
        while True:
            with self._lock:
                self._fill()
                data, self._kept = self._kept, b""
            if data or time.monotonic() >= until_s:
                return data
            time.sleep(0.002)

    def clock(self):
        return time.monotonic()


class FirstKept(net_port.ZenohPort):
    """Keeps the first message's number."""

    first = None

    def _take(self, sample):
        if self.first is None:
            self.first = Message.decode(sample.payload.to_bytes()).sequence
        super()._take(sample)


@pytest.mark.parametrize("block", [False, True], ids=["drop", "block"])
def test_what_a_slow_network_does_not_take_is_counted(block, monkeypatch):
    monkeypatch.setattr(transport, "ZenohPort", FirstKept)
    endpoint = free_endpoint()
    source, stop = SmallPort(), threading.Event()
    with session.listening(f"{endpoint}#so_sndbuf=4096") as network, Relay(endpoint, BYTES_S) as relay:
        publisher = Publisher(source, network, "slow", block=block)
        thread = threading.Thread(target=publisher.run, args=(stop,))
        thread.start()
        with contactfpga.open(f"zenoh://slow?connect={relay.endpoint}&wait=60", timeout=LONG) as board:
            unknown = settled(source, board)
            source.busy = True
            time.sleep(1.5)
            source.busy = False
            relay.bytes_s = 10**7
            assert settled(source, board) == unknown, "every frame came, or is counted"
            stop.set()
            thread.join()
            wait_until(lambda: last_message(board) == publisher.sent - 1, LONG)
            stats, net = board.stats, board.stats.net
    assert stats.restarts == net.refused == 0
    assert stats.lost > 100
    if block:
        assert net.lost_messages == 0
        assert source.overflowed >= stats.lost
    else:
        assert net.lost_messages > 10
        assert net.lost_bytes > 15 * (stats.lost - source.overflowed) > 0


def last_message(board):
    """The number of the last one, from what is counted since the first."""
    port = board._link.transport
    return port.first + port.counters.messages + port.counters.lost_messages - 1


def settled(source, board):
    """Frames that the board has sent and the reader does not know of, once all that was on its way has come."""
    time.sleep(0.5)
    hellos = board.stats.hellos
    source.say_hello()
    wait_until(lambda: board.stats.hellos > hellos, LONG)
    stats = board.stats
    return source.sent - stats.frames - stats.lost - stats.unexplained
