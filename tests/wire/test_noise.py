"""Lost, repeated and garbage bytes: what they cost, and how much of garbage is taken for a frame."""

import math

import numpy as np
import pytest
from frames import receiver
from sample import sample
from wire import Wire, check, crc16

from contactfpga import Skin
from contactfpga.driver.conversation import Conversation, frames_in

REFERENCE = Skin()
SKINS = {
    "zones": REFERENCE,
    "zones of 32x32": Skin(rows=32, columns=32, settle_us=50.0),
    "barycenters": Skin(report="barycenter"),
    "cells": Skin(rows=12, columns=16, report="cells", settle_us=10.0),
}
LINES, GARBAGE = 2, 200
HIT = 2
"""The frame in which the line goes wrong; some come before it, more after."""


class Line:
    """A line on which six frames are sent, numbered by their sequence, one of them hit by an error."""

    def __init__(self, skin, rng):
        wire = Wire(skin)
        self.hello, self.sent = wire.hello(), []
        for index, zones in enumerate((0, 2, rng.randrange(4), 1, 3, 0)):
            options = {"sequence": index, "time": 96 * index + rng.randrange(90)}
            if skin.report == "cells":
                bitmap = [[rng.random() < 0.3 for _ in range(skin.columns)] for _ in range(skin.rows)]
                self.sent.append(wire.cells(bitmap, **options))
            else:
                self.sent.append(wire.zones([(4, rng.randrange(40), rng.randrange(40))] * zones, **options))
        self.before, self.hit = b"".join(self.sent[:HIT]), self.sent[HIT]
        self.behind = b"".join(self.sent[HIT + 1 :])
        self.frames, _ = self.receive(self.hit)
        assert len(self.frames) == len(self.sent)

    def receive(self, hit):
        """What arrives when the frame that is hit comes as these bytes: frames as text, and the counters."""
        host = Conversation("x")
        events = host.receive(self.hello + self.before + hit + self.behind, 0.0)
        reported = [repr(zones.to_dict() | {"flags": sorted(zones.frame.flags)}) for zones in frames_in(events)]
        return reported, host.stats

    def lost(self, hit):
        """Numbers of the frames that do not arrive; whatever arrives was sent, in order, and is counted right."""
        arrived, stats = self.receive(hit)
        numbers = [self.frames.index(frame) for frame in arrived]
        assert numbers == sorted(set(numbers))
        lost = sorted(set(range(len(self.sent))) - set(numbers))
        assert stats.lost == len(lost)
        assert stats.resynchronized == bool(stats.damaged)
        return lost


@pytest.fixture(params=sample(SKINS, quick=["zones", "barycenters"]))
def lines(request, rng):
    return [Line(SKINS[request.param], rng) for _ in range(LINES)]


def test_lost_runs_of_bytes_cost_no_frame_behind_the_next_one(lines, record_property):
    cases = 0
    for line in lines:
        for first in range(len(line.hit)):
            for last in range(first + 1, len(line.hit) + 1):
                lost = line.lost(line.hit[:first] + line.hit[last:])
                whole = first == 0 and last == len(line.hit)
                assert lost == ([HIT] if whole or last < len(line.hit) else [HIT, HIT + 1])
                cases += 1
    record_property("cases", cases)


def test_a_repeated_byte_costs_its_frame_and_a_repeated_delimiter_nothing(lines, record_property):
    for line in lines:
        for at in range(len(line.hit)):
            delimiter = at == len(line.hit) - 1
            assert line.lost(line.hit[: at + 1] + line.hit[at:]) == ([] if delimiter else [HIT])
    record_property("cases", sum(len(line.hit) for line in lines))


