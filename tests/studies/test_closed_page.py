"""What the page on labelling states of closed sheets."""

import pytest
from study_pages import outdated, section

from contactfpga.choices.labellers import LABELLERS
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.closed import tables


def test_the_clocks_of_run_are_up_to_date():
    labeller = LABELLERS["run"]
    cells = (*tables.names(labeller, 8), *tables.worst(labeller, 8), *tables.most(labeller, 8))
    assert writer.line(cells) in section("labelling.md", "closed").splitlines()


def test_the_bound_of_run_is_half_the_columns_and_four():
    """C/2 + 4 clocks after the last row."""
    for columns, bound in zip((8, 16, 32, 64), tables.most(LABELLERS["run"], 8), strict=True):
        assert int(bound) == columns / 2 + 4


@pytest.mark.campaign
def test_all_tables_are_up_to_date():
    assert not outdated("closed")
