"""`contactfpga sheet`: its files, what it prints, and how it fails."""

import dataclasses
import json
import re
import shlex
import zipfile
from pathlib import Path

import pytest
import trimesh

from contactfpga.design.circuit import load_circuit
from contactfpga.design.sheet import check
from contactfpga.shipped import examples
from contactfpga.skin import Skin
from contactfpga.tools import cli

DOCS = Path(__file__).resolve().parents[2] / "docs"
ALL = {
    *("sheet-board.zip", "sheet-bom.csv", "sheet-cpl.csv", "sheet-assembly.svg", "sheet-connectors.csv"),
    *("sheet.kicad_pcb", "sheet.kicad_pro", "sheet.net", "sheet.svg", "sheet-caps.stl", "sheet-frame.stl", "skin.toml"),
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
    given = {name: one["needed"] for name, one in answer["times"].items()}
    assert Skin.load(out / "skin.toml") == dataclasses.replace(Skin.load(skin), **given)
    note = zipfile.ZipFile(out / "sheet-board.zip").read("fabrication.txt").decode()
    assert all(
        words in note for words in ("ENIG", "FR-4, 1.6 mm", "tented", "{:.2f} x {:.2f} mm".format(*answer["board_mm"]))
    )
    assert {name: getattr(circuit, name) for name in answer["circuit"]} == answer["circuit"]
    assert answer["parts"]["DOME_5MM_4LEG"] == 16
    assert answer["caps"]["gap_mm"] == 0.6
    assert answer["kicad"] is None


def test_a_sheet_with_a_ruler_has_combs_and_no_caps(tmp_path, capsys):
    file = examples() / "kits" / "soft" / "skin.toml"
    assert cli.main(["sheet", str(file), "-o", str(tmp_path), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert {path.name for path in tmp_path.iterdir()} == ALL - {"sheet-caps.stl", "sheet-frame.stl"}
    assert (answer["caps"], answer["by_hand"], answer["parts"]["D_SOD-323"]) == (None, {}, 256 + 32)
    assert load_circuit(tmp_path / "skin.toml").falling == load_circuit(file).falling
    bom = (tmp_path / "sheet-bom.csv").read_text()
    numbers = "1N4148WS-E3-08", "RC0603FR-0716KL", "RC0603FR-074R7L", "GRM1885C1H221GA01D", "74LVC595AD"
    assert all(number in bom for number in numbers)
    assert "74HC595" not in bom
    assert cli.main(["sheet", str(file), "-o", str(tmp_path), "--part", "tact"]) == 1
    assert "ruler is 74; its sheet needs combs, not switches" in capsys.readouterr().err


def test_a_sheet_on_a_bed_has_feet_as_wide_as_its_pads(tmp_path, skin):
    bed = "thickness_m = 0.01\narea_m2 = 0.0009\nmass_kg = 0.1\n"
    skin.write_text(skin.read_text(encoding="utf-8-sig") + f'[cover]\nmodel = "foam"\n[cover.bed]\n{bed}')
    assert cli.main(["sheet", str(skin), "-o", str(tmp_path / "out")]) == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == ALL | {"sheet-feet.stl"}
    feet = trimesh.load(tmp_path / "out" / "sheet-feet.stl").split()
    assert [foot.extents[0] for foot in feet] == pytest.approx([15.0] * 4)


def test_a_sheet_around_a_tube_says_what_to_order_and_has_a_clamp(tmp_path, capsys):
    assert cli.main(["sheet", str(examples() / "forearm.toml"), "-o", str(tmp_path)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "order a flex of 0.2 mm, for which this is 225 times its thickness (IPC-2223: at least 10)" in said
    assert {path.name for path in tmp_path.iterdir()} == ALL - {"sheet-frame.stl"} | {"sheet-clamp.stl"}
    note = zipfile.ZipFile(tmp_path / "sheet-board.zip").read("fabrication.txt").decode()
    assert "289.74 x" in note  # 2 pi 45 and a tab of 7 mm
    assert re.search(r"stiffeners: .* bottom, .* J1 40\.72 x 9\.2 at .*, J2 ", note)


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


FINER = [(6.4, "take --part dome\n"), (5.08, "take --part dome and pitch_x_mm = 5.52 and pitch_y_mm = 5.2\n")]


@pytest.mark.parametrize(("pitch", "step"), FINER)
def test_a_cell_finer_than_its_parts_is_refused_in_one_line(tmp_path, skin, capsys, pitch, step):
    skin.write_text(skin.read_text().replace("6.4", str(pitch)))
    assert cli.main(["sheet", str(skin), "-o", str(tmp_path / "new" / "out"), "--part", "tact"]) == 1
    said = capsys.readouterr().err
    assert f"pitch_x_mm is {pitch}; a cell with TACT_4.5MM" in said
    assert said.endswith(f"needs 7 mm: set pitch_x_mm = 7 or more, or {step}")
    assert not (tmp_path / "new").exists()


def test_without_kicad_a_sheet_to_be_checked_is_refused_before_anything_is_written(tmp_path, skin, capsys, monkeypatch):
    monkeypatch.setattr(check, "there", lambda: False)
    assert cli.main(["sheet", str(skin), "-o", str(tmp_path / "out"), "--kicad"]) == 1
    assert "apt install" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("times", ["", "release_us = 0.9  # mine\n"])
def test_the_file_has_the_times_that_its_own_circuit_needs(tmp_path, skin, capsys, times):
    skin.write_text(times + skin.read_text(encoding="utf-8-sig"))
    cli.main(["sheet", str(skin), "-o", str(tmp_path / "out"), "--json"])
    answer = json.loads(capsys.readouterr().out)
    assert set(answer["times"]) == {"release_us"}
    assert answer["times"]["release_us"]["given"] == Skin.load(skin).release_us
    assert cli.main(["settle", "--skin", str(tmp_path / "out" / "skin.toml")]) == 0
    assert "mine" not in times or "# mine" in (tmp_path / "out" / "skin.toml").read_text()


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
