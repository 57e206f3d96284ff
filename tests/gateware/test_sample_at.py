"""The command "sample at": frames after it are sampled at another clock of each row, and nothing else changes."""

import itertools

import numpy as np
import pytest
from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from sample import sample

from contactfpga import Skin
from contactfpga.skin.derived import SAMPLE_AT
from contactfpga_hdl.scan.pins import sample_at_ports
from contactfpga_hdl.scan.sample_at import SampleAt
from contactfpga_sim.model.golden import Timeline, predict
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.request import command, request
from contactfpga_sim.model.golden.trace import Cuts
from contactfpga_sim.verify.cosim import bench_amaranth
from contactfpga_sim.verify.cosim.compare import compare

TINY = {"clock_hz": 1_000_000, "baud": 250_000, "report": "cells"}
FAST = {"scan": "reversal", "precharge_us": 3, "project_us": 6}
SKINS = {
    "direct": Skin(rows=3, columns=4, settle_us=16, release_us=2, **TINY),
    "released for a clock": Skin(rows=3, columns=4, settle_us=18, release_us=1, diodes="row2col", **TINY),
    "one cell": Skin(rows=1, columns=1, settle_us=20, release_us=1, **TINY),
    "masked": Skin(rows=4, columns=3, settle_us=13, release_us=3, mask=((0, 0), (1, 1), (3, 0)), **TINY),
    "precharged": Skin(rows=3, columns=4, settle_us=14, precharge_us=3, guard=True, **TINY),
    "chains": Skin(rows=3, columns=4, settle_us=30, row_drive="74hc595", column_read="74hc165", **TINY),
    "two chains, guarded": Skin(rows=5, columns=3, settle_us=24, row_drive="74hc595", column_read="74hc165",
                                row_chains=2, column_chains=2, guard=True, fail_safe=True, **TINY),
    "debounced": Skin(rows=3, columns=4, settle_us=16, release_us=2, debounce="sym_defer_pk", debounce_press_us=50,
                      debounce_release_us=100, **TINY),
    "on change": Skin(rows=2, columns=2, settle_us=14, release_us=2, send="on_change", keep_alive_ms=0.5,
                      guard=True, **TINY),
    "without diodes": Skin(rows=3, columns=3, settle_us=12, release_us=2, diodes="none", **TINY),
    "reversal": Skin(rows=3, columns=4, settle_us=9, **FAST, **TINY),
    "reversal, guarded": Skin(rows=3, columns=4, settle_us=8, diodes="row2col", guard=True, alive=True, **FAST, **TINY),
    "reversal, debounced": Skin(rows=4, columns=3, settle_us=7, send="on_change", keep_alive_ms=5,
                                debounce="asym_eager_defer_pk", debounce_press_us=50, debounce_release_us=100,
                                mask=((1, 0),), **FAST, **TINY),
}  # fmt: skip
QUICK = ["reversal, guarded"]


def commanded(skin: Skin, seed: int, frames: int) -> Timeline:
    """Random histories of a sheet: cells, stuck columns and cuts change at any clock, more often than rows are driven;
    commands of any value, other commands and requests come at any time."""
    rng, known = np.random.default_rng(seed), facts(skin)
    cycles = frames * known.scan_clocks
    starts = np.cumsum(rng.integers(1, 2 * known.row_clocks, size=cycles // known.row_clocks))
    pieces = []
    for start in starts[starts < cycles]:
        stuck = rng.random(skin.columns) < 0.3 if skin.scan == "raster" and rng.random() < 0.05 else None
        pieces.append((int(start), rng.random((skin.rows, skin.columns)) < rng.choice([0, 0.5, 0.9, 1]), stuck))
    cuts = []
    if skin.guard:
        cut = sorted({int(at) for at in rng.integers(cycles, size=4)})
        cuts = [(at, Cuts({int(rng.integers(skin.rows + 1)): int(rng.integers(3))} if n % 2 else {})) for n, at in
                enumerate(cut)]  # fmt: skip
    received, start = [], int(rng.integers(known.scan_clocks))
    values = [0, 1, 2, 3, known.first_sample, known.settle - 1, known.settle, known.settle + 1, (1 << 21) - 1, 5 << 14]
    for number in itertools.count(129 * 128 + 1):
        value = int(rng.choice([*values, *rng.integers(known.first_sample, known.settle, size=10)]))
        what = int(rng.choice([2, 2, 2, 2, 1, 3, 64 | 2]))
        if not received:
            what, value = 2, known.first_sample
        data = command(number, what, value, False, known.bit_clocks)
        if number % 8 == 0 or (received and rng.random() < 0.2):
            data = request(number | 1, False, known.bit_clocks)
        if start + len(data) * 10 * known.bit_clocks > cycles:
            return Timeline(pieces, received, cuts)
        received.append((start, data))
        start += len(data) * 10 * known.bit_clocks + int(rng.integers(1, 4 * known.scan_clocks))
    raise AssertionError


@pytest.mark.parametrize("name", sample(SKINS, quick=QUICK))
def test_the_whole_board_is_the_golden_models_in_every_clock(name):
    skin = SKINS[name]
    assert SAMPLE_AT in skin.derived.commands
    cycles = max(25 * facts(skin).scan_clocks, 5_000)
    timeline = commanded(skin, len(name), cycles // facts(skin).scan_clocks)
    expected = predict(skin, timeline, cycles)
    plain = predict(skin, Timeline(timeline.pieces, (), timeline.cuts), cycles)
    assert [row[1] for row in expected.rows] != [row[1] for row in plain.rows], "no sample was moved"
    assert compare(expected, bench_amaranth.run(skin, timeline, cycles)) > 100


class Alone(wiring.Component):
    """The gateware that obeys the command "sample at", without a scan."""

    def __init__(self, skin: Skin):
        self.derived = skin.derived
        outputs = {"begins": In(1), "clock": Out(range(self.derived.settle_clocks + 1)), "early": Out(1)}
        super().__init__(sample_at_ports(self.derived) | outputs)

    def elaborate(self, platform):
        m = Module()
        chosen = SampleAt(m, self.derived, self.moves, self.clocks, self.begins)
        m.d.comb += [self.clock.eq(chosen.clock), self.early.eq(chosen.early)]
        return m


def test_a_frame_takes_the_last_clock_that_was_asked_for_before_it_begins(bench, rng):
    skin, cycles = SKINS["direct"], 3_000
    settle, first = facts(skin).settle, facts(skin).first_sample
    values = [
        rng.choice([rng.randrange(settle + 3), rng.randrange(1 << 21), settle - 1 | 1 << 20]) for _ in range(cycles)
    ]
    moves, begins = ([int(rng.random() < 0.3) for _ in range(cycles)] for _ in range(2))
    dut = Alone(skin)
    sim = bench(dut)
    for port, given in ((dut.moves, moves), (dut.clocks, values), (dut.begins, begins)):
        sim.drive(port, given.__getitem__)
    clock, early = sim.watch(dut.clock), sim.watch(dut.early)
    sim.run(cycles - 1)
    asked = taken = settle
    expected = []
    for moved, value, begun in zip(moves, values, begins):
        expected.append(taken)
        taken = asked if begun else taken
        if moved:
            asked = value if first <= value < settle else settle
    assert clock.values == expected[:-1]
    assert early.values == [int(one < settle) for one in expected[:-1]]
    assert {*expected} == {*range(first, settle + 1)}
