"""Pressure units: SPI, readings, thresholds and commands, in lockstep with the golden model."""

import itertools
import random

import numpy as np
import pytest
from amaranth.hdl import Value
from sample import sample

from contactfpga import Skin
from contactfpga_hdl.scan import raster, reversal
from contactfpga_hdl.units.mcp3208 import Mcp3208
from contactfpga_hdl.units.units import Units
from contactfpga_hdl.units.watch import Watch
from contactfpga_sim.model.golden import Timeline, guard, predict, units
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.hello import State
from contactfpga_sim.model.golden.link import Link
from contactfpga_sim.model.golden.request import Reception, Request, command
from contactfpga_sim.model.golden.trace import Cuts
from contactfpga_sim.model.sheet import converter
from contactfpga_sim.verify.cosim import bench_amaranth
from contactfpga_sim.verify.cosim.compare import compare

SMALL = {"rows": 2, "columns": 2, "settle_us": 14, "release_us": 2, "clock_hz": 1_000_000, "baud": 250_000}
TILTED = [[1, 1, 1], [127, -127, 3], [0, 0, -5], [1, -2, 1]]
SKINS = {
    "guard": Skin(**SMALL | {"baud": 500_000, "send": "on_change"}, units=2, guard=True),
    "sums": Skin(**SMALL, units=3, unit_sums=TILTED),
    "fail safe": Skin(**SMALL | {"clock_hz": 3_000_000, "baud": 750_000}, units=2, fail_safe=True, unit_sums=[[1, -1]]),
    "two copies": Skin(**SMALL, units=2, dual=True, fail_safe=True, unit_sums=[[1, -1]]),
    "reversal": Skin(
        **SMALL | {"clock_hz": 4_000_000, "baud": 1_000_000, "send": "on_change"},
        units=2,
        scan="reversal",
        precharge_us=1.0,
        guard=True,
        self_test=True,
        alive=True,
    ),
}
ALONE = {
    "one unit": Skin(**SMALL, units=1, unit_sums=[[1], [-1], [2]]),
    "four sums": SKINS["sums"],
    "12 MHz at 5 V": Skin(units=2, converter_v=5.0, unit_sums=[[1, 1]]),
    "eight units": Skin(**SMALL, units=8, unit_sums=[[127] * 8]),
    "with its own pace": Skin(**SMALL, units=3, converter="ads131m08", unit_sums=[[1, 1, 1], [127, -127, 3]]),
}
ZERO, THRESHOLD, SUM_THRESHOLD = 3, 4, 5


def readings(rng, skin, cycles, bits=12):
    """Random readings of the units, with the cycles of their changes."""
    changes, start = [], 0
    while start < cycles:
        changes.append((start, [rng.choice([0, 2**bits - 1, rng.randrange(2**bits)]) for _ in range(skin.units)]))
        start += rng.choice([7, 60, 500])
    return changes


def setting(rng, skin):
    """(what, value) of a command that some readings reach, now and then of a unit or a sum that is not there."""
    if skin.converter == "ads131m08":  # few sweeps, of large numbers
        return rng.choice([THRESHOLD, ZERO]), rng.randrange(skin.units) | rng.randrange(2**18) << 3
    what = rng.choice([ZERO, THRESHOLD, THRESHOLD, SUM_THRESHOLD, SUM_THRESHOLD, 1, 64 | THRESHOLD])
    number = rng.choice([0, rng.randrange(4096), rng.randrange(2**18)])
    return what, rng.choice([rng.randrange(max(skin.units, len(skin.unit_sums))), rng.randrange(8)]) | number << 3


class Inputs:
    """A converter at the pins of a component in the bench."""

    def __init__(self, pins, timeline, model=converter.Mcp3208):
        self._model, self._units = model([0] * 8), dict(timeline.units)
        self.targets, self.watched = [getattr(pins, name) for name in self._model.gives], []
        self._pins = [Value.cast(getattr(pins, name)) for name in self._model.reads]

    def drive(self, cycle, ctx):
        codes = self._units.get(cycle, [])
        self._model.codes[: len(codes)] = codes
        return self._model.step(*(ctx.get(pin) for pin in self._pins))

    def note(self, _cycle):
        pass


