"""Extents of zones from the compiled labellers, by scipy on as many turns of the sheet as a zone needs.

A turn that is added to the wrong part of a zone, or a complement of the wrong width, changes no sum and no clock, so no
other test of the labellers sees it.
"""

import numpy as np
import pytest
from sample import sample
from zone_oracles import RULES, every_frame, labeled, mazes, noise

from contactfpga_sim.model.golden import all_departures, row_clocks
from contactfpga_sim.model.scenes import shapes

RULE = pytest.mark.parametrize("rule", RULES, ids=str)
SMALL = [(size, rule) for size in ((4, 4), (3, 5), (5, 3)) for rule in RULES]


def extents_of(frames, connectivity, closed):
    """Sorted [frame, area, sum x, sum y, left, right, top, bottom] of the zones in (N, R, C) frames. Around a cylinder
    they are found on turns of the sheet side by side, more than any zone winds through in R rows."""
    _, rows, columns = frames.shape
    turns = 2 * rows + 5 if closed else 1
    labels, count = labeled(np.tile(frames, turns), connectivity)
    frame, y, x = np.nonzero(labels)
    label, cell, middle = labels[frame, y, x], y * columns + x % columns, x // columns == turns // 2
    # Each zone is there many times. It is looked at where its first cell, by rows, lies on the middle turn.
    first = np.full(count + 1, rows * columns)
    np.minimum.at(first, label, cell)
    starts = middle & (cell == first[label])
    ring = np.zeros(count + 1, bool)
    after = labels[frame[starts], y[starts], (x[starts] + columns) % (turns * columns)]
    ring[label[starts]] = closed & (after == label[starts])
    counts = np.isin(label, label[starts]) & (middle | ~ring[label])  # a ring's cells repeat on each turn
    frame, y, x, label = frame[counts], y[counts], x[counts], label[counts]
    chosen, label = np.unique(label, return_inverse=True)
    area, of_frame, sum_x, sum_y = (np.bincount(label, each) for each in (None, frame, x % columns, y))
    box = [np.full(len(chosen), start) for start in (labels.size, -1, labels.size, -1)]
    for found, extreme, place in zip(box, (np.minimum, np.maximum) * 2, (x, x, y, y)):
        extreme.at(found, label, place)
    left, right, top, bottom = box
    whole = ring[chosen] | (right - left >= columns)
    left, right = np.where(whole, 0, left % columns), np.where(whole, columns - 1, right % columns)
    fields = (of_frame / np.maximum(area, 1), area, sum_x, sum_y, left, right, top, bottom)
    return sorted(np.stack(fields, axis=1).astype(int).tolist())


def check(bench, frames, gap=0, stall=0):
    """Check that zones have the oracle's extents, and the model's, and come in the clocks of a Skin without."""
    skin = bench.skin
    rule = skin.connectivity, skin.labeller, skin.closed
    got, expected = bench.run(frames, gap=gap, stall=stall), all_departures(frames, *rule)
    assert np.array_equal(got.frame, expected.frame)
    assert np.array_equal(got.moments, np.concatenate([expected.moments, expected.extents], axis=1))
    records = np.column_stack([got.frame, got.moments[:, :3], got.moments[:, -4:]])
    assert sorted(records.tolist()) == extents_of(frames, skin.connectivity, skin.closed)
    if not gap and not stall:
        busy, _ = row_clocks(frames, *rule)
        handed = got.first_row[0] + (np.cumsum(busy) - busy.ravel()).reshape(busy.shape)
        assert np.array_equal(got.cycle, handed[expected.frame, expected.row] + expected.clock)


@pytest.mark.parametrize(
    ("size", "rule"), sample(SMALL, quick=[((4, 4), RULES[0])], slow=SMALL[len(RULES) : 2 * len(RULES)]), ids=str
)
def test_every_small_frame(benches, size, rule):
    check(benches(*size, *rule, True), every_frame(*size))


@RULE
def test_shapes_noise_and_stalls(benches, rule):
    bench = benches(8, 8, *rule, True)
    rng = np.random.default_rng(5)
    frames = shapes.around(8, 8) if rule[2] else np.array([cells for _, cells in shapes.variants(8, 8)])
    frames = np.concatenate([frames[::5], noise(rng, 8, 8, 500), mazes(rng, 8, 8, 500)])
    check(bench, frames)
    check(bench, frames, gap=20, stall=60)
