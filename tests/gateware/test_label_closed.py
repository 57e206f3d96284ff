"""Labellers of sheets whose ends meet: zones around a cylinder, their turns, and the clocks of docs/timing.md."""

from pathlib import Path

import numpy as np
import pytest
from sample import sample
from scipy import ndimage

from contactfpga import Skin
from contactfpga.choices.labellers import LABELLERS
from contactfpga.skin.derived import Derived
from contactfpga_sim.board.labeller import LabelBench
from contactfpga_sim.golden import all_departures, cylinder, label, row_clocks

CLOSED = [name for name, labeller in LABELLERS.items() if labeller.closed]
RULES = [(connectivity, labeller) for labeller in CLOSED for connectivity in (8, 4)]
DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
RECORDINGS = ("sdh13x6", "dtmf16x16", "feet45x52", "bed64x32", "popu64x27")

SHAPES = {
    # name: rows, zones with 8-connectivity as (area, sum x counted on past the seam or ring or wound, sum y)
    "over the seam": ("#..#", [(2, 7, 0)]),
    "row": ("####", [(4, "ring", 0)]),
    "corners over the seam": ("#... ...#", [(2, 7, 1)]),
    "helix two wide": ("##.. .##. ..## #..#", [(8, 16, 12)]),
    "helix of a turn": ("#... .#.. ..#. ...#", [(4, 6, 6)]),
    "helix of one turn and a cell": ("#... .#.. ..#. ...# #...", [(5, 10, 10)]),
    "helix of three turns": ("##...... ..##.... ....##.. ......## ##...... ..##.... ....##.. ......## ##......",
                             [(18, "wound", 72)]),
    "arms that meet behind": ("#..# #..# ####", [(8, "ring", 10)]),
    "U, open behind": ("#...# #...# ##..#", [(7, 33, 8)]),
    "arch over the seam": ("###.# #.#.# .....", [(7, 3, 3)]),
    "bar over the seam and a dot": ("#...# #.#.# #...#", [(6, 27, 6), (1, 2, 1)]),
    "nested arches over the seam": ("####.#### #.......# #.##.##.# #.#...#.# #.#...#.#",
                                    [(16, 136, 20), (4, 9, 11), (4, 23, 11)]),
    "two rings": ("#### .... ####", [(4, "ring", 0), (4, "ring", 8)]),
    "ring and a dot below it": ("#### .... #..#", [(4, "ring", 0), (2, 7, 4)]),
    "nearly a ring": ("#.#. #.#. #.##", [(7, 21, 8)]),
    "ring in the last row": ("#.#. #.#. #.## ####", [(11, "ring", 20)]),
    "two arms, either side of the seam": (".#..#.# .####.# #.....# #######", [(17, "ring", 30)]),
}  # fmt: skip


def cells_of(picture):
    return np.array([[mark == "#" for mark in line] for line in picture.split()])


def skin_of(rows, columns, connectivity, labeller):
    return Skin(
        rows=rows,
        columns=columns,
        connectivity=connectivity,
        labeller=labeller,
        surface="cylinder",
        radius_mm=20.0,
        closed=True,
        settle_us=100,
        zone_capacity=1,
    )


