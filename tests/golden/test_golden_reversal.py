"""Line reversal in the golden model: what follows from its rules, worked out by hand."""

import numpy as np
import pytest
from reversal import small, zones

from contactfpga.choices.labellers import LABELLERS
from contactfpga.skin.derived import Widths
from contactfpga_sim.model.golden import Timeline, predict


@pytest.mark.parametrize("labeller", LABELLERS)
@pytest.mark.parametrize("rows", [(0,), (3,), (0, 3), (1, 5), (0, 1, 4, 5)])
def test_moments_of_zones_in_rows_that_were_driven_count_the_rows_between(labeller, rows):
    skin = small(rows=6, columns=3, labeller=labeller)
    cells = np.zeros((6, 3), bool)
    cells[list(rows), 1] = True
    widths = Widths(skin.sheet)
    records = [data for _, data, end in predict(skin, Timeline([(0, cells, None)]), 400).records if not end]
    low = widths.area_bits + widths.sum_x_bits
    found = sorted((data & (1 << widths.area_bits) - 1, data >> low) for data in set(records))
    if labeller == "single":
        assert found == [(len(rows), sum(rows))]
    else:
        assert found == sorted((area, sum_y) for area, _, sum_y in zones(cells, 8))
