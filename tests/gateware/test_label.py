"""The labellers: zones against a flood fill, cycles against their rules in docs/timing.md."""

import functools
import itertools

import pytest
from bench import split
from hypothesis import given, settings
from hypothesis import strategies as st
from label_rules import pieces, row_rule
from sample import sample

from contactfpga import Skin
from contactfpga.choices.labellers import LABELLERS
from contactfpga_hdl.label.steps import place_of

EXACT = [name for name, labeller in LABELLERS.items() if labeller.exact]
pytestmark = pytest.mark.parametrize("labeller", EXACT)

SHAPES = {
    "nested U": "#.#.#.# #.#.#.# #.#.#.# #.###.# #.....# #######",
    "nested U, closed late": "#.#.#.# #.#.### #.#.#.. #.###.. #...... #######",
    "spiral": "######### ........# #######.# #.....#.# #.###.#.# #.#...#.# #.#####.# #.......# #########",
    "comb": "######### #.#.#.#.# #.#.#.#.#",
    "comb, teeth up": "#.#.#.#.# #.#.#.#.# #########",
    "rings": "####### #.....# #.###.# #.#.#.# #.###.# #.....# #######",
    "ladder": "##### #...# ##### #...# #####",
    "tree": "#.#.#.#.#.#.#.# ###.###.###.### .#...#...#...#. .#####...#####. ...#.......#... ...#########...",
    "two trees": "#.#.#.#.# ###.#.### .#..#..#. .####..#. ....####.",
    "checkerboard": "#.#.#.# .#.#.#. #.#.#.# .#.#.#.",
    "diagonal": "#...... .#..... ..#.... ...#...",
    "other diagonal": "...# ..#. .#.. #...",
    "dots": "#.#.#.# ....... #.#.#.#",
    "stripes": "##### ..... ##### .....",
    "W": "#...#...# .#.#.#.#. ..#...#..",
    "M": "..#...#.. .#.#.#.#. #...#...#",
    "one long run over many": "#.#.#.# ####### #.#.#.#",
    "over and under": "###.### ..###.. ###.###",
    "passed and joined again": "#...# #.#.# ##### #.#.# #...#",
    "closing inside an open one": "#.#.# #.#.# #...# #...# #####",
    "island joins the right arm": "##### #...# #.#.# ..### ..#.. ..###",
    "island joins the left arm": "##### #...# #.#.# ###.. ..#.. ..###",
    "arches joined on the right": "####### #.....# #.###.# #.#.#.# #.#.### #.#.#.# #.#.#.#",
    "three arches joined": "######### #.......# #.#####.# #.#...#.# #.#.#.#.# #.#.##### #.#.#.#.# ###.#.#.#",
    "column": "# # . #",
    "row": "##.#.###",
    "cell": "#",
    "empty": "... ... ...",
    "full": "#### #### ####",
}


def cells_of(picture):
    return tuple(sum(1 << x for x, mark in enumerate(line) if mark == "#") for line in picture.split())


def skin_of(rows, columns, connectivity, labeller):
    return Skin(
        rows=rows, columns=columns, connectivity=connectivity, labeller=labeller, settle_us=100, zone_capacity=1
    )


def frame_rule(cells, columns, connectivity, labeller, start):
    """By the labeller's rule: cycles at which the rows are handed over, {cycle: zone}, and the end mark's cycle.

    The labeller can take the first row in cycle ``start`` and each next one as soon as it is able to; last comes the
    cycle in which it can take another frame.
    """
    zones = list(pieces(cells, connectivity))
    handed, leaving, cycle = [], {}, start
    for y, word in enumerate(cells):
        handed.append(cycle)
        pair = (cells[y - 1] if y else 0, word)
        clusters, busy, end = row_rule(pair, columns, connectivity, labeller)
        last_clock = {}  # of the rightmost cluster that holds a cell of the zone
        for cluster, clock in clusters:
            for index, zone in enumerate(zones):
                if any((y - 1 + below, x) in zone for below, x in cluster):
                    last_clock[index] = clock
        for index, clock in last_clock.items():
            bottom = max(row for row, _ in zones[index])
            if bottom == y - 1 or y == len(cells) - 1:
                assert cycle + clock not in leaving
                leaving[cycle + clock] = zones[index]
        last = cycle
        cycle += busy
    return handed, leaving, last + end, cycle


