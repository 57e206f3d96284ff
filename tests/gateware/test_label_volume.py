"""The compiled labellers on very many frames: every record with its exact cycle, against the golden model."""

import numpy as np
import pytest
from recorded_frames import RECORDINGS, recorded
from sample import sample
from zone_oracles import RULES, every_frame, mazes, noise

from contactfpga_sim.model.golden import all_departures, row_clocks
from contactfpga_sim.model.scenes import shapes

FLAT = [rule for rule in RULES if not rule[2]]  # each rule costs a compiler's run for every size of sheet
RUN_8, RUN_4, RUN_8_CLOSED = (8, "run", False), (4, "run", False), (8, "run", True)
SQUARES = (8, 16, 33, 64)
RANDOM = {  # (rows, columns): frames for each rule; `serial` takes a tenth
    (1, 3): 200,
    (1, 16): 5_000,
    (16, 3): 5_000,
    (3, 64): 2_000,
    (9, 7): 20_000,
    (8, 8): 40_000,
    (16, 16): 15_000,
    (33, 33): 1_000,
    (64, 64): 300,
}


def check(bench, frames, gap=0, stall=0):
    """Frames back to back: every record, its place in the order and its clock; the bounds on the last one. With gaps
    between rows or stalls of records the same records."""
    rule = bench.skin.connectivity, bench.skin.labeller, bench.skin.closed
    got, expected = bench.run(frames, gap=gap, stall=stall), all_departures(frames, *rule)
    assert np.array_equal(got.frame, expected.frame)
    assert np.array_equal(got.moments, expected.moments)
    if gap or stall:
        return
    busy, end = row_clocks(frames, *rule)
    handed = got.first_row[0] + (np.cumsum(busy) - busy.ravel()).reshape(busy.shape)
    assert np.array_equal(got.first_row, handed[:, 0])
    assert np.array_equal(got.last_row, handed[:, -1])
    assert np.array_equal(got.cycle, handed[expected.frame, expected.row] + expected.clock)
    assert np.array_equal(got.end, handed[:, -1] + end[:, -1])
    assert busy.max() <= bench.skin.derived.label_row_clocks
    check_bounds(bench.skin, frames, got.last_record_clocks)


def check_bounds(skin, frames, clocks):
    """Check the bounds of docs/timing.md for the clocks from the last row to the last record."""
    columns = frames.shape[2]
    assert clocks.max() <= skin.derived.label_clocks - 1
    if skin.closed:
        return
    if skin.labeller == "serial":
        assert clocks.max() <= columns + (-(-columns // 2) if skin.connectivity == 8 else columns) + 1
        return
    assert clocks.max() <= (max(columns + 2, 6) if skin.connectivity == 8 else max(2 * columns + 2, 8))
    ends = frames[:, -2:]
    runs = (ends & ~np.pad(ends, ((0, 0), (0, 0), (1, 0)))[:, :, :-1]).sum(axis=(1, 2))
    assert clocks[runs <= 4].max(initial=0) <= 8


@pytest.mark.parametrize(
    ("size", "rule"),
    sample(
        [(size, rule) for size in ((4, 4), (4, 5), (5, 4), (6, 3)) for rule in RULES],
        quick=[((4, 4), rule) for rule in FLAT],
        slow=[((4, 4), RUN_8_CLOSED)],
    ),
    ids=str,
)
def test_every_small_frame(benches, record_property, size, rule):
    total, part = 1 << size[0] * size[1], 1 << 16
    for first in range(0, total, part):
        check(benches(*size, *rule), every_frame(*size, first, part))
    record_property("cases", total)


@pytest.mark.parametrize(
    ("size", "rule"),
    sample(
        [(size, rule) for size in SQUARES for rule in RULES],
        quick=[(8, RUN_8)],
        slow=[(16, rule) for rule in FLAT[1:]],
    ),
    ids=str,
)
def test_shapes_that_break_labellers(benches, record_property, size, rule):
    frames = shapes.around(size, size) if rule[2] else np.array([cells for _, cells in shapes.variants(size, size)])
    part = 200_000 // size**2
    for first in range(0, len(frames), part):
        check(benches(size, size, *rule), frames[first : first + part])
    check(benches(size, size, *rule), frames[:part], gap=20, stall=60)
    record_property("cases", len(frames))


@pytest.mark.parametrize(
    ("size", "rule"),
    sample(
        [(size, rule) for size in RANDOM for rule in RULES],
        quick=[((8, 8), RUN_8)],
        slow=[((8, 8), RUN_4), *(((16, 16), rule) for rule in (RUN_8, RUN_4)), ((9, 7), RUN_8_CLOSED)],
    ),
    ids=str,
)
def test_noise_and_mazes(benches, record_property, size, rule):
    count = RANDOM[size] // (1 if rule[1] == "run" else 10)
    rng = np.random.default_rng(size)
    for make in (noise, mazes):
        check(benches(*size, *rule), make(rng, *size, count // 2))
    record_property("cases", count)


@pytest.mark.slow
@pytest.mark.parametrize("rule", RULES, ids=str)
@pytest.mark.parametrize(("gap", "stall"), sample([(0, 50), (50, 0), (30, 30), (10, 90)], quick=[(30, 30)]))
def test_stalls_change_no_zone(benches, record_property, gap, stall, rule):
    small = every_frame(4, 4)
    check(benches(4, 4, *rule), small, gap, stall)
    large = noise(np.random.default_rng(gap), 16, 16, 1000)
    check(benches(16, 16, *rule), large, gap, stall)
    record_property("cases", len(small) + len(large))


@pytest.mark.slow  # where the recordings are missing it is skipped, so nothing rests on it by default
@pytest.mark.parametrize(
    ("name", "rule"),
    sample(
        [(name, rule) for name in RECORDINGS for rule in RULES],
        quick=[("dtmf16x16", rule) for rule in FLAT],
    ),
    ids=str,
)
def test_recordings(benches, record_property, name, rule):
    frames = recorded(name)
    for first in range(0, len(frames), 2000):
        check(benches(*frames.shape[1:], *rule), frames[first : first + 2000])
    record_property("cases", len(frames))
