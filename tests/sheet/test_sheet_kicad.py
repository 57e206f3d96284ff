"""KiCad's rules find no error, no warning and no pad that is not connected."""

import random
import re

import pytest
from sample import sample

from contactfpga import Skin
from contactfpga.design.sheet import SheetError, check, kicad, lay_out

pytestmark = pytest.mark.skipif(not check.there(), reason="KiCad 6 is not installed")

TILE = {"pitch_x_mm": 6.4, "pitch_y_mm": 6.4}
SKINS = {
    "8x8": (Skin(rows=8, columns=8, **TILE), "dome"),
    "16x16": (Skin(guard=True, **TILE), "dome"),
    "12x20": (Skin(rows=12, columns=20, row_drive="74hc595", column_read="74hc165"), "tact"),
    "24x32": (Skin(rows=24, columns=32, closed=True, surface="cylinder", radius_mm=40.0), "dome"),
    "finest": (Skin(rows=4, columns=6, pitch_x_mm=5.52, pitch_y_mm=5.2, guard=True), "dome"),
    "finest tact": (Skin(rows=4, columns=6, pitch_x_mm=7.0, pitch_y_mm=5.8, guard=True), "tact"),
    "64x64": (
        Skin(rows=64, columns=64, row_drive="74hc595", row_chains=2, column_read="74hc165", column_chains=4),
        "dome",
    ),
}


def findings(folder, skin, part):
    (folder / "sheet.kicad_pcb").write_text(kicad.board(lay_out(skin, part=part).drawing, "test"))
    (folder / "sheet.kicad_pro").write_text(kicad.project("sheet"))
    return check.findings(folder / "sheet.kicad_pcb")


@pytest.mark.parametrize(
    "name", sample(list(SKINS), quick={"8x8", "12x20", "finest"}, slow={"16x16", "24x32", "finest tact"})
)
def test_kicad_finds_nothing(tmp_path, name):
    assert findings(tmp_path, *SKINS[name]) == []


def drawn(seed):
    """A random Skin that can be built, and a switch."""
    dice = random.Random(seed)
    rows, columns, closed = dice.randint(1, 24), dice.randint(1, 24), dice.random() < 0.3
    values = {
        "rows": rows,
        "columns": max(columns, 8) if closed else columns,
        "pitch_x_mm": round(dice.uniform(5.6, 14), 3),
        "pitch_y_mm": round(dice.uniform(5.6, 14), 3),
        "guard": dice.random() < 0.5,
        "diodes": dice.choice(["col2row", "row2col"]),
        "mask": tuple((r, c) for r in range(rows) for c in range(columns) if dice.random() < dice.choice([0, 0.1])),
        "row_order": tuple(dice.sample(range(rows), rows)),
    }
    if closed:
        values |= {
            "closed": True,
            "surface": "cylinder",
            "radius_mm": round(values["columns"] * dice.uniform(1.2, 2.5), 3),
        }
        del values["pitch_x_mm"]
    if dice.random() < 0.3:
        values |= {"scan": "reversal", "precharge_us": 0.25}
    else:
        values |= {"row_drive": dice.choice(["direct", "74hc595"]), "column_read": dice.choice(["direct", "74hc165"])}
        values["row_chains"] = dice.randint(1, 2) if values["row_drive"] != "direct" and rows > 3 else 1
    return Skin(**values), dice.choice(["dome", "tact"])


@pytest.mark.parametrize("seed", sample(range(40), quick=range(2), slow=range(2, 5)))
def test_kicad_finds_nothing_on_random_sheets(tmp_path, seed):
    skin, part = drawn(seed)
    if refusal := refused(skin, part):
        assert re.match("(pitch_[xy]_mm|radius_mm|rows) is ", refusal)
    else:
        assert findings(tmp_path, skin, part) == []


def refused(skin, part):
    """Why a sheet is refused; nothing for one that is laid out."""
    try:
        lay_out(skin, part=part)
    except SheetError as error:
        return str(error)
    return ""


def test_most_random_sheets_are_laid_out():
    assert [bool(refused(*drawn(seed))) for seed in range(10)].count(True) <= 3