def moments(zone):
    return len(zone), sum(x for _, x in zone), sum(y for y, _ in zone)


@functools.cache
def bench_of(bench, rows, columns, connectivity, labeller):
    dut = LABELLERS[labeller].load_gateware()(skin_of(rows, columns, connectivity, labeller))
    return dut, bench(dut)


def label(bench, frames, columns, connectivity, labeller, rng=None, gap=0.0, stall=0.0):
    """Hands frames over back to back: cycles of the rows and (cycle, moments, or None for an end mark)."""
    rows = len(frames[0])
    dut, sim = bench_of(bench, rows, columns, connectivity, labeller)
    words = [word | (y == rows - 1) << columns for frame in frames for y, word in enumerate(frame)]
    source = sim.source(dut.rows, words, rng, gap=gap)
    sink = sim.sink(dut.records, rng, stall=stall)
    ends = dut.records.payload.shape().size - 1

    def finished():
        return sum(payload >> ends for _, payload in sink.transfers) == len(frames)

    sim.run(80 * len(words) * (columns + 2) + 100, until=finished)
    records = [
        (cycle, None if payload >> ends else fields(payload, rows, columns)) for cycle, payload in sink.transfers
    ]
    return source.transfers, records


def fields(payload, rows, columns):
    """Area, sum x, sum y: each as wide as its largest value on this sheet (docs/protocol.md)."""
    largest = (rows * columns, rows * sum(range(columns)), columns * sum(range(rows)))
    return split(payload, (max(1, most.bit_length()) for most in largest))


def assert_exact(bench, frames, columns, connectivity, labeller):
    """Every row, record and end mark in the very cycle of the rule."""
    handed, records = label(bench, frames, columns, connectivity, labeller)
    wanted_rows, wanted, start = [], [], 0
    for frame in frames:
        rows, leaving, end, start = frame_rule(frame, columns, connectivity, labeller, start)
        wanted_rows += rows
        wanted += [(cycle, moments(zone)) for cycle, zone in sorted(leaving.items())] + [(end, None)]
    assert handed == wanted_rows
    assert records == wanted


def zones_by_frame(records):
    frames = [[]]
    for _, zone in records:
        if zone is None:
            frames.append([])
        else:
            frames[-1].append(zone)
    assert frames.pop() == [], "a record after the last end mark"
    return [sorted(frame) for frame in frames]


def turned(cells, columns):
    """The frame, its mirror images and its transposes."""

    def transpose(frame, width):
        return tuple(sum((word >> x & 1) << y for y, word in enumerate(frame)) for x in range(width))

    def mirror(frame, width):
        return tuple(int(f"{word:0{width}b}"[::-1], 2) for word in frame)

    for frame, width in ((cells, columns), (transpose(cells, columns), len(cells))):
        yield from ((turn, width) for turn in (frame, frame[::-1], mirror(frame, width), mirror(frame[::-1], width)))


@pytest.mark.parametrize(
    ("name", "connectivity"),
    sample(itertools.product(SHAPES, (8, 4)), quick=[(name, (8, 4)[number % 2]) for number, name in enumerate(SHAPES)]),
)
def test_shapes_that_break_labellers_come_out_in_their_cycles(bench, name, connectivity, labeller):
    cells = cells_of(SHAPES[name])
    for frame, columns in dict.fromkeys(turned(cells, len(SHAPES[name].split()[0]))):
        assert_exact(bench, [frame, frame], columns, connectivity, labeller)


def frames_of(rows, columns):
    """Frames of every density: each cell is the AND or OR of two random bits, or one."""
    word = st.integers(0, (1 << columns) - 1)
    dense = st.builds(int.__or__, word, word)
    row = st.one_of(word, dense, st.builds(int.__and__, word, word), st.builds(int.__or__, dense, dense))
    return st.lists(st.tuples(*[row] * rows), min_size=1, max_size=3)


