"""Pressure units: readings, thresholds and commands, in lockstep with the golden model."""

import random

import pytest

from contactfpga import Skin
from contactfpga_sim.cosim import bench_amaranth
from contactfpga_sim.cosim.compare import compare
from contactfpga_sim.golden import Timeline, predict
from contactfpga_sim.golden.request import command

SMALL = {"rows": 2, "columns": 2, "settle_us": 14, "release_us": 2, "clock_hz": 1_000_000, "baud": 250_000}
SKINS = {
    "sums": Skin(**SMALL, units=3, unit_sums=[[1, 1, 1], [127, -127, 3], [0, 0, -5], [1, -2, 1]]),
    "fail safe": Skin(**SMALL | {"clock_hz": 3_000_000, "baud": 750_000}, units=2, fail_safe=True, unit_sums=[[1, -1]]),
}


def play(skin, seed, cycles):
    """Random readings; zeros and thresholds that some of them reach; touches now and then."""
    rng = random.Random(seed)
    units, start = [], 0
    while start < cycles:
        units.append((start, [rng.choice([0, 4095, rng.randrange(4096)]) for _ in range(skin.units)]))
        start += rng.choice([7, 60, 500])
    received, at, number = [], 30, 129 * 128 + 1
    while at < cycles:
        what = rng.choice([3, 4, 4, 5, 1])
        value = rng.randrange(skin.units + 1) | rng.choice([0, rng.randrange(4096), rng.randrange(2**14)]) << 3
        data = command(number, what, value, bit_clocks=skin.clock_hz // skin.baud)
        received.append((at, data))
        at += 10 * skin.clock_hz // skin.baud * len(data) + rng.randrange(50)
        number += 2 if number % 8 == 7 else 1
    return Timeline([], received, units=units)


@pytest.mark.parametrize("name", SKINS)
def test_board_does_what_the_golden_model_says(name):
    skin, cycles = SKINS[name], 5_000
    timeline = play(skin, 3, cycles)
    expected = predict(skin, timeline, cycles)
    assert compare(expected, bench_amaranth.run(skin, timeline, cycles)) > 100
    assert len(expected.contact) >= 2
