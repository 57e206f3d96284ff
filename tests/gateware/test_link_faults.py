"""Reports of faults and slots of the self-test on the wire, between hellos and frames."""

import itertools

import pytest
from amaranth.hdl import Value
from link_bench import SUMMARY, TAG, PackerAndLink, decisions, frame_of, packets_of, random_frames, varying_stalls
from wire import digits, seal

from contactfpga import Skin
from contactfpga_sim.model.golden import faults
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.hello import State
from contactfpga_sim.model.golden.link import Link
from contactfpga_sim.model.golden.request import Reception

SHEET = {"rows": 4, "columns": 4, "connectivity": 4, "settle_us": 5000, "baud": 6_000_000}
SKINS = {
    "guard": Skin(**SHEET, guard=True),  # 4 + 4 + 5 lines, 2 digits
    "both": Skin(**SHEET, guard=True, self_test=True, scan="reversal", precharge_us=1.0),
    "self-test": Skin(**SHEET, self_test=True, scan="reversal", precharge_us=1.0),
}
BITS = {"guard": 13, "both": 14, "self-test": 1}
BYTE = 20  # clocks


def report_of(name, word):
    """A fault report as docs/protocol.md describes it."""
    skin = SKINS[name]
    return seal(digits(word, -(-BITS[name] // 7)) + b"\x90", facts(skin).fingerprint[:2])


def random_words(rng, cycles, bits, spacing):
    """Random fault words as (cycle, word) of every change: single lines, several at once, there and back within some
    clocks."""
    changes, cycle, word = [(0, 0)], 0, 0
    while cycle < cycles:
        cycle += rng.choice([1, 2, 5, spacing, 3 * spacing])
        word ^= rng.choice([1 << rng.randrange(bits), rng.randrange(1 << bits), changes[-1][1]])
        changes.append((cycle, word))
    return changes


def predicted(skin, frames, changes, asked, cycles):
    """The golden model's bytes."""
    reported = faults.FaultHistory()
    for cycle, word in changes[1:]:
        reported.change(cycle, word)
    link = Link(facts(skin), State(facts(skin), [], Reception([], [])), reported)
    decided = [taken for taken, _ in decisions(skin, frames, None)]
    period = facts(skin).hello_scans
    for cycle in sorted([0, *(cycle + 1 for cycle in asked), *(cycle + 1 for cycle in decided[period - 1 :: period])]):
        link.want_hello(cycle)
    overwritten = 0
    for frame, taken in zip(frames, decided, strict=True):
        link.advance(taken)
        overwritten += link.drop()
        link.offer(taken + 7 + 2, frame_of(skin, frame, link.sent, overwritten))
    link.finish(cycles)
    return [(cycle, value) for cycle, value in link.bytes if cycle < cycles]


def paced(sim, port):
    """Takes bytes as fast as the line does."""
    sink = sim.sink(port, ready=lambda cycle: not sink.transfers or cycle >= sink.transfers[-1][0] + BYTE)
    return sink


def held(changes):
    """The word that (cycle, word) pairs set, cycle by cycle; 0 before the first."""
    words, word = dict(changes), 0

    def now(cycle):
        nonlocal word
        word = words.get(cycle, word)
        return word

    return now


def feed(sim, dut, frames, changes, asked=()):
    """Feeds frames, fault words and requests for a hello to the link."""
    words = [word for frame in frames for word in (*frame.items, 1 << 16)]
    source = sim.source(dut.items, words, not_before=[at for frame in frames for at in frame.not_before])
    ends = [index for index, word in enumerate(words) if word >> 16]

    def described(name):
        return lambda _: frames[max(0, sum(index < len(source.transfers) for index in ends) - 1)].facts[name]

    for name in SUMMARY:
        sim.drive(dut.summary[name], described(name))
    for name in TAG:
        sim.drive(dut.tag[name], described(name))
    sim.drive(Value.cast(dut.faults), held(changes))
    sim.drive(dut.asked, lambda cycle: int(cycle in asked))


@pytest.fixture(scope="module")
def guarded(bench):
    dut = PackerAndLink(SKINS["guard"])
    return dut, bench(dut)


def test_reports_frames_and_hellos_go_out_in_the_model_s_cycles(guarded, rng):
    dut, sim = guarded
    frames = random_frames(rng, dut.skin, 60, spacing=3)
    for frame in frames:  # what a hello tells of it is test_link's
        frame.facts |= {"stuck": 0}
    cycles = frames[-1].not_before[-1] + 2000
    changes = random_words(rng, cycles, 13, 80)
    asked = {cycle for cycle in range(cycles) if rng.random() < 0.0002}
    feed(sim, dut, frames, changes, asked)
    sink = paced(sim, dut.bytes)
    sim.run(cycles)
    assert sink.transfers == predicted(dut.skin, frames, changes, asked, cycles)
    packets, _ = packets_of(sink)
    kinds = [packet[-5] >> 4 for _, packet in packets]
    assert {4, 5, 9} == set(kinds)
    assert kinds.count(9) > 3


def test_after_a_hello_and_after_a_change_the_word_itself_is_reported(guarded, rng):
    """A hello and a change are each followed by a report of the word; without a change no report is repeated."""
    dut, sim = guarded
    words = [rng.randrange(1 << 13) for _ in range(4)]
    changes = [(0, 0), *((5000 + 500 * index, word) for index, word in enumerate(words))]
    frame = random_frames(rng, dut.skin, 1)
    feed(sim, dut, frame, changes, {2500, 7000})
    sink = paced(sim, dut.bytes)
    sim.run(10_000)
    packets, _ = packets_of(sink)
    reported = [packet for _, packet in packets if packet[-5] == 0x90]
    assert reported == [report_of("guard", word) for word in (0, 0, *words, words[-1])]
    kinds = [packet[-5] >> 4 for _, packet in packets]
    assert all(after == 9 for kind, after in itertools.pairwise(kinds) if kind == 4)


def test_a_word_that_never_rests_does_not_keep_frames_from_the_wire(guarded, rng):
    """While the fault word changes all the time, at least every other packet is a frame as long as one waits."""
    dut, sim = guarded
    frames = random_frames(rng, dut.skin, 40)
    cycles = frames[-1].not_before[-1]
    changes = [(cycle, rng.randrange(1 << 13)) for cycle in range(0, cycles, 3)]
    feed(sim, dut, frames, changes)
    sink = sim.sink(dut.bytes, ready=varying_stalls(rng, cycles + 1).__getitem__)
    sim.run(cycles)
    packets, ends = packets_of(sink)
    kinds = [packet[-5] >> 4 for _, packet in packets]
    decided = [taken for taken, _ in decisions(dut.skin, frames, None)]
    for place in range(2, len(kinds)):
        if kinds[place] == kinds[place - 1] == 9:
            before, idle = ends[place - 2] + 1, ends[place - 1] + 1
            waited = [before < at + 9 <= idle <= dropped for at, dropped in itertools.pairwise(decided)]
            assert not any(waited), "a frame waited"
    assert kinds.count(5) > 8
    assert kinds.count(9) > 8


@pytest.mark.parametrize("name", ["both", "self-test"])
def test_slots_of_the_self_test_go_out_whole_and_are_acknowledged(bench, rng, name):
    """Slots are whole and none is lost, whatever the wire does; fault reports go first."""
    skin = SKINS[name]
    dut = PackerAndLink(skin)
    sim = bench(dut)
    slots = [(rng.randrange(1 << 14), rng.randrange(16), rng.randrange(16)) for _ in range(12)]
    cycles = 6000
    changes = random_words(rng, cycles - 2000, BITS[name], 900)
    sim.drive(Value.cast(dut.faults), held(changes))
    source = sim.source(dut.slots, [number | rows << 14 | columns << 18 for number, rows, columns in slots], rng, 0.99)
    ready = [rng.random() < 0.5 for _ in range(cycles + 1)]
    sink = sim.sink(dut.bytes, ready=ready.__getitem__)
    sim.run(cycles)
    assert source.done
    packets, _ = packets_of(sink)
    prefix = facts(skin).fingerprint[:2]
    sent = [packet for _, packet in packets if packet[-5] == 0x91]
    expected = [seal(digits(one, 2) + digits(rows | columns << 4, 2) + b"\x91", prefix) for one, rows, columns in slots]
    assert sent == expected == [faults.slot(facts(skin), *slot) for slot in slots]
    reports = [packet for _, packet in packets if packet[-5] == 0x90]
    assert len(reports) > 2
    assert reports[-1] == report_of(name, changes[-1][1])


def test_the_model_s_report_is_the_protocol_s():
    for name, skin in SKINS.items():
        assert facts(skin).fault_bits == BITS[name]
        assert faults.report(facts(skin)) == report_of(name, 0)
