"""KiCad's rules find no error, no warning and no pad that is not connected."""

import re

import pytest
from random_sheet import drawn, refused
from sample import sample

from contactfpga import Skin
from contactfpga.design.circuit import SILICON, Circuit
from contactfpga.design.circuit.values import Falling
from contactfpga.design.sheet import check, kicad, lay_out

pytestmark = pytest.mark.skipif(not check.there(), reason="KiCad 6 is not installed")

RULED = Circuit(falling=Falling(ruler_ohm=24_000), diode=SILICON)
TILE = {"pitch_x_mm": 6.4, "pitch_y_mm": 6.4}
SKINS = {
    "8x8": (Skin(rows=8, columns=8, **TILE), "dome"),
    "16x16": (Skin(guard=True, **TILE), "dome"),
    "12x20": (Skin(rows=12, columns=20, row_drive="74hc595", column_read="74hc165"), "tact"),
    "24x32": (Skin(rows=24, columns=32, closed=True, surface="cylinder", radius_mm=40.0), "dome"),
    "finest": (Skin(rows=4, columns=6, pitch_x_mm=5.52, pitch_y_mm=5.2, guard=True), "dome"),
    "finest tact": (Skin(rows=4, columns=6, pitch_x_mm=7.0, pitch_y_mm=5.8, guard=True), "tact"),
    "combs": (Skin(rows=9, columns=7, guard=True, precharge_us=1, ruler=31, **TILE), "combs"),
    "finest combs": (
        Skin(rows=4, columns=6, guard=True, precharge_us=1, ruler=31, pitch_x_mm=5.2, pitch_y_mm=5.2),
        "combs",
    ),
    "coarse combs": (Skin(rows=3, columns=4, guard=True, precharge_us=1, ruler=31), "combs"),
    "64x64": (
        Skin(rows=64, columns=64, row_drive="74hc595", row_chains=2, column_read="74hc165", column_chains=4),
        "dome",
    ),
}


def findings(folder, skin, part):
    layout = lay_out(skin, RULED, None, 7.0) if part == "combs" else lay_out(skin, part=part)
    (folder / "sheet.kicad_pcb").write_text(kicad.board(layout.drawing, "test"))
    (folder / "sheet.kicad_pro").write_text(kicad.project("sheet"))
    return check.findings(folder / "sheet.kicad_pcb")


@pytest.mark.parametrize(
    "name",
    sample(
        list(SKINS),
        quick={"8x8", "12x20", "finest", "combs", "finest combs"},
        slow={"16x16", "24x32", "finest tact", "coarse combs"},
    ),
)
def test_kicad_finds_nothing(tmp_path, name):
    assert findings(tmp_path, *SKINS[name]) == []


@pytest.mark.parametrize("seed", sample(range(40), quick=range(2), slow=range(2, 5)))
def test_kicad_finds_nothing_on_random_sheets(tmp_path, seed):
    skin, part = drawn(seed)
    if refusal := refused(skin, part):
        assert re.match("(pitch_[xy]_mm|radius_mm|rows) is ", refusal)
    else:
        assert findings(tmp_path, skin, part) == []


def test_most_random_sheets_are_laid_out():
    assert [bool(refused(*drawn(seed))) for seed in range(10)].count(True) <= 3
