"""Resistive cells: their law, and the tables of a Skin's file.

What only this kills: a share of the data sheet that acts the wrong way, a cell without its break force, a cover whose
cells and switches contradict each other, and a table that is not read back as it was written.
"""

import tomllib

import numpy as np
import pytest

from contactfpga.design.cover import CoverError, Switch
from contactfpga.design.cover.cell import read_cell
from contactfpga.design.cover.press import read_cover, write_cover

INK = read_cell({"material": "fsr402"})


def test_the_ink_has_the_resistances_of_its_data_sheet():
    ohm = INK.ohm(np.array([0.09, 0.1, 1.0, 100.0]))
    assert ohm == pytest.approx([np.inf, 31_100, 6_200, 247], rel=0.01)
    one = np.array(1.0)
    assert INK.ohm(one, celsius=85.0) / INK.ohm(one) == pytest.approx(0.85)
    assert INK.ohm(one, seconds=100.0) / INK.ohm(one) == pytest.approx(0.90)
    assert INK.ohm(one, falling=True) / INK.ohm(one) == pytest.approx(0.90)
    assert INK.ohm(np.array(1e4)) == INK.least_ohm


def test_a_sheets_cells_differ_as_stated_and_its_switch_closes_at_the_level():
    cell = read_cell({"material": "velostat", "preload_n": 0.02, "level_n": 0.1})
    gains, preload_n = cell.drawn((64, 64), 3)
    assert np.log(gains).std() == pytest.approx(cell.spread, rel=0.05)
    assert np.sqrt((preload_n**2).mean()) == pytest.approx(0.02, rel=0.05)
    assert preload_n.min() >= 0
    assert INK.switch.force_n == INK.level_n
    opens_n = INK.switch.force_n * (1 - INK.switch.hysteresis)
    assert INK.ohm(np.array(opens_n), falling=True) == pytest.approx(INK.level_ohm)


def test_a_cover_with_cells_is_read_back_as_it_was_written():
    cover = read_cover({"model": "foam", "cell": {"material": "fsr402", "spread": 0.2}})
    assert cover.cell.spread == 0.2
    assert cover.switch == cover.cell.switch != Switch()
    assert read_cover(tomllib.loads(write_cover(cover))["cover"]) == cover


@pytest.mark.parametrize(
    ("cell", "others", "message"),
    [
        ({"material": "wood"}, {}, "material in [cover.cell] is 'wood'; it must be one of fsr402, velostat"),
        ({"level_n": 0.05}, {}, "break_n in [cover.cell] is 0.1; it must lie between 0 and 0.05"),
        ({"spread": "a"}, {}, "spread in [cover.cell] is 'a'; it must lie between 0 and 1"),
        ({"ohms": 1}, {}, "unknown key 'ohms' in [cover.cell]"),
        ({}, {"switch": {}}, "[cover] has cell and switch; leave one of them out"),
        ({}, {"model": "patch"}, "the model 'patch' knows no force, by which cells change"),
    ],
)
def test_a_cell_that_cannot_be_is_refused(cell, others, message):
    with pytest.raises(CoverError) as caught:
        read_cover({"model": "foam", "cell": {"material": "fsr402"} | cell} | others)
    assert message in str(caught.value)
