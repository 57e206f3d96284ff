"""Random histories of a network, message by message, at a ``zenoh://`` port: what it delivers and what it counts."""

import binascii
import itertools
import random
from types import SimpleNamespace

import pytest

import contactfpga
from contactfpga.net import port as net_port
from contactfpga.net.message import BREAK_S, MOST_BYTES, Message

zenoh = pytest.importorskip("zenoh")

KEY = "contactfpga/left"


class Network:
    """In place of Zenoh: the test hands over messages and tokens itself."""

    def __init__(self):
        self.said = []

    def declare_publisher(self, key, **_):
        return SimpleNamespace(put=lambda data: self.said.append((key, data)), undeclare=lambda: None)

    def declare_subscriber(self, key, callback, **options):
        if options:
            self._note = callback
            self.token(1, True)
        else:
            self._take = callback

    def liveliness(self):
        return self

    def close(self):
        pass

    def token(self, number, alive):
        kind = zenoh.SampleKind.PUT if alive else zenoh.SampleKind.DELETE
        self._note(SimpleNamespace(kind=kind, key_expr=f"{KEY}/alive/{number:016x}"))

    def stray_token(self, name):
        self._note(SimpleNamespace(kind=zenoh.SampleKind.PUT, key_expr=f"{KEY}/alive/{name}"))

    def arrive(self, payload):
        self._take(SimpleNamespace(payload=SimpleNamespace(to_bytes=lambda: payload)))


@pytest.fixture
def network(monkeypatch):
    network = Network()
    monkeypatch.setattr(net_port.session, "connected", lambda *_: network)
    return network


@pytest.fixture
def opened(network):
    return net_port.ZenohPort(f"zenoh://{KEY}?wait=60")


def packet(number, era):
    text = b"%d,%d" % (number, era)
    return b"%s,%08x\0" % (text, binascii.crc32(text))


def whole(data):
    """(number, era) of each packet that came whole, as a driver checks it."""
    for piece in data.split(b"\0"):
        text, _, check = piece.rpartition(b",")
        if text and check == b"%08x" % binascii.crc32(text):
            yield tuple(map(int, text.split(b",")))


class Sender:
    """A publisher whose packets carry their number and the era: it changes where times are not known any more."""

    def __init__(self, rng, number, era, first):
        self.rng, self.number, self.era, self.packets = rng, number, era, first
        self.sequence = self.offset = 0
        self.now_us = rng.randrange(1 << 40)
        self._left = b""

    def send(self, most):
        """A message, which may end within a packet."""
        data, last = self._left, b""
        for _ in range(self.rng.randrange(most)):
            data += (last := packet(self.packets, self.era))
            self.packets += 1
        cut = len(data) - self.rng.randrange(max(1, len(last)))
        data, self._left = data[:cut], data[cut:]
        self.now_us += self.rng.randrange(1, round(BREAK_S * 0.9e6))
        message = Message(self.number, self.sequence, self.offset, self.now_us, 0, data)
        self.sequence += 1
        self.offset += len(data)
        return message

    def jump(self):
        """Its clock is set, or it stood still."""
        self.now_us += self.rng.choice([-(10**9), 3_000_000, 10**12])
        self.era += 1


class Reader:
    """Reads what there is; no packets of two eras without a break that shows between them."""

    def __init__(self, port):
        self.port, self.found, self.bytes = port, [], 0
        self._state = None

    def read(self):
        while data := self.port.read(0.0):
            self.bytes += len(data.replace(b"\0", b""))
            self.found += (came := list(whole(data)))
            for _, era in came:
                breaks = self.port.counters.passed_breaks
                assert self._state is None or era == self._state[0] or breaks > self._state[1]
                self._state = era, breaks


