"""The wiring table of `contactfpga build`: every pin of the constraints once, and lines where they are soldered."""

import collections
import csv
import itertools
import json
import re

import pytest
from amaranth_boards.ulx3s import ULX3S_12F_Platform
from sample import sample

from contactfpga.boards import BOARDS, wiring
from contactfpga.design import kits
from contactfpga.design.circuit import Circuit
from contactfpga.design.sheet import lay_out
from contactfpga.tools import cli
from contactfpga_hdl.board import pnr_report, sites
from contactfpga_hdl.board.build import plan_for

CHAINED = {
    "precharge_us": 0,
    "rows": 20,
    "columns": 12,
    "row_drive": "74hc595",
    "column_read": "74hc165",
    "release_us": 4.0,
}
CHANGES = {
    "as shipped": {},
    "direct": {"rows": 4, "columns": 7, "row_drive": "direct"},
    "one line each": {"rows": 1, "columns": 1, "row_drive": "direct", "settle_us": 20.0},
    "chained": CHAINED,
    "two and three chains": CHAINED | {"row_chains": 2, "column_chains": 3},
    "row2col": {"rows": 4, "columns": 4, "row_drive": "direct", "diodes": "row2col"},
    "reversal": {"rows": 4, "columns": 4, "row_drive": "direct", "scan": "reversal", "precharge_us": 0.5},
    "orders": {
        "rows": 3,
        "columns": 4,
        "row_drive": "direct",
        "row_order": (2, 0, 1),
        "column_order": (3, 1, 0, 2),
    },
    "guard and alive": {"rows": 4, "columns": 4, "row_drive": "direct", "guard": True, "alive": True},
    "guard and orders": {
        "rows": 3,
        "columns": 4,
        "row_drive": "direct",
        "guard": True,
        "row_order": (2, 0, 1),
        "column_order": (3, 1, 0, 2),
    },
    "units": {"rows": 4, "columns": 4, "row_drive": "direct", "units": 6, "alive": True},
    "units, chained": CHAINED | {"units": 8, "row_chains": 2},
    "guard, chained": CHAINED | {"guard": True, "alive": True, "row_chains": 2},
}


def skin_of(board, name):
    return board.skin.replace(**CHANGES[name])


def constrained(board, skin):
    """FPGA pin of each port in the constraints that place and route gets, by the port's name in the table."""
    suffix = board.constraints.partition(".")[2]
    text = plan_for(board, skin).files[f"contactfpga.{suffix}"]
    text = text if isinstance(text, str) else text.decode()
    located = re.findall(r"^set_io (\S+) (\S+)$" if suffix == "pcf" else r'COMP "(\S+)" SITE "(\S+)"', text, re.M)
    assert located
    return {_port(name): site for name, site in located}


def _port(name):
    if name.startswith("clk"):
        return "clock"
    port, part, bit = re.fullmatch(r"(\w+?)_\d+__(?:(\w+)__)?io(\[\d+\])?", name).groups()
    return port + (f" {part}" if part else "") + (bit or "")


CASES = list(itertools.product(BOARDS, CHANGES))
QUICK = [
    ("icestick", "as shipped"),
    *(("icebreaker", name) for name in ("two and three chains", "units")),
    *(("ulx3s-12f-ft232h", name) for name in ("reversal", "guard and alive")),
]


@pytest.mark.parametrize(("board", "name"), sample(CASES, quick=QUICK))
def test_each_pin_of_the_constraints_is_in_the_table_once(board, name):
    board = BOARDS[board]
    skin = skin_of(board, name)
    wires = wiring.wires(board, skin)
    assert len({wire.port for wire in wires}) == len(wires)
    found = {wire.port: site for wire, site in zip(wires, sites.wire_sites(board, wires), strict=True)}
    assert found == constrained(board, skin)
    assert len(set(found.values())) == len(found)


