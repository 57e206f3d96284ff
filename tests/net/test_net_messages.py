"""Messages and what is missing between them, without a network: nothing wrong is delivered, what is lost is counted."""

import dataclasses
import random

import pytest
from model_board import ModelBoard

import contactfpga
from contactfpga.driver.address import parse
from contactfpga.driver.conversation import Conversation, frames_in
from contactfpga.driver.stats import NetCounters
from contactfpga.robot.net.message import BEAT_S, QUIET_S, Message, Stream
from contactfpga.robot.net.session import LOOPBACK, is_loopback, key_of, own_endpoint
from contactfpga.wire.command import Command, RequestKind, encode_command, request_kind
from contactfpga.wire.protocol import encode_request

SKIN = contactfpga.Skin()


class Sender:
    """A publisher in simulated time."""

    def __init__(self, rng):
        self.number, self.sequence, self.offset, self.rng = rng.getrandbits(64), 0, 0, rng

    def send(self, data, now_s):
        message = Message(self.number, self.sequence, self.offset, round(now_s * 1e6), 0, data)
        self.sequence += 1
        self.offset += len(data)
        return message.encode()


class Receiver:
    """What a ``zenoh://`` port and the driver make of messages."""

    def __init__(self):
        self.counters = NetCounters()
        self.stream = Stream(self.counters)
        self.host = Conversation("x")
        self.frames = []

    def take(self, payload, now_s):
        for data, after_break in self.stream.take(payload, now_s):
            if after_break:
                self.host.doubt(now_s)
            self.frames += frames_in(self.host.receive(data, now_s))


@pytest.mark.parametrize("seed", range(4))
def test_whatever_is_lost_nothing_wrong_is_delivered(seed):
    """Holes of up to 40 s, in which a frame's time wraps; jams, after which all comes at once; messages twice and late;
    publishers that start again."""
    rng = random.Random(seed)
    board, sender, receiver = ModelBoard(SKIN), Sender(rng), Receiver()
    begun_s, now_s, sent, last_hello_s, old, jam = 0.0, 0.0, set(), -1.0, [], []
    jammed = 0
    for turn in range(2000):
        step_s = rng.choice([0.01, 0.01, 0.01, 0.3, rng.uniform(0, 40)]) if rng.random() < 0.03 else 0.01
        lost = turn > 20 and (step_s > 0.02 or rng.random() < 0.05)
        jammed = rng.randrange(100) if rng.random() < 0.005 else jammed - 1
        now_s += step_s
        board.time_us = round((now_s - begun_s) * 1e6)
        data = b""
        if now_s > last_hello_s + 0.5:
            data, last_hello_s = board.hello(), now_s
        for _ in range(rng.randrange(1, 5)):
            sent.add((board.time_us, board.sent % 256))
            data += board.frame()
        cut = rng.randrange(len(data))
        payloads = [sender.send(data[:cut], now_s), sender.send(data[cut:], now_s)]
        old.append(payloads[0])
        for payload in payloads:
            if not lost and (turn < 20 or rng.random() > 0.02):
                jam.append(payload)
        while jam and jammed <= 0:
            receiver.take(jam.pop(0), now_s)
        if rng.random() < 0.02:
            receiver.take(rng.choice(old), now_s)  # comes again
        if rng.random() < 0.01:
            sender = Sender(rng)
            receiver.stream.ended = rng.random() < 0.5  # else it was cut off and will be missed
            old.clear()
    assert {(zones.time_us, zones.sequence) for zones in receiver.frames} <= sent
    times = [zones.time_us for zones in receiver.frames]
    assert times == sorted(set(times))
    assert len(times) > 100
    stats = receiver.host.stats
    now_s += QUIET_S  # the last publisher may be a new one, of whose first messages none counted
    for payload in (*jam, sender.send(b"", now_s), sender.send(board.hello(), now_s), sender.send(b"", now_s)):
        receiver.take(payload, now_s)
    assert stats.frames + stats.lost + stats.unexplained == len(sent)
    assert receiver.counters.lost_messages > 20
    assert receiver.counters.breaks > 3
    assert stats.restarts == 0


