"""Compiled labellers of sheets whose ends meet: very many frames, against scipy on an unrolled sheet and the clocks of
docs/timing.md."""

import numpy as np
import pytest
import zone_oracles
from recorded_frames import RECORDINGS, recorded
from sample import sample
from zone_oracles import RULES, every_frame, skin_of

from contactfpga_sim.model.golden import all_departures, row_clocks
from contactfpga_sim.model.scenes import shapes
from contactfpga_sim.verify.cosim.bench_labeller import LabelBench


def mazes(rows, columns, count, seed):
    """Dots joined at random, and sheared, so that ways wind around the cylinder."""
    rng = np.random.default_rng(seed)
    frames = np.zeros((count, rows, columns), bool)
    for frame in frames:
        across, down, dots = rng.uniform(0.2, 0.6), rng.uniform(0.5, 0.95), rng.uniform(0.8, 1.0)
        chance = np.zeros((rows, columns))
        chance[::2, ::2], chance[::2, 1::2], chance[1::2, ::2] = dots, across, down
        frame[:] = rng.random((rows, columns)) < chance
        lean = rng.choice([-2, -1, 0, 1, 2])
        for y in range(rows):
            frame[y] = np.roll(frame[y], y * lean // 2)
        frame |= rng.random((rows, columns)) < rng.choice([0.0, 0.05])
    return frames


def check_compiled(frames, connectivity, labeller):
    """Every record is a zone of the unrolled sheet, also with stalls; the labeller is ready for rows, and a frame's end
    mark comes, in the clocks of its rule; the last record comes within the bound."""
    _, rows, columns = frames.shape
    skin = skin_of(rows, columns, connectivity, labeller)
    with LabelBench(skin) as bench:
        got, stalled = bench.run(frames), bench.run(frames, gap=20, stall=60)
    expected = zone_oracles.zones(frames, connectivity)
    for one in (got, stalled):
        assert np.array_equal(zone_oracles.of_records(one.frame, one.moments, columns), expected)
    busy, end = row_clocks(frames, connectivity, labeller, True)
    handed = handed_over(got, busy)
    assert np.array_equal(got.end, handed[:, -1] + end[:, -1])
    assert busy.max() <= skin.derived.label_row_clocks
    assert got.last_record_clocks.max() <= skin.derived.label_clocks - 1
    if labeller == "run" and connectivity == 8:
        assert got.last_record_clocks.max() <= columns / 2 + 5
    return got, expected


def handed_over(got, busy):
    """(N, R) int64: the clock in which each row is taken."""
    return got.first_row[0] + (np.cumsum(busy) - busy.ravel()).reshape(busy.shape)


def check_in_order(frames, connectivity, labeller):
    """The same, and every record in its place and in its clock by the golden model."""
    got, _ = check_compiled(frames, connectivity, labeller)
    rule = connectivity, labeller, True
    expected = all_departures(frames, *rule)
    assert np.array_equal(got.frame, expected.frame)
    assert np.array_equal(got.moments, expected.moments)
    handed = handed_over(got, row_clocks(frames, *rule)[0])
    assert np.array_equal(got.cycle, handed[expected.frame, expected.row] + expected.clock)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rows", "columns", "connectivity", "labeller"),
    sample(
        [(*size, *rule) for size in ((4, 4), (5, 4), (4, 5), (3, 3), (6, 3)) for rule in RULES],
        quick=[(4, 4, 8, "run")],
    ),
)
def test_every_small_frame(record_property, rows, columns, connectivity, labeller):
    total, part = 1 << rows * columns, 1 << 16
    for first in range(0, total, part):
        check_in_order(every_frame(rows, columns, first, min(part, total)), connectivity, labeller)
    record_property("cases", total)


SIZES = [(8, 8), (9, 7), (12, 12), (16, 16), (20, 33), (32, 32), (64, 64)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "connectivity", "labeller"),
    sample(
        [(size, *rule) for size in SIZES for rule in RULES],
        quick=[((9, 7), *rule) for rule in RULES if rule[0] == 8],
        slow=[((9, 7), *rule) for rule in RULES if rule[0] == 4],
    ),
)
def test_random_frames_and_mazes(record_property, size, connectivity, labeller):
    rng = np.random.default_rng(size[0])
    cells = size[0] * size[1]
    few, count = 100_000 // cells, 1_000_000 // cells
    noise = rng.random((count, *size)) < rng.uniform(0.02, 0.98, (count, 1, 1))
    for frames in (noise, mazes(*size, count, seed=size[1])):
        check_in_order(frames[:few], connectivity, labeller)
        for first in range(few, count, 2 * few):
            check_compiled(frames[first : first + 2 * few], connectivity, labeller)
    record_property("cases", 2 * count)


@pytest.mark.campaign
@pytest.mark.parametrize(("connectivity", "labeller"), RULES)
@pytest.mark.parametrize("size", SIZES)
def test_shapes_that_go_around(record_property, size, connectivity, labeller):
    frames, seen = shapes.around(*size), []
    part = 200_000 // (size[0] * size[1])
    for first in range(0, len(frames), part):
        seen.append(check_compiled(frames[first : first + part], connectivity, labeller)[1][:, 2])
    places = np.concatenate(seen)
    assert min((places == zone_oracles.RING).sum(), (places == zone_oracles.WOUND).sum()) > 5
    record_property("cases", len(frames))


@pytest.mark.campaign
@pytest.mark.parametrize(("connectivity", "labeller"), RULES)
@pytest.mark.parametrize("name", RECORDINGS)
def test_recordings_wrapped_around(record_property, name, connectivity, labeller):
    frames = recorded(name)
    for first in range(0, len(frames), 2000):
        check_in_order(frames[first : first + 2000], connectivity, labeller)
    record_property("cases", len(frames))
