"""Lines that are driven against each other are reported by the sheet that the gateware is simulated with."""

import numpy as np
import pytest
from reversal import FAST, never_let_go, small

from contactfpga.skin import Skin
from contactfpga_sim.model.golden import Timeline
from contactfpga_sim.model.sheet.matrix import Contention, Matrix
from contactfpga_sim.verify.cosim import bench_amaranth


@pytest.fixture
def wrong(monkeypatch):
    never_let_go(monkeypatch)


def touch(skin: Skin) -> Timeline:
    cells = np.zeros((skin.rows, skin.columns), bool)
    cells[1, 0] = True
    return Timeline([(100, cells, None)])


@pytest.mark.parametrize(
    "skin",
    [
        small(rows=2, columns=2),
        small(rows=2, columns=2, diodes="row2col"),
        Skin(rows=2, columns=2, settle_us=3.0, precharge_us=0.5),
    ],
    ids=lambda skin: f"{skin.scan}-{skin.diodes}",
)
def test_in_amaranths_simulator(wrong, skin):
    with pytest.raises(Contention, match=r"columns 0b1 are driven against rows 0b10"):
        bench_amaranth.run(skin, touch(skin), 400)


# ---- the sheet's levels


def test_a_driven_column_and_a_selected_row_meet_in_a_pressed_switch_only():
    matrix = Matrix(FAST)
    matrix.press([0b110, *[0] * 15])
    everything = 0xFFFF
    assert matrix.levels(everything ^ 1, everything, 0) == everything ^ 0b110
    assert matrix.levels(everything ^ 1, everything, 0b1001) == everything ^ 0b110, "other columns may be driven"
    assert matrix.levels(everything, everything, everything) == everything, "as all may while no row is selected"
    assert matrix.levels(everything ^ 1, everything ^ 1, everything) == everything, "or while it is let go"
    with pytest.raises(Contention, match=r"columns 0b100 are driven against rows 0b1$"):
        matrix.levels(everything ^ 1, everything, 0b100)


@pytest.mark.parametrize("diodes", ["col2row", "row2col"])
def test_rows_that_are_let_go_show_driven_columns_through_pressed_switches(diodes):
    """Released rows read the level of driven columns through pressed switches, others that of their pulls; a stuck
    column feeds none."""
    skin = small(rows=4, columns=4, diodes=diodes)
    matrix = Matrix(skin)
    matrix.press([0b0001, 0b0110, 0, 0b1000], np.array([False, False, True, False]))
    invert = 0 if diodes == "col2row" else 0b1111
    assert matrix.row_levels(0, 0, 0b1111) ^ invert == 0b1011
    assert matrix.row_levels(0, 0, 0b1110) ^ invert == 0b1010
    assert matrix.row_levels(0, 0, 0b1100) ^ invert == 0b1000, "column 2 is stuck"
    assert matrix.row_levels(0, 0, 0) ^ invert == 0
    assert matrix.row_levels(0b0101, 0b1111, 0b1111) == 0b0101, "what is driven is what is driven"