class Stranger:
    """Forges messages out of one that it read."""

    def __init__(self, rng):
        self.rng = rng

    def forge(self, payload):
        """A message of the same publisher or of another, which begins somewhere near or far, or continues the one that
        was read."""
        read, rng = Message.decode(payload), self.rng
        far = [1, 2, 3, 300, 1 << 32, (1 << 63) - 1]
        after = {"sequence": read.sequence + 1, "offset": read.offset + len(read.data)}
        kind = rng.randrange(4)
        if kind == 1:
            after = {name: value + rng.choice(far) for name, value in after.items()}
        elif kind == 2:
            after = {name: rng.choice([0, 1, value // 2, (1 << 64) - 1]) for name, value in after.items()}
        elif kind == 3:
            after["publisher"] = rng.getrandbits(64)
        data = bytes(rng.randrange(1, 255) for _ in range(rng.choice([0, 1, 40, 5000])))
        read_us = read.read_us + rng.choice([0, 1, 1000, -1, 10**9, -(10**9)])
        return dataclasses.replace(read, **after, data=data, read_us=read_us).encode()


@pytest.mark.parametrize("seed", range(60))
def test_after_any_forged_message_a_reader_goes_on_within_a_second(seed):
    """At any place, the beginning included, between messages that are 10 ms or a beat apart and may get lost."""
    rng = random.Random(seed)
    sender, counters, now_s = Sender(rng), NetCounters(), 1000.0
    stream, step_s, losing = Stream(counters), rng.choice([0.01, BEAT_S]), rng.choice([0.0, 0.0, 0.3])
    forged_at, found, sent = rng.choice([0, 1, 2, rng.randrange(3, 20)]), b"", {}
    read = sender.send(b"-first-", now_s)
    for number in range(forged_at):
        if rng.random() >= losing:
            read = sender.send(b"<%d>" % number, now_s)
            stream.take(read, now_s)
        now_s += step_s
    forged = Stranger(rng).forge(read)
    found += b"".join(piece for piece, _ in stream.take(forged, now_s))
    forged_s, believed = now_s, counters.messages
    for number in range(1000, 1000 + round(3 / step_s)):
        now_s += step_s
        message = sender.send(b"<%d>" % number, now_s)
        if rng.random() >= losing:
            sent[b"<%d>" % number] = now_s
            found += b"".join(piece for piece, _ in stream.take(message, now_s))
    last = list(sent)[-1]  # which may still be doubted
    late = [text for text, at_s in sent.items() if text not in found and text != last]
    assert all(sent[text] - forged_s < 1.0 for text in late)
    assert counters.refused <= len(late) + 2
    assert counters.messages > believed
    if step_s == 0.01 and not losing and Message.decode(forged).data not in found:
        assert not late, "what was forged and not believed costs nothing"


def test_a_hole_is_counted_in_messages_and_bytes_and_makes_no_packet_of_two():
    rng, counters = random.Random(1), NetCounters()
    sender, stream = Sender(rng), Stream(counters)
    assert stream.take(sender.send(b"abc", 0.0), 0.0) == [], "the first one, until another bears it out"
    assert stream.take(sender.send(b"def", 0.1), 0.1) == [(b"abc", False), (b"def", False)]
    sender.send(b"12345", 0.2)
    sender.send(b"67", 0.3)
    assert stream.take(sender.send(b"ghi", 0.4), 0.4) == []
    sender.send(b"8", 0.5)
    assert stream.take(sender.send(b"jkl", 0.6), 0.6) == [(b"\0ghi", False)]
    assert stream.take(sender.send(b"mno", 0.7), 0.7) == [(b"\0jkl", False), (b"mno", False)]
    assert (counters.lost_messages, counters.lost_bytes, counters.breaks, counters.messages) == (3, 8, 0, 5)


@pytest.mark.parametrize("step_s", [-0.001, -3600.0, 2.1, 3600.0])
def test_a_step_of_the_publishers_clock_is_a_break(step_s):
    """Or its process stood still, and its port ran over meanwhile: the same from here."""
    counters, sender = NetCounters(), Sender(random.Random(1))
    stream = Stream(counters)
    stream.take(sender.send(b"", 1000.0), 0.0)
    stream.take(sender.send(b"a", 1000.0), 0.0)
    assert stream.take(sender.send(b"b", 1000.0 + step_s), 0.0) == [(b"\0b", True)]
    assert stream.take(sender.send(b"c", 1000.1 + step_s), 0.0) == [(b"c", False)]
    assert counters.breaks == 1


# ---- what may go to a board


def test_requests_pass_in_both_forms_and_commands_are_told_apart():
    for pulsed in (False, True):
        request = encode_request(0x10101, hello=True, pulsed=pulsed)
        command = encode_command(0x10101, Command(1, 5), pulsed=pulsed)
        assert request_kind(request) is RequestKind.REQUEST
        assert request_kind(request + request) is RequestKind.REQUEST
        assert request_kind(command) is RequestKind.COMMAND
        assert request_kind(request + command) is RequestKind.COMMAND
        for cut in range(1, len(request)):
            assert request_kind(request[:cut]) is RequestKind.OTHER
            assert request_kind(request[cut:]) is RequestKind.OTHER


# ---- addresses


def test_addresses():
    address = parse("zenoh://contactfpga/left?connect=tcp/10.0.0.2:7447&wait=30&config=a%26b.json5")
    assert (address.key, address.connect, address.wait_s) == ("contactfpga/left", "tcp/10.0.0.2:7447", 30.0)
    assert address.config == "a&b.json5"


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("zenoh://", "key is ''"),
        ("zenoh://a/*", "key is 'a/*'"),
        ("zenoh://a//b", "key is 'a//b'"),
        ("zenoh://a?wait=-1", "wait is '-1'"),
        ("zenoh://a?wait=nan", "wait is 'nan'"),
        ("zenoh://a?speed=1", "'speed=1' is no option"),
        ("zenoh://a?wait=1&wait=2", "given twice"),
    ],
)
def test_addresses_that_cannot_be_are_refused_before_anything_is_opened(name, said):
    with pytest.raises(contactfpga.AddressError) as caught:
        contactfpga.open(name)
    assert said in str(caught.value)


def test_which_endpoints_are_this_machine_alone():
    here = ["tcp/127.0.0.1:7447", "tls/localhost:1", "tcp/[::1]:7447", "unixsock-stream//tmp/x", "udp/127.3.2.1:1?x=y"]
    there = [
        "tcp/0.0.0.0:7447",
        "tcp/[::]:7447",
        "tcp/192.168.0.1:7447",
        "tls/robot.local:7447",
        "tcp/127.0.0.1.nip.io:1",
    ]
    assert all(map(is_loopback, [*here, LOOPBACK, own_endpoint()]))
    assert not any(map(is_loopback, there))


def test_keys_come_from_names():
    assert key_of("left forearm", b"\1\2") == "contactfpga/left-forearm"
    assert key_of("", b"\1\2") == "contactfpga/0102"
