"""How many row times a frame of an adaptive scan takes; contact, masks and stuck columns."""

import itertools
import math

import numpy as np
import pytest
from frames import decoded

from contactfpga.skin import Skin
from contactfpga.wire.hello import HelloReader
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.golden import Timeline, adaptive, predict, requests
from contactfpga_sim.model.golden.adaptive import AdaptiveScanModel
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.verify.cosim import bench_amaranth, bench_native
from contactfpga_sim.verify.cosim.compare import compare

SMALL = {"scan": "adaptive", "rows": 4, "columns": 3, "settle_us": 3.0, "release_us": 1.0}
TALL = Skin(**SMALL | {"rows": 8})  # compiled once for several tests


# ---- how many row times a frame takes


def frame(rows: int, listed: frozenset[int], pressed: int) -> list[adaptive.Choice]:
    """The slots of a frame; ``pressed`` has a bit for each row that reads pressed."""
    choices = adaptive.row_choices(rows, listed)
    slots = [next(choices)]
    try:
        while True:
            slots.append(choices.send(any(pressed >> row & 1 for row in slots[-1][0])))
    except StopIteration:
        return slots


@pytest.mark.parametrize("rows", range(2, 9))
def test_row_times_of_every_frame(record_property, rows):
    """For every list and every pattern: the static bounds, the worst case, and that each row's cells are found."""
    halvings = math.ceil(math.log2(rows))
    for bits, pressed in itertools.product(range(1 << rows), repeat=2):
        listed = frozenset(row for row in range(rows) if bits >> row & 1)
        slots = frame(rows, listed, pressed)
        alone = [min(driven) for driven, is_alone in slots if is_alone]
        assert alone == sorted(set(alone)), "alone in ascending order, once at most"
        assert listed | {row for row in range(rows) if pressed >> row & 1} <= set(alone)
        probed = [driven for driven, is_alone in slots if not is_alone]
        quiet = frozenset().union(*(driven for driven in probed if not any(pressed >> row & 1 for row in driven)))
        assert quiet | set(alone) == set(range(rows))
        assert len(slots) <= min(rows + 2 * halvings + 2, 2 * rows - 1)
        new = pressed & ~bits
        if not new:
            assert len(slots) <= len(listed) + 1
        elif new.bit_count() == 1:
            assert len(slots) <= len(listed) + 2 + 2 * halvings
        if not listed and not pressed:
            assert slots == [(frozenset(range(rows)), False)]
    record_property("cases", 4**rows)


@pytest.mark.parametrize("rows", [16, 25, 64])
def test_row_times_of_random_frames_of_large_sheets(rng, record_property, rows):
    halvings = math.ceil(math.log2(rows))
    for _ in range(3000):
        listed = frozenset(row for row in range(rows) if rng.random() < rng.choice((0.02, 0.2, 0.9)))
        pressed = sum(1 << row for row in range(rows) if rng.random() < rng.choice((0.0, 0.05, 0.3, 0.9)))
        assert len(frame(rows, listed, pressed)) <= rows + 2 * halvings + 2
        new = rng.choice(sorted(set(range(rows)) - listed) or [0])
        static = sum(1 << row for row in listed)
        assert len(frame(rows, listed, static)) <= min(rows, len(listed) + 1)
        assert len(frame(rows, listed, static | 1 << new)) <= len(listed) + 2 + 2 * halvings
    record_property("cases", 9000)


def slots_of_frames(skin: Skin, cells: np.ndarray, frames: int) -> list[int]:
    """Row times between the last rows of the gateware's frames with these cells pressed from power-up on."""
    cycles = (frames + 1) * (int(cells.any(axis=1).sum()) + 2) * skin.derived.row_clocks
    if skin == TALL:
        with CompiledBoard(skin, ("rows",)) as board:
            board.hold(cells[None], cycles)
            lasts = [cycle for cycle, _, last in board.take("rows").tolist() if last]
    else:
        rows = bench_amaranth.run(skin, Timeline([(0, cells, None)]), cycles).rows
        lasts = [cycle for cycle, _, last in rows if last]
    assert len(lasts) >= frames
    return [round(int(gap) / skin.derived.row_clocks) for gap in np.diff(lasts[:frames])]


@pytest.mark.slow
def test_the_gateware_takes_a_row_time_more_than_active_rows():
    for active in range(9):
        cells = np.zeros((8, 3), bool)
        cells[[0, 7, 3, 4, 6, 1, 5, 2][:active], active % 3] = True
        assert set(slots_of_frames(TALL, cells, 12)[3:]) == {min(8, active + 1)}


# ---- contact, masks, stuck columns, time


