"""Labellers of sheets whose ends meet: zones around a cylinder, their turns, and the clocks of docs/timing.md."""

import numpy as np
import pytest
import zone_oracles
from bench import split
from recorded_frames import recorded
from zone_oracles import RING, RULES, WOUND, cells_of, every_frame, skin_of

from contactfpga.choices.labellers import LABELLERS
from contactfpga_sim.model.golden import all_departures, label
from contactfpga_sim.model.golden.zones import closed_flood

SHAPES = {
    # name: rows, zones with 8-connectivity as (area, sum x counted on past the seam or ring or wound, sum y)
    "over the seam": ("#..#", [(2, 7, 0)]),
    "row": ("####", [(4, RING, 0)]),
    "corners over the seam": ("#... ...#", [(2, 7, 1)]),
    "helix two wide": ("##.. .##. ..## #..#", [(8, 16, 12)]),
    "helix of a turn": ("#... .#.. ..#. ...#", [(4, 6, 6)]),
    "helix of one turn and a cell": ("#... .#.. ..#. ...# #...", [(5, 10, 10)]),
    "helix of three turns": ("##...... ..##.... ....##.. ......## ##...... ..##.... ....##.. ......## ##......",
                             [(18, WOUND, 72)]),
    "arms that meet behind": ("#..# #..# ####", [(8, RING, 10)]),
    "U, open behind": ("#...# #...# ##..#", [(7, 33, 8)]),
    "arch over the seam": ("###.# #.#.# .....", [(7, 3, 3)]),
    "bar over the seam and a dot": ("#...# #.#.# #...#", [(6, 27, 6), (1, 2, 1)]),
    "nested arches over the seam": ("####.#### #.......# #.##.##.# #.#...#.# #.#...#.#",
                                    [(16, 136, 20), (4, 9, 11), (4, 23, 11)]),
    "arch over the seam and a zone in it, joined below": ("###..## ..#..#. #.#..#. ###..#.", [(14, 99, 20)]),
    "arch that ends beside the seam, and a dot in it": ("...###.. ..#...#. #.#.#..# ...#....", [(10, 44, 13)]),
    "two rings": ("#### .... ####", [(4, RING, 0), (4, RING, 8)]),
    "ring and a dot below it": ("#### .... #..#", [(4, RING, 0), (2, 7, 4)]),
    "nearly a ring": ("#.#. #.#. #.##", [(7, 21, 8)]),
    "ring in the last row": ("#.#. #.#. #.## ####", [(11, RING, 20)]),
    "ring with a tail of five turns": ("### " + "#.. .#. ..# " * 5, [(18, RING, 120)]),
    "two arms, either side of the seam": (".#..#.# .####.# #.....# #######", [(17, RING, 30)]),
}  # fmt: skip


def simulated(bench, frames, connectivity, labeller, rng=None, gap=0.0, stall=0.0):
    """(N, R, C) frames back to back in Amaranth's simulator: cycles of the rows, and (cycle, record, or None for an end
    mark)."""
    _, rows, columns = frames.shape
    skin = skin_of(rows, columns, connectivity, labeller)
    dut = LABELLERS[labeller].load_gateware()(skin)
    sim = bench(dut)
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


def check_simulated(bench, frames, connectivity, labeller):
    """Every row, record and end mark in the very cycle of the golden rule."""
    handed, records = simulated(bench, frames, connectivity, labeller)
    start, rows, wanted = 0, [], []
    for cells in frames:
        work = label.labelling(cells, connectivity, labeller, closed=True)
        rows += [start + sum(work.busy[:y]) for y in range(len(cells))]
        for zone in work.departures:
            cycle = rows[zone.row - len(cells)] + zone.clock
            wanted.append((cycle, (zone.area, zone.sum_x, zone.sum_y, zone.turned)))
        wanted.append((rows[-1] + work.end, None))
        start += sum(work.busy)
    assert handed == rows
    assert records == wanted


@pytest.mark.parametrize("name", SHAPES)
def test_the_golden_model_knows_shapes_by_hand_and_agrees_with_an_unrolled_sheet(name):
    cells, zones = cells_of(SHAPES[name][0]), SHAPES[name][1]
    columns = cells.shape[1]
    for connectivity in (8, 4):
        work = label.labelling(cells, connectivity, "run", closed=True)
        records = [(zone.area, zone.sum_x, zone.sum_y, zone.turned) for zone in work.departures]
        found = zone_oracles.of_records(0, records, columns)
        assert np.array_equal(found, zone_oracles.zones(cells[None], connectivity))
        if connectivity == 8:
            by_hand = [(0, a, x if x in (RING, WOUND) else x % (columns * a), y) for a, x, y in zones]
            assert found.tolist() == sorted(map(list, by_hand))


@pytest.mark.parametrize("connectivity", [8, 4])
@pytest.mark.parametrize("columns", [3, 4, 7])
def test_the_golden_model_floods_a_cylinder(connectivity, columns):
    rng = np.random.default_rng(columns)
    frames = rng.random((100, 5, columns)) < rng.uniform(0.3, 0.9, (100, 1, 1))
    departures = all_departures(frames, connectivity, closed=True)
    found = zone_oracles.of_records(departures.frame, departures.moments, columns)
    assert np.array_equal(found, zone_oracles.zones(frames, connectivity))
    for index, cells in enumerate(frames):
        labels, turned = closed_flood(cells, connectivity)
        records = []
        for zone, past in enumerate(turned, 1):
            y, x = np.nonzero(labels == zone)
            records.append((len(x), int(x.sum()), int(y.sum()), past))
        of_many = departures.moments[departures.offsets[index] : departures.offsets[index + 1]].tolist()
        assert sorted(map(tuple, of_many)) == sorted(records)


@pytest.mark.parametrize(("connectivity", "labeller"), RULES)
def test_shapes_come_out_in_their_cycles(bench, connectivity, labeller):
    for picture, _ in SHAPES.values():
        cells = cells_of(picture)
        check_simulated(bench, np.array([cells, np.roll(cells, 2, axis=1)[::-1]]), connectivity, labeller)


@pytest.mark.parametrize(("connectivity", "labeller"), RULES)
def test_frames_of_three_rows_and_columns_come_out_in_their_cycles(bench, connectivity, labeller):
    """Every fifth one; the compiled labellers take all of them."""
    check_simulated(bench, every_frame(3, 3)[connectivity // 4 :: 5], connectivity, labeller)


@pytest.mark.parametrize(("connectivity", "labeller"), RULES)
def test_stalls_on_either_port_change_no_zone(bench, rng, connectivity, labeller):
    frames = np.random.default_rng(5).random((8, 6, 9)) < 0.55
    _, straight = simulated(bench, frames, connectivity, labeller)
    _, stalled = simulated(bench, frames, connectivity, labeller, rng, gap=0.4, stall=0.6)
    assert [record for _, record in stalled] == [record for _, record in straight]


@pytest.mark.parametrize(("connectivity", "labeller"), RULES)
def test_a_recording_wrapped_around_comes_out_in_its_cycles(bench, connectivity, labeller):
    check_simulated(bench, recorded("sdh13x6")[::40][:12], connectivity, labeller)
