"""The link: which packet goes out when, and what is in it, against a replay of the rules of docs/timing.md."""

import bisect
import itertools
import struct
import zlib

import pytest
from link_bench import (
    ITEM_BYTES,
    SUMMARY,
    TAG,
    TRAILER_BYTES,
    Frame,
    PackerAndLink,
    decisions,
    frame_of,
    packets_of,
    random_frames,
    sealed,
    varying_stalls,
)
from sample import sample

from contactfpga import Skin
from contactfpga.skin.derived import KEEP_ALIVE_BIT
from contactfpga_hdl.link import link as link_module
from contactfpga_hdl.link import odometer

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


def skin_of(name):
    return Skin(**SHEET, **SKINS[name])


def hello_of(skin, digits=(0,) * 16):
    """The hello; ``digits`` are those of its state."""

    def field(kind, value):
        return bytes([kind, len(value)]) + value

    report = ["moments", "cells"].index(skin.report)
    sheet = [skin.rows, skin.columns, skin.connectivity, report, 0, int(skin.send == "on_change")]
    first = field(1, bytes(sheet) + struct.pack("<HBB", skin.zone_capacity, 0, 0))
    rest = field(3, struct.pack("<dd", skin.pitch_x_mm, skin.pitch_y_mm)) + field(5, skin.fingerprint)
    rest += field(6, struct.pack("<II", skin.clock_hz, skin.baud))
    if skin.report == "cells":
        rest += field(8, b"\x02")  # the command that moves the sample
    check = field(255, struct.pack("<I", zlib.crc32(first + rest)))
    return b"\0" + sealed(first + field(2, bytes(128 + digit for digit in digits)) + rest + check + b"\x40")


def run(bench_of_skin, skin, frames, ready, asked=(), number=lambda cycle: 0, after=400):
    """Feed the frames to the link; returns the bytes' sink and the items' source."""
    dut, sim = bench_of_skin
    size = ITEM_BYTES[skin.report]
    words = [word for frame in frames for word in (*frame.items, 1 << 8 * size)]
    ends = [index for index, word in enumerate(words) if word >> 8 * size]
    source = sim.source(dut.items, words, not_before=[at for frame in frames for at in frame.not_before])

    def described(name):
        def value(_cycle):
            ended = bisect.bisect_left(ends, len(source.transfers))
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


def replay(skin, frames, sink, cycles, asked=(), keep_alive=None):
    """(cycle in which it is taken, packet) of every packet, None for a hello, given when each delimiter was
    transferred. A second one follows a packet if none is taken in the cycle after it: all these Skins rest for more
    than a millisecond."""
    decided = dict(zip([at for at, _ in decisions(skin, frames, keep_alive)], frames))
    assert len(decided) == len(frames)
    sends = dict(decisions(skin, frames, keep_alive))
    hello_from, waiting, idle_from = [0], None, 0
    sent = overwritten = ends = 0
    packets, delimiters, ended = [], [cycle for cycle, byte in sink.transfers if not byte], None
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
        if takes_hello and delimiters:
            delimiters.pop(0)  # in front of it
        if takes_hello or takes_frame or cycle == ended:
            idle_from = delimiters.pop(0) + 1 if delimiters else None
            ended = idle_from if takes_hello or takes_frame else None
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


@pytest.mark.parametrize("name", sample(SKINS, quick=["on change", "cells"]))
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
    packets, _ = packets_of(sink)
    wanted, overwritten = replay(skin, frames, sink, cycles, asked, KEEP_ALIVE.get(name))
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
        wanted, _ = replay(skin, [first, second], sink, 10_000)
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


