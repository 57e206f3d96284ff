"""A scan that hands on only the rows that are touched: the records are those of the sheet."""

import numpy as np
import pytest

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_sim import golden
from contactfpga_sim.golden.trace import Timeline

ROWS = (0, 1, 2, 5)


@pytest.mark.parametrize(
    ("labeller", "expected"), [("single", {(4, 8)}), ("run", {(3, 3), (1, 5)}), ("projection", {(3, 3), (1, 5)})]
)
def test_a_zone_over_rows_that_were_skipped_has_its_place_on_the_sheet(labeller, expected):
    skin = Skin(
        scan="reversal", rows=7, columns=1, precharge_us=0.25, settle_us=0.5, labeller=labeller, clock_hz=24_000_000
    )
    cells = np.zeros((7, 1), bool)
    cells[list(ROWS)] = True
    trace = golden.predict(skin, Timeline([(0, cells, None)], ()), 1000)
    records = {data for _, data, end in trace.records if not end}
    derived = Derived(skin)
    shift = derived.area_bits + derived.sum_x_bits
    assert {(data & (1 << derived.area_bits) - 1, data >> shift) for data in records} == expected
