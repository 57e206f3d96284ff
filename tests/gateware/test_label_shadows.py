"""The labellers that are not exact: what they take for a zone, each record with its clock, and that nothing is lost."""

import numpy as np
import pytest
from sample import sample
from zone_oracles import zones_by_image_tools

from contactfpga_sim.model.golden.label import labelling
from contactfpga_sim.model.scenes import shapes

LABELLERS = ("projection", "single")
SIZES = ((4, 4), (1, 1), (1, 7), (7, 1), (9, 12), (16, 16), (3, 64))
QUICK_SIZES = ((4, 4), (9, 12))
BENCHES = [(labeller, size) for labeller in LABELLERS for size in SIZES]
QUICK_BENCHES = [(labeller, QUICK_SIZES[1]) for labeller in LABELLERS]  # each has to be compiled


def frames_of(rows, columns, count=400):
    """Frames of a sheet: every third one of 4x4, otherwise shapes that break labellers, and noise of every density."""
    if (rows, columns) == (4, 4):
        return (np.arange(0, 1 << 16, 3)[:, None] >> np.arange(16) & 1).astype(bool).reshape(-1, 4, 4)
    rng = np.random.default_rng(rows * 100 + columns)
    noise = rng.random((count, rows, columns)) < rng.uniform(0.01, 0.9, (count, 1, 1))
    known = [cells for _, cells in shapes.variants(rows, columns)] if min(rows, columns) > 1 else []
    return np.array([*noise, *known, np.zeros((rows, columns), bool)])


@pytest.mark.parametrize("labeller", LABELLERS)
@pytest.mark.parametrize("size", SIZES, ids=str)
def test_the_model_takes_for_zones_what_the_shadows_say(labeller, size):
    for cells in frames_of(*size)[:1500]:
        found = [(zone.area, zone.sum_x, zone.sum_y) for zone in labelling(cells, 8, labeller).departures]
        assert sorted(found) == sorted(zones_by_image_tools(cells, labeller))


@pytest.mark.parametrize(("labeller", "size"), sample(BENCHES, QUICK_BENCHES), ids=str)
def test_every_record_comes_in_its_clock(benches, record_property, labeller, size):
    frames = frames_of(*size)
    got = benches(*size, 8, labeller).run(frames)
    handed, wanted, ends = int(got.first_row[0]), [], []
    for index, cells in enumerate(frames):
        work = labelling(cells, 8, labeller)
        rows = handed + np.cumsum([0, *work.busy])
        wanted += [
            (index, int(rows[zone.row]) + zone.clock, zone.area, zone.sum_x, zone.sum_y) for zone in work.departures
        ]
        ends.append(int(rows[-2]) + work.end)
        handed = int(rows[-1])
    records = np.column_stack([got.frame, got.cycle, got.moments])
    assert records.tolist() == [list(record) for record in wanted]
    assert got.end.tolist() == ends
    record_property("cases", len(frames))


@pytest.mark.parametrize(("labeller", "size"), sample(BENCHES, QUICK_BENCHES), ids=str)
@pytest.mark.parametrize(("gap", "stall"), [(0, 50), (50, 0), (30, 30), (10, 90)])
def test_stalls_change_no_zone(benches, labeller, size, gap, stall):
    frames = frames_of(*size)[-2000:]
    bench = benches(*size, 8, labeller)
    free, stalled = bench.run(frames), bench.run(frames, gap=gap, stall=stall, seed=gap + stall)
    assert np.array_equal(stalled.frame, free.frame)
    assert np.array_equal(stalled.moments, free.moments)
