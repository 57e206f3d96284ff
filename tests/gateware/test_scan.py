"""The scanner: which row is driven when, and what it makes of the column pins (docs/timing.md, Scan)."""

import dataclasses
import itertools
import types

import pytest
from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga import Skin
from contactfpga.skin.derived import EPOCH_BITS, TIME_BITS
from contactfpga_hdl.scan.frame_clock import watch_epoch
from contactfpga_hdl.scan.raster import Scanner

SKINS = {
    "1x1": {"rows": 1, "columns": 1, "settle_us": 18, "release_us": 1},
    "1x7": {"rows": 1, "columns": 7, "settle_us": 17, "release_us": 3},
    "7x1": {"rows": 7, "columns": 1, "settle_us": 6, "release_us": 4, "clock_hz": 3_000_000},
    "3x5": {"rows": 3, "columns": 5, "settle_us": 8, "release_us": 3, "mask": ((0, 1), (2, 1), (2, 4), (1, 1))},
    "2x20": {"rows": 2, "columns": 20, "settle_us": 1, "release_us": 25, "mask": ((0, 0), (1, 0), (1, 19))},
    "64x2": {"rows": 64, "columns": 2, "settle_us": 9, "release_us": 1, "mask": ((63, 0), (0, 1))},
}
DIODES = ("col2row", "row2col")


def skin_of(name, **options):
    """A Skin with a clock of 1 MHz, so that a microsecond is a clock, unless another one is given."""
    fields = {"report": "cells", "clock_hz": 1_000_000, "baud": 250_000} | SKINS[name] | options
    return Skin(**fields)


@dataclasses.dataclass
class Expected:
    """Pin levels and rows of a run by the rules of docs/timing.md."""

    driven: list  # number of the driven row in each cycle, or None
    rows: list  # (cycle, cells) of each transfer
    contact: list  # level in each cycle
    tags: dict  # cycle of a frame's last transfer: (time, stuck, requested, heard), there one clock later


