"""What a fault does to the pins: ``contact`` with ``fail_safe``, and ``alive``."""

import itertools

import numpy as np
import pytest
from sample import sample

from contactfpga import Skin
from contactfpga_hdl.link.alive import Alive
from contactfpga_hdl.scan import raster, reversal
from contactfpga_sim.model.golden import Timeline, guard, predict
from contactfpga_sim.model.golden.trace import Cuts
from contactfpga_sim.verify.cosim import bench_amaranth
from contactfpga_sim.verify.cosim.compare import compare

FIELDS = {
    "rows": 2, "columns": 2, "settle_us": 14, "release_us": 2, "clock_hz": 1_000_000, "baud": 250_000,
    "send": "on_change", "keep_alive_ms": 20, "alive": True, "fail_safe": True,
}  # fmt: skip
GUARDED = Skin(**FIELDS, guard=True, row_order=(1, 0), column_order=(1, 0))
SKINS = {
    "guarded": GUARDED,
    "no guard lines": Skin(**FIELDS),
    "reversal": Skin(**FIELDS | {"scan": "reversal", "settle_us": 2, "precharge_us": 1, "project_us": 2}),
    "slow frames": Skin(**FIELDS | {"settle_us": 700, "fail_safe": False}, guard=True),
}
NOTHING = np.zeros((2, 2), bool)


def events(skin: Skin, cycles: int, pause: int) -> Timeline:
    """Now and then a touch, a stuck column or a cut line, for a time around a tick of the alive pin."""
    rng = np.random.default_rng(skin.guard + 2 * (skin.scan == "raster"))
    pieces, cuts, start = [(0, NOTHING, None)], [(0, Cuts())], 50
    while start < cycles:
        end = start + int(rng.integers(1, 900))
        kind = rng.choice(["touch", "stuck", "cut"] if skin.guard else ["touch", "stuck"])
        if kind == "cut":
            cuts += [(start, Cuts({int(rng.integers(3)): 0})), (end, Cuts())]
        else:
            stuck = rng.random(2) < 0.7 if kind == "stuck" else None
            pieces += [(start, rng.random((2, 2)) < 0.5, stuck), (end, NOTHING, None)]
        start = end + int(rng.integers(1, pause))
    return Timeline(pieces, cuts=cuts)


@pytest.mark.whole
@pytest.mark.parametrize("name", sample(SKINS, quick=["guarded", "reversal"]))
def test_both_pins_are_the_golden_models_in_every_clock(name, monkeypatch):
    """``contact`` and ``alive`` as the golden model predicts, in Amaranth's simulator. Reports of faulty lines are
    renewed every 512 us."""
    for scan in (raster, reversal):
        monkeypatch.setattr(scan, "RETRY_BIT", 9)
    monkeypatch.setattr(guard, "RETRY_US", 2**9)
    skin = SKINS[name]
    cycles = 20_000 if name == "slow frames" else 5_000
    pause = {"slow frames": 9_000, "guarded": 700, "reversal": 4_000}.get(name, 1_500)
    timeline = events(skin, cycles, pause)
    expected = predict(skin, timeline, cycles)
    assert compare(expected, bench_amaranth.run(skin, timeline, cycles)) > 20
    assert expected.alive


def test_alive_turns_where_all_was_well_since_the_last_tick(bench, rng):
    """``alive`` toggles at a tick if all was well since the last one, also if it was well in the clock of a tick,
    before or after it, or while a fault is reported."""
    cycles, period = 6_000, 7
    well = [int(rng.random() < 0.15) for _ in range(cycles)]
    fault = [int(rng.random() < 0.1) for _ in range(cycles)]
    dut = Alive(1)
    dut.tick_clocks = period
    sim = bench(dut)
    sim.drive(dut.well, well.__getitem__)
    sim.drive(dut.fault, fault.__getitem__)
    pin = sim.watch(dut.pin)
    sim.run(cycles - 1)
    level, expected = 0, []
    for cycle in range(cycles - 1):
        expected.append(level)
        if cycle % period == period - 1:
            since = range(max(0, cycle - period), cycle)
            level ^= any(well[seen] and not any(fault[seen:cycle]) for seen in since)
    assert pin.values == expected
    assert 100 < sum(one != other for one, other in itertools.pairwise(expected)) < cycles // period - 100
