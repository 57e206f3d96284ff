"""A network that is slower than the board: with `drop` messages are dropped, with `block` the board's port runs over.
Either way the reader knows how much did not come."""

import time

import pytest
from fake_board import wait_until
from net_processes import Relay, free_endpoint
from small_port import AwakeClock, SmallPort, published

import contactfpga
from contactfpga.robot.net import port as net_port
from contactfpga.robot.net import session
from contactfpga.robot.net.message import Message

pytest.importorskip("zenoh")

LONG = 60.0
BYTES_S = 15_000
"""Less than half of what the board sends."""


class FirstKept(net_port.ZenohPort):
    """Keeps the first message's number."""

    first = None

    def _take(self, sample):
        if self.first is None:
            self.first = Message.decode(sample.payload.to_bytes()).sequence
        super()._take(sample)


@pytest.mark.parametrize("block", [False, True], ids=["drop", "block"])
def test_what_a_slow_network_does_not_take_is_counted(block, monkeypatch, endpoint):
    monkeypatch.setattr(net_port, "ZenohPort", FirstKept)
    with (
        AwakeClock() as awake,
        session.listening(f"{endpoint}#so_sndbuf=4096") as network,
        Relay(endpoint, BYTES_S) as relay,
        published(source := SmallPort(now=awake.seconds), network, "slow", block=block) as publisher,
        contactfpga.open(f"zenoh://slow?connect={relay.endpoint}&wait=60", timeout=LONG) as board,
    ):
        unknown = settled(source, board)
        sent = source.sent
        source.go(2000.0)
        # For 1.5 s; while this process has to wait, none comes, and none is lost.
        wait_until(lambda: source.sent - sent >= 3000 and (block or board.stats.net.lost_messages > 10), LONG)
        source.go(0.0)
        relay.bytes_s = 10**7
        assert settled(source, board) == unknown, "every frame came, or is counted"
        publisher.end()
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


def test_a_port_does_not_run_over_while_bytes_are_collected():
    """For 0.6 s, in which three times as many come as the port holds. While this process has to wait, none comes."""
    with AwakeClock() as awake, session.listening(free_endpoint()) as network:
        source = SmallPort(now=awake.seconds)
        with published(source, network, "slow", batch_s=0.6) as publisher:
            source.port_bytes = 1024
            begun_s = time.monotonic()
            source.go(300.0)
            wait_until(lambda: source.sent > 400, LONG)
            publisher.end()
            took_s = time.monotonic() - begun_s
    assert source.overflowed == 0
    assert publisher.sent < 3 + took_s / 0.6


def last_message(board):
    """The number of the last one, from what is counted since the first."""
    port = board._link.transport
    return port.first + port.counters.messages + port.counters.lost_messages - 1


def settled(source, board):
    """Frames that the board has sent and the reader does not know of, once all that was on its way has come."""
    time.sleep(0.5)
    hellos = board.stats.hellos
    # Over and over, as a network that is still slow drops it.
    wait_until(lambda: source.say_hello() or board.stats.hellos > hellos, LONG, pause_s=0.3)
    stats = board.stats
    return source.sent - stats.frames - stats.lost - stats.unexplained