@pytest.mark.slow
def test_contact_rises_within_a_settle_time_and_four_clocks_of_any_touch():
    known = facts(TALL)
    with CompiledBoard(TALL, ("contact",)) as board:
        for row, column, instant in itertools.product(range(8), range(3), range(known.row_clocks)):
            board.restart()
            cells = np.zeros((1, 8, 3), bool)
            board.hold(cells, start := 3 * known.row_clocks + instant)
            cells[0, row, column] = True
            board.hold(cells, known.settle + 8)
            (rise,) = board.take("contact").tolist()
            assert rise[0] - start == 3
            assert rise[1] == 1


def test_contact_falls_with_a_frame_without_a_press():
    known = facts(TALL)
    touched, untouched = np.zeros((2, 8, 3), bool)
    touched[2, 1] = True
    timeline = Timeline([(0, touched, None), (40 * known.row_clocks + 5, untouched, None)])
    trace = bench_amaranth.run(TALL, timeline, 60 * known.row_clocks + 5)
    (_, up, *_), (fall, down, *_) = trace.contact
    ends = [cycle for cycle, _, last in trace.rows if last]
    assert (up, down) == (1, 0)
    whole = [end for end in ends if end > 40 * known.row_clocks + 5 + 2 * known.row_clocks]
    assert fall <= whole[0], "two row times a frame: the probe, the row"


def test_a_masked_switch_that_is_closed_costs_a_row_time_and_nothing_else():
    skin = Skin(**SMALL | {"mask": ((2, 1),), "report": "cells", "baud": 6_000_000})
    cells = np.zeros((4, 3), bool)
    cells[2, 1] = True
    assert set(slots_of_frames(skin, cells, 12)[3:]) == {2}
    both = cells.copy()
    both[0, 1] = True  # the same column
    change = 40 * skin.derived.row_clocks
    trace = bench_amaranth.run(skin, Timeline([(0, cells, None), (change, both, None)]), 2 * change)
    assert not any(row for cycle, row, _ in trace.rows if cycle < change)
    whole = len(trace.rows) // 4 * 4
    assert [row for _, row, _ in trace.rows[whole - 4 : whole]] == [2, 0, 0, 0]
    assert [(cycle >= change, level) for cycle, level in trace.contact] == [(True, 1)]


def test_a_column_that_is_masked_in_every_row_never_wakes_the_scan():
    skin = Skin(**SMALL | {"mask": tuple((row, 1) for row in range(4))})
    cells = np.zeros((4, 3), bool)
    cells[:, 1] = True
    assert set(slots_of_frames(skin, cells, 6)) == {1}


@pytest.mark.slow
def test_stuck_columns_are_counted_as_soon_as_they_read_pressed():
    skin = Skin(**SMALL | {"baud": 6_000_000})
    stuck = np.array([True, False, True])
    cycles = 200 * skin.derived.row_clocks
    timeline = Timeline([(0, np.zeros((4, 3), bool), stuck)], requests([cycles // 8], facts(skin).bit_clocks))
    trace = predict(skin, timeline, cycles)
    assert compare(trace, bench_amaranth.run(skin, timeline, cycles))
    frames, hellos = decoded(bytes(value for _, value in trace.bytes), skin)
    assert {frame.flags for frame in frames} == {frozenset({"fault"})}
    assert HelloReader().take(hellos[-1]).stuck == 2


def test_a_frame_tells_the_time_of_its_first_sample():
    skin = Skin(**SMALL)
    known = facts(skin)
    cells = np.zeros((4, 3), bool)
    cells[[1, 3], 0] = True
    scanner = AdaptiveScanModel(known, Timeline([(0, cells, None)]), [])
    for _ in range(20):
        before = len(scanner.slots)
        scan, _ = scanner.frame()
        assert scan.time_us == scanner.slots[before].strobe // known.clocks_per_us


@pytest.mark.campaign
@pytest.mark.parametrize("pressed", [0, 3])
def test_unchanged_frames_come_again_within_the_keep_alive_and_hellos_twice_a_second(pressed):
    keep_alive_ms = 20.0
    skin = Skin(
        scan="adaptive", rows=8, columns=2, clock_hz=1_000_000, baud=100_000, settle_us=80.0, release_us=20.0,
        send="on_change", keep_alive_ms=keep_alive_ms,
    )  # fmt: skip
    cells = np.zeros((8, 2), bool)
    cells[:pressed] = True
    timeline, cycles = Timeline([(0, cells, None)]), 1_100_000
    trace = bench_native.run(skin, timeline, cycles)
    compare(predict(skin, timeline, cycles), trace)
    ends = [cycle for cycle, value in trace.bytes if value == 0]
    frames = [end for end in ends[6:] if end]
    assert max(np.diff(frames)) <= 1000 * keep_alive_ms
    assert max(np.diff(frames)) > 1000 * keep_alive_ms - 2 * skin.derived.max_frame_slots * 100
    data = bytes(value for _, value in trace.bytes)
    assert len(decoded(data, skin)[1]) == 3, "at power-up and twice after that"