@pytest.mark.parametrize("connectivity", [8, 4])
@pytest.mark.parametrize(
    ("rows", "columns"), sample([(6, 9), (4, 16), (9, 5), (1, 12), (12, 1), (5, 2)], quick=[(6, 9), (1, 12), (5, 2)])
)
def test_random_frames_come_out_in_their_cycles(bench, rows, columns, connectivity, labeller):
    @settings(max_examples=15, deadline=None, derandomize=True, database=None)
    @given(frames_of(rows, columns))
    def check(frames):
        assert_exact(bench, frames, columns, connectivity, labeller)

    check()


def maze(rng, rows, columns):
    """Dots in every other row and column, joined at random: zones nest deeper in it than in noise."""
    across, down, dots = rng.uniform(0.2, 0.6), rng.uniform(0.5, 0.95), rng.uniform(0.8, 1.0)
    chance = [[dots, across], [down, 0.0]]
    return tuple(sum((rng.random() < chance[y % 2][x % 2]) << x for x in range(columns)) for y in range(rows))


@pytest.mark.parametrize("connectivity", [8, 4])
@pytest.mark.parametrize(
    ("rows", "columns", "count"), sample([(9, 9, 20), (12, 17, 15), (20, 32, 2)], quick=[(9, 9, 20), (20, 32, 2)])
)
def test_mazes_come_out_in_their_cycles(bench, rng, rows, columns, count, connectivity, labeller):
    assert_exact(bench, [maze(rng, rows, columns) for _ in range(count)], columns, connectivity, labeller)


@pytest.mark.parametrize("connectivity", [8, 4])
@pytest.mark.parametrize(("rows", "columns"), [(6, 9), (1, 7), (7, 1)])
@pytest.mark.parametrize(("gap", "stall"), [(0.4, 0.8), (0.8, 0.4)])
def test_stalls_on_either_port_change_no_zone(bench, rng, rows, columns, connectivity, gap, stall, labeller):
    frames = [tuple(rng.randrange(1 << columns) for _ in range(rows)) for _ in range(6)]
    frames += [maze(rng, rows, columns) for _ in range(6)]
    _, records = label(bench, frames, columns, connectivity, labeller, rng, gap, stall)
    wanted = [sorted(moments(zone) for zone in pieces(frame, connectivity)) for frame in frames]
    assert zones_by_frame(records) == wanted


@pytest.mark.parametrize("connectivity", [8, 4])
@pytest.mark.parametrize("columns", sample([1, 2, 3, 8, 16, 33, 64], quick=[1, 3, 8, 16]))
def test_the_last_record_comes_within_the_bound(bench, rng, columns, connectivity, labeller):
    dots = sum(1 << x for x in range(0, columns, 2))
    whole = (1 << columns) - 1
    pairs = [
        (dots, 0),
        (0, dots),
        (dots, dots),
        (dots, whole ^ dots),
        (whole ^ dots, dots),
        (whole, dots),
        (dots, whole),
    ]
    pairs += [tuple(rng.randrange(1 << columns) for _ in range(2)) for _ in range(30)]
    runs_in = [(word & ~(word << 1)).bit_count() for word in range(1 << min(columns, 8))]
    few = [rng.choices([word for word, count in enumerate(runs_in) if count <= 2], k=2) for _ in range(12)]
    pairs += [tuple(word << rng.randrange(columns - min(columns, 8) + 1) for word in pair) for pair in few]
    handed, records = label(bench, [(dots, *pair) for pair in pairs], columns, connectivity, labeller)
    if labeller == "run":
        bound = max(columns + 2, 6) if connectivity == 8 else max(2 * columns + 2, 8)
    else:
        bound = 2 * columns + 5
    marks = [index for index, (_, zone) in enumerate(records) if zone is None]
    for index, pair in enumerate(pairs):
        first = marks[index - 1] + 1 if index else 0
        last = handed[3 * index + 2]
        clocks = max([cycle for cycle, _ in records[first : marks[index]]], default=last) - last
        assert clocks <= bound
        if sum((word & ~(word << 1)).bit_count() for word in pair) <= 4:
            assert clocks <= (8 if labeller == "run" else columns + 6)


def test_what_an_empty_row_costs(bench, labeller):
    handed, _ = label(bench, [(0,) * 20] * 2, 16, 8, labeller)
    assert handed == [(1 if labeller == "run" else 18) * row for row in range(40)]


@pytest.mark.parametrize("connectivity", [8, 4])
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
