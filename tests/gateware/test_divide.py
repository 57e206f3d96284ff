"""Barycenters divided on the board: exact against fractions, clock by clock against docs/timing.md, and to the host."""

import itertools
import math
from fractions import Fraction

import pytest
from sample import sample
from zone_oracles import nearest

from contactfpga import Skin
from contactfpga_hdl.report.divide import Divider


def skin_of(rows, columns, bits, **options):
    return Skin(rows=rows, columns=columns, report="barycenter", barycenter_bits=bits, settle_us=300, **options)


class Oracle:
    """Records and items of a sheet by docs/protocol.md, quotients in fractions."""

    def __init__(self, rows, columns, bits):
        self.rows, self.columns, self.bits = rows, columns, bits
        sums = columns * sum(range(rows)), rows * sum(range(columns))
        self.area = (rows * columns).bit_length()
        self.sum_y, self.sum_x = (max(1, value.bit_length()) for value in sums)
        self.clocks = (max(rows, columns) - 1).bit_length() + bits + 1  # one for each bit of the quotient

    @property
    def end(self):
        return 1 << self.area + self.sum_x + self.sum_y

    def record(self, area, sum_x, sum_y):
        return area | sum_x << self.area | sum_y << self.area + self.sum_x

    def item(self, area, sum_x, sum_y):
        widths = [max(1, (self.rows * self.columns - 1).bit_length())]
        widths += [max(1, ((lines - 1) * 2**self.bits).bit_length()) for lines in (self.columns, self.rows)]
        word = offset = 0
        for value, width in zip((area % 2 ** widths[0], *self.barycenter(area, sum_x, sum_y)), widths):
            assert value < 1 << width
            word |= value << offset
            offset += width
        return word, -(-offset // 8)

    def barycenter(self, *moments):
        area, *sums = moments
        return [nearest(total, area, self.bits) for total in sums]

    def every_zone(self):
        """(area, sum x, sum y) of every set of cells that is not empty: all that a labeller can emit."""
        found = {(0, 0, 0)}
        for y, x in itertools.product(range(self.rows), range(self.columns)):
            found |= {(area + 1, sum_x + x, sum_y + y) for area, sum_x, sum_y in found}
        return sorted(found - {(0, 0, 0)})


def run(bench, rng, oracle, zones, dut=None, gap=0.0, **sink):
    """Through a divider, an end mark after every fifth zone; returns (cycle of transfer, record or item) of both."""
    words = []
    for index, zone in enumerate(zones):
        words += [oracle.record(*zone), *([oracle.end] * (index % 5 == 4))]
    words.append(oracle.end)
    dut = dut or Divider(skin_of(oracle.rows, oracle.columns, oracle.bits))
    sim = bench(dut)
    source = sim.source(dut.records, words, rng, gap=gap)
    taker = sim.sink(dut.items, rng, **sink)
    sim.run(60 * len(words) * (oracle.clocks + 2), until=lambda: source.done and len(taker.transfers) == len(words))
    wanted = [None if word == oracle.end else oracle.item(*zone) for word, zone in zip(words, spread(zones))]
    return words, wanted, source, taker


def spread(zones):
    """The zones with None where an end mark goes."""
    for index, zone in enumerate(zones):
        yield zone
        if index % 5 == 4:
            yield None
    yield None


def check_items(wanted, taker):
    """Check each item's bits; of an end mark only that it is one."""
    size = next(item for item in wanted if item)[1]
    got = [word for _, word in taker.transfers]
    assert [word >> 8 * size for word in got] == [int(item is None) for item in wanted]
    assert [word for word, item in zip(got, wanted) if item] == [item[0] for item in wanted if item]


def test_extents_go_with_their_zones(bench, rng):
    oracle, dut = Oracle(4, 4, 2), Divider(skin_of(4, 4, 2, extent=True))
    zones = [(zone, rng.randrange(256)) for zone in rng.sample(oracle.every_zone(), 60)]
    bits = oracle.end.bit_length() - 1
    sim = bench(dut)
    sim.source(dut.records, [oracle.record(*zone) | extent << bits for zone, extent in zones], rng, gap=0.3)
    taker = sim.sink(dut.items, rng, stall=0.5)
    sim.run(6000, until=lambda: len(taker.transfers) == len(zones))
    assert [word for _, word in taker.transfers] == [oracle.item(*zone)[0] | extent << 12 for zone, extent in zones]


SHEETS = [(1, 1), (1, 2), (2, 2), (3, 3), (1, 7), (6, 1), (2, 5), (4, 3), (4, 4)]
BITS = (0, 1, 4, 8)


@pytest.mark.parametrize(
    ("rows", "columns", "bits"),
    sample(
        [(*sheet, bits) for sheet in SHEETS for bits in BITS],
        quick=[(*sheet, BITS[number % 4]) for number, sheet in enumerate(SHEETS)] + [(4, 4, 8)],
    ),
)
def test_every_zone_of_a_small_sheet_is_rounded_exactly_and_takes_its_clocks(
    bench, rng, record_property, rows, columns, bits
):
    oracle = Oracle(rows, columns, bits)
    zones = oracle.every_zone()
    words, wanted, source, taker = run(bench, rng, oracle, zones)
    check_items(wanted, taker)
    clock, before = 0, oracle.end
    for word, taken, (offered, _) in zip(words, source.transfers, taker.transfers, strict=True):
        if word == oracle.end:
            clock += before != oracle.end  # an item's clock goes by
            assert taken == offered == clock
            clock += 1
        else:
            assert (taken, offered) == (clock + oracle.clocks, clock + oracle.clocks + 1)
            clock += oracle.clocks + 1
        before = word
    record_property("cases", len(zones))


@pytest.mark.parametrize("size", [16, 32, 64])
@pytest.mark.parametrize("bits", [0, 4, 8])
def test_zones_at_the_edge_of_rounding_on_large_sheets(bench, rng, size, bits):
    """Division is exact for sums just below, at and above half a step, and areas small, large and next to a power of
    two."""
    oracle = Oracle(size, size, bits)
    cells, zones = size * size, {(size * size, size * sum(range(size)), size * sum(range(size)))}
    for area in (1, 2, 3, size - 1, size, size + 1, cells // 2 - 1, cells // 2, cells // 2 + 1, cells - size):
        for _ in range(4):
            x, y = (rng.randrange(size // 4, size - size // 4) for _ in range(2))
            half = area * Fraction(2 * rng.randrange(2**bits) + 1, 2 ** (bits + 1))
            for more in (-1, 0, 1):
                sum_x, sum_y = (min(area * line + math.floor(half) + more, area * (size - 1)) for line in (x, y))
                if max(sum_x, sum_y) <= size * sum(range(size)):
                    zones.add((area, sum_x, sum_y))
    assert len(zones) > 50
    _, wanted, _, taker = run(bench, rng, oracle, sorted(zones))
    check_items(wanted, taker)


def test_an_area_of_0_which_only_a_faulty_labeller_lets_out_takes_the_same_clocks(bench):
    """The frame says `mismatch`; whatever is sent for its barycenter, the zones after it are right."""
    oracle = Oracle(4, 5, 2)
    dut = Divider(skin_of(4, 5, 2))
    sim = bench(dut)
    source = sim.source(dut.records, [oracle.record(0, 3, 2), oracle.record(3, 4, 5), oracle.end])
    sink = sim.sink(dut.items)
    sim.run(100, until=lambda: len(sink.transfers) == 3)
    assert source.transfers[:2] == [oracle.clocks, 2 * oracle.clocks + 1]
    assert sink.transfers[1][1] == oracle.item(3, 4, 5)[0]
