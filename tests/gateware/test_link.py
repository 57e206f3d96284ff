"""The link: which packet goes out when, and what is in it, against a replay of the rules of docs/timing.md."""

import dataclasses
import struct
import zlib
from unittest import mock

import pytest
from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from contactfpga import Skin
from contactfpga_hdl.link import link as link_module
from contactfpga_hdl.link import odometer
from contactfpga_hdl.link.link import Link, offset_bits
from contactfpga_hdl.link.pack import Packer
from contactfpga_hdl.report.backlog import Backlog

SHEET = {"rows": 4, "columns": 4, "connectivity": 4, "settle_us": 5000}  # a scan takes 20.004 ms
SKINS = {
    "always": {},
    "on change": {"send": "on_change", "keep_alive_ms": 90.0},
    "every scan": {"send": "on_change", "keep_alive_ms": 21.0},
    "cells": {"report": "cells"},
    "cells on change": {"report": "cells", "send": "on_change"},
}
KEEP_ALIVE = {"on change": 4, "every scan": 1, "cells on change": 4}  # scans
HELLO_EVERY = 24
ITEM_BYTES = {"moments": 2, "cells": 1}  # 5 + 5 + 5 bits, 4 bits
TRAILER_BYTES = 7  # 24 + 8 + 3 + 5 + 4 + 4 bits and the last byte
TAG = {"time": 24, "stuck": 3, "fault": 1, "heard": 3, "requested": 1}
SUMMARY = {"cells": 5, "zones": 4, "overflow": 1, "mismatch": 1, "changed": 1}


@dataclasses.dataclass
class Frame:
    items: list
    facts: dict
    not_before: list = dataclasses.field(default_factory=list)  # of the items and the end mark


class PackerAndLink(wiring.Component):
    """Backlog, packer and link as the top joins them."""

    def __init__(self, skin):
        self.skin = skin
        self.backlog, self.packer, self.link = Backlog(skin), Packer(skin, offset_bits(skin)), Link(skin)
        members = self.link.signature.members
        outside = {name: members[name] for name in ("tag", "summary", "asked", "epoch", "number", "bytes")}
        super().__init__({"items": In(self.backlog.passed.signature.flip()), **outside})

    def elaborate(self, platform):
        m = Module()
        m.submodules += [self.backlog, self.packer, self.link]
        wiring.connect(m, wiring.flipped(self.items), self.backlog.passed)
        wiring.connect(m, self.backlog.waiting, self.packer.items)
        wiring.connect(m, self.packer.frames, self.link.frames)
        wiring.connect(m, self.link.bytes, wiring.flipped(self.bytes))
        for part in (self.packer, self.link):
            m.d.comb += [part.tag.eq(self.tag), part.summary.eq(self.summary)]
        m.d.comb += [getattr(self.link, name).eq(getattr(self, name)) for name in ("asked", "epoch", "number")]
        return m


def skin_of(name):
    return Skin(**SHEET, **SKINS[name])