def expected(skin, pressed, requests=types.MappingProxyType({})):
    """The rules of docs/timing.md for the pressed columns in each cycle, whatever row is driven.

    ``requests``: by cycle, the bits that frames repeat."""
    megahertz = skin.clock_hz // 1_000_000
    S, L = round(skin.settle_us * megahertz), round(skin.release_us * megahertz)
    T, R, cycles = S + L, skin.rows, len(pressed)
    present = [sum(1 << c for c in range(skin.columns) if (r, c) not in skin.mask) for r in range(R)]
    anywhere = 0
    for word in present:
        anywhere |= word
    result = Expected([], [], [], {})
    result.driven = [cycle // T % R if cycle % T < S else None for cycle in range(cycles)]
    contact = [False] * cycles
    level, scan, time, requested, heard, begun = False, [], 0, False, 0, 0
    for k in range(cycles // T + 1):
        strobe = k * T + S + 1
        if strobe + 1 >= cycles:
            break
        row = k % R
        cells = pressed[strobe - 2] & present[row]
        result.rows.append((strobe + 1, cells))
        if row == 0:
            scan, time = [], strobe // megahertz % 2**24
            begins = k * T if skin.report == "cells" else strobe  # where a command may move the sample
            requested = any(begun <= x < begins for x in requests)
            heard = next((bits for x, bits in sorted(requests.items(), reverse=True) if x < begins), 0)
            begun = begins
        scan.append(cells)
        if cells:
            level = True
        elif row == R - 1 and not any(scan):
            level = False
        contact[strobe + 1 :] = [level] * (cycles - strobe - 1)
        if row == R - 1:
            stuck = 0
            for slot in range(k - R, k):  # slots fR - 1 to fR + R - 2
                stuck |= pressed[(slot + 1) * T - 1] & anywhere if slot >= 0 else 0
            if strobe + 2 < cycles:
                result.tags[strobe + 1] = (time, min(7, stuck.bit_count()), int(requested), heard)
    result.contact = [int(value) for value in contact]
    return result


def run(bench, skin, pressed, requests=types.MappingProxyType({}), sink=None):
    """Row pins, transfers, contact and tags of the gateware for the pressed columns in each cycle."""
    dut = Scanner(skin)
    sim = bench(dut)
    all_columns = (1 << skin.columns) - 1
    flip = all_columns if skin.diodes == "col2row" else 0
    sim.drive(dut.pins.columns, lambda cycle: (pressed[cycle] if cycle < len(pressed) else 0) ^ flip)
    sim.drive(dut.request, lambda cycle: int(cycle in requests))
    heard = [0]

    def last_heard(cycle):
        heard.append(requests.get(cycle - 1, heard[-1]))
        return heard[-1]

    sim.drive(dut.heard, last_heard)
    rows = sim.sink(dut.rows)
    pins, contact = sim.watch(dut.pins.rows), sim.watch(dut.contact)
    tag = [sim.watch(dut.tag[name]) for name in ("time", "stuck", "requested", "heard")]
    sim.run(len(pressed))
    idle = (1 << skin.rows) - 1 if skin.diodes == "col2row" else 0
    mask = (1 << skin.columns) - 1
    lasts = [cycle for cycle, payload in rows.transfers if payload >> skin.columns]
    driven = []
    for word in pins.values:
        selected = word ^ idle
        assert selected & (selected - 1) == 0, "two rows at once"
        driven.append(selected.bit_length() - 1 if selected else None)
    return Expected(
        driven,
        [(cycle, payload & mask) for cycle, payload in rows.transfers],
        contact.values,
        {cycle: tuple(watch[cycle + 1] for watch in tag) for cycle in lasts if cycle + 1 < len(pressed)},
    )


def assert_same(got, wanted):
    for field in dataclasses.fields(Expected):
        assert getattr(got, field.name) == getattr(wanted, field.name), field.name


def scan_clocks(skin):
    return round((skin.settle_us + skin.release_us) * skin.clock_hz / 1e6) * skin.rows


@pytest.mark.parametrize("diodes", DIODES)
@pytest.mark.parametrize("name", SKINS)
def test_every_output_follows_the_rules_for_columns_that_change_each_clock(bench, rng, name, diodes):
    skin = skin_of(name, diodes=diodes)
    cycles = max(600, 3 * scan_clocks(skin))
    pressed, quiet = [], 0
    for cycle in range(cycles):
        if cycle % 97 == 0:
            quiet = rng.random() < 0.5  # long enough for whole scans of the small sheets without contact
        pressed.append(0 if quiet else sum(1 << c for c in range(skin.columns) if rng.random() < 0.3))
    requests = {cycle: rng.randrange(1, 8) for cycle in range(cycles) if rng.random() < 0.02}
    wanted = expected(skin, pressed, requests)
    assert {*wanted.contact} == {0, 1}
    assert_same(run(bench, skin, pressed, requests), wanted)


def test_a_frames_tag_holds_until_the_next_frames_last_strobe(bench):
    skin = skin_of("3x5")
    dut = Scanner(skin)
    sim = bench(dut)
    sim.drive(dut.request, lambda cycle: int(cycle == 20))
    sim.sink(dut.rows)
    tag = sim.watch(dut.tag)
    sim.run(33 * 4)
    for frame in range(3):
        last, following = 33 * frame + 22 + 9, 33 * (frame + 1) + 22 + 9
        assert len(set(tag.values[last + 2 : following + 1])) == 1
        assert tag[following] != tag[following + 1]


def test_a_row_is_offered_until_it_is_taken(bench, rng):
    skin = skin_of("3x5")
    dut = Scanner(skin)
    sim = bench(dut)
    pressed = [rng.randrange(32) for _ in range(1200)]
    sim.drive(dut.pins.columns, lambda cycle: pressed[cycle % 1200] ^ 31)
    sink = sim.sink(dut.rows, ready=lambda cycle: rng.random() < 0.3 or cycle % 11 == 9)  # before the next row comes
    rows = expected(skin, pressed).rows
    sim.run(rows[-1][0] + 11)  # the last one is taken, too
    assert [payload & 31 for _, payload in sink.transfers] == [cells for _, cells in rows]
    assert sink.offered == [cycle for cycle, _ in rows]
    assert any(cycle != offered for (cycle, _), offered in zip(sink.transfers, sink.offered))


class Epochs(wiring.Component):
    """The gateware's counter of epochs, without a scan."""

    def __init__(self, late):
        self.late = late
        super().__init__({"time": In(TIME_BITS), "epoch": Out(1)})

    def elaborate(self, platform):
        m = Module()
        watch_epoch(m, self.time, self.epoch, self.late)
        return m


@pytest.mark.parametrize("late", [False, True])
def test_an_epoch_begins_with_each_further_2_to_the_22_us_and_not_at_power_up(bench, rng, late):
    """Epochs begin at multiples of 2^22 us, also of a time that begins below 0 because columns shift in for longer than
    rows."""
    times = [-5 if late else 0]
    while len(times) < 400:
        times.append(times[-1] + rng.choice([1, 3, rng.randrange(1 << 20)]))
    dut = Epochs(late)
    sim = bench(dut)
    sim.drive(dut.time, lambda cycle: times[cycle] % (1 << TIME_BITS))
    epoch = sim.watch(dut.epoch)
    sim.run(len(times) - 1)
    begun = [max(0, time) >> EPOCH_BITS for time in times[:-1]]
    assert epoch.values == [0, *(int(after > before) for before, after in itertools.pairwise(begun))]
    assert sum(epoch.values) > 10