@pytest.mark.parametrize("name", CHANGES)
def test_each_line_of_the_sheet_is_led_to_once(name):
    board = BOARDS["ulx3s-85f"]
    skin = skin_of(board, name)
    lines = [wire.line for wire in wiring.wires(board, skin)] + [one.line for one in wiring.outputs(skin)]
    wanted = [f"row {row}" for row in range(skin.rows)] + [f"column {column}" for column in range(skin.columns)]
    wanted += ["guard row", "guard column"] if skin.guard else []
    assert sorted(line.leads_to for line in lines if line.kind) == sorted(wanted)
    assert ("alive" in {wire.port for wire in wiring.wires(board, skin)}) == skin.alive


def test_chips_and_outputs_are_those_of_the_data_sheets():
    skin = BOARDS["icebreaker"].skin.replace(**CHAINED, row_chains=2)
    found = {one.line.leads_to: one.place for one in wiring.outputs(skin)}
    assert found["row 0"] == ("74HC595", "0", "0", "QA 15")
    assert found["row 9"] == ("74HC595", "0", "1", "QB 1")
    assert found["row 10"] == ("74HC595", "1", "0", "QA 15")
    assert found["column 0"] == ("74HC165", "0", "0", "H 6")
    assert found["column 7"] == ("74HC165", "0", "0", "A 11")
    assert found["column 8"] == ("74HC165", "0", "1", "H 6")
    places = [(one.chip, one.chain, one.number, one.pin) for one in wiring.outputs(skin)]
    assert len({*places}) == len(places)


@pytest.mark.parametrize(
    ("changes", "rows", "columns"),
    [({}, "", "up"), ({"diodes": "row2col"}, "", "down"), (CHANGES["reversal"], "down", "up")],
)
def test_lines_are_pulled_to_the_level_that_they_have_untouched(changes, rows, columns):
    skin = BOARDS["ulx3s-85f"].skin.replace(**changes)
    assert {line.pull for line in wiring.row_lines(skin)} == {rows}
    assert {line.pull for line in wiring.column_lines(skin)} == {columns}


def test_each_pin_of_the_fast_kits_sheet_leads_to_one_pin_of_the_ulx3s(tmp_path, capsys):
    """No wire is missing, doubled or wrong. Power pins are copied from the ULX3S's schematic; signals are compared with
    the constraints by the platform's pins."""
    assert cli.main(["sheet", "--kit", "fast", "-o", str(tmp_path)]) == 0
    said = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    rows = list(csv.DictReader((tmp_path / "sheet-connectors.csv").read_text().splitlines()))
    pins = [(row["connector"], row["pin"]) for row in rows if row["connector"]]
    assert pins == [(name, str(pin)) for name in ("J1", "J2") for pin in range(1, 27)]
    power = {"GND": {f"J{n} {pin}" for n in (1, 2) for pin in (3, 4, 21, 22, 37, 38)}, "3V3": {"J2 1", "J2 2"}}
    kit = kits.kit("fast")
    wanted, (gpio, *_) = constrained(kit.board, kit.skin), ULX3S_12F_Platform.connectors
    found = {row["wire"]: row["board"] for row in rows if row["wire"] not in power}
    assert found.keys() == wanted.keys() - {"clock", "held_high"}
    for wire, place in found.items():
        header, side, number = re.fullmatch(r"J(\d) G([PN])(\d+)", place).groups()
        assert gpio.mapping[number + {"P": "+", "N": "-"}[side]] == wanted[wire]
        assert int(header) == 1 + (int(number) >= 14)
    used = [row["board"] for row in rows if row["board"] != "open"]
    assert len(set(used)) == len(used)
    assert all(row["board"] in {*power[row["wire"]], "open"} for row in rows if row["wire"] in power)
    for number, (one, other) in enumerate(zip(rows[:26], rows[26:52], strict=True), 1):
        words = f"J1 {number} {one['wire']} {one['board']} J2 {number} {other['wire']} {other['board']}"
        assert any(line.startswith(words) for line in said)


@pytest.fixture(autouse=True)
def wide(monkeypatch):
    """As wide as where nothing has a width; a parallel run of the tests sets its own."""
    monkeypatch.setenv("COLUMNS", "160")


