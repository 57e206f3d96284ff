"""The self-test: the gateware in lockstep with the golden model, and which faults show in which slot."""

import itertools

import numpy as np
import pytest
from amaranth.hdl import Cat
from bench import split
from reversal import any_skin, small, touches
from sample import sample

from contactfpga.instruments.self_test import SelfTest
from contactfpga.skin import Skin
from contactfpga.wire.faults import SelfTestSlot
from contactfpga_hdl.scan import self_test as gateware
from contactfpga_hdl.scan.reversal import ReversalScanner
from contactfpga_sim.model.golden import Timeline, predict
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.request import command, request
from contactfpga_sim.model.sheet.matrix import Shorts
from contactfpga_sim.model.sheet.shift import SheetAtPins
from contactfpga_sim.verify.cosim import bench_amaranth
from contactfpga_sim.verify.cosim.compare import compare


def asked(skin: Skin, rng, cycles: int) -> list[tuple[int, bytes]]:
    """Self-tests, other commands, of which one looks like them, and requests, some of them back to back."""
    bit_clocks = facts(skin).bit_clocks
    other = command(9, 64 | 1, 0, False, bit_clocks)
    sent, cycle, number = [(0, other)], max(10 * bit_clocks * len(other), rng.randrange(600)), 129 * 128 + 1
    while cycle < cycles:
        kind = rng.random()
        if kind < 0.75:
            data = command(number, 1 if kind < 0.65 else rng.choice([2, 3]), 0, kind < 0.1, bit_clocks)
        else:
            data = request(number, kind < 0.8, bit_clocks)
        sent.append((cycle, data))
        cycle += 10 * bit_clocks * len(data) + rng.choice([0, 1, rng.randrange(200), rng.randrange(4000)])
        number += 2 if number % 8 == 7 else 1
    return sent


def any_life(rng, skin: Skin, cycles: int) -> Timeline:
    return Timeline(touches(skin, rng, cycles).pieces, asked(skin, rng, cycles))


