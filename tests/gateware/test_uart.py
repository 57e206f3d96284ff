"""The UART's receiver, level by level; the transmitter is proved."""

import pytest
from wire import line

from contactfpga_hdl.link.uart import Receiver

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