def printed(capsys, *arguments):
    assert cli.main(["build", *arguments]) == 0
    return capsys.readouterr().out


def test_resistors_are_those_of_the_files_circuit(tmp_path, capsys):
    file = tmp_path / "skin.toml"
    skin = BOARDS["ulx3s-12f"].skin.replace(**CHANGES["reversal"])
    file.write_text(f"{skin.to_toml()}[circuit]\nseries_ohm = 33\nrow_pull_ohm = 5600\ncolumn_pull_ohm = 47_000\n")
    out = printed(capsys, "ulx3s-12f", "--wiring", "--skin", str(file))
    assert re.search(r"^rows\[3\] +GPIO 1- +A11 +row 3 +33 Ω +5\.6 kΩ to ground *$", out, re.M)
    assert re.search(r"^columns\[0\] +GPIO 18\+ +H18 +column 0 +33 Ω +47 kΩ to 3\.3 V *$", out, re.M)
    assert re.search(r"^contact +GPIO 27- +E13 +stop input[^Ω]*$", out, re.M)
    wires = json.loads(printed(capsys, "ulx3s-12f", "--wiring", "--json", "--skin", str(file)))["wires"]
    assert {one["wire"]: one for one in wires}["rows[3]"] == {
        "wire": "rows[3]",
        "pin": "GPIO 1-",
        "fpga": "A11",
        "leads_to": "row 3",
        "series_ohm": 33,
        "pull": {"to": "down", "ohm": 5600},
    }


def test_without_a_circuit_no_value_is_made_up(tmp_path, capsys):
    file = tmp_path / "skin.toml"
    file.write_text("rows = 4\n")
    out = printed(capsys, "ulx3s-12f", "--wiring", "--skin", str(file))
    assert "Ω" not in out
    assert re.search(r"^columns\[0\] .*column 0 +to 3\.3 V *$", out, re.M)
    assert "its table [circuit]" in out


def test_a_sheet_that_does_not_fit_has_no_table(tmp_path, capsys):
    file = tmp_path / "skin.toml"
    file.write_text(BOARDS["icebreaker"].skin.replace(row_drive="direct").to_toml())
    assert cli.main(["build", "icebreaker", "--wiring", "--skin", str(file)]) == 1
    said = capsys.readouterr()
    assert said.out == ""
    assert "take 16 + 16 wires" in said.err


def test_one_object_holds_what_was_built(tmp_path, monkeypatch, capsys):
    report = pnr_report.Report((562, 1280), 482, (1, 16), (791, 1280), 119.14, 12.0)
    monkeypatch.setattr("contactfpga_hdl.board.build.build", lambda *_: report)
    answer = json.loads(printed(capsys, "icestick", "--json", "--output", str(tmp_path)))
    assert answer["bitstream"] == str(tmp_path / "contactfpga.bin")
    assert answer["report"]["luts"] == [562, 1280]
    assert len(answer["wires"]) == 4 + 16 + 4
    assert len(answer["outputs"]) == 16
    assert {one["series_ohm"] for one in answer["outputs"]} == {33}


@pytest.mark.parametrize("name", CHANGES)
def test_counts_of_parts_are_those_of_the_layout(name):
    skin = skin_of(BOARDS["ulx3s-85f"], name)
    placed = collections.Counter(one.part.name for one in lay_out(skin, Circuit()).drawing.placed)
    counted = wiring.parts(skin)
    enable = skin.row_drive != "direct"  # a resistor of its own
    assert placed["DOME_5MM_4LEG"] == counted["switches"] == skin.rows * skin.columns - len(skin.mask)
    assert placed["D_SOD-323"] == counted.get("diodes", 0)
    assert placed["R_0603"] - enable == counted["series resistors"] + counted.get("pull resistors", 0)
    chips = {chip: counted.get(chip, 0) for chip in ("74HC595", "74HC165")}
    assert placed["SOIC-16"] == placed["C_0603"] == sum(chips.values()) == counted.get("capacitors of 100 nF", 0)
    assert chips["74HC595"] == skin.row_chains * -(-skin.row_lines // (8 * skin.row_chains)) * enable
