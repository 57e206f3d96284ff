"""The USB bridge's model: every phase against a chip that is stepped byte by byte, and sums by hand."""

import dataclasses
import itertools
import random

import numpy as np
import pytest
from bridge_oracle import brute

from contactfpga.boards import BOARDS
from contactfpga.boards.spec import Bridge
from contactfpga_sim.apps.latency.spread import MixedTimes, Spread, summed
from contactfpga_sim.apps.latency.usb import BridgeChip, BridgeSettings, ByteStream, delivered

MHZ = 12
CLOCK_HZ = MHZ * 1_000_000
BYTE = 40
"""Clocks of a byte at 3 Mbaud."""
FAST = BOARDS["icebreaker"].bridge
SLOW = BOARDS["ulx3s-12f"].bridge
HIGH_US = {n: 8 * (55 + 2 + n) / 480 for n in range(600)}
"""What a high-speed packet with n bytes takes on the bus: USB 2.0, table 5-10."""


def packet(start, size):
    """A packet of this many bytes from a clock on, back to back, its delimiter last."""
    return [(start + BYTE * (number + 1), 0 if number == size - 1 else 7) for number in range(size)]


def stream(*packets, since=-48_000, until=60_000):
    times, values = zip(*itertools.chain(*packets), strict=True)
    return ByteStream(np.array(times), np.array(values), since, until)


def end_us(line, byte):
    return line.times[byte] / MHZ


@pytest.mark.parametrize("board", list(BOARDS))
def test_each_board_has_the_packets_and_frames_of_its_bridge(board):
    chip = BOARDS[board].bridge
    high = chip.chip in ("FT2232H", "FT232H")
    assert (chip.frame_us, chip.payload_bytes) == ((125, 510) if high else (1000, 62))


def test_a_packet_that_no_timer_meets_takes_a_microframe_to_the_digit():
    """Two packets in a row: the first one starts the timer anew, so it cannot run out within the second."""
    line = stream(packet(1000, 17), packet(3000, 17))
    late = delivered(BridgeSettings(FAST), CLOCK_HZ, line, 33)
    at = end_us(line, 33)
    assert late.low.min() == pytest.approx(at + HIGH_US[17], abs=1e-9)
    assert late.worst == pytest.approx(at + 125 + HIGH_US[17], abs=1e-9)
    for share in (0.01, 0.25, 0.5, 0.99):
        assert late.quantile(share) == pytest.approx(at + HIGH_US[17] + 125 * share, abs=1e-9)