def test_a_wrong_byte_costs_its_frame_and_a_wrong_delimiter_the_next_one_as_well(lines, record_property):
    cases = 0
    for line in lines[:1]:
        for at, byte in enumerate(line.hit):
            delimiter = at == len(line.hit) - 1
            for wrong in sorted(set(range(256)) - {byte})[at % 5 :: 5]:  # a fifth each place, all values over some
                lost = line.lost(line.hit[:at] + bytes([wrong]) + line.hit[at + 1 :])
                assert lost == ([HIT, HIT + 1] if delimiter else [HIT])
                cases += 1
    record_property("cases", cases)


def test_garbage_costs_the_frame_it_runs_into(lines, rng, record_property):
    """Inserted anywhere, of any length, with and without zero bytes in it: never more than that one frame."""
    for line in lines:
        for _ in range(GARBAGE):
            at = rng.randrange(len(line.hit) + 1)
            garbage = rng.randbytes(rng.choice([1, 2, 3, 8, 60, 600]))
            text = line.hit[:at] + garbage + line.hit[at:]
            whole = b"\0" + line.hit in b"\0" + text  # garbage may hold the bytes that it cuts off
            parted = text.endswith(b"\0")  # from the next frame
            assert line.lost(text) == ([] if whole else [HIT]) + ([] if parted else [HIT + 1])
    record_property("cases", GARBAGE * len(lines))


# ---- the share of garbage that is accepted


PREFIX = Wire(REFERENCE).prefix


def checks(stuffed):
    """What may come after these bytes: a hello's check covers nothing else."""
    return check(stuffed, PREFIX), check(stuffed)


def crc_table():
    return np.array([crc16(bytes([byte])) ^ crc16(b"\0") for byte in range(256)], np.uint16)


def passing(packets, table):
    """Which rows of an array of packets end with their own check bytes: the tests' CRC, all rows at once."""
    crc = np.full(len(packets), crc16(PREFIX), np.uint16)
    for column in packets[:, :-3].T:
        crc = table[(crc ^ column) & 0xFF] ^ crc >> 8
    parts = (crc & 0x7F | 0x80, crc >> 7 & 0x7F | 0x80, crc >> 14 | 0x80)
    return np.flatnonzero((packets[:, -3] == parts[0]) & (packets[:, -2] == parts[1]) & (packets[:, -1] == parts[2]))


PACKETS = 4_000_000
PER_LENGTH = 160_000
LENGTHS = range(5, 5 + PACKETS // PER_LENGTH)


def garbage(marked):
    """PACKETS packets without a zero byte; marked: their last bytes have the bits that are the same in every packet."""
    generator = np.random.default_rng(20250)
    for length in LENGTHS:
        packets = generator.integers(1, 256, (PER_LENGTH, length), np.uint8)
        if marked:
            packets[:, -3:] = 0x80 | generator.integers(0, (128, 128, 4), (PER_LENGTH, 3), np.uint8)
        yield packets


@pytest.mark.parametrize(
    ("marked", "bound"),
    [(False, 255**-3), (True, 2**-16)],
    ids=["any bytes that are not zero", "with the fixed bits of the check bytes"],
)
def test_garbage_that_is_accepted(marked, bound, record_property):
    """The bound: to each beginning belongs one of all the values that the three bytes at the end can take."""
    table, accepts = crc_table(), receiver(REFERENCE)
    checked = accepted = 0
    for packets in garbage(marked):
        for index in passing(packets, table):
            packet = packets[index].tobytes()
            assert packet[-3:] == check(packet[:-3], PREFIX)
            checked += 1
            accepted += accepts(packet)
        for packet in packets[:200]:
            assert accepts(packet.tobytes()) <= (packet[-3:].tobytes() in checks(packet[:-3].tobytes()))
    expected = PACKETS * bound
    assert checked <= expected + 5 * math.sqrt(expected) + 5
    assert accepted <= checked
    assert accepted / PACKETS <= 2**-16
    if marked:
        assert checked >= expected - 5 * math.sqrt(expected)
    record_property("cases", PACKETS)
    record_property("right_check_bytes", checked)
    record_property("accepted", accepted)
    record_property("bound", bound)