@pytest.mark.whole
@pytest.mark.parametrize("name", sample(SKINS, quick=["fail safe", "guard"]))
def test_board_does_what_the_golden_model_says(name, monkeypatch):
    """Boards with units do what the golden model says; with guard lines for longer than the first hello. Faults are
    renewed every 256 us, so that reports and readings wait together."""
    for scan in (raster, reversal):
        monkeypatch.setattr(scan, "RETRY_BIT", 8)
    monkeypatch.setattr(guard, "RETRY_US", 2**8)
    skin = SKINS[name]
    cycles = 5_000 if skin.guard else 3_000
    rng = random.Random(4)  # touches every kind of board
    received, at, number, bit = [], 30, 129 * 128 + 1, skin.clock_hz // skin.baud
    while at < cycles:
        data = command(number, *setting(rng, skin), bit_clocks=bit)
        received.append((at, data))
        at += 10 * bit * len(data) + rng.randrange(50)
        number += 2 if number % 8 == 7 else 1
    touches = [(cycle, np.array([[0, rng.random() < 0.2]] * 2, bool), None) for cycle in range(0, cycles, 700)]
    cuts = [(at, Cuts({rng.randrange(3): rng.randrange(3)})) for at in range(0, cycles, 230)] if skin.guard else []
    timeline = Timeline(touches, received, cuts, readings(rng, skin, cycles))
    expected = predict(skin, timeline, cycles)
    assert compare(expected, bench_amaranth.run(skin, timeline, cycles)) > 100
    assert len(expected.contact) >= 2


@pytest.mark.parametrize("name", ALONE)
def test_readings_and_thresholds_are_the_golden_models_in_every_clock(bench, name):
    """Commands come in any clock, and the wire takes packets at any time."""
    skin, model, cycles, bits = ALONE[name], converter.Mcp3208, 4_000, 12
    if skin.converter == "ads131m08":
        model, cycles, bits = converter.Ads131m08, 29_500, 24
    rng, often = random.Random(5), 80 / cycles
    requests = [Request(cycle, 1, False, setting(rng, skin)) for cycle in range(cycles) if rng.random() < often]
    timeline = Timeline([], units=readings(rng, skin, cycles, bits))
    expected = units.play(facts(skin), timeline, requests, cycles)
    dut = Units(skin)
    sim = bench(dut)
    sim._add(Inputs(dut.pins, timeline, model))
    orders = {one.cycle: one.command for one in requests}
    sim.drive(dut.command, lambda cycle: int(cycle in orders))
    sim.drive(dut.what, lambda cycle: orders.get(cycle, (0, 0))[0])
    sim.drive(dut.value, lambda cycle: orders.get(cycle, (0, 0))[1])
    over, armed, due = sim.watch(dut.over), sim.watch(dut.armed), sim.watch(dut.packet.due)
    sim.run(cycles)
    assert changes(over.values) == [one for one in expected.over if one[0] < cycles]
    assert changes(armed.values) == [one for one in expected.armed if one[0] < cycles]
    assert due.values.index(1) == expected.packets[0][0]
    assert len(expected.over) > 2


def changes(levels):
    """(cycle, level) of every change of a level that is low at first."""
    pairs = enumerate(itertools.pairwise([0, *levels]))
    return [(cycle, level) for cycle, (before, level) in pairs if level != before]


def sweep_of(readings, data):
    """Readings and sequence in the plain bytes of a packet, by docs/protocol.md."""
    digits = [byte - 128 for byte in data]
    found = [digits[place] + 128 * digits[place + 1] for place in range(0, 2 * readings, 2)]
    trailer = sum(digit << 7 * place for place, digit in enumerate(digits[2 * readings :]))
    return found, trailer % 2**24, trailer >> 24


