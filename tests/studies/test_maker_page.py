"""The maker's page: the values in its schematic, and its Skin, which the circuit model takes."""

import re
import tomllib
from pathlib import Path

from contactfpga.boards import find
from contactfpga.design import buildable, kits
from contactfpga.design.circuit import load_checked, load_circuit, needed
from contactfpga.skin import Skin
from contactfpga_sim.lab.maker import tables

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = DOCS / "maker.md"


def test_the_schematic_shows_the_values_of_the_kit_and_of_the_tables():
    drawn = (DOCS / "images" / "schematic.svg").read_text(encoding="utf-8")
    circuit = load_circuit(kits.kit("starter").skin_path)
    for ohm in (circuit.column_pull_ohm, tables.PULLED.row_pull_ohm):
        assert f">{ohm / 1000:g} kΩ<" in drawn
    assert f">{circuit.series_ohm:g} Ω<" in drawn


def test_the_pages_skin_works_with_its_circuit(tmp_path):
    (text,) = re.findall(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    file = tmp_path / "skin.toml"
    file.write_text(text, encoding="utf-8")
    assert tomllib.loads(text)["circuit"]["column_pull_ohm"] == tables.PULLED.column_pull_ohm
    skin = Skin.load(file)
    circuit = load_checked(file, skin)
    needs = needed(circuit, skin.rows, skin.columns)
    assert needs.pulled_release.us(1.3) <= skin.release_us
    assert needs.settle.us(1.3) <= skin.settle_us
    (board,) = re.findall(r"contactfpga build (\w+) --skin my.toml", PAGE.read_text(encoding="utf-8"))
    assert not any(buildable.findings(find(board), find(board).load(file), circuit).values())
