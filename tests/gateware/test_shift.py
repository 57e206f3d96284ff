"""Rows on 74HC595 and columns on 74HC165: what reaches the sheet, what is read, and when (docs/timing.md, Scan)."""

import dataclasses
import itertools
import math

import pytest
from amaranth.hdl import Cat
from bench import split
from sample import sample

from contactfpga import Skin
from contactfpga_hdl.scan.pins import column_pins, row_pins
from contactfpga_hdl.scan.raster import Scanner
from contactfpga_sim.model.golden import predict
from contactfpga_sim.model.sheet.shift import COLUMN_PINS, ROW_PINS, SheetAtPins
from contactfpga_sim.verify.cosim import bench_native
from contactfpga_sim.verify.cosim.compare import compare
from contactfpga_sim.verify.cosim.covering import stimulus

LINES = [(1, 1), (2, 2), (8, 1), (9, 1), (9, 2), (17, 1), (17, 2), (17, 3)]
"""Lines, chains."""
DIODES = ("col2row", "row2col")
QUICK_LINES = sample(
    itertools.product(LINES, DIODES), quick=[(lines, DIODES[number % 2]) for number, lines in enumerate(LINES)]
)


def skin_of(rows=3, columns=4, megahertz=12, **options):
    """``rows`` and ``columns`` are a number of direct lines, or (lines, chains)."""
    fields = {"report": "cells", "clock_hz": megahertz * 1_000_000, "baud": megahertz * 250_000}
    for kind, wiring, lines in (("row", "row_drive", rows), ("column", "column_read", columns)):
        fields[f"{kind}s"] = lines if isinstance(lines, int) else lines[0]
        if not isinstance(lines, int):
            fields |= {wiring: "74hc595" if kind == "row" else "74hc165", f"{kind}_chains": lines[1]}
    return Skin(**fields | options)


@dataclasses.dataclass
class Times:
    """The times E, X, Z, S, L and T of docs/timing.md, by its rules."""

    bit: int
    late: int
    start: int
    settle: int
    release: int
    slot: int


def times(skin):
    megahertz = skin.clock_hz / 1e6
    bit = max(2, math.ceil(skin.clock_hz / skin.shift_hz))
    by_rows, by_columns = skin.row_drive == "74hc595", skin.column_read == "74hc165"
    late = bit * math.ceil(skin.columns / skin.column_chains) * by_columns
    shift = ((math.ceil(skin.rows / skin.row_chains) + 1) * bit + 1) * by_rows
    read = late + bit * by_columns
    release = max(math.ceil(skin.release_us * megahertz), read, bit * by_rows)
    settle = max(math.ceil(skin.settle_us * megahertz), read, shift - release)
    return Times(bit, late, (settle + release) * by_rows, settle, release, settle + release)


@dataclasses.dataclass
class Run:
    """Levels and rows of the scanner, by cycle."""

    driven: list  # rows that are selected
    rows: list  # (cycle, cells) of each transfer
    pins: dict  # levels of each of its output pins


def run(bench, skin, cells, sheet=None):
    """Run the scanner in a sheet with ``cells[cycle]`` pressed, R words each."""
    dut = Scanner(skin)
    sim = bench(dut)
    sheet = sheet or SheetAtPins(skin)
    ports = [getattr(dut.pins, name) for name in sheet.reads]
    seen = {name: [] for name in sheet.reads}
    idle = (1 << skin.rows) - 1 if skin.diodes == "col2row" else 0
    driven = []

    def levels(cycle, word):
        pins = dict(zip(sheet.reads, split(word, map(len, ports)), strict=True))
        for name, value in pins.items():
            seen[name].append(value)
        sheet.matrix.press(cells[min(cycle, len(cells) - 1)])
        (level,) = sheet.step(pins)
        driven.append([row for row in range(skin.rows) if (sheet.row_levels ^ idle) >> row & 1])
        return level

    (drives,) = sheet.drives
    sim.drive(getattr(dut.pins, drives), levels, Cat(ports))
    rows = sim.sink(dut.rows)
    sim.run(len(cells))
    mask = (1 << skin.columns) - 1
    return Run(driven[: len(cells)], [(cycle, payload & mask) for cycle, payload in rows.transfers], seen)


