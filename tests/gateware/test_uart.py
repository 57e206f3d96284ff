"""The UART's two halves, level by level."""

import pytest
from wire import line

from contactfpga_hdl.link.uart import Receiver, Transmitter

BIT_CLOCKS = (2, 3, 4, 104)
SAMPLED = (4, 5, 104)
"""With fewer clocks a board reads pulses."""


def reported(bench, bit_clocks, levels, idle=3):
    """Run the receiver on levels that start in cycle ``idle``; returns (cycle, level) of each data bit, and the cycles
    of good and of bad stop bits."""
    dut = Receiver(bit_clocks)
    sim = bench(dut)
    levels = [1] * idle + levels + [1] * 12 * bit_clocks
    sim.drive(dut.pin, lambda cycle: levels[cycle] if cycle < len(levels) else 1)
    bit, level, good, bad = (sim.watch(port) for port in (dut.bits.bit, dut.bits.level, dut.bits.good, dut.bits.bad))
    sim.run(len(levels))
    bits, *stops = ([cycle for cycle, high in enumerate(port.values) if high] for port in (bit, good, bad))
    return [(cycle, level[cycle]) for cycle in bits], *stops


def received(bench, bit_clocks, levels, idle=3):
    """Cycles of good stop bits."""
    return reported(bench, bit_clocks, levels, idle)[1]


def moment(bit_clocks, start):
    return start + 2 + bit_clocks // 2 + 9 * bit_clocks


@pytest.mark.parametrize("bit_clocks", BIT_CLOCKS)
def test_bytes_go_out_bit_by_bit_without_a_gap(bench, bit_clocks):
    data = [0x00, 0xFF, 0x55, 0xA6, 0x01, 0x80]
    dut = Transmitter(bit_clocks)
    sim = bench(dut)
    source = sim.source(dut.bytes, data)
    pin = sim.watch(dut.pin)
    sim.run(10 * bit_clocks * len(data) + 20)
    assert source.transfers == [index * 10 * bit_clocks for index in range(len(data))]
    assert pin.values == [1] + line(data, bit_clocks) + [1] * 19


@pytest.mark.parametrize("bit_clocks", BIT_CLOCKS)
def test_a_byte_starts_one_clock_after_its_transfer_and_the_line_rests_high(bench, rng, bit_clocks):
    data = [rng.randrange(256) for _ in range(12)]
    dut = Transmitter(bit_clocks)
    sim = bench(dut)
    source = sim.source(dut.bytes, data, rng, gap=1 - 1 / (12 * bit_clocks))
    pin = sim.watch(dut.pin)
    sim.run(2000 * bit_clocks, until=lambda: source.done)
    expected = [1] * len(pin.values)
    for start, byte in zip(source.transfers, data, strict=True):
        expected[start + 1 : start + 1 + 10 * bit_clocks] = line([byte], bit_clocks)
    assert pin.values == expected[: len(pin.values)]
    assert any(b - a > 10 * bit_clocks for a, b in zip(source.transfers, source.transfers[1:]))


@pytest.mark.parametrize("bit_clocks", SAMPLED)
def test_every_bit_is_reported_in_its_middle(bench, rng, bit_clocks):
    data = [0x00, 0xFF, 0x55, *(rng.randrange(256) for _ in range(5))]
    bits, good, bad = reported(bench, bit_clocks, line(data, bit_clocks), idle=5)
    first = 5 + 2 + bit_clocks // 2
    assert bits == [
        (first + (10 * index + 1 + place) * bit_clocks, byte >> place & 1)
        for index, byte in enumerate(data)
        for place in range(8)
    ]
    assert good == [moment(bit_clocks, 5 + 10 * bit_clocks * index) for index in range(len(data))]
    assert bad == []


@pytest.mark.parametrize("bit_clocks", [*SAMPLED, 9])
def test_a_low_pulse_counts_as_a_start_bit_from_half_a_bit_on(bench, bit_clocks):
    half = bit_clocks // 2
    for length in (1, half):  # the middle of the start bit is clock number `half`, from 0
        assert received(bench, bit_clocks, [0] * length, idle=5) == []
    assert received(bench, bit_clocks, [0] * (half + 1), idle=5) == [moment(bit_clocks, 5)]


@pytest.mark.parametrize("bit_clocks", SAMPLED)
def test_a_byte_with_a_low_stop_bit_is_no_byte(bench, bit_clocks):
    levels = line([0x33], bit_clocks)
    center = 9 * bit_clocks + bit_clocks // 2
    bits, good, bad = reported(bench, bit_clocks, levels[:-bit_clocks] + [0] * (bit_clocks // 2 + 1))
    assert (good, bad) == ([], [moment(bit_clocks, 3)])
    assert [level for _, level in bits] == [1, 1, 0, 0, 1, 1, 0, 0]
    spike = list(levels)
    spike[center] = 0  # only the middle of the stop bit counts
    assert received(bench, bit_clocks, spike) == []
    spike = list(levels)
    spike[center - 1] = 0
    assert received(bench, bit_clocks, spike) == [moment(bit_clocks, 3)]


@pytest.mark.parametrize("bit_clocks", SAMPLED)
def test_nothing_is_received_during_a_break_and_the_next_byte_is(bench, bit_clocks):
    pause = [0] * 10 * bit_clocks * 3
    rest = [1] * 12 * bit_clocks  # what the end of the break looks like is over by then
    found = received(bench, bit_clocks, pause + rest + line([0xC5], bit_clocks))
    assert [cycle for cycle in found if cycle < 3 + len(pause)] == []
    assert found[-1] == moment(bit_clocks, 3 + len(pause) + len(rest))


@pytest.mark.parametrize("bit_clocks", [16, 104])
@pytest.mark.parametrize("error", [-0.02, 0.02])
def test_a_rate_two_per_cent_off_is_received(bench, rng, bit_clocks, error):
    data = [rng.randrange(256) for _ in range(6)]
    bit = bit_clocks * (1 + error)
    bits = line(data, 1)
    levels = [bits[int(clock / bit)] for clock in range(int(len(bits) * bit))]
    found = received(bench, bit_clocks, levels, idle=3)
    starts = [3 + next(c for c in range(len(levels)) if c >= 10 * bit * index) for index in range(len(data))]
    assert found == [moment(bit_clocks, start) for start in starts]
