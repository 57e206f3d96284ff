"""Random histories of a network, message by message, at a ``zenoh://`` port: what it delivers and what it counts."""

import binascii
import itertools
import random
import sys
from types import SimpleNamespace

import pytest

import contactfpga
from contactfpga.robot.net import port as net_port
from contactfpga.robot.net.message import BREAK_S, MOST_BYTES, Message

zenoh = pytest.importorskip("zenoh")

KEY = "contactfpga/left"


def test_a_missing_extra_is_one_here_too(monkeypatch):
    monkeypatch.setitem(sys.modules, "zenoh", None)
    with pytest.raises(contactfpga.MissingExtra, match=r"pip install 'contactfpga\[net\]'"):
        contactfpga.open(f"zenoh://{KEY}")


class Network:
    """In place of Zenoh: the test hands over messages and tokens itself."""

    def __init__(self, *first):
        self.said, self.first = [], first

    def declare_publisher(self, key, **_):
        return SimpleNamespace(put=lambda data: self.said.append((key, data)), undeclare=lambda: None)

    def declare_subscriber(self, key, callback):
        if key.endswith("/alive/*"):
            self._note = callback
        else:
            self._take = callback
            for payload in self.first:
                self.arrive(payload)

    def liveliness(self):
        return self

    def close(self):
        pass

    def token(self, number, alive):
        kind = zenoh.SampleKind.PUT if alive else zenoh.SampleKind.DELETE
        self._note(SimpleNamespace(kind=kind, key_expr=f"{KEY}/alive/{number:016x}"))

    def stray_token(self, name, kind):
        self._note(SimpleNamespace(kind=kind, key_expr=f"{KEY}/alive/{name}"))

    def arrive(self, payload):
        self._take(SimpleNamespace(payload=SimpleNamespace(to_bytes=lambda: payload)))


class Clock:
    """In place of the module ``time``."""

    now_s = 1000.0

    def monotonic(self):
        return self.now_s


@pytest.fixture
def clock(monkeypatch):
    monkeypatch.setattr(net_port, "time", Clock())
    return net_port.time


@pytest.fixture
def network(clock, monkeypatch):
    network = Network(Message(99, 0, 0, 0, 0, b"").encode())
    monkeypatch.setattr(net_port.session, "connected", lambda *_: network)
    return network


@pytest.fixture
def opened(network):
    """A message came, of a publisher that nothing more is heard of."""
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
    losing, arrived, old = rng.choice([0.0, 0.1, 0.5]), 1, []
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
    for last in (sender.send(1), sender.send(1)):
        network.arrive(last.encode())
    reader.read()
    counters = opened.counters
    numbers = [number for number, _ in reader.found]
    assert numbers == sorted(set(numbers)), "in order, and none twice"
    assert set(numbers) <= set(range(sender.packets))
    assert len(numbers) > 20
    assert counters.messages + counters.refused == arrived + 2
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
    sender, stranger, changes, arrived, strange = Sender(rng, 1, 0, 0), None, 0, 1, 0
    heard = 0  # messages of the one that is to be read, of which two make it known
    for _ in range(600):
        chance = rng.random()
        if chance < 0.02 and heard > 1:
            network.token(sender.number, False)
            if stranger is not None and rng.random() < 0.5:
                sender, stranger = stranger, None
            else:
                number += 1
                sender = Sender(rng, number, number, sender.packets + 1000)
                network.token(number, True)
            changes, heard = changes + 1, 0
        elif chance < 0.04 and stranger is None and heard > 1:
            number += 1
            stranger = Sender(rng, number, number, sender.packets + 1_000_000)
            network.token(number, True)
        elif chance < 0.06 and stranger is not None:
            network.token(stranger.number, False)
            stranger = None
        elif chance < 0.3 and stranger is not None and heard > 1:
            network.arrive(stranger.send(3).encode())
            arrived, strange = arrived + 1, strange + 1
        elif chance < 0.9:
            message = sender.send(4)
            network.arrive(message.encode())
            arrived, heard = arrived + 1, heard + 1
        reader.read()
        assert opened.counters.messages + opened.counters.refused in (arrived, arrived - 1)
    eras = [era for _, era in reader.found]
    assert len(eras) > 100
    changed = sum(before != after for before, after in itertools.pairwise(eras))
    assert changed <= changes, "frames of two boards are never mixed"
    assert opened.counters.passed_breaks == opened.counters.breaks
    assert opened.counters.publishers in (changes, changes + 1)
    assert opened.counters.refused <= strange + 1
    assert changes > 1
    assert strange > 5