def test_the_epoch_is_counted_but_not_while_a_hello_tells_it(bench):
    dut = PackerAndLink(skin_of("cells"))
    sim = bench(dut)
    sim.drive(dut.epoch, lambda cycle: int(cycle in epochs))
    asked = {100, 400, 3000, 6000, 6500}
    while_sent = {150, 450, 3050, 6001, 6500, 6550}  # one per hello can wait
    epochs = {cycle for cycle in range(300, 6500, 40) if not any(0 <= cycle - at < 200 for at in asked)} | while_sent
    frame = Frame([], dict.fromkeys(TAG | SUMMARY, 0), [1])
    sink = run((dut, sim), dut.skin, [frame], lambda cycle: True, asked, after=7200)
    packets, _ = packets_of(sink)
    reported = []
    for begun, packet in packets:
        if packet[0] == 0:
            digits = packet[16 + 7 : 16 + 11]
            taken = begun - 2
            reported.append((taken, sum((digit & 127) << 7 * place for place, digit in enumerate(digits))))
    assert len(reported) == 6
    for taken, epoch in reported:
        assert epoch == sum(cycle < taken for cycle in epochs), taken
    assert reported[-1][1] > 128


def test_a_keep_alive_is_due_after_its_turns_whatever_comes_with_them(bench, rng):
    """Link of a scan that waits: the clock's bit toggles in any clock, mostly as it is decided whether a frame is sent;
    the first frame is sent."""
    skin, cycles = Skin(scan="reversal", precharge_us=1.0, send="on_change", keep_alive_ms=6.0), 6_000
    decide = [int(rng.random() < 0.2) for _ in range(cycles)]
    wanted = {name: [int(rng.random() < 0.03) for _ in range(cycles)] for name in ("changed", "requested")}
    toggled = [int(rng.random() < (0.2 if decided else 0.02)) for decided in decide]
    toggles = [count % 2 for count in itertools.accumulate(toggled)]
    dut = link_module.Link(skin)
    sim = bench(dut)
    sim.drive(dut.frames.decide, decide.__getitem__)
    sim.drive(dut.summary.changed, wanted["changed"].__getitem__)
    sim.drive(dut.tag.requested, wanted["requested"].__getitem__)
    sim.drive(dut.time, lambda cycle: toggles[cycle] << KEEP_ALIVE_BIT)
    due, send = sim.watch(dut.due), sim.watch(dut.frames.verdict.send)
    sim.run(cycles - 1)
    most = skin.derived.keep_alive_toggles
    passed = most
    for cycle in range(cycles - 1):
        is_due = passed >= most
        sends = is_due or wanted["changed"][cycle] or wanted["requested"][cycle]
        assert (due[cycle], send[cycle]) == (is_due, sends), cycle
        passed = 0 if decide[cycle] and sends else passed + toggled[cycle]
    assert most > 2
    assert 100 < sum(due.values) < cycles - 100


def test_readings_go_after_each_four_frames_that_follow_one_another(bench):
    """Frames and readings wait at all times."""
    dut = link_module.Link(Skin(units=1))
    sim = bench(dut)
    sim.drive(dut.units.due, lambda cycle: 1)
    sim.drive(dut.frames.commit, lambda cycle: int(cycle % 4 == 0))
    sim.sink(dut.bytes)
    taken, frames = sim.watch(dut.units.taken), sim.watch(dut.frames.verdict.sequence)
    sim.run(1_000)
    sent = [frames[cycle] for cycle, level in enumerate(taken.values) if level]
    assert sent == list(range(4, 4 * len(sent) + 1, 4))
    assert len(sent) > 4


def test_carries_that_come_in_one_clock_are_both_counted(bench):
    """Carries of the sent frames and of the epoch in the same clock, through a second digit, are both counted."""
    dut, count = odometer.Odometer(), 130
    sim = bench(dut)
    for pulses in (dut.sent, dut.epoch):
        sim.drive(pulses, lambda cycle: int(40 <= cycle < 40 * (count + 1) and cycle % 40 == 0))
    sim.drive(dut.place, lambda cycle: cycle % 16)
    digit = sim.watch(dut.digit)
    sim.run(40 * (count + 3))
    at = 16 * (40 * (count + 2) // 16)
    state = [digit[at + 1 + place] for place in range(11)]
    assert state == [0, 0, count % 128, count // 128, 0, 0, 0, count % 128, count // 128, 0, 0]