def unrolled(cells, connectivity):
    """Zones by scipy on many turns side by side: [(area, x, sum y)], x as in SHAPES."""
    columns = cells.shape[1]
    turns = 2 * (cells.size // columns) + 3
    structure = ndimage.generate_binary_structure(2, 1 if connectivity == 4 else 2)
    labels, _ = ndimage.label(np.tile(cells, turns), structure)
    middle, seen, found = turns // 2 * columns, set(), []
    for y, x in zip(*np.nonzero(cells), strict=True):
        if (y, x) in seen:
            continue
        ys, xs = np.nonzero(labels == labels[y, middle + x])
        places = set(zip(ys.tolist(), (xs % columns).tolist(), strict=True))
        seen |= places
        turn = xs // columns - (xs // columns).min()
        past = int((turn > 0).sum())
        place = "ring" if len(places) < len(ys) else "wound" if turn.max() > 1 else None
        if place is None:
            place = (int((xs % columns).sum()) + columns * past) % (columns * len(ys))
        found.append((len(places), place, sum(y for y, _ in places)))
    return sorted(found, key=str)


def named(records, columns):
    """The same of (area, sum x, sum y, turned) records."""
    found = []
    for area, sum_x, sum_y, turned in records:
        place = "ring" if turned == area else "wound" if turned > area else None
        found.append((area, (sum_x + columns * turned) % (columns * area) if place is None else place, sum_y))
    return sorted(found, key=str)


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
    widths = Derived(skin).record_bits
    end = sum(widths)
    sim.run(
        80 * len(words) * (columns + 2), until=lambda: sum(word >> end for _, word in sink.transfers) == len(frames)
    )
    return source.transfers, [(cycle, None if word >> end else split(word, widths)) for cycle, word in sink.transfers]


def split(word, widths):
    fields = []
    for width in widths:
        fields.append(word & (1 << width) - 1)
        word >>= width
    return tuple(fields)


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
    for connectivity in (8, 4):
        work = label.labelling(cells, connectivity, "run", closed=True)
        found = named([(zone.area, zone.sum_x, zone.sum_y, zone.turned) for zone in work.departures], cells.shape[1])
        assert found == unrolled(cells, connectivity)
        if connectivity == 8:
            columns = cells.shape[1]
            assert found == sorted(
                ((a, x if isinstance(x, str) else x % (columns * a), y) for a, x, y in zones), key=str
            )


@pytest.mark.parametrize("connectivity", [8, 4])
@pytest.mark.parametrize("columns", [3, 4, 7])
def test_the_golden_model_floods_a_cylinder(connectivity, columns):
    rng = np.random.default_rng(columns)
    frames = rng.random((100, 5, columns)) < rng.uniform(0.3, 0.9, (100, 1, 1))
    departures = all_departures(frames, connectivity, closed=True)
    for index, cells in enumerate(frames):
        labels, turned = cylinder.flood(cells, connectivity)
        records = []
        for zone, past in enumerate(turned, 1):
            y, x = np.nonzero(labels == zone)
            records.append((len(x), int(x.sum()), int(y.sum()), past))
        assert named(records, columns) == unrolled(cells, connectivity)
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


def every_frame(rows, columns, first=0, count=None):
    cells = rows * columns
    numbers = np.arange(first, first + (count or 1 << cells), dtype=np.uint32)
    return (numbers[:, None] >> np.arange(cells, dtype=np.uint32) & 1).astype(bool).reshape(-1, rows, columns)


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


def recorded(name):
    path = DATA / f"{name}.dev.npz"
    if not path.exists():
        pytest.skip(f"the recordings are not part of the project: {path.name} is not there")
    with np.load(path, allow_pickle=False) as file:
        return file["pressed"]


def check_compiled(frames, connectivity, labeller, stalled=False):
    """Every record, its place in the order and its clock; and the bound on the last one."""
    _, rows, columns = frames.shape
    rule = connectivity, labeller, True
    with LabelBench(skin_of(rows, columns, connectivity, labeller)) as bench:
        got = bench.run(frames)
        expected = all_departures(frames, *rule)
        if stalled:
            assert np.array_equal(bench.run(frames, gap=20, stall=60).sorted_moments(), expected.sorted_moments())
    assert np.array_equal(got.frame, expected.frame)
    assert np.array_equal(got.moments, expected.moments)
    busy, end = row_clocks(frames, *rule)
    handed = got.first_row[0] + (np.cumsum(busy) - busy.ravel()).reshape(busy.shape)
    assert np.array_equal(got.cycle, handed[expected.frame, expected.row] + expected.clock)
    assert np.array_equal(got.end, handed[:, -1] + end[:, -1])
    assert busy.max() <= Derived(skin_of(rows, columns, connectivity, labeller)).label_row_clocks
    if labeller == "run" and connectivity == 8:
        assert got.last_record_clocks.max() <= columns / 2 + 5


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
        check_compiled(every_frame(rows, columns, first, min(part, total)), connectivity, labeller)
    record_property("cases", total)


@pytest.mark.campaign
@pytest.mark.parametrize(("connectivity", "labeller"), RULES)
@pytest.mark.parametrize("size", [(9, 7), (12, 12), (16, 16), (20, 33), (64, 64)])
def test_random_frames_and_mazes(record_property, size, connectivity, labeller):
    rng = np.random.default_rng(size[0])
    count = 200_000 // (size[0] * size[1])
    noise = rng.random((count, *size)) < rng.uniform(0.02, 0.98, (count, 1, 1))
    check_compiled(np.concatenate([noise, mazes(*size, count, seed=size[1])]), connectivity, labeller, stalled=True)
    record_property("cases", 2 * count)


@pytest.mark.campaign
@pytest.mark.parametrize(("connectivity", "labeller"), RULES)
@pytest.mark.parametrize("name", RECORDINGS)
def test_recordings_wrapped_around(record_property, name, connectivity, labeller):
    frames = recorded(name)
    for first in range(0, len(frames), 2000):
        check_compiled(frames[first : first + 2000], connectivity, labeller)
    record_property("cases", len(frames))