def test_what_is_not_read_in_time_is_left_out_and_counted_in_bytes(network, opened, monkeypatch):
    """The oldest; and what follows comes after a break, one for each hole."""
    monkeypatch.setattr(net_port, "MOST_WAITING", 12)
    pieces = (b"", b"abc", b"defg", b"hijk", b"lmnop", b"qrst")
    for sequence, data in enumerate(pieces):
        network.arrive(Message(1, sequence, len(b"".join(pieces[:sequence])), sequence, 0, data).encode())
    assert [opened.read(0.0), opened.read(0.0)] == [b"\0lmnopqrst", b""]
    counters = opened.counters
    assert (counters.left_out, counters.breaks, counters.passed_breaks) == (11, 1, 1)


def test_a_publisher_of_another_release_is_named(network, monkeypatch):
    (message,) = network.first
    network.first = [b"cfp2" + message[4:]]
    monkeypatch.setattr(net_port, "FOUND_S", 0.0)
    with pytest.raises(contactfpga.VersionMismatch, match=r"another version than 1, .*same release on both computers"):
        net_port.ZenohPort(f"zenoh://{KEY}")
    network.first += [message]
    port = net_port.ZenohPort(f"zenoh://{KEY}")
    for sequence in range(2):
        network.arrive(Message(1, sequence, sequence, 0, 0, b"x").encode())
    assert port.read(0.0) == b"xx", "but who sends what can be read is read"
    network.arrive(b"cfp2" + message[4:])
    assert port.read(0.0) == b""


@pytest.fixture
def read(network, opened):
    """One whose publisher is known."""
    for sequence in range(3):
        network.arrive(Message(1, sequence, sequence, 0, 0, b"x").encode())
    assert opened.read(0.0) == b"xxx"
    return opened


def after(port, clock, seconds):
    """What reading says when so much more time has passed: it is lost, or goes on."""
    clock.now_s += seconds
    try:
        return port.read(0.0)
    except contactfpga.PortLost as error:
        return str(error)


def test_tokens_of_others_hide_no_death(network, read, clock):
    """Nor do tokens that no publisher declares."""
    for name in ("", "x", "1" * 17, "00000000deadbeef", "٣" * 16):
        network.stray_token(name, zenoh.SampleKind.PUT)
        network.stray_token(name, zenoh.SampleKind.DELETE)
    network.token(1, True)
    assert after(read, clock, 60.9) == b""
    said = after(read, clock, 0.2)
    assert "its publisher ended, or the network is broken (messages under its key that it did not send: 1; " in said


def test_a_token_that_is_withdrawn_ends_a_publisher_only_if_it_is_silent(network, read, clock):
    network.token(1, False)
    assert after(read, clock, 59.9) == b""
    network.arrive(Message(1, 3, 3, 0, 0, b"y").encode())
    assert after(read, clock, 60.9) == b"y"
    assert after(read, clock, 0.0) == b"", "it was somebody else who declared and withdrew the same token"
    network.token(1, False)
    assert "is gone" in after(read, clock, 0.0)


def test_what_is_silent_while_this_process_stands_still_is_not_gone(network, read, clock, monkeypatch):
    """As a stopped program, or one that gets no processor: what was sent meanwhile comes after it has looked."""

    def waits(more_s):
        lasts = lambda timeout_s: setattr(clock, "now_s", clock.now_s + timeout_s + more_s)  # noqa: E731
        monkeypatch.setattr(read._changed, "wait", lasts)

    for sequence in (3, 4):
        waits(100.0)
        for _ in range(3):
            assert after(read, clock, 0.0) == b""
        network.arrive(Message(1, sequence, sequence, 0, 0, b"y").encode())
        assert read.read(0.0) == b"y"
    assert after(read, clock, 0.0) == b""
    waits(0.1)
    assert after(read, clock, 60.8) == b"", "that it stood still before is counted once"
    waits(0.3)
    assert after(read, clock, 0.0) == b""
    waits(0.1)
    assert "is gone" in after(read, clock, 0.1), "and the rest of the time is not"


def test_whoever_forges_a_message_and_a_token_keeps_nobody_out(network, opened, clock):
    """What a reader does who is there first: a forged message, then the publisher, whose messages come in beats."""
    network.arrive(Message(7, 1 << 63, 1 << 63, 0, 0, b"forged").encode())
    network.token(7, True)
    for sequence in range(3):
        clock.now_s += 0.25
        network.arrive(Message(1, sequence, sequence, 0, 0, b"x").encode())
    assert opened.read(0.0) == b"xxx"
