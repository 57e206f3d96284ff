"""Debounce: every switch on its own, by the rules of docs/timing.md."""

import functools
import itertools
import math

import pytest
from amaranth.sim import Simulator

from contactfpga import Skin
from contactfpga_hdl.debounce.even import Debounce
from contactfpga_hdl.debounce.timed import TimedDebounce

METHODS = ("sym_defer_pk", "asym_eager_defer_pk")
SHEETS = ((1, 1), (1, 7), (7, 1), (13, 6), (3, 5), (2, 17))
DELAYS = ((0, 0), (0, 3), (1, 0), (1, 1), (2, 5), (5, 2), (9, 9))


def skin_of(rows, columns, method, press, release):
    """A Skin whose times are ``press`` and ``release`` scans."""
    row_us = max(16, columns + 6, math.ceil((columns + 32) / rows))
    scan_us = row_us * rows
    return Skin(
        rows=rows,
        columns=columns,
        settle_us=row_us - 1,
        release_us=1,
        report="cells",
        clock_hz=1_000_000,
        baud=250_000,
        debounce=method,
        debounce_press_us=press * scan_us,
        debounce_release_us=release * scan_us,
    )


def debounced(method, press, release, samples):
    """Level that one switch counts as after each of its samples."""
    out, state, run, ignored = [], 0, 0, 0
    for sample in samples:
        if method == "sym_defer_pk":
            run = run + 1 if sample != state else 0
            if run == (release if state else press) + 1:
                state, run = 1 - state, 0
        elif not state:
            if sample:
                state, run, ignored = 1, 0, max(0, press - 1)
        elif ignored:
            ignored -= 1
        else:
            run = 0 if sample else run + 1
            if run == release + 1:
                state = 0
        out.append(state)
    return out


def bouncing(rng, samples):
    """A switch that is pressed and released at random and bounces after each change."""
    out = []
    while len(out) < samples:
        for level in (0, 1):
            out += [rng.randrange(2) for _ in range(rng.randrange(8))]
            out += [level] * rng.choice((1, 2, 3, 5, 6, 7, 9, 10, 11, 14))
    return out[:samples]


@functools.cache
def bench_of(bench, *facts):
    dut = Debounce(skin_of(*facts))
    return dut, bench(dut)


def frames_through(bench, facts, frames, **stalls):
    """Debounced frames (lists of row words) for raw ones; also source and sink, with their cycles."""
    rows, columns = facts[:2]
    dut, sim = bench_of(bench, *facts)
    raw = [row | (index == rows - 1) << columns for frame in frames for index, row in enumerate(frame)]
    source = sim.source(dut.raw, raw, stalls.get("rng"), gap=stalls.get("gap", 0))
    sink = sim.sink(dut.rows, stalls.get("rng"), stall=stalls.get("stall", 0))
    sim.run(30 * (columns + 5) * len(raw) + 100, until=lambda: len(sink.transfers) == len(raw))
    lasts = [payload >> columns for _, payload in sink.transfers]
    assert lasts == ([0] * (rows - 1) + [1]) * len(frames)
    words = [payload & (1 << columns) - 1 for _, payload in sink.transfers]
    return [words[start : start + rows] for start in range(0, len(words), rows)], source, sink


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("sheet", SHEETS)
def test_every_switch_follows_the_rule_whatever_the_others_do(bench, rng, method, sheet):
    rows, columns = sheet
    count = max(20, 600 // (rows * (columns + 3)))
    for press, release in rng.sample(DELAYS, 3):
        cells = {cell: bouncing(rng, count) for cell in itertools.product(range(rows), range(columns))}
        wanted = {cell: debounced(method, press, release, samples) for cell, samples in cells.items()}
        frames = [[sum(cells[r, c][n] << c for c in range(columns)) for r in range(rows)] for n in range(count)]
        got, _, _ = frames_through(bench, (*sheet, method, press, release), frames, rng=rng, gap=0.3, stall=0.3)
        for (r, c), states in wanted.items():
            assert [frame[r] >> c & 1 for frame in got] == states, f"switch {r}, {c} at {press}, {release}"


UNEVEN = Skin(rows=3, columns=4, clock_hz=12_000_000, report="cells", scan="reversal", precharge_us=1.0, settle_us=2.0)


def timed(method, press, release, samples):
    """Level that one switch counts as, and whether a time is running, after each of its samples (time, level)."""
    out, state, since, ignored_from = [], 0, None, None
    for now, level in samples:
        if ignored_from is not None and now - ignored_from < press:
            out.append((1, True))
            continue
        ignored_from = None
        if method == "asym_eager_defer_pk" and level > state:
            state, since, ignored_from = 1, None, now if press else None
        elif level == state:
            since = None
        else:
            since = now if since is None else since
            if now - since >= (release if state else press):
                state, since = level, None
        out.append((state, since is not None))
    return out


def rows_alone(skin, taken):
    """The debounce of uneven times, fed with rows (time, number, levels of four switches) that are driven alone: the
    rows that leave it as (cells, last), and after each row whether that row is busy."""
    dut, got, busy = TimedDebounce(skin), [], []

    async def bench(ctx):
        ctx.set(dut.rows.ready, 1)
        ctx.set(dut.alone, 1)
        for now, row, levels in taken:
            ctx.set(dut.raw.payload.cells, packed(levels))
            ctx.set(dut.raw.payload.last, row == 2)
            ctx.set(dut.now, now % 2 ** len(dut.now))
            ctx.set(dut.raw.valid, 1)
            while not (await ctx.tick().sample(dut.raw.ready))[-1]:
                pass
            ctx.set(dut.raw.valid, 0)
            ctx.set(dut.now, ~now % 2 ** len(dut.now))  # its clock goes on while the row is inside
            for _ in range(skin.columns + 4):
                _, _, valid, left = await ctx.tick().sample(dut.rows.valid, dut.rows.payload)
                if valid:
                    got.append((left.cells, left.last))
            busy.append(ctx.get(dut.busy) >> row & 1)

    simulator = Simulator(dut)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
    return got, busy


def packed(levels):
    return sum(level << column for column, level in enumerate(levels))


@pytest.mark.whole
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("press", "release"), [(0, 0), (0, 3), (2, 0), (2, 4)])
def test_samples_at_uneven_times_follow_the_rule_and_busy_rows_are_reported(rng, method, press, release):
    """Each row is driven alone, at times of its own; the times of the rule are those of docs/timing.md."""
    times = [us + 1 if us else 0 for us in (press, release)]
    skin = UNEVEN.replace(debounce=method, debounce_press_us=press, debounce_release_us=release)
    now, levels, taken = 0, [[0] * 4 for _ in range(3)], []
    for row in list(range(3)) * 120:
        now += rng.randint(1, 2)
        levels[row] = [level ^ (rng.random() < rng.choice([0.02, 0.5])) for level in levels[row]]
        taken.append((now, row, levels[row]))
    rule = {
        (row, column): iter(timed(method, *times, [(now, some[column]) for now, at, some in taken if at == row]))
        for row, column in itertools.product(range(3), range(4))
    }
    wanted = [[next(rule[row, column]) for column in range(4)] for _, row, _ in taken]
    got, busy = rows_alone(skin, taken)
    assert got == [(packed(state for state, _ in some), row == 2) for (_, row, _), some in zip(taken, wanted)]
    assert busy == [any(state or runs for state, runs in some) for some in wanted]
