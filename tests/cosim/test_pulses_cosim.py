"""Boards that read pulses do what the golden model predicts, whatever the host sends them."""

import numpy as np
import pytest

from contactfpga.skin import Skin
from contactfpga_sim.model.golden import Timeline, predict
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.request import heard
from contactfpga_sim.verify.cosim import bench_amaranth, bench_native
from contactfpga_sim.verify.cosim.compare import compare
from contactfpga_sim.verify.cosim.covering import stimulus, traffic


@pytest.mark.parametrize("baud", [12_000_000, 8_000_000])
@pytest.mark.parametrize("bench", [bench_amaranth, pytest.param(bench_native, marks=pytest.mark.campaign)])
def test_gateware_and_golden_model_agree_at_two_and_three_clocks_a_bit(baud, bench):
    skin = Skin(rows=2, columns=3, clock_hz=24_000_000, baud=baud, settle_us=1.0, release_us=0.5)
    cycles = 6_000 if bench is bench_amaranth else 400_000
    rng = np.random.default_rng(baud)
    gaps = rng.choice([0, 1, 7, 100, 500], size=cycles // 500).tolist()
    pieces = stimulus(skin, cycles, seed=1).pieces
    timeline = Timeline(pieces, traffic(skin, gaps, 17, cycles, rng))
    asked = heard(timeline.received, facts(skin).bit_clocks).requests
    assert len(asked) >= 2
    expected = predict(skin, timeline, cycles)
    assert compare(expected, bench.run(skin, timeline, cycles)) > cycles // 10
