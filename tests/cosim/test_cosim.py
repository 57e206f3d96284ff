"""The gateware does what the golden model predicts, cycle for cycle, at every boundary."""

import functools
import itertools

import pytest
from frames import decoded
from sample import each_choice, sample

from contactfpga.skin import Skin
from contactfpga_sim.model.golden import Timeline, Trace, boundaries, predict
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.verify.cosim import bench_amaranth, bench_cocotb, bench_native
from contactfpga_sim.verify.cosim.compare import compare
from contactfpga_sim.verify.cosim.covering import CHOICES, pairs_in, pairwise, skin_for, stimulus
from contactfpga_sim.verify.cosim.record import OutOfTime

COVERING = pairwise(CHOICES)
NAMED = ("connectivity", "labeller", "debounce", "report", "send")
COCOTB = {
    "reference": Skin(),
    "debounced-cells": Skin(
        rows=5,
        columns=9,
        diodes="row2col",
        debounce="asym_eager_defer_pk",
        debounce_press_us=60.0,
        debounce_release_us=30.0,
        report="cells",
        send="on_change",
        keep_alive_ms=0.2,
        mask=((0, 0), (4, 8)),
        settle_us=2.5,
        row_drive="74hc595",
        column_read="74hc165",
        column_chains=2,
    ),
    "serial": Skin(labeller="serial", settle_us=2.5),
    "barycenter": Skin(rows=9, columns=7, report="barycenter", barycenter_bits=2, settle_us=2.5),
    "precharge": Skin(rows=6, columns=8, diodes="row2col", settle_us=1.5, precharge_us=0.5),
    "reversal": Skin(rows=6, columns=8, scan="reversal", settle_us=0.5, precharge_us=0.25, send="on_change"),
}


def name_of(choice: dict) -> str:
    rows, columns = choice["sheet"]
    return f"{rows}x{columns}-{'-'.join(str(choice[name]) for name in NAMED)}"


def cycles_for(skin: Skin) -> int:
    return max(3_000, min(25 * facts(skin).scan_clocks, 6_000))


def flags_in(skin: Skin, trace: Trace) -> set[str]:
    """Flags and counters that frames on the wire show, hellos among them."""
    frames, hellos = decoded(bytes(value for _, value in trace.bytes), skin)
    seen = {"hello"} if hellos else set()
    for frame in frames:
        seen |= frame.flags | {name for name in ("overwritten", "heard", "cells") if getattr(frame, name)}
    return seen


def test_covering_set_holds_every_pair_of_choices():
    names = list(CHOICES)
    found = pairs_in([[CHOICES[name].index(choice[name]) for name in names] for choice in COVERING])
    sizes = [len(CHOICES[name]) for name in names]
    total = sum(a * b for place, a in enumerate(sizes) for b in sizes[place + 1 :])
    assert len(found) == total
    assert len(COVERING) <= 2 * 7 * 4


@pytest.mark.whole
@pytest.mark.parametrize(
    "number",
    sample(range(len(COVERING)), quick=each_choice(COVERING)),
    ids=[name_of(choice) for choice in COVERING],
)
def test_covering_set_in_amaranths_simulator(number):
    skin = skin_for(COVERING[number])
    cycles = cycles_for(skin)
    for seed in itertools.count(number, len(COVERING)):  # until something happens at each boundary
        timeline = stimulus(skin, cycles, seed)
        expected = predict(skin, timeline, cycles)
        if all(expected.events(boundary) for boundary in boundaries(skin)):
            break
    assert compare(expected, bench_amaranth.run(skin, timeline, cycles)) > 100


def test_covering_set_touches_every_flag_and_counter():
    seen = set()
    for number, choice in enumerate(COVERING):
        skin = skin_for(choice)
        cycles = cycles_for(skin)
        seen |= flags_in(skin, predict(skin, stimulus(skin, cycles, seed=number), cycles))
    assert seen == {"hello", "heard", "overflow", "overwritten", "fault", "cells"}


@pytest.mark.slow
@pytest.mark.skipif(not bench_cocotb.available("icarus"), reason="no iverilog on PATH")
@pytest.mark.parametrize("name", sample(COCOTB, quick=["reference"]))
def test_top_through_cocotb_on_icarus(name):
    check_through_cocotb(COCOTB[name], "icarus", 10_000)


@pytest.mark.campaign  # Verilator compiles for long; `make test` has it in test_demo.py
@pytest.mark.parametrize("name", COCOTB)
def test_top_through_cocotb(name):
    check_through_cocotb(COCOTB[name], "verilator", 30_000)


def check_through_cocotb(skin, simulator, cycles):
    timeline = stimulus(skin, cycles, seed=4)
    expected = predict(skin, timeline, cycles)
    got = bench_cocotb.run(skin, timeline, cycles, simulator)
    assert compare(expected, got) > cycles // 10


@functools.cache
def half_a_second() -> tuple[Skin, Trace]:
    """0.51 s of board time at 1 MHz as predicted: too slow for Amaranth's simulator, so the compiled board has it."""
    skin = Skin(rows=1, columns=1, clock_hz=1_000_000, baud=100_000, settle_us=1_800.0, release_us=100.0)
    cycles = 510_000
    timeline = Timeline(stimulus(skin, cycles, seed=2).pieces)
    expected = predict(skin, timeline, cycles)
    compare(expected, bench_native.run(skin, timeline, cycles))
    return skin, expected


@pytest.mark.slow
def test_hello_comes_again_after_half_a_second():
    skin, trace = half_a_second()
    assert len(decoded(bytes(value for _, value in trace.bytes), skin)[1]) == 2


@pytest.mark.slow
def test_sequence_counts_past_255_frames():
    skin, trace = half_a_second()
    numbers = [frame.sequence for frame in decoded(bytes(value for _, value in trace.bytes), skin)[0]]
    assert numbers == [number % 256 for number in range(len(numbers))]
    assert len(numbers) > 258


def test_simulation_past_its_time_limit_is_ended():
    skin = Skin()
    with pytest.raises(OutOfTime):
        bench_amaranth.run(skin, Timeline([]), 10_000_000, limit_s=0.3)
    with pytest.raises(OutOfTime):
        bench_cocotb.run(skin, Timeline([]), 10_000_000, limit_s=0.3)
