"""Every built-in choice, whatever it is: the gateware does what the golden model says in every clock."""

import numpy as np
import pytest

from contactfpga import Skin
from contactfpga.choices.converters import CONVERTERS
from contactfpga.choices.debounces import DEBOUNCES
from contactfpga.choices.labellers import LABELLERS
from contactfpga.choices.scans import SCANS
from contactfpga_sim.model.golden import Timeline, predict
from contactfpga_sim.verify.cosim import bench_amaranth
from contactfpga_sim.verify.cosim.compare import compare

SMALL = {"rows": 3, "columns": 4, "settle_us": 40, "release_us": 3, "clock_hz": 1_000_000, "baud": 250_000}
CHOICES = {"labeller": LABELLERS, "scan": SCANS, "debounce": DEBOUNCES, "converter": CONVERTERS}
CASES = [(field, name) for field, choices in CHOICES.items() for name in choices]


def skin_of(field, name):
    """A small Skin with this choice and what it needs, told from the registry."""
    needs = {"precharge_us": 1.0} if field == "scan" and SCANS[name].reads_rows else {}
    if field == "converter":
        needs = {"units": 2, "unit_sums": [[1, -1]]}
    if field == "debounce" and DEBOUNCES[name].gateware:
        needs = {"debounce_press_us": 300.0, "debounce_release_us": 200.0}
    return Skin(**SMALL | {field: name} | needs)


@pytest.mark.parametrize(("field", "name"), CASES)
def test_a_choice_does_what_its_golden_rule_says(field, name):
    skin = skin_of(field, name)
    frames = np.random.default_rng(5).random((8, skin.rows, skin.columns)) < 0.35
    timeline = Timeline.frames(skin, frames)
    cycles = 3_000
    assert compare(predict(skin, timeline, cycles), bench_amaranth.run(skin, timeline, cycles)) > 100
