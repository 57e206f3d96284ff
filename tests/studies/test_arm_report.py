"""`contactfpga study arm`: its table, its pictures and its cases."""

import dataclasses
import json
import re

import pytest
from study_pages import section

from contactfpga.design import kits
from contactfpga.design.cover import load_cover
from contactfpga.tools import cli
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.arm import report, tables
from contactfpga_sim.lab.arm.case import Case

PAPER = Case.load("paper")


@pytest.fixture(scope="module")
def found():
    return report.columns(PAPER, "paper", 6e-3)


@pytest.fixture
def ran_before(found, monkeypatch):
    """The command's runs, without running them again."""
    asked = []
    monkeypatch.setattr(report, "columns", lambda *given: asked.append(given) or found)
    yield found
    assert asked == [(PAPER, "paper", pytest.approx(6e-3), None)]


@pytest.mark.slow
def test_the_table_has_the_papers_numbers_beside_ours(capsys, tmp_path, ran_before, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    assert cli.main(["study", "arm", "--places", "0", "--output", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    cells = {name: values for name, *values in (re.split(" {2,}", line.strip()) for line in lines)}
    late, peaks = ran_before["6 ms"].outcome, [f"{one.outcome.peak_force_n:.2f}" for one in ran_before.values()]
    before = ["2.3", "2.54", f"{late.torque_before_nm:.2f}", "+11 %"]
    assert cells["sensor torque before the reaction, Nm"][:4] == before
    assert cells["contact force at the reaction, N"][0] == "12"
    assert cells["speed stays positive for, ms"][:4] == ["5", "5.05", "5.05", "+1 %"]
    assert [value for value in cells["peak force, N"] if value in peaks] == peaks
    assert cells["because of"] == ["contact"] * 3 + ["torque"] * 2 + ["contact"]
    said = " ".join(lines)
    assert "chosen, not measured" in said
    assert "The paper takes its 12 N as the force at which the switch closes" in said
    pictures = {path.name for path in tmp_path.iterdir()}
    assert pictures == {f"arm-{name}.{end}" for name in ("fig6-speed", "fig7-torque") for end in ("png", "svg")}
    assert all(path.stat().st_size > 5000 for path in tmp_path.iterdir())


def test_a_skin_brings_its_own_cover_and_no_columns_of_the_paper(monkeypatch, capsys):
    asked = []
    monkeypatch.setattr(report, "columns", lambda *given: asked.append(given))
    monkeypatch.setattr(report, "as_json", lambda *given: {})
    path = kits.kit("starter").skin_path
    assert cli.main(["study", "arm", "--json", "--places", "0", "--skin", str(path), "--body", "forearm"]) == 0
    ((case, name, _, skin),) = asked
    assert (case.cover, case.body, skin.pitch_x_mm) == (load_cover(path), "forearm", 6.4)
    assert name == f"paper under {path} against forearm"
    assert cli.main(["study", "arm", "--json", "--body", "forearm"]) == 1
    assert "the model 'point' knows rigid ones alone" in capsys.readouterr().err


@pytest.mark.slow
def test_json_holds_every_run_in_si_units(capsys, tmp_path, monkeypatch, ran_before):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["study", "arm", "--json", "--places", "0"]) == 0
    known = json.loads(capsys.readouterr().out)
    assert known["runs"] == {name: dataclasses.asdict(result.outcome) for name, result in ran_before.items()}
    for field, printed in known["paper"].items():
        ours = known["runs"]["6 ms"][field]
        assert known["deviation_from_paper"][field] == pytest.approx(ours / printed - 1)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[link]\ninertia_kgm2 = 1\nlever_m = 1\nspeed_m_s = 1\n", "the part [motor] is missing"),
        ('like = "paper"\n[arm]\n', "unknown part 'arm'"),
        ('like = "paper"\n[foam]\nthickness_m = -1.0\n', "thickness_m is -1.0"),
        ('like = "paper"\nmodel = "foam"\n[foam]\ncut = true\n', "give [cover.cap] as well"),
        ('like = "paper"\nmodel = "foam"\n[cap]\nside_m = 0.011\n', "a cap is 0.011 m wide; the pitch is 0.01 m"),
        ('like = "paper"\n[cap]\nside = 1\n', "unknown key 'side' in [cap]"),
        (
            'like = "paper"\n[control]\nperiod_s = 0.255e-3\n',
            "period_s is 0.000255; it must be a whole number of times",
        ),
        ('like = "paper"\n[run]\nstep_s = 3.125e-6\n', "step_s is 3.125e-06; it must be a whole number of clocks"),
        (
            'like = "paper"\n[bed]\nthickness_m = 0.01\narea_m2 = 1e-3\nmass_kg = 0.1\n[[touch]]\n[[touch]]\n',
            "touch has 2 things; a board on a bed does not tilt",
        ),
        ("x = \n", "not a TOML file"),
        ('like = "paper"\n[[touch]]\nx_mm = 156.0\n', "x_mm of a touch is 156; the sheet ends at 155 mm"),
    ],
)
def test_a_case_that_cannot_be_is_refused_with_its_value(tmp_path, capsys, text, said):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    assert cli.main(["study", "arm", "--case", str(path), "--json"]) == 1
    assert said in capsys.readouterr().err


@pytest.mark.slow
def test_the_pages_set_is_what_the_command_gives(found):
    assert section("arm.md", "set") == writer.spelled(str(tables.set_table(tables.ArmRuns(None, {}, found, {}, {}))))
