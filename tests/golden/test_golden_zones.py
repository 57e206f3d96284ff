"""The golden model's zones and labeller timing: third opinions, known shapes, and the rule worked cell by cell."""

import cv2
import numpy as np
import pytest
import zone_oracles
from label_rules import row_rule
from zone_oracles import every_frame, zones_by_scipy, zones_of_frames

from contactfpga.choices.labellers import LABELLERS
from contactfpga_sim.model import golden
from contactfpga_sim.model.golden.label import labelling
from contactfpga_sim.model.golden.zones import closed_flood
from contactfpga_sim.model.scenes import shapes

CONNECTIVITIES = (4, 8)
SHAPES = [(1, 1), (1, 17), (17, 1), (3, 64), (64, 3), (5, 7), (16, 16), (33, 20), (64, 64)]


def random_frames(rng: np.random.Generator, shape: tuple[int, int], count: int) -> np.ndarray:
    density = rng.random((count, 1, 1))
    return rng.random((count, *shape)) < density


def cv2_zones(cells: np.ndarray, connectivity: int) -> list[tuple[int, int, int]]:
    _, _, stats, centers = cv2.connectedComponentsWithStats(cells.astype(np.uint8), connectivity=connectivity)
    found = [
        (int(area), *np.rint(center * area).astype(int).tolist())
        for area, center in zip(stats[1:, cv2.CC_STAT_AREA], centers[1:], strict=True)
    ]
    return sorted(found)


def vector_zones(frames: np.ndarray, connectivity: int) -> list[tuple[int, int, int, int]]:
    found = golden.all_departures(frames, connectivity)
    return list(map(tuple, np.column_stack([found.frame, found.sorted_moments()]).tolist()))


@pytest.mark.parametrize("connectivity", CONNECTIVITIES)
@pytest.mark.parametrize("shape", SHAPES)
def test_flood_fill_agrees_with_scipy_and_opencv(shape, connectivity):
    rng = np.random.default_rng([*shape, connectivity])
    for cells in random_frames(rng, shape, 12):
        found = golden.zones(cells, connectivity)
        assert found == cv2_zones(cells, connectivity)
        assert found == zones_by_scipy(cells, connectivity)


@pytest.mark.parametrize("connectivity", CONNECTIVITIES)
def test_every_4x4_frame_agrees_with_scipy(connectivity):
    frames = every_frame(4, 4)
    assert vector_zones(frames, connectivity) == zones_of_frames(frames, connectivity)


@pytest.mark.parametrize("connectivity", CONNECTIVITIES)
@pytest.mark.parametrize("labeller", [name for name, labeller in LABELLERS.items() if labeller.exact])
@pytest.mark.parametrize("shape", SHAPES)
def test_many_frames_at_once_agree_with_flood_fill_and_the_labellers_rule(shape, connectivity, labeller):
    rng = np.random.default_rng([*shape, connectivity, 1])
    frames = random_frames(rng, shape, 6 if shape == (64, 64) else 40)
    found = golden.all_departures(frames, connectivity, labeller)
    busy, end = golden.row_clocks(frames, connectivity, labeller)
    clocks = golden.last_record_clocks(frames, connectivity, labeller)
    for index, cells in enumerate(frames):
        one = labelling(cells, connectivity, labeller)
        own = slice(found.offsets[index], found.offsets[index + 1])
        table = np.column_stack([found.row[own], found.clock[own], found.moments[own]]).tolist()
        assert table == [[zone.row, zone.clock, zone.area, zone.sum_x, zone.sum_y] for zone in one.departures]
        assert busy[index].tolist() == list(one.busy)
        assert end[index, -1] == one.end
        final = [zone.clock for zone in one.departures if zone.row == shape[0] - 1]
        assert clocks[index] == max(final, default=0)


@pytest.mark.parametrize("closed", [False, True], ids=["plane", "closed"])
@pytest.mark.parametrize("connectivity", CONNECTIVITIES)
@pytest.mark.parametrize("labeller", [name for name, labeller in LABELLERS.items() if labeller.exact])
def test_clocks_of_rows_are_those_of_the_rules_worked_cell_by_cell(labeller, connectivity, closed):
    compared = 0
    for rows, columns, count in ((4, 4, 1500), (3, 3, 1000), (5, 7, 500), (3, 16, 150), (2, 64, 25)):
        frames = random_frames(np.random.default_rng([rows, columns, connectivity]), (rows, columns), count)
        rule = LABELLERS[labeller].load_golden()
        leaves, busy, end = (rule.closed if closed else rule).strips(frames, connectivity)
        words = (frames.astype(object) << np.arange(columns)).sum(axis=2)
        for frame, y in np.ndindex(words.shape):
            pair = (words[frame, y - 1] if y else 0, words[frame, y])
            clusters, *clocks = row_rule(pair, columns, connectivity, labeller, closed)
            assert [busy[frame, y], end[frame, y]] == clocks
            for cluster, clock in clusters:
                assert max(leaves[frame, y, x] for _, x in cluster) == clock
                compared += 1
    assert compared > 10_000


@pytest.mark.slow
def test_frames_beyond_one_portion_keep_their_places():
    rng = np.random.default_rng(5)
    few = random_frames(rng, (32, 32), 50)
    many = np.concatenate([few] * 45)  # more cells than are worked at once
    one, all_found = golden.all_departures(few, 8), golden.all_departures(many, 8)
    assert np.array_equal(all_found.moments, np.concatenate([one.moments] * 45))
    assert np.array_equal(np.diff(all_found.offsets), np.tile(np.diff(one.offsets), 45))


@pytest.mark.parametrize("connectivity", CONNECTIVITIES)
@pytest.mark.parametrize("columns", [3, 4, 7])
def test_zones_around_a_cylinder_are_those_of_an_unrolled_sheet(connectivity, columns):
    """Random frames; rings, helices and spirals. Flood fill and the rule for many frames agree on each."""
    rng = np.random.default_rng(columns)
    some = zone_oracles.noise(rng, 8, columns, 100)
    frames = np.concatenate([some, zone_oracles.mazes(rng, 8, columns, 50), shapes.around(8, columns)[::5]])
    departures = golden.all_departures(frames, connectivity, closed=True)
    found = zone_oracles.of_records(departures.frame, departures.moments, columns)
    assert np.array_equal(found, zone_oracles.zones(frames, connectivity))
    assert {zone_oracles.RING, zone_oracles.WOUND} <= {*found[:, 2].tolist()}
    for index, cells in enumerate(frames):
        labels, turned = closed_flood(cells, connectivity)
        records = []
        for zone, past in enumerate(turned, 1):
            y, x = np.nonzero(labels == zone)
            records.append((len(x), int(x.sum()), int(y.sum()), past))
        of_many = departures.moments[departures.offsets[index] : departures.offsets[index + 1]].tolist()
        assert sorted(map(tuple, of_many)) == sorted(records)


@pytest.mark.parametrize("labeller", [one for one in LABELLERS.values() if one.exact], ids=lambda one: one.name)
@pytest.mark.parametrize("connectivity", [8, 4])
def test_the_last_two_rows_alone_decide_how_late_the_last_record_is(labeller, connectivity):
    rng = np.random.default_rng(3)
    frames = rng.random((500, 9, 16)) < rng.choice([0.1, 0.3, 0.6, 0.9], (500, 1, 1))
    whole = golden.last_record_clocks(frames, connectivity, labeller)
    assert np.array_equal(golden.last_record_clocks(frames[:, -2:], connectivity, labeller), whole)
