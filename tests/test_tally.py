"""A row's moments and whether a frame changed, counted before the labeller."""

import itertools

import pytest

from contactfpga import Skin
from contactfpga_hdl.tally import Change, Tally

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


@pytest.mark.parametrize("sheet", SHEETS)
def test_moments_of_each_row_come_two_clocks_after_it_and_nothing_between(bench, rng, sheet):
    rows, columns = sheet
    taken = taken_rows(rng, rows, columns, max(3, 100 // rows), shortest_gap=1)
    taken |= {max(taken) + 1 + y: ((1 << columns) - 1, y == rows - 1) for y in range(rows)}  # the largest sums
    dut = Tally(skin_of(rows, columns))
    sim = bench(dut)
    drive_rows(sim, dut, taken, columns, rng)
    got = [sim.watch(dut.moments[name]) for name in ("area", "sum_x", "sum_y")]
    sim.run(max(taken) + 5)
    counted = {cycle + 2 for cycle in taken}
    assert not any(any(watch[cycle] for watch in got) for cycle in range(max(taken) + 5) if cycle not in counted)
    for y, (cycle, (word, _)) in zip(itertools.cycle(range(rows)), taken.items()):
        pressed = [x for x in range(columns) if word >> x & 1]
        assert [watch[cycle + 2] for watch in got] == [len(pressed), sum(pressed), len(pressed) * y]


@pytest.mark.parametrize("sheet", SHEETS)
def test_changed_compares_each_row_with_the_same_row_a_frame_before(bench, rng, sheet):
    rows, columns = sheet
    before, taken, clears, wanted, cycle = [0] * rows, {}, set(), {}, 2
    for _ in range(max(6, 60 // rows)):
        frame = list(before)
        for _ in range(rng.choice((0, 0, 1, 2))):
            frame[rng.randrange(rows)] ^= 1 << rng.randrange(columns)
        for y, word in enumerate(frame):
            taken[cycle] = word, y == rows - 1
            cycle += rng.randrange(2, 5)
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
