"""The adaptive scan: which rows are driven (docs/timing.md, Adaptive scan), how many row times that takes, and that
nothing is later than in a raster scan."""

import functools
import itertools
import math

import numpy as np
import pytest
from decoded import decoded
from sample import each_choice, sample

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga.wire.hello import HelloReader
from contactfpga_sim.board.compiled import CompiledBoard
from contactfpga_sim.cosim import bench_amaranth, bench_native, record
from contactfpga_sim.cosim.compare import compare
from contactfpga_sim.cosim.covering import ADAPTIVE, pairwise, skin_for, stimulus
from contactfpga_sim.golden import BOUNDARIES, Timeline, driven, predict, requests, seek
from contactfpga_sim.golden.adaptive import Scanner
from contactfpga_sim.golden.facts import facts

COVERING = pairwise(ADAPTIVE)
SMALL = {"scan": "adaptive", "rows": 4, "columns": 3, "settle_us": 3.0, "release_us": 1.0}
TALL = Skin(**SMALL | {"rows": 8})  # compiled once for several tests


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
    forgets = record.Stimulus.pins
    outputs = []

    def pins(self, cycle, levels):
        registers = self._sheet.row_registers
        if cycle == lost:
            registers.shifted, registers.latched = [0], [(1 << skin.rows) - 1]  # no row is low
        outputs.append(registers.latched[0])
        return forgets(self, cycle, levels)

    monkeypatch.setattr(record.Stimulus, "pins", pins)
    timeline, cycles = Timeline([(touched, cells, None)]), touched + 30 * known.row_clocks
    assert compare(predict(skin, timeline, cycles), bench_amaranth.run(skin, timeline, cycles)) > 100
    assert outputs[lost] == (1 << skin.rows) - 1
    assert outputs[lost + 2 * known.row_clocks] == 0


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
    needed = Derived(Skin(scan="adaptive", settle_us=200.0, **fields)).min_row_clocks
    skin = Skin(scan="adaptive", settle_us=(needed - 12) / 12, **fields)
    assert Derived(skin).row_clocks == needed
    with CompiledBoard(skin, (*BOUNDARIES, "driven")) as board:
        assert sum(play(board, crowds(skin, 40_000, seed), 40_000) for seed in range(6)) > 30_000


# ---- how many row times a frame takes


def frame(rows: int, listed: frozenset[int], pressed: int) -> list[seek.Choice]:
    """The slots of a frame; ``pressed`` has a bit for each row that reads pressed."""
    choices = seek.frame(rows, listed)
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
    cycles = (frames + 1) * (int(cells.any(axis=1).sum()) + 2) * Derived(skin).row_clocks
    if skin == TALL:
        with CompiledBoard(skin, ("rows",)) as board:
            board.hold(cells[None], cycles)
            lasts = [cycle for cycle, _, last in board.take("rows").tolist() if last]
    else:
        rows = bench_amaranth.run(skin, Timeline([(0, cells, None)]), cycles).rows
        lasts = [cycle for cycle, _, last in rows if last]
    assert len(lasts) >= frames
    return [round(int(gap) / Derived(skin).row_clocks) for gap in np.diff(lasts[:frames])]


def test_the_gateware_takes_a_row_time_more_than_active_rows():
    for active in range(9):
        cells = np.zeros((8, 3), bool)
        cells[[0, 7, 3, 4, 6, 1, 5, 2][:active], active % 3] = True
        assert set(slots_of_frames(TALL, cells, 12)[3:]) == {min(8, active + 1)}


# ---- contact, masks, stuck columns, time


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
    cells = np.zeros((1, 8, 3), bool)
    with CompiledBoard(TALL, ("contact", "rows")) as board:
        cells[0, 2, 1] = True
        board.hold(cells, 40 * known.row_clocks + 5)
        cells[0, 2, 1] = False
        board.hold(cells, 20 * known.row_clocks)
        (_, up, _), (fall, down, _) = board.take("contact").tolist()
        ends = [cycle for cycle, _, last in board.take("rows").tolist() if last]
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
    change = 40 * Derived(skin).row_clocks
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


def test_stuck_columns_are_counted_as_soon_as_they_read_pressed():
    skin = Skin(**SMALL | {"baud": 6_000_000})
    stuck = np.array([True, False, True])
    cycles = 200 * Derived(skin).row_clocks
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
    scanner = Scanner(known, Timeline([(0, cells, None)]), [])
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
    assert max(np.diff(frames)) > 1000 * keep_alive_ms - 2 * Derived(skin).max_frame_slots * 100
    data = bytes(value for _, value in trace.bytes)
    assert len(decoded(data, skin)[1]) == 3, "at power-up and twice after that"


