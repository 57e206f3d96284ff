"""The labellers in Amaranth's simulator: each row, record and end mark in its clock by the golden model, which
`test_golden_zones.py` holds against flood fills and rules worked cell by cell."""

import functools
import itertools

import numpy as np
import pytest
from bench import split
from label_rules import pieces
from recorded_frames import recorded
from sample import sample
from zone_oracles import RULES, every_frame, mazes, noise, skin_of

from contactfpga.choices.labellers import LABELLERS
from contactfpga_hdl.label.steps import place_of
from contactfpga_sim.model.golden.label import labelling
from contactfpga_sim.model.scenes import shapes

RULE = pytest.mark.parametrize(("connectivity", "labeller", "closed"), RULES)


@functools.cache
def bench_of(bench, skin):
    dut = LABELLERS[skin.labeller].load_gateware()(skin)
    return dut, bench(dut)


def label(bench, frames, rule, rng=None, gap=0.0, stall=0.0):
    """(N, R, C) frames back to back: cycles of the rows, and (cycle, record, or None for an end mark)."""
    _, rows, columns = frames.shape
    skin = skin_of(rows, columns, *rule)
    dut, sim = bench_of(bench, skin)
    words = [
        int((row << np.arange(columns)).sum()) | (y == rows - 1) << columns
        for one in frames
        for y, row in enumerate(one)
    ]
    source, sink = sim.source(dut.rows, words, rng, gap=gap), sim.sink(dut.records, rng, stall=stall)
    widths = skin.derived.record_bits
    end = sum(widths)
    sim.run(
        80 * len(words) * (columns + 2), until=lambda: sum(word >> end for _, word in sink.transfers) == len(frames)
    )
    return source.transfers, [(cycle, None if word >> end else split(word, widths)) for cycle, word in sink.transfers]


def check(bench, frames, *rule):
    """Check that every row, record and end mark is in the cycle of the golden rule."""
    start, rows, wanted = 0, [], []
    for cells in frames:
        work = labelling(cells, *rule)
        rows += [start + sum(work.busy[:y]) for y in range(len(cells))]
        for zone in work.departures:
            record = (zone.area, zone.sum_x, zone.sum_y, zone.turned)[: 3 + rule[2]]
            wanted.append((rows[zone.row - len(cells)] + zone.clock, record))
        wanted.append((rows[-1] + work.end, None))
        start += sum(work.busy)
    assert label(bench, frames, rule) == (rows, wanted)


@RULE
def test_shapes_that_break_labellers_come_out_in_their_cycles(bench, connectivity, labeller, closed):
    frames = shapes.around(5, 8)[::7] if closed else np.array([cells for _, cells in shapes.variants(7, 9)])
    check(bench, frames, connectivity, labeller, closed)


@RULE
def test_frames_of_three_rows_and_columns_come_out_in_their_cycles(bench, connectivity, labeller, closed):
    """Every fifth frame of 3x3 cells, record by record with its cycle; the compiled labellers take all of 4x4."""
    check(bench, every_frame(3, 3)[connectivity // 4 :: 5], connectivity, labeller, closed)


SIZES = [(6, 9), (1, 12), (12, 3), (5, 2), (12, 1), (4, 16), (9, 5), (12, 17), (20, 32)]


@pytest.mark.parametrize(
    ("size", "connectivity", "labeller", "closed"),
    sample(
        [(size, *rule) for size in SIZES for rule in RULES if size[1] > 2 or not rule[2]],
        quick=[(size, *rule) for size in SIZES[:3] for rule in RULES],
    ),
)
def test_noise_and_mazes_come_out_in_their_cycles(bench, size, connectivity, labeller, closed):
    rng = np.random.default_rng(size)
    frames = np.concatenate([make(rng, *size, max(2, 1000 // (size[0] * size[1]))) for make in (noise, mazes)])
    check(bench, frames, connectivity, labeller, closed)


@RULE
def test_a_recording_comes_out_in_its_cycles(bench, connectivity, labeller, closed):
    check(bench, recorded("sdh13x6")[::40][:12], connectivity, labeller, closed)


@pytest.mark.parametrize(("connectivity", "labeller"), [rule[:2] for rule in RULES if not rule[2]])
def test_open_zones_never_share_a_place_in_the_table(connectivity, labeller):
    """For all pairs of rows of 8 columns, which hold those of fewer.

    Only zones with runs in the row before or in the new row are open. Those of one cluster become one zone, and
    their places are read before its place is written; so what counts are runs of one row, and of two clusters.
    """
    derived = skin_of(2, 8, connectivity, labeller).derived
    places = [place_of(derived, x) for x in range(8)]
    assert max(places) < derived.open_zones
    starts_of = [[x for x in range(8) if (word & ~(word << 1)) >> x & 1] for word in range(256)]
    for upper, lower in itertools.product(range(256), repeat=2):
        used = []
        for cluster in pieces((upper, lower), connectivity):
            above = [places[x] for x in starts_of[upper] if (0, x) in cluster]
            below = [places[x] for x in starts_of[lower] if (1, x) in cluster]
            assert len(set(above)) == len(above)
            assert len(set(below)) == len(below)
            used += {*above, *below}
        assert len(set(used)) == len(used), f"{upper:08b} over {lower:08b}"
