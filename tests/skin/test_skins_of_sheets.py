"""Which sheets one FPGA can serve together."""

from pathlib import Path

import pytest

from contactfpga import Skin, SkinError, examples
from contactfpga.skin.several import Several

REGISTERS = {"row_drive": "74hc595", "column_read": "74hc165"}
SKIN = Skin(**REGISTERS)


def test_the_example_is_two_sheets():
    several = Several.load(examples() / "two-sheets.toml")
    assert [(skin.name, skin.rows, skin.columns) for skin in several.skins] == [("chest", 16, 16), ("back", 12, 24)]
    assert (several.clock_hz, several.baud) == (12_000_000, 3_000_000)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"clock_hz": 24_000_000}, "sheet 1: clock_hz is 24000000, that of sheet 0 is 12000000"),
        ({"baud": 1_000_000}, "sheet 1: baud is 1000000, that of sheet 0 is 3000000"),
        ({"row_drive": "direct"}, "sheet 1: row_drive is 'direct'.*set row_drive = '74hc595'"),
        ({"column_read": "direct"}, "sheet 1: column_read is 'direct'"),
        ({"dual": True}, "sheet 1: dual is True"),
        ({"units": 3, "baud": 3_000_000}, "sheet 1: units is 3"),
    ],
)
def test_sheets_that_do_not_go_together_are_refused(changes, words):
    with pytest.raises(SkinError, match=words):
        Several((SKIN, Skin(**(REGISTERS | changes))))


@pytest.mark.parametrize("count", [0, 1, 17])
def test_there_are_two_to_sixteen_sheets(count):
    with pytest.raises(SkinError, match=f"there are {count} sheets; one FPGA serves 2 to 16"):
        Several((SKIN,) * count)
    assert len(Several((SKIN,) * 16).skins) == 16


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no key 'sheets'"),
        ("sheets = []\nbaud = 3", "unknown key 'baud'"),
        ("sheets = 3", "sheets is 3; it must be a list of Skin files"),
        ("sheets = [3]", r"sheets is \[3\]; it must be a list of Skin files"),
        ("sheets = ['a.toml']", "several.toml: there are 1 sheets"),
        ("sheets = ['a.toml', 'b.toml']", "several.toml: sheet 1: baud is 1000000"),
    ],
)
def test_a_file_that_is_wrong_is_named(tmp_path: Path, text, words):
    (tmp_path / "a.toml").write_text(SKIN.to_toml())
    (tmp_path / "b.toml").write_text(SKIN.replace(baud=1_000_000).to_toml())
    (tmp_path / "several.toml").write_text(text)
    with pytest.raises(SkinError, match=words):
        Several.load(tmp_path / "several.toml")


def test_a_file_of_sheets_is_no_skin():
    with pytest.raises(
        SkinError, match=r"names the Skins of several sheets; name one of them, or give all as --sheets"
    ):
        Skin.load(examples() / "two-sheets.toml")
