"""The compiled labeller on very many frames: every record with its exact cycle, against the golden model."""

import itertools

import numpy as np
import pytest
from recorded_frames import RECORDINGS, recorded
from sample import sample
from zone_oracles import every_frame

from contactfpga.choices.labellers import LABELLERS
from contactfpga.skin import Skin
from contactfpga_sim.model.golden import all_departures, row_clocks
from contactfpga_sim.model.scenes import shapes
from contactfpga_sim.verify.cosim.bench_labeller import LabelBench, LabellerRecords

EXACT = tuple(name for name, labeller in LABELLERS.items() if labeller.exact)
BOTH = pytest.mark.parametrize("labeller", EXACT)
RULES = (*itertools.product((8, 4), EXACT),)  # each costs a compiler's run for every size of sheet

SQUARES = (8, 16, 33, 64)
RANDOM = {  # (rows, columns): frames for each connectivity; `serial` takes a tenth
    (1, 1): 200,
    (1, 16): 5_000,
    (16, 1): 5_000,
    (3, 64): 2_000,
    (9, 12): 40_000,
    (8, 8): 40_000,
    (16, 16): 15_000,
    (33, 33): 1_000,
    (64, 64): 300,
}
QUICK_RANDOM = [((8, 8), 8, "run")]
SLOW_RANDOM = [((8, 8), 4, "run"), *(((16, 16), *rule) for rule in RULES if "run" in rule)]