@pytest.mark.parametrize("seed", range(20))
def test_random_histories_of_one_publisher(network, opened, seed, monkeypatch):
    """Messages that are lost, come twice, late or damaged; clocks that jump; readers that are too slow."""
    rng = random.Random(seed)
    monkeypatch.setattr(net_port, "MOST_WAITING", rng.choice([400, 1 << 24]))
    sender, reader = Sender(rng, 1, 0, 0), Reader(opened)
    losing, arrived, old = rng.choice([0.0, 0.1, 0.5]), 0, []
    for _ in range(400):
        if rng.random() < 0.02:
            sender.jump()
        message = sender.send(rng.choice([1, 12]))
        old.append(message)
        if rng.random() < 0.05:
            network.arrive(rng.choice(old[-5:]).encode())  # perhaps before its turn, or again
            arrived += 1
        if rng.random() < 0.03:
            network.arrive(rng.choice([b"", b"cfp1", rng.randbytes(60), message.encode() + bytes(MOST_BYTES + 1)]))
            arrived += 1
        if rng.random() >= losing:
            network.arrive(message.encode())
            arrived += 1
        if rng.random() < 0.2:
            reader.read()
    last = sender.send(1)
    network.arrive(last.encode())
    reader.read()
    counters = opened.counters
    numbers = [number for number, _ in reader.found]
    assert numbers == sorted(set(numbers)), "in order, and none twice"
    assert set(numbers) <= set(range(sender.packets))
    assert len(numbers) > 20
    assert counters.messages + counters.refused == arrived + 1
    first = next(one for one in old if one.sequence == last.sequence + 1 - counters.messages - counters.lost_messages)
    assert first in old[:40], "all messages since the first that came are counted"
    sent = b"".join(one.data for one in old[first.sequence :]) + last.data
    delimiters = sent.count(b"\0")
    assert counters.lost_bytes + counters.left_out + reader.bytes <= len(sent)
    assert counters.lost_bytes + counters.left_out + reader.bytes + delimiters >= len(sent)
    assert counters.passed_breaks == counters.breaks


@pytest.mark.parametrize("seed", range(10))
def test_random_histories_of_publishers(network, opened, seed):
    """They end, and are killed, and start again; a second one under the same key is not heard as long as the first
    one runs. Whoever follows comes after a break."""
    rng = random.Random(100 + seed)
    reader, number = Reader(opened), 1
    sender, stranger, changes, refused = Sender(rng, 1, 0, 0), None, 0, 0
    heard = False
    for _ in range(600):
        chance = rng.random()
        if chance < 0.02 and heard:
            network.token(sender.number, False)
            if stranger is not None and rng.random() < 0.5:
                sender, stranger = stranger, None
            else:
                number += 1
                sender = Sender(rng, number, number, sender.packets + 1000)
                network.token(number, True)
            changes, heard = changes + 1, False
        elif chance < 0.04 and stranger is None and heard:
            number += 1
            stranger = Sender(rng, number, number, sender.packets + 1_000_000)
            network.token(number, True)
        elif chance < 0.06 and stranger is not None:
            network.token(stranger.number, False)
            stranger = None
        elif chance < 0.3 and stranger is not None and heard:
            network.arrive(stranger.send(3).encode())
            refused += 1
        elif chance < 0.9:
            message = sender.send(4)
            network.arrive(message.encode())
            heard = True
        reader.read()
        assert opened.counters.refused == refused
    eras = [era for _, era in reader.found]
    assert len(eras) > 100
    changed = sum(before != after for before, after in itertools.pairwise(eras))
    assert changed <= changes, "frames of two boards are never mixed"
    assert opened.counters.passed_breaks == opened.counters.breaks
    assert opened.counters.publishers in (changes, changes + 1)
    assert changes > 1
    assert refused > 5


def test_what_is_not_read_in_time_is_left_out_and_counted_in_bytes(network, opened, monkeypatch):
    """The oldest; and what follows comes after a break, one for each hole."""
    monkeypatch.setattr(net_port, "MOST_WAITING", 12)
    pieces = (b"abc", b"defg", b"hijk", b"lmnop", b"qrst")
    for sequence, data in enumerate(pieces):
        network.arrive(Message(1, sequence, len(b"".join(pieces[:sequence])), sequence, 0, data).encode())
    assert [opened.read(0.0), opened.read(0.0)] == [b"\0lmnopqrst", b""]
    counters = opened.counters
    assert (counters.left_out, counters.breaks, counters.passed_breaks) == (11, 1, 1)


def test_a_publisher_of_another_release_is_named(network, opened):
    message = Message(1, 0, 0, 0, 0, b"x").encode()
    network.arrive(b"cfp2" + message[4:])
    with pytest.raises(contactfpga.VersionMismatch, match=r"another version than 1, .*same release on both computers"):
        opened.read(0.0)
    network.arrive(message)
    assert opened.read(0.0) == b"x", "but who sends what can be read is read"
    network.arrive(b"cfp2" + message[4:])
    assert opened.read(0.0) == b""


def test_an_empty_message_that_comes_twice_is_refused(network, opened):
    for _ in range(2):
        network.arrive(Message(1, 5, 100, 0, 0, b"").encode())
    assert (opened.counters.messages, opened.counters.lost_messages, opened.counters.refused) == (1, 0, 1)


def test_tokens_that_no_publisher_declares_are_none(network, opened):
    for name in ("", "x", "1" * 17, "0x00000000000000", "٣" * 16):
        network.stray_token(name)
    network.token(1, False)
    opened._gone_s -= 61.0
    with pytest.raises(contactfpga.PortLost):
        opened.read(0.0)
