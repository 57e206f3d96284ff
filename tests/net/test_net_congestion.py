"""A network that is slower than the board: with `drop` messages are dropped, with `block` the board's port runs over.
Either way the reader knows how much did not come."""

from types import SimpleNamespace

import pytest
import small_port
from fake_board import wait_until
from net_processes import Relay, free_endpoint
from small_port import SmallPort, published

import contactfpga
from contactfpga.robot.net import port as net_port
from contactfpga.robot.net import publisher, session
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
        session.listening(f"{endpoint}#so_sndbuf=4096") as network,
        Relay(endpoint, BYTES_S) as relay,
        published(source := SmallPort(), network, "slow", block=block) as sends,
        contactfpga.open(f"zenoh://slow?connect={relay.endpoint}&wait=60", timeout=LONG) as board,
    ):
        unknown = settled(source, board)
        sent = source.sent
        source.go(2000.0)
        enough = lambda: source.overflowed > 200 if block else board.stats.net.lost_messages > 10  # noqa: E731
        wait_until(lambda: source.sent - sent >= 3000 and enough())
        source.go(0.0)
        relay.bytes_s = 10**7
        assert settled(source, board) == unknown, "every frame came, or is counted"
        sends.end()
        wait_until(lambda: last_message(board) == sends.sent - 1)
        stats, net = board.stats, board.stats.net
    assert stats.restarts == net.refused == 0
    assert stats.lost > 100
    if block:
        assert net.lost_messages == 0
        assert source.overflowed >= stats.lost
    else:
        assert net.lost_messages > 10
        assert net.lost_bytes > 15 * (stats.lost - source.overflowed) > 0


def test_a_port_does_not_run_over_while_bytes_are_collected(monkeypatch):
    """For 0.6 s, in which three times as many come as the port holds."""
    now_s = [0.0]
    clock = SimpleNamespace(monotonic=lambda: now_s[0], sleep=lambda s: now_s.append(now_s.pop() + s))
    for user in (small_port, publisher):
        monkeypatch.setattr(user, "time", clock)
    source = SmallPort()
    source.port_bytes = 1024
    source.go(300.0)
    with session.listening(free_endpoint()) as network:
        slow = publisher.BoardPublisher(source, network, "slow", batch_s=0.6)
        slow.run(SimpleNamespace(is_set=lambda: source.sent > 400))
    assert source.overflowed == 0
    assert slow.sent < 3 + now_s[0] / 0.6


def last_message(board):
    """The number of the last one, from what is counted since the first."""
    port = board._link.transport
    return port.first + port.counters.messages + port.counters.lost_messages - 1


def settled(source, board):
    """Frames that the board has sent and the reader does not know of, once a hello has come that counts them all."""
    # Over and over, as a network that is still slow drops it.
    wait_until(lambda: source.say_hello() or board.hello.sent == source.sent, pause_s=0.3)
    stats = board.stats
    return source.sent - stats.frames - stats.lost - stats.unexplained