def random_frames(rows: int, columns: int, count: int, seed: int) -> np.ndarray:
    """Noise of every density, and patches of every size with some noise in them."""
    rng = np.random.default_rng(seed)
    density = rng.uniform(0.02, 0.98, (count, 1, 1))
    frames = rng.random((count, rows, columns)) < density
    for index in range(0, count, 2):
        grain = int(rng.integers(2, 7))
        coarse = rng.random((-(-rows // grain), -(-columns // grain))) < density[index, 0, 0]
        patches = coarse.repeat(grain, 0).repeat(grain, 1)[:rows, :columns]
        frames[index] = patches ^ (rng.random((rows, columns)) < 0.05)
    return frames


def check_exact(bench: LabelBench, frames: np.ndarray) -> LabellerRecords:
    """Frames back to back: every record, its place in the order and its clock; the issue's bounds on the last one."""
    rule = bench.skin.connectivity, bench.skin.labeller
    got = bench.run(frames)
    expected = all_departures(frames, *rule)
    assert np.array_equal(got.frame, expected.frame)
    assert np.array_equal(got.moments, expected.moments)
    busy, end = row_clocks(frames, *rule)
    handed = got.first_row[0] + (np.cumsum(busy) - busy.ravel()).reshape(busy.shape)
    assert np.array_equal(got.first_row, handed[:, 0])
    assert np.array_equal(got.last_row, handed[:, -1])
    assert np.array_equal(got.cycle, handed[expected.frame, expected.row] + expected.clock)
    assert np.array_equal(got.end, handed[:, -1] + end[:, -1])
    check_bounds(bench.skin, frames, got.last_record_clocks)
    return got


def check_bounds(skin: Skin, frames: np.ndarray, clocks: np.ndarray) -> None:
    columns = frames.shape[2]
    if skin.labeller == "serial":
        assert clocks.max() <= columns + (-(-columns // 2) if skin.connectivity == 8 else columns) + 1
        return
    worst = max(columns + 2, 6) if skin.connectivity == 8 else max(2 * columns + 2, 8)
    assert clocks.max() <= worst
    ends = frames[:, -2:]
    runs = (ends & ~np.pad(ends, ((0, 0), (0, 0), (1, 0)))[:, :, :-1]).sum(axis=(1, 2))
    assert clocks[runs <= 4].max(initial=0) <= 8


def check_stalled(bench: LabelBench, frames: np.ndarray, gap: int, stall: int) -> None:
    """Frames with random gaps on the row port and stalls on the record port: the same zones."""
    expected = all_departures(frames, bench.skin.connectivity, bench.skin.labeller)
    got = bench.run(frames, gap=gap, stall=stall, seed=gap + 100 * stall + 1)
    assert np.array_equal(got.frame, expected.frame)
    assert np.array_equal(got.sorted_moments(), expected.sorted_moments())
    assert (np.diff(got.cycle) > 0).all()


@pytest.mark.parametrize(
    ("columns", "connectivity", "labeller"),
    sample([(columns, *rule) for columns in (4, 5) for rule in RULES], quick=[(4, *rule) for rule in RULES]),
)
def test_every_small_frame(benches, record_property, columns, connectivity, labeller):
    bench = benches(4, columns, connectivity, labeller)
    total, part = 1 << 4 * columns, 1 << 16
    worst = 0
    for first in range(0, total, part):
        got = check_exact(bench, every_frame(4, columns, first, part))
        worst = max(worst, int(got.last_record_clocks.max()))
    record_property("cases", total)
    record_property("worst_last_record_clocks", worst)


@pytest.mark.parametrize(
    ("size", "connectivity", "labeller"),
    sample(
        [(size, *rule) for size in SQUARES for rule in RULES],
        quick=[(8, 8, "run")],
        slow=[(16, *rule) for rule in RULES[1:]],
    ),
)
def test_shapes_that_break_labellers(benches, record_property, size, connectivity, labeller):
    frames = np.array([cells for _, cells in shapes.variants(size, size)])
    check_exact(benches(size, size, connectivity, labeller), frames)
    check_stalled(benches(size, size, connectivity, labeller), frames, gap=20, stall=60)
    record_property("cases", len(frames))


@pytest.mark.parametrize(
    ("size", "connectivity", "labeller"),
    sample([(size, *rule) for size in RANDOM for rule in RULES], quick=QUICK_RANDOM, slow=SLOW_RANDOM),
    ids=str,
)
def test_random_frames(benches, record_property, size, connectivity, labeller):
    count = RANDOM[size] if labeller == "run" else RANDOM[size] // 10
    frames = random_frames(*size, count, seed=size[0] * 100 + size[1])
    check_exact(benches(*size, connectivity, labeller), frames)
    record_property("cases", len(frames))


def test_random_frames_are_enough():
    assert sum(RANDOM.values()) >= 100_000, "for each connectivity, in the campaign"
    run = QUICK_RANDOM + SLOW_RANDOM
    assert sum(RANDOM[size] // (1 if labeller == "run" else 10) for size, _, labeller in run) >= 100_000


@pytest.mark.slow
@BOTH
@pytest.mark.parametrize("connectivity", [8, 4])
@pytest.mark.parametrize(("gap", "stall"), sample([(0, 50), (50, 0), (30, 30), (10, 90)], quick=[(30, 30)]))
def test_stalls_change_no_zone(benches, record_property, gap, stall, connectivity, labeller):
    small = every_frame(4, 4)
    check_stalled(benches(4, 4, connectivity, labeller), small, gap, stall)
    large = random_frames(16, 16, 1000, seed=gap)
    check_stalled(benches(16, 16, connectivity, labeller), large, gap, stall)
    record_property("cases", len(small) + len(large))


@pytest.mark.slow  # where the recordings are missing it is skipped, so nothing rests on it by default
@pytest.mark.parametrize(
    ("name", "connectivity", "labeller"),
    sample(
        [(name, *rule) for name in RECORDINGS for rule in RULES],
        quick=[("dtmf16x16", *rule) for rule in RULES],
    ),
)
def test_recordings(benches, record_property, name, connectivity, labeller):
    frames = recorded(name)
    check_exact(benches(*frames.shape[1:], connectivity, labeller), frames)
    record_property("cases", len(frames))


@BOTH
def test_a_wrong_sum_would_be_seen(benches, monkeypatch, labeller):
    """The comparison itself: one bit of one record, and one clock, each make it fail."""
    bench = benches(4, 4, 8, labeller)
    frames = every_frame(4, 4, first=1000, count=100)
    right = bench.run(frames)
    for field, place in (("moments", (40, 1)), ("cycle", 40)):
        wrong = bench.run(frames)
        getattr(wrong, field)[place] ^= 1
        monkeypatch.setattr(bench, "run", lambda _, wrong=wrong: wrong)
        with pytest.raises(AssertionError):
            check_exact(bench, frames)
        monkeypatch.undo()
    assert np.array_equal(bench.run(frames).moments, right.moments)
