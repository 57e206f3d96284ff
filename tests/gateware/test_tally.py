"""A row's moments and whether a frame changed, counted before the labeller."""

import itertools
import math

import pytest

from contactfpga import Skin
from contactfpga_hdl.report.audit import Tally
from contactfpga_hdl.report.change import Change

SHEETS = ((1, 1), (1, 9), (9, 1), (5, 7), (3, 64), (64, 3), (16, 16))


def skin_of(rows, columns, **options):
    return Skin(rows=rows, columns=columns, settle_us=100, **options)


def taken_rows(rng, rows, columns, frames, shortest_gap):
    """{cycle: (words, last)}: rows of random frames at random moments."""
    taken, cycle = {}, rng.randrange(4)
    for _ in range(frames):
        density = rng.random()
        for y in range(rows):
            taken[cycle] = sum(1 << x for x in range(columns) if rng.random() < density), y == rows - 1
            cycle += rng.randrange(shortest_gap, 5)
    return taken


def drive_rows(sim, dut, taken, columns, rng):
    """Between rows the payload is noise: only ``taken`` says when it counts."""
    noise = [rng.randrange(2 << columns) for _ in range(17)]
    sim.drive(dut.taken, lambda cycle: int(cycle in taken))
    sim.drive(dut.row, lambda cycle: row_word(taken[cycle], columns) if cycle in taken else noise[cycle % 17])


def row_word(row, columns):
    cells, last = row
    return cells | last << columns


def spaced_rows(rng, rows, columns, frames):
    """The shortest row time, and {cycle: (words, last)} with rows that far apart, the last frame full."""
    words = [rng.randrange(1 << columns) for _ in range(frames * rows)] + [(1 << columns) - 1] * rows
    row_clocks = max(10, columns + 6)
    return row_clocks, {2 + row_clocks * k: (word, k % rows == rows - 1) for k, word in enumerate(words)}


@pytest.mark.parametrize("hold", [0.0, 0.6])
@pytest.mark.parametrize("sheet", SHEETS)
def test_a_rows_moments_come_in_shares_from_two_clocks_after_it_on(bench, rng, sheet, hold):
    rows, columns = sheet
    row_clocks, taken = spaced_rows(rng, rows, columns, max(2, 60 // rows))
    groups = math.ceil(columns / next(size for size in (4, 8, 16) if columns <= 4 * size))
    holds = set()
    for start in taken:  # at most as many as a row has steps
        holds.update(rng.sample(range(start + 1, start + row_clocks - 1), k=round(hold * columns)))
    dut = Tally(skin_of(rows, columns))
    sim = bench(dut)
    drive_rows(sim, dut, taken, columns, rng)
    sim.drive(dut.hold, lambda cycle: int(cycle in holds))
    shares = [sim.watch(dut.moments[name]) for name in ("area", "sum_x", "sum_y")]
    busy = sim.watch(dut.busy)
    sim.run(max(taken) + row_clocks + 1)
    for y, (start, (word, _)) in zip(itertools.cycle(range(rows)), taken.items()):
        free = [cycle for cycle in range(start + 1, start + row_clocks + 1) if cycle not in holds]
        pressed = [x for x in range(columns) if word >> x & 1]
        totals = [sum(watch[cycle] for cycle in free[: groups + 1]) for watch in shares]
        assert totals == [len(pressed), sum(pressed), len(pressed) * y]
        assert not any(watch[cycle] for watch in shares for cycle in (start + 1, *free[groups + 1 :]))
        assert [cycle for cycle in free if busy[cycle]] == (free[: groups + 1] if word else [])


@pytest.mark.parametrize("sheet", SHEETS)
def test_empty_rows_may_follow_without_a_pause(bench, rng, sheet):
    rows, columns = sheet
    row_clocks, spaced = spaced_rows(rng, rows, columns, max(2, 60 // rows))
    taken, pressed, cycle = {}, {}, 2
    for y, (word, last) in zip(itertools.cycle(range(rows)), spaced.values()):
        word *= rng.random() < 0.4
        cycle = max(cycle, max(pressed, default=-row_clocks) + row_clocks) if word else cycle
        taken[cycle] = word, last
        if word:
            pressed[cycle] = y, [x for x in range(columns) if word >> x & 1]
        cycle += 1
    dut = Tally(skin_of(rows, columns))
    sim = bench(dut)
    drive_rows(sim, dut, taken, columns, rng)
    shares = [sim.watch(dut.moments[name]) for name in ("area", "sum_x", "sum_y")]
    sim.run(cycle + row_clocks)
    for start, (y, xs) in pressed.items():
        totals = [sum(watch[cycle] for cycle in range(start + 1, start + row_clocks)) for watch in shares]
        assert totals == [len(xs), sum(xs), len(xs) * y]


@pytest.mark.parametrize("sheet", SHEETS)
def test_changed_compares_each_row_with_the_same_row_a_frame_before(bench, rng, sheet):
    rows, columns = sheet
    before, taken, clears, wanted, cycle = [0] * rows, {}, set(), {}, 2
    for changes in [1, 0, *rng.choices((0, 0, 1, 2), k=max(6, 60 // rows))]:
        frame = list(before)
        for _ in range(changes):
            frame[rng.randrange(rows)] ^= 1 << rng.randrange(columns)
        for y, word in enumerate(frame):
            taken[cycle] = word, y == rows - 1
            cycle += rng.randrange(1 if rows > 1 else 2, 5)
        wanted[cycle] = int(frame != before)
        clears.add(cycle)
        before = frame
        cycle += rng.randrange(3)  # the next frame's first row may come in the clock that clears
    dut = Change(skin_of(rows, columns))
    sim = bench(dut)
    drive_rows(sim, dut, taken, columns, rng)
    sim.drive(dut.clear, lambda cycle: int(cycle in clears))
    changed = sim.watch(dut.changed)
    sim.run(cycle + 2)
    assert {cycle: changed[cycle] for cycle in wanted} == wanted
    assert set(wanted.values()) == {0, 1}


def test_changed_rises_one_clock_after_the_row(bench):
    dut = Change(skin_of(2, 3))
    sim = bench(dut)
    taken = {3: (0, 0), 6: (0b100, 1)}
    sim.drive(dut.taken, lambda cycle: int(cycle in taken))
    sim.drive(dut.row, lambda cycle: row_word(taken.get(cycle, (0b111, 0)), 3))
    changed = sim.watch(dut.changed)
    sim.run(10)
    assert changed.values == [0] * 7 + [1] * 3