def slots_in(skin: Skin, transfers: list[tuple[int, int]]) -> int:
    """Slots of self-tests among the bytes that a board sends."""
    packets = bytes(value for _, value in transfers).split(b"\0")
    ends = -(-(skin.rows + skin.columns) // 7) + 2 + 1  # of a packet without zero bytes: its code, then its plain bytes
    return sum(len(packet) == ends + 1 + 3 and packet[ends] == 0x91 for packet in packets)


LOCKSTEP = [
    {"rows": 3, "columns": 4, "alive": True, "fail_safe": True, "mask": ((1, 1),)},
    {"rows": 2, "columns": 3, "diodes": "row2col", "guard": True, "alive": True, "fail_safe": True},
    {"rows": 3, "columns": 2, "report": "cells", "send": "always", "mask": ((0, 0), (0, 1)), "baud": 6_000_000},
    {"rows": 4, "columns": 2, "mask": ((0, 1), (1, 1), (2, 1), (3, 1)), "baud": 3_000_000},
]


@pytest.mark.parametrize("fields", sample(LOCKSTEP, quick=LOCKSTEP[:2]), ids=lambda f: f"{f['rows']}x{f['columns']}")
def test_the_whole_board_is_the_golden_models_in_every_clock(rng, soon, fields):
    """Self-tests are asked for at any time: at the start, in frames, in each other, while switches are pressed."""
    skin = small(**fields, self_test=True)
    cycles = 3000 * facts(skin).bit_clocks  # hellos are over, and slots go out
    timeline = any_life(rng, skin, cycles)
    expected = predict(skin, timeline, cycles)
    assert compare(expected, bench_amaranth.run(skin, timeline, cycles)) > 150
    assert slots_in(skin, expected.bytes) > 3 or facts(skin).bit_clocks > 2  # slower lines are busy with hellos


@pytest.mark.campaign
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("seed", range(60))
def test_any_skin_with_a_self_test_is_the_golden_models_in_every_clock(rng, soon, seed):
    skin = any_skin(rng).replace(self_test=True, fail_safe=True, alive=True, guard=rng.random() < 0.5)
    cycles = 8000
    timeline = any_life(rng, skin, cycles)
    assert compare(predict(skin, timeline, cycles), bench_amaranth.run(skin, timeline, cycles, limit_s=600)) > 100


# ---- which faults show where


def self_test(bench, skin: Skin, pressed: np.ndarray, shorts: Shorts, stuck: np.ndarray | None = None):
    """The self-test of a scanner whose sheet has these faults, as the host reads it, and the bit that the board tells.
    No line is driven against another one."""
    dut = ReversalScanner(skin)
    sim, sheet = bench(dut), SheetAtPins(skin)
    sheet.matrix.join(shorts)
    sheet.matrix.press(pressed, stuck)
    ports = [getattr(dut.pins, name) for name in sheet.reads]

    def levels(_: int, pins: int) -> int:
        columns, rows = sheet.step(dict(zip(sheet.reads, split(pins, map(len, ports)), strict=True)))
        return columns | rows << skin.column_lines

    sim.drive(Cat(dut.pins.columns, dut.pins.rows_read), levels, Cat(*ports))
    sim.drive(dut.command, lambda cycle: int(cycle == 1))
    slots, joined = sim.sink(dut.slots), sim.watch(dut.faults)
    known, count = facts(skin), 1 + skin.rows + skin.columns
    sim.run(1 + (count + 1) * (2 * known.project + known.settle + 8))  # the slot that was under way counts as well
    every = (1 << skin.rows) - 1
    found = [
        SelfTestSlot(number, bits_of(word & every), bits_of(word >> skin.rows))
        for number, word in ((word & 0x3FFF, word >> 14) for _, word in slots.transfers)
    ]
    assert [slot.number for slot in found] == list(range(count))
    bit = joined.values[-1] >> known.fault_bits - 1
    return SelfTest(tuple(found), skin.rows, skin.columns, skin.guard, frozenset(skin.mask)), bit


def bits_of(word: int) -> tuple[int, ...]:
    return tuple(place for place in range(word.bit_length()) if word >> place & 1)


def crossing(row: int, column: int) -> str:
    return f"row {row} and column {column} joined, or the diode at ({row}, {column}) is bridged"


def single_faults(rows: int, columns: int):
    """(shorts, switches that have to be pressed, what is reported) of each pair of lines and each diode."""
    for one, other in itertools.combinations(range(rows), 2):
        yield Shorts(rows=((one, other),)), (), f"rows {one} and {other} joined"
    for one, other in itertools.combinations(range(columns), 2):
        yield Shorts(columns=((one, other),)), (), f"columns {one} and {other} joined"
    for place in itertools.product(range(rows), range(columns)):
        yield Shorts(crossed=(place,)), (), crossing(*place)
        yield Shorts(bridged=(place,)), (place,), crossing(*place)
    for row in range(rows):
        yield Shorts(supplied=(row,)), (), f"row {row} is held at the released level"


def any_cells(rng, rows: int, columns: int) -> np.ndarray:
    share = rng.choice([0, 0.3, 0.7, 1])
    return np.array([[rng.random() < share for _ in range(columns)] for _ in range(rows)])


@pytest.mark.parametrize("diodes", ["col2row", "row2col"])
def test_each_single_short_and_bridged_diode_is_named_whatever_is_pressed(bench, rng, diodes):
    skin = small(rows=3, columns=2, self_test=True, diodes=diodes)
    for shorts, needed, reported in single_faults(3, 2):
        cells = any_cells(rng, 3, 2)
        for place in needed:
            cells[place] = True
        test, bit = self_test(bench, skin, cells, shorts)
        assert (test.faults, test.untested, bit) == ((reported,), (), 1), cells


def test_a_whole_sheet_says_nothing_but_what_is_pressed(bench, rng):
    for number in range(8):
        skin = small(rows=2, columns=3, self_test=True, guard=number % 2 == 1, mask=((0, 0), (1, 0)))
        cells = any_cells(rng, 2, 3)
        test, bit = self_test(bench, skin, cells, Shorts())
        assert (test.findings, bit) == ((), 0)
        assert test.pressed == {(row, column) for row, column in np.argwhere(cells).tolist() if column}


def test_diodes_of_guard_switches_are_named(bench):
    skin, nothing = small(rows=3, columns=3, self_test=True, guard=True), np.zeros((3, 3), bool)
    for line in range(3):
        cause = "joined, or the diode between them is bridged"
        test, bit = self_test(bench, skin, nothing, Shorts(bridged=((line, 3),)))
        assert (test.findings, bit) == ((("fault", f"row {line} and the guard column {cause}"),), 1)
        test, bit = self_test(bench, skin, nothing, Shorts(bridged=((3, line),)))
        assert (test.findings, bit) == ((("fault", f"column {line} and the guard row {cause}"),), 1)


def test_a_column_with_a_strong_pull_is_not_judged_and_the_others_are(bench):
    skin, nothing = small(rows=2, columns=3, self_test=True), np.zeros((2, 3), bool)
    test, bit = self_test(bench, skin, nothing, Shorts(pulled=(1,), columns=((0, 2),)))
    assert test.faults == ("columns 0 and 2 joined",)
    assert test.untested == ("column 1 cannot be tested: its pull is too strong, or it is held at the released level",)
    assert bit == 1
    test, bit = self_test(bench, skin, nothing, Shorts(pulled=(1,), columns=((0, 1),)))
    assert (test.faults, bit) == (("column 0 follows column 1",), 1)


def test_the_first_frame_comes_after_the_self_test_in_the_stated_time():
    skin = small(rows=3, columns=4, self_test=True, send="always")
    trace, known = predict(skin, Timeline([]), 2000), facts(skin)
    without = predict(skin.replace(self_test=False), Timeline([]), 2000)
    later = (1 + 3 + 4) * (2 * known.project + known.settle + 8)
    assert trace.rows[0][0] - without.rows[0][0] == later


def test_what_is_reported_follows_from_each_slot_of_one_test_after_the_other(bench, rng):
    """Lines that rise come and go in any clock, in most tests none. A column that rises in the first slot says nothing
    in that test; a row that does with no column is joined with the supply. A whole test without a finding ends it."""
    skin, cycles = small(rows=3, columns=2, self_test=True, mask=((0, 1), (1, 1), (2, 1))), 30_000
    count, known = 3 + 2, facts(skin)
    dut = gateware.SelfTest(skin)
    sim = bench(dut)
    calm = [rng.random() < 0.7 for _ in range(cycles // 200 + 1)]

    def rises(bits):
        words = [rng.getrandbits(bits) & rng.getrandbits(bits) & rng.getrandbits(bits) for _ in range(cycles)]
        return [0 if calm[cycle // 200] and rng.random() < 0.99 else word for cycle, word in enumerate(words)]

    rows, columns = rises(3), rises(2)
    for cycle in range(cycles):
        if calm[cycle // 200] and rng.random() < 0.03:
            rows[cycle] = columns[cycle] = 1
    sim.drive(dut.rows, rows.__getitem__)
    sim.drive(dut.columns, columns.__getitem__)
    sim.drive(dut.begin, lambda cycle, asks: int(asks and rng.random() < 0.7), dut.asks)
    sim.drive(dut.command, lambda cycle: int(rng.random() < 0.02))
    sim.sink(dut.slots, rng, 0.3)
    ends, number, joined = sim.watch(dut.ends), sim.watch(dut.slots.payload.number), sim.watch(dut.joined)
    sim.run(cycles - 1)

    reported, expected, first, found, tests = 0, [], 0, False, []
    for cycle in range(cycles - 1):
        expected.append(reported)
        if not ends[cycle]:
            continue
        line = number[cycle] - 1
        counts = rows[cycle] | (columns[cycle] & 1) << 3  # the other column is masked whole
        if line < 0:
            first, found = rows[cycle] | columns[cycle] << 3, False
            bad = bool(counts & 7 and not counts >> 3)
        else:
            bad = bool(counts & ~first & ~(1 << line) & (0b11111 if line < 3 else 0b11000))
        found |= bad
        reported |= bad
        if line == count - 1:
            reported = int(found)
            tests.append((bool(first & 7), bool(first >> 3), found))
    assert joined.values == expected
    # A row that rises in the first slot without a column is a finding.
    assert {*tests} >= {*itertools.product((False, True), repeat=3)} - {(True, False, False)}
    assert known.project + known.settle < cycles // 200
