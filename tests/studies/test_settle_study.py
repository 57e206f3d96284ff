"""Break points of a precharged scan: found again where the page says, and against closed forms."""

from pathlib import Path

import numpy as np
import pytest
from study_pages import section

from contactfpga.design.circuit import Circuit
from contactfpga_sim.lab.settle import breaks, tables

PAGE = Path(__file__).resolve().parents[2] / "docs" / "settle.md"


@pytest.mark.parametrize("name", breaks.KNOBS)
def test_each_break_is_found_again_on_both_of_its_sides(name):
    """The values before and after the break of each run's first one, as the page has them."""
    knob = breaks.KNOBS[name]
    run = next(iter(knob.runs))
    row = next(line for line in section("settle.md", "breaks").splitlines() if f"| {knob.title}: " in line).split(" | ")
    holds, fails = (float(row[index].strip("*").replace(",", "")) for index in (2, 3))
    assert row[1] == run
    assert knob.values.index(fails) == knob.values.index(holds) + 1
    assert knob.runs[run](holds).right
    assert not knob.runs[run](fails).right


def test_coupling_breaks_where_capacitances_divide():
    """Neighbors fall by almost the whole supply; the column keeps what its other capacitances hold."""
    knob = breaks.KNOBS["coupling"]
    for picofarad in (5.0, 20.0, 50.0):
        fallen = 3.3 - knob.runs["16x16, 30 pF a line"](picofarad).amount
        divided = (2 * picofarad * 3.15 + 2 * 3.3) / (30 + 2 * picofarad + 16 * 2)
        assert fallen == pytest.approx(divided, rel=0.06)


def test_a_shorted_diode_carries_what_its_resistances_let_through():
    found = tables.row_time(tables.sheet(1))
    selecting = (found.seconds > 0.4e-6 + 0.04e-6) & (found.seconds < 0.75e-6)
    row = tables.patterns.middle(tables.SIZE)
    into = -found.pin_ma(row)[selecting]
    # Pin, switch, switch, series resistance and pin; the diode at 10 mA.
    junction = 0.02687 * np.log(into[-1] * 1e-3 / Circuit().diode.saturation_a)
    assert into[-1] == pytest.approx((3.3 - junction) / (40 + 100 + 100 + 4 + 40) * 1e3, rel=0.01)
    assert into == pytest.approx(into[-1], rel=0.01)


def test_no_current_flows_before_the_row_is_selected():
    found = tables.row_time(tables.sheet(3))
    before = (found.seconds > 0.1e-6) & (found.seconds < 0.28e-6)
    assert np.abs(found.amperes[before, : tables.SIZE]).max() < 0.5e-3  # what pulls feed
    assert tables.flowing_us(found, tables.patterns.middle(tables.SIZE)) == pytest.approx(0.5, abs=0.05)


def test_without_a_shorted_diode_the_pins_carry_what_pulls_feed():
    found = tables.row_time(tables.sheet(0))
    row = tables.patterns.middle(tables.SIZE)
    last = int(np.flatnonzero(found.seconds < 0.79e-6)[-1])
    assert abs(found.pin_ma(row)[last]) < 0.1