def sealed(plain, before=b""):
    """COBS, check bytes and delimiter for a packet without long blocks; the check covers ``before`` as well."""
    stuffed = b"".join(bytes([len(block) + 1]) + block for block in plain.split(b"\0"))
    crc = crc16(before + stuffed)
    return stuffed + bytes([128 + crc % 128, 128 + crc // 128 % 128, 128 + crc // 128**2]) + b"\0"


def crc16(data):
    """CRC-16/MCRF4XX, bit by bit in the order of the line."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x8408 if crc & 1 else 0)
    return crc


def hello_of(skin, digits=(0,) * 16):
    """The hello; ``digits`` are those of its state."""

    def field(kind, value):
        return bytes([kind, len(value)]) + value

    report = ["moments", "cells"].index(skin.report)
    sheet = [skin.rows, skin.columns, skin.connectivity, report, 0, int(skin.send == "on_change")]
    first = field(1, bytes(sheet) + struct.pack("<HBB", skin.zone_capacity, 0, 0))
    rest = field(3, struct.pack("<dd", skin.pitch_x_mm, skin.pitch_y_mm)) + field(5, skin.fingerprint)
    rest += field(6, struct.pack("<II", skin.clock_hz, skin.baud))
    check = field(255, struct.pack("<I", zlib.crc32(first + rest)))
    return b"\0" + sealed(first + field(2, bytes(128 + digit for digit in digits)) + rest + check + b"\x40")


def frame_of(skin, frame, sequence, overwritten):
    facts = frame.facts | {"sequence": sequence, "overwritten": overwritten}
    widths = {"time": 24, "sequence": 8, "heard": 3, "cells": 5, "zones": 4, "overwritten": 4}
    word = offset = 0
    for name, width in (widths | {"overflow": 1, "mismatch": 1, "fault": 1}).items():
        word |= facts[name] % (1 << width) << offset
        offset += width
    size = ITEM_BYTES[skin.report]
    items = b"".join(item.to_bytes(size, "little") for item in frame.items)
    word |= (5 if skin.report == "moments" else 6) << offset + 1
    return sealed(items + word.to_bytes(7, "little"), skin.fingerprint[:2])


def random_frames(rng, skin, count, spacing=1):
    """Frames at least as far apart as the Skin allows, their items somewhere in that time."""
    size = ITEM_BYTES[skin.report]
    most = skin.zone_capacity if skin.report == "moments" else 4
    frames, start = [], 1
    for index in range(count):
        items = [rng.randrange(1 << 8 * size - 1) for _ in range(rng.randrange(most + 1))]
        widths = TAG | SUMMARY
        facts = {name: rng.randrange(1 << width) for name, width in widths.items()} | {"time": index}
        facts["requested"] = int(rng.random() < 0.15)
        if index in (0, 1):  # the first one goes out all the same, the second one waits for the keep-alive
            facts |= {"changed": 0, "requested": 0}
        length = rng.choice((1, 1, spacing, 3 * spacing)) * (most * size + 32)
        end = start + length - 1
        times = sorted(rng.sample(range(start, end), len(items)))
        frames.append(Frame(items, facts, [*times, end]))
        start += length
    return frames


def run(bench_of_skin, skin, frames, ready, asked=(), number=lambda cycle: 0, after=400):
    """Puts the frames through; returns the bytes' sink and the items' source."""
    dut, sim = bench_of_skin
    size = ITEM_BYTES[skin.report]
    words = [word for frame in frames for word in (*frame.items, 1 << 8 * size)]
    ends = [index for index, word in enumerate(words) if word >> 8 * size]
    source = sim.source(dut.items, words, not_before=[at for frame in frames for at in frame.not_before])

    def described(name):
        def value(_cycle):
            ended = sum(index < len(source.transfers) for index in ends)
            return frames[max(0, ended - 1)].facts[name]

        return value

    for name in SUMMARY:
        sim.drive(dut.summary[name], described(name))
    for name in TAG:
        sim.drive(dut.tag[name], described(name))
    sim.drive(dut.asked, lambda cycle: int(cycle in asked))
    sim.drive(dut.number, number)
    sink = sim.sink(dut.bytes, ready=ready)
    sim.run(frames[-1].not_before[-1] + after)
    assert source.transfers == [at for frame in frames for at in frame.not_before], "the link never stalls"
    return sink


def decisions(skin, frames, keep_alive):
    """(cycle of the decision, whether sent) for each frame: none of it depends on the wire."""
    size, free, idle, out = ITEM_BYTES[skin.report], 0, None, []
    for frame in frames:
        for put in frame.not_before[:-1]:
            free = max(put + 2, free) + size
        taken = max(frame.not_before[-1] + 2, free)
        idle = None if idle is None else idle + 1
        facts = frame.facts
        sent = skin.send == "always" or bool(facts["changed"] or facts["requested"])
        sent = sent or idle is None or idle == keep_alive
        idle = 0 if sent else idle
        free = taken + (TRAILER_BYTES + 2 if sent else 1)
        out.append((taken, sent))
    return out


def replay(skin, frames, delimiters, cycles, asked=(), keep_alive=None):
    """(cycle in which it is taken, packet) of every packet, None for a hello, given when each one's delimiter was
    transferred."""
    decided = dict(zip([at for at, _ in decisions(skin, frames, keep_alive)], frames))
    assert len(decided) == len(frames)
    sends = dict(decisions(skin, frames, keep_alive))
    hello_from, waiting, idle_from = [0], None, 0
    sent = overwritten = ends = 0
    packets, delimiters = [], list(delimiters)
    for cycle in range(cycles):
        takes_hello = takes_frame = False
        if idle_from is not None and cycle >= idle_from:
            takes_hello = any(at <= cycle for at in hello_from)
            takes_frame = not takes_hello and waiting is not None and waiting[0] <= cycle
        if takes_hello:
            hello_from = [at for at in hello_from if at > cycle]
            packets.append((cycle, None))
        elif takes_frame:
            packets.append((cycle, waiting[1]))
            waiting, sent = None, sent + 1
        if takes_hello or takes_frame:
            idle_from = delimiters.pop(0) + 1 if delimiters else None
        if cycle in decided:
            ends += 1
            if ends % HELLO_EVERY == 0:
                hello_from.append(cycle + 1)
            if sends[cycle]:
                overwritten += waiting is not None
                waiting = cycle + TRAILER_BYTES + 2, frame_of(skin, decided[cycle], sent, overwritten)
        if cycle in asked:
            hello_from.append(cycle + 1)
    return packets, overwritten


def hello_sent(skin, sink, begun, sent, number=lambda cycle: 0, stuck=lambda cycle: 0):
    """The hello whose first byte was offered in a cycle, after this many frames. Each digit is taken in the clock after
    the transfer of the byte before it."""
    first = sink.offered.index(begun)
    taken = [sink.transfers[first + 15 + place][0] + 1 for place in range(16)]
    digits = [sent >> 7 * place & 127 for place in range(7)] + [0] * 4
    digits += [number(taken[11 + place]) >> 7 * place & 127 for place in range(3)] + [stuck(taken[14]), 0]
    return hello_of(skin, digits)


def packets_of(sink):
    """(cycle in which the first byte was offered, bytes) of every packet, and when its delimiter was taken."""
    packets, ends, current, begun, before = [], [], b"", 0, 0
    for offered, (cycle, byte) in zip(sink.offered, sink.transfers):
        if not current:
            begun = offered
        else:
            assert offered - before <= 2, "bytes follow without a gap"
        current, before = current + bytes([byte]), cycle
        if not byte and len(current) > 1:
            packets.append((begun, current))
            ends.append(cycle)
            current = b""
    return packets, ends


def varying_stalls(rng, cycles):
    """Whether the wire is ready in each cycle: now fast, now hardly ever."""
    levels = []
    while len(levels) < cycles:
        rate = rng.choice((1.0, 0.5, 0.15, 0.05, 0.02))
        levels += [rng.random() < rate for _ in range(rng.choice((100, 400, 1200)))]
    return levels


@pytest.mark.parametrize("name", SKINS)
def test_every_packet_is_whole_and_starts_in_its_cycle_whatever_the_wire_does(bench, rng, name):
    skin = skin_of(name)
    frames = random_frames(rng, skin, 90, spacing=2)
    cycles = frames[-1].not_before[-1] + 400
    ready = varying_stalls(rng, cycles + 1)
    asked = {cycle for cycle in range(cycles) if rng.random() < 0.001}
    numbers = [rng.randrange(1 << 21) for _ in range(cycles // 64 + 8)]

    def number(cycle):
        return numbers[cycle // 64]

    dut = PackerAndLink(skin)
    sim = bench(dut)
    stuck = sim.watch(dut.tag.stuck)
    sink = run((dut, sim), skin, frames, lambda cycle: ready[cycle], asked, number)
    packets, ends = packets_of(sink)
    wanted, overwritten = replay(skin, frames, ends, cycles, asked, KEEP_ALIVE.get(name))
    sent = 0
    assert 0 <= len(wanted) - len(packets) <= 1  # the last one may still be on its way
    for (begun, packet), (taken, expected) in zip(packets, wanted):
        assert begun - 2 == taken
        assert packet == (expected or hello_sent(skin, sink, begun, sent, number, stuck.__getitem__))
        sent += expected is not None
    assert len(packets) >= len(wanted) - 1
    assert len(packets) > 30
    assert overwritten > 2
    assert len({packet for _, packet in packets if packet[0] == 0}) > 3, "hellos differ in what they tell"


@pytest.fixture(scope="module")
def link(bench):
    dut = PackerAndLink(skin_of("always"))
    return dut, bench(dut)


def test_the_wire_may_take_a_frame_until_the_very_clock_in_which_the_next_is_decided(link):
    skin = skin_of("always")
    facts = dict.fromkeys(TAG | SUMMARY, 1)
    first = Frame([0x1234], facts, [190, 210])
    second = Frame([0x2345, 0x3456], facts | {"requested": 0, "time": 2}, [250, 260, 270])
    (_, _), (decided, _) = decisions(skin, [first, second], None)
    idle_from = set()
    for release in range(decided - 20, decided + 5):
        ready = [cycle < 150 or cycle >= release for cycle in range(1000)]
        sink = run(link, skin, [first, second], ready.__getitem__)
        packets, ends = packets_of(sink)
        wanted, _ = replay(skin, [first, second], ends, 10_000)
        assert [packet for _, packet in packets[1:]] == [packet for _, packet in wanted[1:]]
        assert [begun - 2 for begun, _ in packets] == [taken for taken, _ in wanted]
        idle_from.add(ends[0] + 1)
        in_time = ends[0] + 1 <= decided
        sequence = [(1, 0), (2, 0)] if in_time else [(2, 1)]
        assert [packet for _, packet in packets[1:]] == [
            frame_of(skin, (first, second)[number - 1], number - 1 - over, over) for number, over in sequence
        ]
    assert {decided, decided + 1} <= idle_from


def test_a_hello_goes_out_at_start_every_half_second_and_when_asked_for(link, rng):
    skin = skin_of("always")
    frames = random_frames(rng, skin, 2 * HELLO_EVERY + 2, spacing=3)
    asked = {frames[10].not_before[0], frames[30].not_before[0], frames[30].not_before[0] + 1}
    sink = run(link, skin, frames, lambda cycle: True, asked)
    packets, _ = packets_of(sink)
    hellos = [begun for begun, packet in packets if packet[0] == 0]
    assert len(hellos) in (5, 6), "two wishes in a row may share one hello"
    assert hellos[0] == 2
    assert len(hello_of(skin)) <= 81
    for period in (1, 2):
        decided = decisions(skin, frames, None)[HELLO_EVERY * period - 1][0]
        assert any(0 < begun - decided <= 3 + 2 * 90 for begun in hellos), "after one frame at most"


def test_frames_sent_are_counted_past_the_digits_that_the_link_keeps(bench):
    """The carry into the odometer's digits, and its own carries: 2^14 frames are too many to simulate, so the counters
    begin just before."""
    dut = PackerAndLink(skin_of("cells"))
    with mock.patch.object(link_module, "LIVE_DIGITS", 1), mock.patch.object(odometer, "LIVE_DIGITS", 1):
        sim = bench(dut)
        frames = [Frame([], dict.fromkeys(TAG | SUMMARY, 0), [40 * index + 1]) for index in range(300)]
        asked = {40 * index + 20 for index in (2, 127, 128, 129, 255, 256, 257, 298)}
        sink = run((dut, sim), dut.skin, frames, lambda cycle: True, asked)
    packets, _ = packets_of(sink)
    sent = told = 0
    for begun, packet in packets:
        if packet[0] == 0:
            assert packet == hello_sent(dut.skin, sink, begun, sent)
            told = max(told, sent)
        else:
            sent += 1
    assert told > 128


def test_the_epoch_is_counted_but_not_while_a_hello_tells_it(bench):
    dut = PackerAndLink(skin_of("cells"))
    sim = bench(dut)
    sim.drive(dut.epoch, lambda cycle: int(cycle in epochs))
    asked = {100, 400, 3000, 6000, 6500}
    while_told = {150, 450, 3050, 6001, 6500, 6550}  # one per hello can wait
    epochs = {cycle for cycle in range(300, 6500, 40) if not any(0 <= cycle - at < 200 for at in asked)} | while_told
    frame = Frame([], dict.fromkeys(TAG | SUMMARY, 0), [1])
    sink = run((dut, sim), dut.skin, [frame], lambda cycle: True, asked, after=7200)
    packets, _ = packets_of(sink)
    told = []
    for begun, packet in packets:
        if packet[0] == 0:
            digits = packet[16 + 7 : 16 + 11]
            taken = begun - 2
            told.append((taken, sum((digit & 127) << 7 * place for place, digit in enumerate(digits))))
    assert len(told) == 6
    for taken, epoch in told:
        assert epoch == sum(cycle < taken for cycle in epochs), taken
    assert told[-1][1] > 128
