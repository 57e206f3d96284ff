"""A Skin's file that states its circuit, and what refuses one that cannot work."""

import pytest

import contactfpga
from contactfpga.design.circuit import (
    SILICON,
    Circuit,
    CircuitError,
    Diode,
    check,
    load_checked,
    load_circuit,
    problems,
)
from contactfpga.skin import Skin
from contactfpga.tools import cli

STATED = """rows = 8
columns = 8
[circuit]
line_pf = 50
diode = "silicon"
"""
TOO_STRONG = "rows = 8\n[circuit]\ncolumn_pull_ohm = 2200\n"


@pytest.fixture
def skin_file(tmp_path):
    path = tmp_path / "my skin.toml"

    def write(text):
        path.write_text(text)
        return str(path)

    return write


def test_the_table_is_read(skin_file):
    path = skin_file(STATED)
    skin = Skin.load(path)
    assert skin == Skin(rows=8, columns=8)
    assert load_circuit(path) == load_checked(path, skin) == Circuit(line_pf=50, diode=SILICON)
    assert load_circuit(skin_file("rows = 8")) is None


def test_a_diode_of_ones_own(skin_file):
    fields = "saturation_a = 1e-9\nemission = 1.5\nseries_ohm = 1\njunction_pf = 3\njunction_v = 0.6\ngrading = 0.4\n"
    path = skin_file("[circuit.diode]\n" + fields)
    assert load_circuit(path) == Circuit(diode=Diode(1e-9, 1.5, 1, 3, 0.6, 0.4))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("line_pf", "pf", "unknown key 'pf' in [circuit]; known are line_pf, crossing_pf"),
        ("50", "-1", "line_pf in [circuit] is -1; it must lie between 0.1 and 100000 pF"),
        ("50", "nan", "line_pf in [circuit] is nan; it must lie between"),
        ("50", "true", "line_pf in [circuit] is True; it must lie between"),
        ('"silicon"', '"glass"', "diode is 'glass'; it must be one of schottky, silicon, or [circuit.diode]"),
        ('"silicon"', "4", "circuit.diode is 4; it must be a part, [circuit.diode]"),
        ('diode = "silicon"', "[circuit.diode]\nemission = 1", "saturation_a is missing in [circuit.diode]"),
        ('diode = "silicon"', "low_v = 2.5", "low_v = 2.5, high_v = 2 and supply_v = 3.3 are not in order"),
    ],
)
def test_a_circuit_that_cannot_be_is_refused(skin_file, old, new, message):
    assert old in STATED
    with pytest.raises(CircuitError) as caught:
        load_circuit(skin_file(STATED.replace(old, new)))
    assert "skin.toml: " in str(caught.value)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    "command", [["build", "icebreaker", "--skin", "FILE"], ["board", "--skin", "FILE"], ["zones", "sim://?skin=FILE"]]
)
def test_what_cannot_work_is_refused_before_anything_is_made(skin_file, capsys, command, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    path = skin_file(TOO_STRONG)
    assert cli.main([word.replace("FILE", path) for word in command]) == 1
    said = capsys.readouterr().err.replace("\n", " ")
    assert "a pressed column comes to" in said
    assert "at most 0.50 V are needed, 0.3 V below VIL" in said
    assert "column_pull_ohm = " in said
    assert f"`contactfpga settle --skin {path!r}` shows all" in said
    assert list(tmp_path.iterdir()) == [tmp_path / "my skin.toml"]


def test_the_least_pull_that_is_recommended_does_and_less_does_not():
    circuit = Circuit(column_pull_ohm=2200.0)
    (level, current) = problems(circuit, 16, 16)
    assert "mA" in current.what
    recommended = float(level.helps.split(" = ")[1].split()[0])
    assert not problems(circuit.replace(column_pull_ohm=recommended), 16, 16)
    assert problems(circuit.replace(column_pull_ohm=recommended / 1.3), 16, 16)


def test_projections_count_only_where_they_are_made():
    circuit = Circuit(row_pull_ohm=4700.0)
    assert not problems(circuit, 64, 64)
    found = problems(circuit, 64, 64, projects=True)
    assert ["touched row" in found[0].what, "pin of a column" in found[1].what, len(found)] == [True, True, 2]
    with pytest.raises(CircuitError, match="row_pull_ohm = 27000 would do"):
        check(circuit, Skin(rows=64, columns=64, scan="reversal", precharge_us=0.25))


def test_where_no_pull_helps_that_is_said():
    (level, *_) = problems(Circuit(low_v=0.4, diode=SILICON), 4, 4)
    assert "no column_pull_ohm would do: take a Schottky diode" in level.helps


@pytest.mark.parametrize(("picofarad", "stuck"), [(10, False), (2000, True)])
def test_the_virtual_board_has_the_circuit_of_its_skin(skin_file, picofarad, stuck):
    """With 2 nF a line the pulls take longer than the release time, which a board reports."""
    path = skin_file(f"[circuit]\ncolumn_pull_ohm = 8200\ncrossing_pf = 0\nline_pf = {picofarad}\n")
    with contactfpga.open(f"sim://?scene=full&skin={path}", timeout=30.0) as board:
        zones = board.read()
    assert zones.pressed == 256
    assert ("stuck" in zones.faults) == stuck
