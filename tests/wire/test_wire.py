"""No bit flip and no short burst on the wire turns a packet into one that was never sent."""

import random

import numpy as np
import pytest
from sample import sample
from wire import Wire, crc16, line, request, taken_in

import contactfpga
from contactfpga.driver.conversation import Conversation, frames_in
from contactfpga.wire import protocol
from contactfpga.wire.command import Command, encode_command
from contactfpga.zones.run import Run
from contactfpga_sim.model.golden.request import command

SKINS = {
    "reference": contactfpga.Skin(),
    "smallest": contactfpga.Skin(rows=1, columns=1),
    "4x4": contactfpga.Skin(rows=4, columns=4, connectivity=4),
    "32x32": contactfpga.Skin(rows=32, columns=32, settle_us=40.0),
    "64x64": contactfpga.Skin(rows=64, columns=64, settle_us=40.0),
    "cells": contactfpga.Skin(rows=8, columns=11, report="cells", settle_us=10.0),
    "guard": contactfpga.Skin(guard=True),
}

GENERATOR = 1 | 1 << 4 | 1 << 11 | 1 << 16
"""x^16 + x^12 + x^5 + 1, the bit of the highest power first on the line: the shortest error the CRC cannot see."""


def _random_zones(skin, rng, count):
    zones = []
    for _ in range(count):
        area = rng.randint(1, max(1, skin.rows * skin.columns // max(count, 1) // 2))
        zones.append((area, rng.randint(0, area * (skin.columns - 1)), rng.randint(0, area * (skin.rows - 1))))
    return zones


def _frame(name, rng, count):
    skin = SKINS[name]
    wire = Wire(skin)
    trailer = {
        "time": rng.randrange(1 << 24),
        "sequence": rng.randrange(256),
        "overwritten": rng.randrange(16),
        "heard": rng.choice([0, 0, 3]),
        "flags": rng.choice([[], [], ["fault"], ["mismatch"]]),
    }
    if skin.report == "cells":
        return wire.cells([[rng.random() < 0.3 for _ in range(skin.columns)] for _ in range(skin.rows)], **trailer)
    return wire.zones(_random_zones(skin, rng, count), **trailer)


def _packets():
    """(name of the Skin, packet): a set on which the proofs by trial run."""
    rng = random.Random("packets")
    chosen = [("reference", _frame("reference", rng, count)) for count in (0, 0, 1, 1, 2, 3)]
    chosen += [(name, _frame(name, rng, 1)) for name in SKINS if name != "reference"]
    chosen.append(("reference", Wire(SKINS["reference"]).zones([])))  # hardly a byte that is not zero
    chosen.append(("reference", Wire(SKINS["reference"]).hello()))
    chosen.append(("guard", Wire(SKINS["guard"]).report(1 << 3 | 1 << 40)))
    return chosen


PACKETS = _packets()
BEHIND = [_frame(name, random.Random(str(index)), 1) for index, (name, _) in enumerate(PACKETS)]
VARIANTS = [(*packet, behind) for packet, behind in zip(PACKETS, BEHIND)]
QUICK = [VARIANTS[index] for index in (0, 4, 6, 10, len(PACKETS) - 2, len(PACKETS) - 1)]
"""An empty frame, one of two zones, one of the smallest sheet, bitmap rows, a hello, a report of faults."""
QUICKEST = [QUICK[1], QUICK[-1]]


def _cases(quick):
    ids = [f"{index}-{name}" for index, (name, _) in enumerate(PACKETS)]
    return pytest.mark.parametrize(("name", "packet", "behind"), sample(VARIANTS, quick), ids=ids)


CASES, LONG_CASES = _cases(QUICK), _cases(QUICKEST)


class AnyTime:
    """Takes every frame: which ones fit those before is not what these tests are about."""

    before, known = None, True

    def take_hello(self, hello, now, fresh):
        pass

    def take(self, packets, widths, last, came_s):
        return packets["time_us"]


def accepted(name, stream):
    """What a host that knows the board makes of ``stream``: frames, hellos and errors, as values that compare."""
    host = Conversation("x")
    host.receive(Wire(SKINS[name]).hello(sent=7, heard=1000), 0.0)
    host._timeline = AnyTime()
    events = host.receive(stream, 0.0)
    found = {repr(said(zones) | {"heard": zones.frame.heard}) for zones in frames_in(events)}
    return found | {repr(event) for event in events if not isinstance(event, Run)}


def said(zones):
    """What the board says; the time on the host's clock depends on the frames before."""
    return {name: value for name, value in zones.to_dict().items() if not name.startswith("host_")}


def flipped(stream, error, bit):
    """``stream`` with the bits of ``error`` flipped from ``bit`` on, in the order of the line."""
    return (int.from_bytes(stream, "little") ^ error << bit).to_bytes(len(stream), "little")


def test_packets_arrive_as_they_are():
    for (name, packet), behind in zip(PACKETS, BEHIND):
        assert len(accepted(name, packet + behind)) == 2


# ---- one bit


@CASES
def test_no_single_flip(name, packet, behind, record_property):
    stream = packet + behind
    sent = accepted(name, stream)
    for bit in range(8 * len(packet)):
        assert accepted(name, flipped(stream, 1, bit)) < sent, f"bit {bit}"
    record_property("cases", 8 * len(packet))


@pytest.mark.parametrize("step", sample([3, 1], quick=[3]))
def test_no_single_flip_in_long_frames(step, record_property):
    """Frames with COBS blocks of 254 bytes, and with the most zones their Skin carries."""
    rng, cases = random.Random(5), 0
    for name, zones in (
        ("64x64", [(1, 1 + i % 63, 1 + i % 62) for i in range(120)]),
        ("reference", _random_zones(SKINS["reference"], rng, 64)),
    ):
        packet = Wire(SKINS[name]).zones(zones)
        sent = accepted(name, packet)
        assert len(sent) == 1
        for bit in range(0, 8 * len(packet) - 8, step):
            assert not accepted(name, flipped(packet, 1, bit)), f"{name}: bit {bit}"
            cases += 1
    record_property("cases", cases)


# ---- bursts


def _crc_table():
    table = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        table = table >> 1 ^ np.where(table & 1, 0x8408, 0).astype(np.uint16)
    return table


TABLE = _crc_table()


class Hunt:
    """Follows many variants of a stream at once and finds those in which a piece passes its check bytes.

    They are followed through the bytes that differ. What comes after is the same for all, so there the state of the
    CRC decides; which states pass is found by trying all 65,536.
    """

    def __init__(self, stream, start=0xFFFF):
        self.start = start
        self.stream = np.frombuffer(stream, np.uint8)
        self.zeros = np.flatnonzero(self.stream == 0)
        self._passing = {}

    def survivors(self, errors, bit):
        """Which of the ``errors`` (int array), flipped from ``bit`` on, leave a piece they touch that passes."""
        first, shift = divmod(bit, 8)
        errors = (errors.astype(np.uint64) << np.uint64(shift)).view(np.uint8).reshape(-1, 8)
        end = int(self.zeros[self.zeros >= first][0])  # the delimiter of the packet in which the error begins
        until = first + 3 if first + 3 <= end - 3 else max(first + 3, end + 1)
        begun = np.full(len(errors), self.stream[:first].tobytes().rfind(b"\0") + 1)
        state = np.full(len(errors), self.start, np.uint16)
        found = np.zeros(len(errors), bool)
        states, values = {}, {}
        for index in range(int(begun[0]), until):
            value = self.stream[index] ^ errors[:, index - first] if index >= first else self.stream[index]
            states[index], values[index] = state, value
            state = state >> 8 ^ TABLE[(state ^ value) & 0xFF]
            ends = values[index] == 0
            if np.any(ends):
                if index - 3 in states:
                    passes = _checks(states[index - 3], *(values[index - 3 + place] for place in range(3)))
                    found |= ends & (index - begun >= 5) & passes
                begun = np.where(ends, index + 1, begun)
                state = np.where(ends, np.uint16(self.start), state)
        return found | (begun != end + 1) & self.passing(until)[state]

    def passing(self, start):
        """(65536,) bool: whether a piece passes that is not at its end before ``start`` with this state there."""
        if start not in self._passing:
            end = int(self.zeros[self.zeros >= start][0])
            assert end - start >= 3
            state = np.arange(1 << 16, dtype=np.uint16)
            for byte in self.stream[start : end - 3]:
                state = state >> 8 ^ TABLE[(state ^ byte) & 0xFF]
            self._passing[start] = _checks(state, *self.stream[end - 3 : end])
        return self._passing[start]


def _checks(crc, *check):
    parts = (crc & 0x7F, crc >> 7 & 0x7F, crc >> 14)
    return np.logical_and.reduce([value == (part | 0x80) for value, part in zip(check, parts)])


class Hunts:
    """Both checks that a piece may pass: the one of frames, and that of hellos."""

    def __init__(self, name, stream):
        starts = (crc16(Wire(SKINS[name]).prefix), 0xFFFF)
        self._hunts = [Hunt(stream, start) for start in starts]

    def survivors(self, errors, bit):
        return np.logical_or.reduce([hunt.survivors(errors, bit) for hunt in self._hunts])


ALL_BURSTS = np.arange(1, 1 << 16, 2)
"""Every burst of up to 16 bits that begins with its first bit."""


@LONG_CASES
def test_no_burst_up_to_16_bits(name, packet, behind, record_property):
    """All of them that begin in the packet or its delimiter. What passes the check bytes goes to the driver."""
    stream = packet + behind
    sent = accepted(name, stream)
    hunt = Hunts(name, stream)
    for bit in range(8 * len(packet)):
        for error in ALL_BURSTS[hunt.survivors(ALL_BURSTS, bit)]:
            assert accepted(name, flipped(stream, int(error), bit)) <= sent, f"burst {error:#x} from bit {bit}"
    record_property("cases", 8 * len(packet) * len(ALL_BURSTS))


@CASES
def test_bursts_go_through_the_driver_alike(name, packet, behind, record_property):
    """A sample of all bursts, none sorted out before."""
    rng = random.Random(repr(packet))
    stream = packet + behind
    sent = accepted(name, stream)
    for _ in range(500):
        error, bit = rng.randrange(1, 1 << 16, 2), rng.randrange(8 * len(packet))
        assert accepted(name, flipped(stream, error, bit)) < sent, f"burst {error:#x} from bit {bit}"
    record_property("cases", 500)


@CASES
def test_the_hunt_sees_the_shortest_error_that_the_crc_cannot(name, packet, behind):
    """The generator itself, 17 bits, passes wherever it makes no zero byte and leaves the check's marks."""
    before = b"" if packet.startswith(b"\0") else Wire(SKINS[name]).prefix
    hunt = Hunt(packet + behind, crc16(before))
    passing = 0
    for bit in range(8 * (len(packet) - 4) - 16):
        variant = flipped(packet, GENERATOR, bit)
        whole = 0 not in variant[1:-1] and (variant[0] == 0) == (packet[0] == 0)
        assert hunt.survivors(np.array([GENERATOR]), bit)[0] == whole, f"bit {bit}"
        passing += whole
        if whole:
            assert variant[-4:-1] == protocol.check_bytes(variant[:-4].lstrip(b"\0"), before)
    assert passing > 0 or len(packet) < 10


# ---- requests


REQUESTS = [request(number, hello) for number, hello in ((0x15A2D1, False), (0x4081, True), (0x1FFFFF, False))]
REQUESTS.append(command(0x15A2D1, 1, 0x54321, True))


@pytest.mark.parametrize("packet", sample(REQUESTS, quick=[REQUESTS[0], REQUESTS[-1]]))
def test_no_burst_makes_a_request_that_was_not_sent(packet, record_property):
    """All bursts of up to 16 bits; what a board takes is written from docs/protocol.md in tests/support."""
    stream = packet + request(0x123456 | 1)[1:]
    sent = taken_in(stream.split(b"\0"))
    assert len(sent) == 2
    number, hello, what = sent[0]
    as_host = encode_command(number, Command(*what), hello) if what else protocol.encode_request(number, hello)
    assert packet == as_host
    hunt, hits = Hunt(stream), 0
    for bit in range(8 * len(packet)):
        for error in ALL_BURSTS[hunt.survivors(ALL_BURSTS, bit)]:
            taken = taken_in(flipped(stream, int(error), bit).split(b"\0"))
            assert set(taken) <= set(sent), f"burst {error:#x} from bit {bit}"
            hits += 1
    record_property("cases", 8 * len(packet) * len(ALL_BURSTS))


# ---- the line itself, with start and stop bits


def uart(bits, keep_broken):
    """Bytes a receiver makes of the line; one without a stop bit is kept or dropped."""
    out, at = bytearray(), 0
    while at + 10 <= len(bits):
        if bits[at]:
            at += 1
            continue
        if bits[at + 9] or keep_broken:
            out.append(sum(bit << place for place, bit in enumerate(bits[at + 1 : at + 9])))
        at += 10 if bits[at + 9] else 9
    return bytes(out)


@LONG_CASES
@pytest.mark.parametrize("keep_broken", [False, True])
def test_no_flip_and_no_burst_of_line_bits(name, packet, behind, keep_broken, record_property):
    """Every single flip, start and stop bits among them, and a sample of bursts up to 16 line bits."""
    rng = random.Random(repr(packet))
    bits = line(packet + behind, 1) + [1] * 12
    sent = accepted(name, packet + behind)
    singles = [(bit, 1) for bit in range(10 * len(packet))]
    bursts = [(rng.randrange(10 * len(packet)), rng.randrange(1, 1 << 16, 2)) for _ in range(300)]
    for bit, error in singles + bursts:
        wrong = list(bits)
        for place in range(16):
            if bit + place < len(wrong):
                wrong[bit + place] ^= error >> place & 1
        assert accepted(name, uart(wrong, keep_broken)) <= sent, f"burst {error:#x} from line bit {bit}"
    record_property("cases", len(singles) + len(bursts))