# ---- no later than a raster scan


@functools.cache
def every_transition(patterns: int) -> np.ndarray:
    """A walk through all ordered pairs of different patterns."""
    walk = [0]
    for pattern in range(patterns):
        for other in range(pattern + 1, patterns):
            walk += [other, pattern]
        walk.append(min(pattern + 1, patterns - 1))
    return np.array(walk)


def lateness(skin: Skin, walk: np.ndarray, hold: int) -> np.ndarray:
    """Clocks from each change of the walk to the end of the first frame that has it, as have all that follow."""
    frames = (walk[:, None] >> np.arange(skin.rows) & 1).astype(bool)[:, :, None]
    with CompiledBoard(skin, ("rows",)) as board:
        board.hold(frames, hold)
        events = board.take("rows")
    count = len(events) // skin.rows
    words = events["data"][: count * skin.rows].reshape(count, skin.rows).astype(int)
    seen = (words << np.arange(skin.rows)).sum(axis=1)
    ends = events["cycle"][: count * skin.rows].reshape(count, skin.rows)[:, -1].astype(int)
    number = ends // hold
    wrong = np.flatnonzero(seen != walk[number])
    wrong = wrong[wrong + 1 < count]
    late = np.zeros(len(walk), int)
    np.maximum.at(late, number[wrong], ends[wrong + 1] - number[wrong] * hold)
    return late


DEBOUNCES = {
    "none": ({}, 0),
    "sym_defer_pk": ({"debounce": "sym_defer_pk"}, 2),
    "asym_eager_defer_pk": ({"debounce": "asym_eager_defer_pk"}, 2),
}


def skins_of(rows: int, debounce: dict, scans: int) -> tuple[Skin, Skin]:
    """The same sheet, raster and adaptive."""
    fields = {"rows": rows, "columns": 1, "settle_us": 2.0, "release_us": 1.0, **debounce}
    scan_us = 3.0 * rows
    fields |= {"debounce_press_us": scans * scan_us, "debounce_release_us": scans * scan_us}
    return Skin(**fields), Skin(scan="adaptive", **fields)


def worst_of_raster(skin: Skin, scans: int) -> int:
    """The first row closed just after its sample; then the debounce time, and the rest of the scan."""
    known = facts(skin)
    return (2 * skin.rows - 1 + scans * skin.rows) * known.row_clocks + 2 + known.debounced * (skin.columns + 3)


def check_transitions(rows: int, name: str, offset: int) -> int:
    debounce, scans = DEBOUNCES[name]
    raster, adaptive = skins_of(rows, debounce, scans)
    assert facts(raster).row_clocks == facts(adaptive).row_clocks
    hold = (4 * rows + (scans + bool(scans)) * rows + 4) * facts(raster).row_clocks + offset
    walk = every_transition(1 << rows)
    late = lateness(adaptive, walk, hold)
    worst = worst_of_raster(raster, scans)
    assert worst - 8 * facts(raster).row_clocks < late.max() <= worst
    return len(walk) - 1


@pytest.mark.parametrize("name", sample(DEBOUNCES, quick=["sym_defer_pk"]))
def test_every_transition_of_4_rows_is_no_later_than_a_rasters_worst(record_property, name):
    """And the frames are the sheet's from then on. The offset moves each transition against the slots."""
    row_clocks = facts(skins_of(4, {}, 0)[0]).row_clocks
    cases = sum(check_transitions(4, name, offset) for offset in range(1, 8 * row_clocks, 13))
    record_property("cases", cases)


@pytest.mark.campaign
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("offset", [7, 11])
@pytest.mark.parametrize("name", DEBOUNCES)
def test_every_transition_of_8_rows_is_no_later_than_a_rasters_worst(record_property, name, offset):
    record_property("cases", check_transitions(8, name, offset))


@pytest.mark.campaign
@pytest.mark.parametrize("name", ["none", "sym_defer_pk"])
def test_a_rasters_worst_is_what_a_raster_takes(name):
    debounce, scans = DEBOUNCES[name]
    raster, _ = skins_of(4, debounce, scans)
    known = facts(raster)
    walk = np.array([0, 1] * 20)  # from one pattern to the other, each time a clock later in the scan
    hold = (4 + scans) * known.scan_clocks + 1
    late = lateness(raster, walk, hold)
    assert worst_of_raster(raster, scans) - 20 <= late.max() <= worst_of_raster(raster, scans)