def expected_driven(skin, cycles):
    """The rows that are driven in each cycle."""
    t = times(skin)
    slots = [divmod(cycle - t.start, t.slot) for cycle in range(cycles)]
    return [[slot % skin.rows] if slot >= 0 and clock < t.settle else [] for slot, clock in slots]


def expected_rows(skin, cells):
    """(cycle, cells) of each row that is offered."""
    t = times(skin)
    samples = range(t.start + t.settle - 1, len(cells) - t.late - 3, t.slot)
    return [(sample + t.late + 3, cells[sample][slot % skin.rows]) for slot, sample in enumerate(samples)]


def changing(rng, skin, cycles):
    """Other cells in every cycle."""
    return [[rng.getrandbits(skin.columns) for _ in range(skin.rows)] for _ in range(cycles)]


def slots(skin, count):
    t = times(skin)
    return t.start + count * t.slot + t.late + 6


# ---- what is driven and read, and when


@pytest.mark.parametrize(("lines", "diodes"), QUICK_LINES)
def test_rows_on_registers_are_driven_one_by_one_and_read_in_the_last_clock(bench, rng, lines, diodes):
    skin = skin_of(rows=lines, diodes=diodes, settle_us=2.0, release_us=0.25)
    cells = changing(rng, skin, slots(skin, 2 * skin.rows + 1))
    got = run(bench, skin, cells)
    assert got.driven == expected_driven(skin, len(cells))
    assert got.rows == expected_rows(skin, cells)
    assert len(got.rows) > 2 * skin.rows


@pytest.mark.parametrize(("lines", "diodes"), QUICK_LINES)
def test_columns_on_registers_are_those_of_the_load(bench, rng, lines, diodes):
    skin = skin_of(columns=lines, diodes=diodes, settle_us=2.0, release_us=0.25)
    cells = changing(rng, skin, slots(skin, 7))
    got = run(bench, skin, cells)
    assert got.driven == expected_driven(skin, len(cells))
    assert got.rows == expected_rows(skin, cells)
    assert len(got.rows) == 7


@pytest.mark.parametrize("megahertz", [1, 12, 25, 50])
@pytest.mark.parametrize("shift_hz", [700_000, 8_000_000, 50_000_000])
def test_a_bit_takes_what_the_shift_clock_says(bench, rng, megahertz, shift_hz):
    skin = skin_of((5, 2), (3, 1), megahertz, shift_hz=shift_hz, settle_us=1.0, release_us=1.0)
    wanted = {1: (2, 2, 2), 12: (18, 2, 2), 25: (36, 4, 2), 50: (72, 7, 2)}[megahertz]
    assert times(skin).bit == wanted[[700_000, 8_000_000, 50_000_000].index(shift_hz)]
    cells = changing(rng, skin, slots(skin, 3))
    got = run(bench, skin, cells)
    assert got.driven == expected_driven(skin, len(cells))
    assert got.rows == expected_rows(skin, cells)
    assert len(got.rows) == 3


def test_derived_clocks_are_those_of_the_rules():
    for rows, columns, megahertz, shift_hz in itertools.product(
        [5, *LINES], [5, *LINES], [1, 12, 50], [10**6, 8 * 10**6]
    ):
        registers = not (isinstance(rows, int) and isinstance(columns, int))
        options = {"shift_hz": shift_hz} if registers else {}
        skin = skin_of(rows, columns, megahertz, settle_us=20.0, release_us=1.0, **options)
        mine, theirs = times(skin), skin.derived
        assert (mine.settle, mine.release) == (theirs.settle_clocks, theirs.release_clocks)
        assert (mine.start, mine.late) == (theirs.start_clocks, theirs.column_shift_clocks)
        if registers:
            assert mine.bit == theirs.shift_clocks


# ---- what the chips see


@pytest.fixture(params=[12, 24, 50])
def traffic(bench, rng, request):
    """A sheet with both kinds of registers, and what went over their pins."""
    skin = skin_of((9, 2), (7, 2), request.param, settle_us=3.0, release_us=1.0)
    return skin, run(bench, skin, changing(rng, skin, slots(skin, 12))).pins