def test_the_wire_gets_the_newest_sweep_whole_however_late_it_takes_it(bench, rng):
    """A packet holds one whole sweep, the newest: each reading names its sweep. Some sweeps complete in the clock in
    which the one before is taken."""
    skin, cycles = SKINS["sums"], 9_000
    sweep = skin.derived.units.sweep_clocks
    timeline = Timeline([], units=[(3 + n * sweep, [3 * n, 3 * n + 1, 3 * n + 2]) for n in range(cycles // sweep)])
    ready = [cycle for cycle, _ in units.play(facts(skin), timeline, [], cycles).packets]
    dut = Units(skin)
    sim = bench(dut)
    sim._add(Inputs(dut.pins, timeline))
    starts = []  # cycles in which a packet is taken
    state = {"until": 40}

    def take(cycle, due):
        taken = bool(due) and cycle >= state["until"]
        if taken:
            starts.append(cycle)
            meets = next((later - 1 for later in ready if later > cycle + 20 + sweep), cycles)
            state["until"] = rng.choice([meets, cycle + 20 + rng.choice([0, 1, 5, 60, 100, 119, 300])])
        return int(taken)

    sim.drive(dut.packet.taken, take, dut.packet.due)
    sim.drive(dut.packet.place, lambda cycle: max(0, min(20, cycle - starts[-1] - 1)) if starts else 0)
    byte = sim.watch(dut.packet.byte)
    sim.run(cycles)
    whole = [start for start in starts if start + 20 < cycles]
    for start in whole:
        data = [byte[start + 2 + place] for place in range(13)]
        assert data[0] == 13
        assert data[-1] == 0x80
        newest = max(index for index, cycle in enumerate(ready) if cycle <= start)
        read, time_us, sequence = sweep_of(3, data[1:-1])
        assert (read, sequence) == ([3 * newest, 3 * newest + 1, 3 * newest + 2], newest % 256)
        assert time_us == 3 + newest * sweep + 12
    assert len(whole) > 20
    assert len({start + 1 for start in whole} & {*ready}) > 3


LIMITS = {2.7: (1_000_000, 1e-6), 3.3: (1_000_000, 1e-6), 5.0: (2_000_000, 0.5e-6)}
"""By supply: fastest clock in Hz, and half a period of it twice, in s (DS21298E, table 1-1)."""


@pytest.mark.parametrize("supply_v", LIMITS)
@pytest.mark.parametrize("clock_hz", [1_000_000, 12_000_000, 25_000_000, 60_000_000])
def test_pins_keep_the_times_of_the_data_sheet(bench, clock_hz, supply_v):
    """High and low 250 ns each, select 100 ns before the first edge, 500 ns without it, data 50 ns about an edge."""
    skin = Skin(clock_hz=clock_hz, baud=clock_hz // 12, units=3, converter_v=supply_v, settle_us=100)
    dut = Mcp3208(skin)
    sim = bench(dut)
    clock, select_n, mosi = (sim.watch(getattr(dut.pins, name)) for name in converter.Mcp3208.reads)
    sim.run(4 * skin.derived.units.spacing_clocks)
    s, most_hz = 1 / clock_hz, LIMITS[supply_v][0]
    edges = changes(clock.values)
    rises = [cycle for cycle, level in edges if level]
    assert min(late - early for (early, _), (late, _) in itertools.pairwise(edges)) * s >= 250e-9 - 1e-15
    assert min(late - early for early, late in itertools.pairwise(rises)) * s >= 1 / most_hz - 1e-15
    selected = changes([1 - level for level in select_n.values])
    for (begin, _), (end, _) in zip(selected[:6:2], selected[1:6:2], strict=True):
        inside = [cycle for cycle in rises if begin <= cycle < end]
        assert len(inside) == 19
        assert (inside[0] - begin) * s >= 100e-9
        assert min(abs(cycle - rise) for rise in inside for cycle, _ in changes(mosi.values)) * s >= 50e-9
    gaps = [begin - end for (_, _), (end, _), (begin, _) in zip(selected[::2], selected[1::2], selected[2::2])]
    assert min([selected[0][0], *gaps]) * s >= 500e-9 - 1e-15


@pytest.mark.parametrize("delay_ns", [0, 200])
def test_a_converter_that_answers_late_is_read(bench, delay_ns):
    """A bit may come 200 ns after the falling edge, 2 of the 3 clocks of a level at 12 MHz."""
    skin = ALONE["12 MHz at 5 V"]
    dut = Mcp3208(skin)
    sim = bench(dut)
    inputs = Inputs(dut.pins, Timeline([], units=[(0, [0b101010101010, 0b010101010101])]))
    answers = [0] * (delay_ns * 12 // 1000)
    drive = inputs.drive
    inputs.drive = lambda cycle, ctx: (answers.append(drive(cycle, ctx)[0]), (answers.pop(0),))[1]
    sim._add(inputs)
    done, value = sim.watch(dut.done), sim.watch(dut.reading.value)
    sim.run(600)
    read = [value[cycle] for cycle in range(600) if done[cycle]]
    assert read[:4] == [0b101010101010, 0b010101010101] * 2


def test_contact_rises_within_a_sweep_and_eight_clocks():
    """``contact`` rises within a sweep and eight clocks of a touch that all units of a sweep see, otherwise within a
    conversion more."""
    skin = SKINS["sums"].replace(fail_safe=True)
    derived = skin.derived.units
    begun, sweep = 2 * derived.level_clocks + 1, derived.sweep_clocks
    set_all = [
        Request(0, 1, False, one) for one in ((THRESHOLD, 2 | 900 << 3), (SUM_THRESHOLD, 3 | 900 // 8 << 3))
    ]  # sums of 21 bits
    for moment in range(begun + sweep, begun + 2 * sweep, 7):
        timeline = Timeline([], units=[(moment, [0, 0, 1000])])
        over = units.play(facts(skin), timeline, set_all, 5 * sweep).over
        assert moment < over[0][0] + 1 <= moment + sweep + derived.spacing_clocks + 8
    timeline = Timeline([], units=[(begun + sweep, [1000, 0, 0])])  # which only the last sum sees
    by_sum = units.play(facts(skin), timeline, set_all, 5 * sweep).over
    assert by_sum[0][0] + 1 <= begun + 2 * sweep + 8


@pytest.mark.parametrize("baud", [1_000_000, 3_000_000, 12_000_000])
def test_a_frame_waits_for_one_packet_of_readings_at_most_and_these_for_five_frames(rng, baud):
    """Frames come so fast that they fill the line, or leave room."""
    known = facts(Skin(units=8, clock_hz=24_000_000, baud=baud))
    readings = [(2_000 + 3_840 * n, bytes([8] * 26) + b"\0") for n in range(100)]
    link = Link(known, State(known, [], Reception([], [])), units=readings)
    cycle, offered, starts = 1_000, 0, {}
    while cycle < 300_000:
        link.advance(cycle)
        link.drop()
        offered += 1
        packet = (
            bytes([5, *(1 + offered // 250**place % 250 for place in range(3)), *[5] * rng.randrange(8, 14)]) + b"\0"
        )
        link.offer(cycle, packet)
        starts[packet[1:4]] = cycle
        cycle += rng.randrange(2_000, 3_000)
    sent = packets(link.bytes)
    waits, kinds = [], [kind for _, kind, _ in sent]
    byte = 10 * known.bit_clocks + 2  # from when a packet is taken until its first byte is
    for index, (begin, kind, data) in enumerate(sent):
        if kind == 5:
            between = [other for other in sent[:index] if other[0] - byte > starts[data[1:4]]]
            assert len(between) <= 1
            assert all(one[1] == 8 for one in between)
            waits.append(begin - starts[data[1:4]])
    runs = [len(list(run)) for kind, run in itertools.groupby(kinds) if kind == 5]
    assert len(runs) > 8
    assert max(runs[1:-1]) <= 5  # one may be on the wire as readings begin to wait
    assert max(waits) <= 10 * known.bit_clocks * (27 + 18)


def packets(sent):
    """(cycle of the first byte, first byte, bytes) of each packet."""
    found, begin = [], 0
    for end, (_, value) in enumerate(sent):
        if value == 0:
            if end > begin:
                found.append((sent[begin][0], sent[begin][1], bytes(byte for _, byte in sent[begin:end])))
            begin = end + 1
    return found


SUMS = [[1, 1, 1], [2, -3, 1], [0, 0, -5], [1, -2, 1]]
"""Of so few bits that thresholds are given in steps of 1."""
EPOCHS, EPOCH, READ = 200, 32, (8, 14, 20)
"""How many, of how many clocks; when in each of them a unit is read."""


def test_a_sum_is_over_from_its_threshold_on_to_the_last_step(bench):
    """Zeros, then a threshold of one sum at, or one off, the amount of the readings that come; the others have none."""
    rng = np.random.default_rng(3)
    zeros, read = rng.integers(4096, size=(2, EPOCHS, 3))
    orders, expected, before = {}, [], 0
    for epoch in range(EPOCHS):
        place = int(rng.integers(4))
        amount = abs(int(SUMS[place] @ (read[epoch] - zeros[epoch])))
        number = max(1, amount + int(rng.integers(-1, 2)))
        given = [*((ZERO, unit, int(zeros[epoch, unit])) for unit in range(3)), (SUM_THRESHOLD, before, 0)]
        for cycle, (what, index, value) in enumerate([*given, (SUM_THRESHOLD, place, number)], epoch * EPOCH):
            orders[cycle] = what, index | value << 3
        expected.append(int(amount >= number))
        before = place

    def unit(cycle):
        return sum(cycle % EPOCH >= start for start in READ[1:])

    dut = Watch(Skin(units=3, unit_sums=SUMS))
    sim = bench(dut)
    sim.drive(dut.command, lambda cycle: int(cycle in orders))
    sim.drive(dut.what, lambda cycle: orders.get(cycle, (0, 0))[0])
    sim.drive(dut.value, lambda cycle: orders.get(cycle, (0, 0))[1])
    sim.drive(dut.done, lambda cycle: int(cycle % EPOCH in READ))
    sim.drive(dut.reading.unit, unit)
    sim.drive(dut.reading.value, lambda cycle: int(read[cycle // EPOCH % EPOCHS, unit(cycle)]))
    sim.drive(dut.reading.last, lambda cycle: int(unit(cycle) == 2))
    over = sim.watch(dut.over)
    sim.run(EPOCHS * EPOCH)
    assert over.values[EPOCH - 1 :: EPOCH] == expected
    assert 40 < sum(expected) < 160
