"""Line reversal with guard lines: each break is reported and nothing else, and when touches are seen."""

from dataclasses import dataclass

import numpy as np
import pytest
from amaranth.hdl import Cat
from bench import split
from guard_lines import breaks
from reversal import FAST, any_skin, noted_pins, selected_changes, small, touches
from sample import sample

from contactfpga.skin import Skin
from contactfpga_hdl.scan import reversal, reversal_guard
from contactfpga_hdl.scan.reversal import ReversalScanner
from contactfpga_sim.model.golden import Timeline, driven, predict
from contactfpga_sim.model.golden import reversal_lines as golden_guard
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.trace import Cuts
from contactfpga_sim.verify.cosim import bench_amaranth, bench_native
from contactfpga_sim.verify.cosim.compare import compare
from contactfpga_sim.verify.cosim.record import InputDriver

SLOW = {"clock_hz": 1_000_000, "baud": 100_000, "precharge_us": 1.0, "settle_us": 2.0, "release_us": 1.0, "guard": True}


@dataclass
class Life:
    """Pins, reports and rows of a scanner with guard lines, cycle by cycle."""

    words: list[int]
    """What is reported: rows lowest, then columns, then stuck columns."""
    contact: list[int]
    packed: list[int]
    """Cycles in which a frame was packed."""


def live(bench, skin: Skin, timeline: Timeline, cycles: int) -> Life:
    """A scanner whose rows are taken at once; a frame is packed two clocks after its last row."""
    dut = ReversalScanner(skin)
    sim, sheet = bench(dut), InputDriver(skin, timeline)
    sink, packed = sim.sink(dut.rows), []
    ports = [getattr(dut.pins, name) for name in sheet.reads]

    def levels(cycle: int, pins: int) -> int:
        named = dict(zip(sheet.reads, split(pins, map(len, ports)), strict=True))
        columns, rows, _ = sheet.pins(cycle, named)
        return columns | rows << skin.column_lines

    def is_packed(cycle: int) -> int:
        ended = [taken for taken, word in sink.transfers[-2:] if word >> skin.columns & 1 and taken == cycle - 2]
        packed.extend(cycle for _ in ended)
        return int(bool(ended))

    sim.drive(Cat(dut.pins.columns, dut.pins.rows_read), levels, Cat(*ports))
    sim.drive(dut.packed, is_packed)
    words, contact = sim.watch(dut.faults), sim.watch(dut.contact)
    sim.run(cycles)
    return Life(words.values, contact.values, packed)


def cut_now_and_then(skin: Skin, rng, cycles: int) -> list[tuple[int, Cuts]]:
    """Lines that are cut at any place for any time."""
    found, start = [], rng.randrange(400)
    while start < cycles:
        rows = {rng.randrange(skin.row_lines): rng.randrange(skin.column_lines)} if rng.random() < 0.4 else {}
        columns = {rng.randrange(skin.column_lines): rng.randrange(skin.row_lines)} if rng.random() < 0.4 else {}
        found.append((start, Cuts(rows, columns)))
        start += rng.randint(1, rng.choice([60, 900]))
    return found


def any_life(rng, skin: Skin, cycles: int) -> Timeline:
    timeline = touches(skin, rng, cycles)
    pieces = [
        (start, cells, None if stuck is None else np.append(stuck, rng.random() < 0.5))
        for start, cells, stuck in timeline.pieces
    ]
    return Timeline(pieces, timeline.received, cut_now_and_then(skin, rng, cycles))


LOCKSTEP = [
    {"rows": 3, "columns": 4, "alive": True, "fail_safe": True, "mask": ((1, 1),)},
    {"rows": 4, "columns": 2, "report": "cells", "diodes": "row2col", "send": "always", "fail_safe": True},
    {"rows": 2, "columns": 3, "debounce": "sym_defer_pk", "debounce_press_us": 7.0, "debounce_release_us": 12.0},
    {"rows": 3, "columns": 3, "mask": ((0, 0), (0, 1), (0, 2), (1, 2), (2, 2))},
]


@pytest.mark.parametrize("fields", LOCKSTEP, ids=lambda fields: f"{fields['rows']}x{fields['columns']}")
def test_the_whole_board_is_the_golden_models_in_every_clock(rng, monkeypatch, soon, fields):
    skin, cycles = small(**fields, guard=True), 1600
    timeline, pins = any_life(rng, skin, cycles), noted_pins(monkeypatch)
    assert compare(predict(skin, timeline, cycles), bench_amaranth.run(skin, timeline, cycles)) > 150
    assert selected_changes(skin, pins) == driven(skin, timeline, cycles)


def test_checks_at_rest_wait_for_a_turn_after_the_check_of_a_frame(monkeypatch, soon):
    """The frame's begins in each clock of the time between two turns, also in that of a turn."""
    skin, spacing = small(rows=2, columns=2, project_us=2.0, **SLOW | {"baud": 500_000}), 3 * 32 + 1
    pieces = []
    for start in range(60, 33 * spacing, spacing):
        pieces += [(start, np.eye(2, dtype=bool), None), (start + 9, np.zeros((2, 2), bool), None)]
    timeline, pins, cycles = Timeline(pieces), noted_pins(monkeypatch), 33 * spacing
    compare(predict(skin, timeline, cycles), bench_amaranth.run(skin, timeline, cycles))
    assert selected_changes(skin, pins) == driven(skin, timeline, cycles)