def edges(levels, rising=True):
    return [cycle for cycle in range(1, len(levels)) if levels[cycle - 1] != levels[cycle] == int(rising)]


def test_shift_clocks_have_halves_of_equal_length_and_data_holds_around_their_rise(traffic):
    skin, pins = traffic
    bit = times(skin).bit
    for name in ("row_clock", "column_clock"):
        rises, falls = edges(pins[name]), edges(pins[name], rising=False)
        assert len(rises) > 20
        assert {fall - rise for rise, fall in zip(rises, falls)} == {bit // 2}
        assert min(late - early for early, late in itertools.pairwise(rises)) == bit
    for rise in edges(pins["row_clock"]):
        around = pins["row_data"][rise - (bit - bit // 2) : rise + bit // 2]
        assert len({*around}) == 1, "set up for one half, held for the other"


def test_latch_comes_after_the_last_bit_and_a_bit_before_the_outputs_go_on(traffic):
    skin, pins = traffic
    bit = times(skin).bit
    latches, shifts = edges(pins["row_latch"]), edges(pins["row_clock"])
    enables = edges(pins["row_enable_n"], rising=False)
    assert enables == [latch + bit for latch in latches][: len(enables)]
    assert len(enables) >= 12
    for latch in latches:
        assert latch - max(shift for shift in shifts if shift < latch) == bit // 2
        assert all(pins["row_enable_n"][latch - 1 : latch + bit])
        assert pins["row_latch"][latch : latch + bit + 1] == [1] * bit + [0]


def test_load_pulse_lasts_a_bit_and_leaves_one_before_the_first_shift(traffic):
    skin, pins = traffic
    bit = times(skin).bit
    begins, ends = edges(pins["column_load_n"], rising=False), edges(pins["column_load_n"])
    assert [end - begin for begin, end in zip(begins, ends)] == [bit] * len(ends)
    shifts = edges(pins["column_clock"])
    for end, following in itertools.pairwise(ends):
        between = [shift for shift in shifts if end <= shift < following]
        assert between == [end + bit * place for place in range(1, 4)], "four lines, the first needs no shift"
        assert not any(pins["column_clock"][end - bit : end + bit]), "no edge while loading"


@pytest.mark.parametrize("bit", [2, 3, 7])
def test_a_chip_may_take_nearly_a_whole_bit_to_answer(bench, rng, bit):
    skin = skin_of((3, 1), (9, 2), bit * 4, shift_hz=4_000_000, settle_us=3.0, release_us=1.0)
    assert times(skin).bit == bit
    cells = changing(rng, skin, slots(skin, 4))
    for delay in range(bit + 1):
        got = run(bench, skin, cells, SheetAtPins(skin, column_delay=delay))
        assert (got.rows == expected_rows(skin, cells)) == (delay < bit), delay


@pytest.mark.parametrize("power_up", sample(range(8), quick=range(3)))
def test_power_up_contents_never_reach_the_sheet(bench, power_up):
    skin = skin_of((9, 2), (5, 1))
    full = [[31] * 9] * slots(skin, 10)
    got = run(bench, skin, full, SheetAtPins(skin, power_up))
    assert got.driven == expected_driven(skin, len(full))
    assert got.driven[: times(skin).start] == [[]] * times(skin).start
    assert got.rows == expected_rows(skin, full)


# ---- the compiled board


@pytest.mark.campaign
def test_the_compiled_board_with_registers_is_the_golden_models_in_every_clock(record_property):
    skin = Skin(rows=17, columns=19, row_drive="74hc595", row_chains=2, column_read="74hc165", column_chains=3)
    cycles = 200_000
    timeline = stimulus(skin, cycles, seed=5)
    assert compare(predict(skin, timeline, cycles), bench_native.run(skin, timeline, cycles)) > 10_000
    record_property("cases", cycles)


def test_the_sheets_pins_are_those_of_the_gateware():
    for skin in (skin_of(), skin_of((5, 2), (5, 3))):
        assert ROW_PINS[skin.row_drive] == tuple(row_pins(skin))
        assert (*COLUMN_PINS[skin.column_read], *SheetAtPins(skin).drives) == tuple(column_pins(skin))
