"""`contactfpga sheet`: its files, what it prints, and how it fails."""

import json
import re
import shlex
from pathlib import Path

import pytest

from contactfpga.design.circuit import load_circuit
from contactfpga.design.sheet import check
from contactfpga.shipped import examples
from contactfpga.skin import Skin
from contactfpga.tools import cli

DOCS = Path(__file__).resolve().parents[2] / "docs"
ALL = {
    *(f"sheet-{side}-{kind}.gbr" for side in ("top", "bottom") for kind in ("copper", "mask", "paste", "print")),
    *("sheet-edge.gbr", "sheet-plated.drl", "sheet-unplated.drl", "sheet.ipc", "sheet.net"),
    *("sheet.kicad_pcb", "sheet.kicad_pro", "sheet.svg", "sheet-caps.stl", "skin.toml"),
    *("sheet-parts.csv", "sheet-placement.csv", "sheet-connectors.csv"),
}


@pytest.fixture
def skin(tmp_path):
    path = tmp_path / "my.toml"
    text = "rows = 4\ncolumns = 4\npitch_x_mm = 6.4\npitch_y_mm = 6.4\n"
    path.write_text(text, encoding="utf-8-sig")  # with a byte order mark, as some editors write it
    return path


def test_all_files_are_there_and_the_circuit_is_complete(tmp_path, skin, capsys):
    out = tmp_path / "out"
    assert cli.main(["sheet", str(skin), "-o", str(out), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert {path.name for path in out.iterdir()} == ALL == set(answer["files"])
    circuit = load_circuit(out / "skin.toml")
    assert Skin.load(out / "skin.toml") == Skin.load(skin)
    assert {name: getattr(circuit, name) for name in answer["circuit"]} == answer["circuit"]
    assert answer["parts"]["DOME_5MM_4LEG"] == 16
    assert answer["caps"]["gap_mm"] == 0.6
    assert answer["kicad"] is None


def test_text_says_the_same(tmp_path, skin, capsys):
    cli.main(["sheet", str(skin), "-o", str(tmp_path / "out"), "--json"])
    answer = json.loads(capsys.readouterr().out)
    cli.main(["sheet", str(skin), "-o", str(tmp_path / "my sheet")])
    said = capsys.readouterr().out
    next_step = " ".join(said.partition("next: ")[2].split())
    assert shlex.split(next_step) == ["contactfpga", "settle", "--skin", str(tmp_path / "my sheet" / "skin.toml")]
    assert "{:.1f} x {:.1f} mm".format(*answer["board_mm"]) in said
    for name, value in answer["circuit"].items():
        assert f"{name} = {value:g}\n" in said
    assert "16 of 5.8 mm, 0.6 mm apart" in said


@pytest.mark.parametrize(("pitch", "step"), [(6.4, "a larger pitch, or the part dome\n"), (5.08, "a larger pitch\n")])
def test_a_cell_finer_than_its_parts_is_refused_in_one_line(tmp_path, skin, capsys, pitch, step):
    skin.write_text(skin.read_text().replace("6.4", str(pitch)))
    assert cli.main(["sheet", str(skin), "-o", str(tmp_path / "new" / "out"), "--part", "tact"]) == 1
    said = capsys.readouterr().err
    assert f"pitch_x_mm is {pitch}; a cell with TACT_4.5MM" in said
    assert said.endswith(f"choose {step}")
    assert not (tmp_path / "new").exists()


@pytest.mark.skipif(not check.there(), reason="KiCad 6 is not installed")
def test_check_asks_kicad(tmp_path, skin, capsys, monkeypatch):
    assert cli.main(["sheet", str(skin), "-o", str(tmp_path / "out"), "--kicad"]) == 0
    assert "KiCad: 0 findings" in capsys.readouterr().out
    monkeypatch.setattr(check, "findings", lambda board: ["[clearance]: too near"])
    assert cli.main(["sheet", str(skin), "-o", str(tmp_path / "out"), "--kicad"]) == 1
    assert "too near" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--edge-mm", "3"], "7"),
        (["--part", "spring"], "spring"),
        (["--cable", "-1"], "-1"),
    ],
)
def test_values_out_of_range_are_refused(tmp_path, skin, capsys, arguments, message):
    with pytest.raises(SystemExit):
        cli.main(["sheet", str(skin), "-o", str(tmp_path / "out"), *arguments])
    assert message in capsys.readouterr().err


def test_the_figures_of_the_page_are_those_of_the_command(tmp_path, capsys):
    cli.main(["sheet", str(examples() / "tiles.toml"), "-o", str(tmp_path)])
    said, page = capsys.readouterr().out, (DOCS / "sheet.md").read_text(encoding="utf-8")
    lowest, highest = re.search(r"rows (\S+) to (\S+) ohm", said).groups()
    assert f"rows have {lowest} to {highest} Ω" in page