@pytest.mark.parametrize("seed", range(12))
def test_every_phase_is_that_of_a_chip_stepped_frame_by_frame(seed):
    rng = random.Random(seed)
    chip = rng.choice([FAST, SLOW, dataclasses.replace(FAST, high_speed=False), Bridge("tiny", (0, 0), None, 1, True)])
    settings = BridgeSettings(chip, rng.choice([1, 2, 3]), rng.choice([0, 0, None]), rng.choice([1, 4, 10]))
    period = settings.period_us * MHZ
    packets, at = [], -2 * period
    while at < period:
        size = rng.choice([1, 2, 5, 17, 80])
        packets.append(packet(at, size))
        at += BYTE * size + rng.choice([0, 1, 500, 1151, 9000])
    line = stream(*packets, since=-2 * period, until=at + 3 * period)
    inside = [number for number, time in enumerate(line.times) if time > 0 and line.values[number] == 0]
    byte = rng.choice(inside)
    late = delivered(settings, CLOCK_HZ, line, byte)
    assert late.weight.sum() == pytest.approx(1)
    origin = line.since - line.since % (settings.chip.frame_us * MHZ // settings.asks)
    count = 300
    for number in range(count):
        share = (number + 0.377) / count
        place = int(np.searchsorted(np.cumsum(late.weight), share))
        phase = origin / MHZ + settings.period_us * share
        within = share - np.cumsum(late.weight)[place] + late.weight[place]
        found = late.low[place] + within / late.weight[place] * (late.high[place] - late.low[place])
        assert found == pytest.approx(brute(settings, MHZ, line, byte, phase), abs=1e-6)


@pytest.mark.parametrize("event", [0, None])
def test_the_chip_that_is_stepped_sends_the_same(event):
    settings = BridgeSettings(FAST, 1, event)
    line = stream(*(packet(1152 * number, 17) for number in range(-40, 40)), until=80_000)
    byte = 17 * 60 + 16
    late = delivered(settings, CLOCK_HZ, line, byte)
    for place in range(0, len(late.low), 7):
        middle = (late.low[place] + late.high[place]) / 2
        share = np.cumsum(late.weight)[place] - late.weight[place] / 2
        phase = (line.since + settings.period_us * MHZ * share) / MHZ
        chip = BridgeChip(FAST.payload_bytes, 1000, event, sent=phase - 1000)
        for time, value in zip(line.times / MHZ, line.values):
            chip.put(time, int(value))
        before, at = 0, phase
        while before <= byte:
            packets = chip.take(at)
            sizes = list(itertools.accumulate(map(len, packets), initial=before))
            before, at = sizes[-1], at + 125
        there = next(number for number, size in enumerate(sizes) if size > byte)
        bus = sum(settings.packet_us(len(one)) for one in packets[:there])
        assert at - 125 + bus == pytest.approx(middle, abs=1e-6)


def test_a_delimiter_that_is_the_first_byte_of_its_packet_closes_none():
    """AN232B-04, "Event Characters"; it is what the worst phase of a single packet costs."""
    chip = BridgeChip(FAST.payload_bytes, 1000, 0)
    assert chip.take(1000) == [b""]
    chip.put(1001, 0)
    assert chip.take(1125) == []
    assert chip.take(2000) == [b"\0"]
    late = delivered(BridgeSettings(FAST), CLOCK_HZ, stream(packet(1000, 17)), 16)
    assert late.worst - late.quantile(0.99) > 800


@pytest.mark.parametrize("asks", [1, 10])
def test_a_second_delimiter_closes_what_meets_an_emptied_chip(asks):
    line = stream(packet(1000, 18), since=-48_000)
    line.values[-2] = 0
    late = delivered(BridgeSettings(FAST, asks=asks), CLOCK_HZ, line, 16)
    assert late.worst <= end_us(line, 17) + 125 / asks + HIGH_US[17] + 1e-9


def test_what_cannot_be_told_is_refused():
    line = stream(packet(1000, 17), since=0, until=2000)
    with pytest.raises(ValueError, match="byte 16 comes before the chip has sent once"):
        delivered(BridgeSettings(FAST), CLOCK_HZ, line, 16)
    short = stream(packet(1000, 17), until=2000)
    with pytest.raises(ValueError, match="byte 16 is not delivered before the stream ends"):
        delivered(BridgeSettings(FAST), CLOCK_HZ, short, 16)
    with pytest.raises(ValueError, match="timer_ms is 0; it must be from 1 to 255"):
        BridgeSettings(FAST, 0)


def test_quantiles_of_single_times_and_of_spread_ones():
    assert MixedTimes.of([4.0, 1.0, 2.0, 3.0]).spread() == Spread(2.5, 4.0, 4.0)
    assert MixedTimes.of([5.0]).spread() == Spread(5.0, 5.0, 5.0)
    even = MixedTimes(np.array([0.0, 10.0]), np.array([2.0, 10.0]), np.array([0.5, 0.5]))
    assert even.quantile(0.25) == pytest.approx(1.0)
    assert even.quantile(0.5) == pytest.approx(6.0), "the middle of the gap"
    assert even.quantile(0.51) == 10.0
    assert even.share(np.array([-1.0, 1.0, 5.0, 10.0, 11.0])).tolist() == pytest.approx([0, 0.25, 0.5, 1, 1])
    both = MixedTimes.mixed([even, MixedTimes.of([20.0])])
    assert both.weight.sum() == pytest.approx(1)
    assert both.worst == 20.0


def test_a_sum_is_that_of_all_pairs():
    one, other = MixedTimes(np.array([0.0]), np.array([8.0]), np.array([1.0])), MixedTimes.of([1.0, 3.0])
    places = np.add.outer((np.arange(20_000) + 0.5) / 2500, [1.0, 3.0])
    for share in (0.1, 0.5, 0.99):
        assert summed(one, other, share) == pytest.approx(np.quantile(places, share), abs=1e-3)
    assert summed(one, other, 1.0) == pytest.approx(11.0)
