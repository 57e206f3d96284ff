"""The adaptive scan: which rows are driven (docs/timing.md, Adaptive scan), how many row times that takes, and that
nothing is later than in a raster scan."""

import collections
import functools
import operator

import numpy as np
import pytest
from sample import each_choice, sample

from contactfpga.skin import Skin
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.golden import BOUNDARIES, Timeline, driven, predict, requests
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.verify.cosim import bench_amaranth, bench_native, record
from contactfpga_sim.verify.cosim.compare import compare
from contactfpga_sim.verify.cosim.covering import ADAPTIVE, pairwise, skin_for, stimulus

COVERING = pairwise(ADAPTIVE)
SMALL = {"scan": "adaptive", "rows": 4, "columns": 3, "settle_us": 3.0, "release_us": 1.0}


def touches(skin: Skin, cycles: int, seed: int) -> Timeline:
    """A few switches that change and bounce, with long pauses: an adaptive scan is mostly quiet."""
    rng = np.random.default_rng([seed, 13])
    cells = np.zeros((skin.rows, skin.columns), bool)
    pieces, start = [], 0
    while start < cycles:
        if rng.random() < 0.2:
            cells = np.zeros_like(cells)
        else:
            cells = cells ^ (rng.random(cells.shape) < rng.choice([0.5, 2.0, 5.0]) / cells.size)
        pieces.append((start, cells, rng.random(skin.columns) < 0.1 if rng.random() < 0.03 else None))
        start += int(facts(skin).row_clocks * rng.choice([0.04, 0.3, 1.0, 3.3, skin.rows, 4 * skin.rows])) + 1
    return Timeline(pieces, requests([cycles // 3, cycles // 2], facts(skin).bit_clocks))


def play(board: CompiledBoard, timeline: Timeline, cycles: int) -> int:
    """Everything at the board's boundaries is as predicted, the driven rows too; returns the events compared."""
    board.restart()
    bench_native.play(board, timeline, cycles)
    events = {name: board.take(name) for name in (*BOUNDARIES, "driven")}
    count = compare(predict(board.skin, timeline, cycles), bench_native.trace(events, cycles))
    wanted = driven(board.skin, timeline, cycles)
    assert list(zip(events["driven"]["cycle"].tolist(), events["driven"]["data"].tolist())) == wanted
    return count + len(wanted)


# ---- gateware and golden model


@pytest.mark.whole
@pytest.mark.parametrize("number", sample(range(len(COVERING)), quick=each_choice(COVERING)))
def test_covering_set_in_amaranths_simulator(number):
    skin = skin_for(COVERING[number])
    cycles = 1_200
    make = stimulus if number % 2 else touches
    timeline = make(skin, cycles, number)
    assert compare(predict(skin, timeline, cycles), bench_amaranth.run(skin, timeline, cycles)) > 50


BOARDS = {
    "8x8": {"rows": 8, "columns": 8},
    "33x17": {
        "rows": 33,
        "columns": 17,
        "settle_us": 6.0,
        "send": "on_change",
        "keep_alive_ms": 2.0,
        "zone_capacity": 5,
    },
    "13x6": {
        "rows": 13,
        "columns": 6,
        "diodes": "row2col",
        "report": "cells",
        "mask": ((3, 3), (4, 3)),
        "baud": 6_000_000,
    },
    "16x16": {"rows": 16, "columns": 16, "row_drive": "74hc595"},
    "9x4": {"rows": 9, "columns": 4, "row_drive": "74hc595", "row_chains": 3, "shift_hz": 4_000_000, "settle_us": 3.0},
    "7x5": {"rows": 7, "columns": 5, "debounce": "sym_defer_pk", "debounce_press_us": 84, "debounce_release_us": 126},
    "7x5, eager": {
        "rows": 7,
        "columns": 5,
        "debounce": "asym_eager_defer_pk",
        "debounce_press_us": 126,
        "report": "cells",
    },
}


@pytest.mark.slow
@pytest.mark.parametrize("name", sample(BOARDS, quick=["9x4"]))
def test_the_compiled_board_is_the_golden_models_in_every_clock(record_property, name):
    skin = Skin(scan="adaptive", **BOARDS[name])
    cycles, events = 40_000, 0
    with CompiledBoard(skin, (*BOUNDARIES, "driven")) as board:
        for seed in range(6):
            events += play(board, (stimulus if seed % 3 == 0 else touches)(skin, cycles, seed), cycles)
    assert events > 6_000
    record_property("cases", 6 * cycles)


def test_a_disturbed_register_of_an_untouched_sheet_is_right_again_one_slot_later(monkeypatch):
    """Rows on 74HC595 lose what they hold; a touch two slots later is seen as if nothing had been."""
    skin = Skin(**SMALL, row_drive="74hc595")
    known = facts(skin)
    lost, touched = 20 * known.row_clocks + 7, 22 * known.row_clocks + 7
    cells = np.zeros((skin.rows, skin.columns), bool)
    cells[2, 1] = True
    forgets = record.InputDriver.pins
    outputs = []

    def pins(self, cycle, levels):
        registers = self._sheet.row_registers
        if cycle == lost:
            registers.shifted, registers.latched = [0], [(1 << skin.rows) - 1]  # no row is low
        outputs.append(registers.latched[0])
        return forgets(self, cycle, levels)

    monkeypatch.setattr(record.InputDriver, "pins", pins)
    timeline, cycles = Timeline([(touched, cells, None)]), touched + 30 * known.row_clocks
    assert compare(predict(skin, timeline, cycles), bench_amaranth.run(skin, timeline, cycles)) > 100
    assert outputs[lost] == (1 << skin.rows) - 1
    assert outputs[lost + 2 * known.row_clocks] == 0


def test_columns_that_keep_their_level_for_all_of_the_release_time_but_a_clock_are_not_stuck(monkeypatch):
    skin = Skin(**SMALL)
    known = facts(skin)
    cells = np.zeros((skin.rows, skin.columns), bool)
    cells[2, 1] = cells[3, 0] = True
    exact = record.InputDriver.pins
    pressed = collections.deque(maxlen=known.row_clocks - known.settle)  # now and in the clocks before; low is pressed

    def pins(self, cycle, levels):
        columns, *others = exact(self, cycle, levels)
        pressed.append(columns)
        return functools.reduce(operator.and_, pressed), *others

    timeline, cycles = Timeline([(7, cells, None)]), 30 * known.row_clocks
    trace = predict(skin, timeline, cycles)
    monkeypatch.setattr(record.InputDriver, "pins", pins)
    assert compare(trace, bench_amaranth.run(skin, timeline, cycles)) > 100


CROWDED = [((16, 16), 4, "moments"), ((20, 24), 8, "cells")]


def crowds(skin: Skin, cycles: int, seed: int) -> Timeline:
    """As many zones as a row can hold in every other row, in some rows or none: what is packed and kept the longest."""
    rng = np.random.default_rng([seed, 17])
    dots = np.zeros((skin.rows, skin.columns), bool)
    dots[::2, ::2] = True
    pieces, start = [], 0
    while start < cycles:
        some = dots & (rng.random((skin.rows, 1)) < rng.random())
        noise = rng.random(dots.shape) < 0.5
        pieces.append((start, (dots, np.roll(dots, 1, 0), np.zeros_like(dots), some, noise)[rng.integers(5)], None))
        start += int(facts(skin).row_clocks * (rng.choice([1, 3, skin.rows // 2, 2 * skin.rows]) + rng.random())) + 1
    return Timeline(pieces)


@pytest.mark.campaign
@pytest.mark.parametrize(("size", "connectivity", "report"), CROWDED)
def test_the_shortest_row_time_that_is_accepted_is_enough(size, connectivity, report):
    fields = {"rows": size[0], "columns": size[1], "connectivity": connectivity, "report": report}
    needed = Skin(scan="adaptive", settle_us=200.0, **fields).derived.min_row_clocks
    skin = Skin(scan="adaptive", settle_us=(needed - 12) / 12, **fields)
    assert skin.derived.row_clocks == needed
    with CompiledBoard(skin, (*BOUNDARIES, "driven")) as board:
        assert sum(play(board, crowds(skin, 40_000, seed), 40_000) for seed in range(6)) > 30_000