@pytest.mark.campaign
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("seed", range(60))
def test_any_skin_with_guard_lines_is_the_golden_models_in_every_clock(rng, soon, seed):
    skin, cycles = any_skin(rng).replace(guard=True, fail_safe=True, alive=True), 6000
    timeline = any_life(rng, skin, cycles)
    assert compare(predict(skin, timeline, cycles), bench_amaranth.run(skin, timeline, cycles)) > 100


@pytest.mark.campaign
def test_the_compiled_board_of_the_reference_sheet_is_the_golden_models_in_every_clock(rng):
    skin, cycles = FAST.replace(guard=True), 60_000
    timeline = any_life(rng, skin, cycles)
    assert compare(predict(skin, timeline, cycles), bench_native.run(skin, timeline, cycles)) > 1000


def in_turn(rng, spacing: int, lasts: int) -> tuple[list[int], list[tuple[int, Cuts]]]:
    """Each break of a 3x2 sheet, from cycles that are about ``spacing`` apart, and mended ``lasts`` cycles later."""
    at = [number * spacing + 40 + rng.randrange(40) for number in range(len(breaks(3, 2)))]
    cuts = [(start, cut) for start, (cut, _) in zip(at, breaks(3, 2), strict=True)]
    return at, sorted(cuts + [(start + lasts, Cuts()) for start in at], key=lambda cut: cut[0])


@pytest.mark.parametrize("diodes", sample(["col2row", "row2col"], quick=["row2col"]))
def test_at_rest_each_break_at_each_place_is_reported_after_two_checks_and_nothing_else(bench, soon, rng, diodes):
    skin = small(rows=3, columns=2, project_us=2.0, diodes=diodes, **SLOW)
    spacing = 540
    at, cuts = in_turn(rng, spacing, 100)
    words = live(bench, skin, Timeline([], cuts=cuts), at[-1] + spacing).words
    for start, (cut, wanted) in zip(at, breaks(3, 2), strict=True):
        assert {word & ~wanted for word in words[start : start + spacing - 80]} == {0}, cut
        assert words[start + 2 * 32 + 20] == wanted, cut
        assert words[start + spacing - 80] == 0, f"{cut} was mended"


def test_two_checks_at_rest_come_within_one_ms():
    assert golden_guard.CHECK_US == 1 << reversal_guard.CHECK_BIT == 1 << reversal.CHECK_BIT
    assert 2 * golden_guard.CHECK_US + 20 < 1000


@pytest.mark.parametrize("diodes", sample(["col2row", "row2col"], quick=["col2row"]))
def test_each_break_at_each_place_is_reported_within_two_frames_whatever_is_pressed(bench, monkeypatch, rng, diodes):
    monkeypatch.setattr(reversal, "RETRY_BIT", 7)
    skin = small(rows=3, columns=2, project_us=2.0, diodes=diodes, **SLOW)
    spacing = 560
    at, cuts = in_turn(rng, spacing, 250)
    pieces = []
    for start in range(0, at[-1] + spacing, 25):
        cells = np.array([[rng.random() < 0.5 for _ in range(2)] for _ in range(3)])
        cells[0, 0] = cells[1, 1] = True  # no single break hides both
        pieces.append((start, cells, None))
    life = live(bench, skin, Timeline(pieces, cuts=cuts), at[-1] + spacing)
    for start, (cut, wanted) in zip(at, breaks(3, 2), strict=True):
        assert {word & ~wanted for word in life.words[start : start + spacing - 80]} == {0}, cut
        _, _, _, after_two = [cycle for cycle in life.packed if cycle >= start][:4]  # the first one was under way
        assert after_two < start + 250
        assert life.words[after_two] == wanted, cut
        assert life.words[start + spacing - 80] == 0, f"{cut} was mended"


def test_a_whole_sheet_is_never_reported_whatever_is_pressed(bench, soon, rng):
    skin = small(rows=2, columns=3, project_us=2.0, mask=((0, 1),), **SLOW)
    every = [np.array([number >> bit & 1 for bit in range(6)], bool).reshape(2, 3) for number in range(64)]
    pieces = [(60 * number, cells, None) for number, cells in enumerate(every)]
    pieces += [(start, every[rng.randrange(64)], None) for start in range(60 * 64, 60 * 64 + 1500, 5)]
    assert set(live(bench, skin, Timeline(pieces), 60 * 64 + 1500).words) == {0}


@pytest.mark.parametrize(("project_us", "clocks"), [(1.0, 43), (0.7, 36)])
def test_a_touch_is_seen_when_the_check_is_over(bench, monkeypatch, rng, project_us, clocks):
    """A check of an untouched sheet delays a touch: at worst ``contact`` comes after settle and projection time and 7
    clocks, not 3 clocks."""
    monkeypatch.setattr(reversal, "CHECK_BIT", 4)
    monkeypatch.setattr(reversal_guard, "CHECK_BIT", 4)
    skin = small(rows=2, columns=2, settle_us=0.5, project_us=project_us, precharge_us=0.25, guard=True)
    turn, pieces = 24 * 16, []
    touch = [number * turn + rng.choice([0, 1, rng.randrange(-6, 50)]) for number in range(3, 40)]
    for start in touch:
        pieces += [(start, np.eye(2, dtype=bool), None), (start + 60, np.zeros((2, 2), bool), None)]
    contact = live(bench, skin, Timeline(pieces), 40 * turn + 100).contact
    late = [contact.index(1, start) - start for start in touch]
    settle, project = facts(skin).settle, facts(skin).project
    assert min(late) == 3
    assert settle + project + 3 <= max(late) <= settle + project + 7 == clocks
