"""`contactfpga settle`: the same answer as text and as JSON, and plain words where a sheet cannot work."""

import json
import re

import pytest

from contactfpga.boards import BOARDS
from contactfpga.design import buildable
from contactfpga.design.circuit import Circuit, CircuitError, check_times, needed
from contactfpga.errors import UNSOLVED
from contactfpga.skin import Skin
from contactfpga.tools import cli

SMALL = ["settle", "--rows", "2", "--columns", "3"]


def asked(capsys, *options):
    status = cli.main([*SMALL, *options, "--json"])
    return status, json.loads(capsys.readouterr().out)


@pytest.fixture
def quick(monkeypatch):
    """What the sheet needs is always the same."""
    needs = needed(Circuit(), 1, 1)
    monkeypatch.setattr("contactfpga.design.circuit.needed", lambda *_: needs)


def test_the_issues_example(capsys):
    assert cli.main(["settle", "--pf", "100", "--switch-ohm", "500"]) == 0
    said = capsys.readouterr().out
    found = {key: float(value) for key, value in re.findall(r"^(\w+_us) +([\d.]+)", said, re.MULTILINE)}
    assert found["settle_us"] == pytest.approx(0.42 * 1.3, rel=0.1)  # 420 ns in the design of the fast scan
    assert found["precharge_us"] <= 0.25
    assert "worst pattern: all" in said


@pytest.mark.usefixtures("quick")
def test_json_and_text_say_the_same(capsys):
    _, answer = asked(capsys, "--margin", "2")
    cli.main([*SMALL, "--margin", "2"])
    said = capsys.readouterr().out
    for name in ("precharge_us", "settle_us", "project_us"):
        assert re.search(rf"^{name} +{answer[name]:.2f} ", said, re.MULTILINE)
    assert f"{answer['levels']['pressed_v']:.2f} V" in said
    assert answer["circuit"]["line_pf"] == 30


@pytest.mark.usefixtures("quick")
def test_every_value_of_the_circuit_has_an_option_that_counts(capsys):
    _, before = asked(capsys)
    for name in before["circuit"].keys() - {"diode"}:
        value = before["circuit"][name] * 1.01
        flag = "--pf" if name == "line_pf" else "--" + name.replace("_", "-")
        assert asked(capsys, flag, str(value))[1]["circuit"][name] == value
    for name in before["circuit"]["diode"]:
        value = before["circuit"]["diode"][name] * 1.01
        flag = "--diode-" + name.replace("_", "-")
        assert asked(capsys, flag, str(value))[1]["circuit"]["diode"][name] == value


def test_an_option_says_what_the_class_says_of_its_value():
    parser = cli._parser().topics["settle"]
    parser.complete()
    texts = {action.dest: action.help for action in parser._actions}
    assert texts["crossing_pf"] == (
        "Capacitance of a row to a column at their crossing, with an open switch (default: 2 pF)."
    )
    assert texts["diode_saturation_a"] == "Saturation current (schottky: 1.5e-07 A)."
    assert texts["pin_ma"].endswith("with its usual drive strength (default: 8 mA).")  # the first sentence alone
    assert texts["diode_grading"] == "Grading coefficient (schottky: 0.5)."


def test_a_sheet_that_cannot_work_says_which_and_what_helps(capsys):
    status, answer = asked(capsys, "--column-pull-ohm", "700")
    assert status == UNSOLVED
    assert answer["settle_us"] is None
    assert "a pressed column comes to" in answer["problems"][0]["what"]
    cli.main([*SMALL, "--column-pull-ohm", "700"])
    said = capsys.readouterr().out
    assert re.search(r"^settle_us +never", said, re.MULTILINE)
    assert "cannot work: a pressed column comes to" in said


@pytest.mark.slow
def test_the_skins_values_and_times(capsys, tmp_path):
    path = tmp_path / "skin.toml"
    path.write_text('rows = 2\ncolumns = 3\ndiodes = "row2col"\nrelease_us = 1\n[circuit]\nline_pf = 60\n')
    assert cli.main(["settle", "--skin", str(path), "--switch-ohm", "200", "--json"]) == 3  # a time is too short
    answer = json.loads(capsys.readouterr().out)
    assert (answer["rows"], answer["columns"], answer["diodes"]) == (2, 3, "row2col")
    assert (answer["circuit"]["line_pf"], answer["circuit"]["switch_ohm"]) == (60, 200)
    assert answer["skin"]["settle_us"]["enough"]
    assert not answer["skin"]["release_us"]["enough"]  # a keeper of 100 kilohms
    cli.main(["settle", "--skin", str(path)])
    assert "the Skin's release_us = 1: too short" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--pf", "0"], "'0' is not a number from 0.1 to 100000 pF"),
        (["--switch-ohm", "nan"], "'nan' is not a number from 0.1 to"),
        (["--rows", "65"], "'65' is not a whole number from 1 to 64"),
        (["--margin", "0.5"], "'0.5' is not a number from 1 to 10"),
        (["--diode", "tube"], "invalid choice: 'tube'"),
    ],
)
def test_bad_values_are_refused(capsys, options, message):
    with pytest.raises(SystemExit):
        cli.main([*SMALL, *options])
    assert message in capsys.readouterr().err


def test_a_skin_without_diodes(capsys, tmp_path):
    path = tmp_path / "skin.toml"
    path.write_text('diodes = "none"\nconnectivity = 4\n')
    assert cli.main(["settle", "--skin", str(path)]) == 1
    assert "diodes is 'none'" in capsys.readouterr().err


SCANNED = Skin(rows=3, columns=3, precharge_us=1.0, settle_us=5.0, guard=True)


def test_guard_lines_count_as_lines_in_every_answer(tmp_path, capsys):
    """A time that is enough for 3x3 lines is not enough for 3x3 with guard lines, which are those of 4x4."""
    bare, guarded = (needed(Circuit(), size, size).settle.us(1.3) for size in (3, 4))
    assert bare < guarded
    skin = SCANNED.replace(settle_us=bare)
    check_times(Circuit(), skin.replace(guard=False))
    with pytest.raises(CircuitError, match=f"settle_us = {guarded:g} would do"):
        check_times(Circuit(), skin)
    path = tmp_path / "skin.toml"
    path.write_text(skin.to_toml())
    assert cli.main(["settle", "--skin", str(path)]) == UNSOLVED
    said = capsys.readouterr().out
    assert said.startswith("3x3 and guard lines, col2row")
    assert f"the Skin's settle_us = {bare:g}: too short, {guarded:.2f} needed" in said
    assert buildable.proposed(BOARDS["ulx3s-12f"], skin, Circuit())["settle_us"] == guarded
