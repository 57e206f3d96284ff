"""`contactfpga arm`: its table, its pictures, its charts, and the push that it yields to."""

import csv
import dataclasses
import functools
import json
import math
import re
import subprocess
import sys
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from contactfpga import cli
from contactfpga.skin import Skin
from contactfpga_sim import kept
from contactfpga_sim.arm import charts, command, comply, report, study, sweep
from contactfpga_sim.arm.case import Case, CaseError, names
from contactfpga_sim.arm.run import run
from contactfpga_sim.arm.sweep import Task

PAPER = Case.load("paper")
PUSH = Case.load("push")


@pytest.fixture
def nothing_kept(tmp_path, monkeypatch):
    compiled = kept.cache_folder()
    monkeypatch.setattr(kept, "cache_folder", lambda: tmp_path / "kept")
    return compiled


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


def test_the_table_has_the_papers_numbers_beside_ours(capsys, tmp_path, ran_before):
    assert cli.main(["arm", "--output", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    table = [[cell.strip() for cell in line.split("│")[1:-1]] for line in lines if "│" in line]
    cells = {name: others for name, *others in table}
    assert len(cells) == len(report.ROWS) + 1
    late, by_uart = ran_before["6 ms"].outcome, ran_before["UART"].outcome
    before = ["2.3", "2.54", f"{late.torque_before_nm:.2f}", "+11 %"]
    assert cells["sensor torque before the reaction, Nm"][:4] == before
    assert cells["contact force at the reaction, N"][0] == "12"
    assert cells["speed stays positive for, ms"][:4] == ["5", "5.05", "5.05", "+1 %"]
    assert cells["peak force, N"][2] == f"{late.peak_force_n:.2f}"
    assert cells["peak force, N"][4] == f"{by_uart.peak_force_n:.2f}"
    assert cells["because of"][2:] == ["contact", "", "contact", "contact", "torque", "torque", "contact"]
    said = " ".join(lines)
    assert "chosen, not measured" in said
    assert "The paper takes its 12 N as the force at which the switch closes" in said
    pictures = {path.name for path in tmp_path.iterdir()}
    assert pictures == {f"arm-{name}.{end}" for name in ("fig6-speed", "fig7-torque") for end in ("png", "svg")}
    assert all(path.stat().st_size > 5000 for path in tmp_path.iterdir())


def test_the_columns_are_what_they_are_called(found):
    assert list(found) == ["6 ms", "UART", "pin", "limit alone", "at 12 N, 6 ms", "at 12 N, no limit"]
    outcomes = [result.outcome for result in found.values()]
    assert [outcome.reason for outcome in outcomes] == ["contact"] * 3 + ["torque"] * 2 + ["contact"]
    closing = [result.course["force_n"][result.course["closed"].argmax()] for result in found.values()]
    assert closing[:4] == pytest.approx([4.1556] * 4, rel=0.01)
    assert closing[4:] == pytest.approx([12.0] * 2, rel=0.01)
    assert outcomes[5].reacts_s - outcomes[5].closes_s == pytest.approx(6e-3, abs=0.25e-3)
    assert outcomes[1].zones == 1


def test_json_holds_every_run_in_si_units(capsys, tmp_path, monkeypatch, ran_before):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["arm", "--json"]) == 0
    known = json.loads(capsys.readouterr().out)
    assert known["runs"] == {name: dataclasses.asdict(result.outcome) for name, result in ran_before.items()}
    for field, printed in known["paper"].items():
        ours = known["runs"]["6 ms"][field]
        assert known["deviation_from_paper"][field] == pytest.approx(ours / printed - 1)
    assert not list(tmp_path.iterdir())


def test_another_case_has_neither_the_papers_numbers_nor_its_other_reading(capsys, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('like = "paper"\n[link]\nspeed_m_s = 0.1\n')
    assert cli.main(["arm", "--case", str(path), "--json", "--latency", "3"]) == 0
    known = json.loads(capsys.readouterr().out)
    assert "paper" not in known
    assert list(known["runs"]) == ["3 ms", "UART", "pin", "limit alone"]
    assert known["runs"]["3 ms"]["peak_force_n"] < 12


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[link]\ninertia_kgm2 = 1\nlever_m = 1\nspeed_m_s = 1\n", "the part [motor] is missing"),
        ('like = "paper"\n[arm]\n', "unknown part 'arm'"),
        ('like = "paper"\n[foam]\nthick = 1\n', "unknown key 'thick' in [foam]"),
        ('like = "paper"\n[foam]\nthickness_m = -1.0\n', "thickness_m is -1.0"),
        ('like = "paper"\n[foam]\npoisson = 0.7\n', "poisson is 0.7"),
        ('like = "paper"\n[control]\nbehaviour = "flee"\n', "behaviour is 'flee'; it must be one of reverse, comply"),
        (
            'like = "paper"\n[control]\nperiod_s = 0.255e-3\n',
            "period_s is 0.000255; it must be a whole number of times",
        ),
        ('like = "paper"\n[run]\nstep_s = 1e-4\n', "step_s is 0.0001; it must be at most 3.125e-05"),
        ('like = "paper"\n[run]\nstep_s = 3.125e-6\n', "step_s is 3.125e-06; it must be a whole number of clocks"),
        ('like = "paper"\ntouch = []\n', "touch is empty"),
        ('like = "nobody"\n', "case 'nobody' is not known"),
        ("x = \n", "not a TOML file"),
        ('like = "paper"\n[[touch]]\nx_mm = 156.0\n', "x_mm of a touch is 156; the sheet ends at 155 mm"),
    ],
)
def test_a_case_that_cannot_be_is_refused_with_its_value(tmp_path, capsys, text, said):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    assert cli.main(["arm", "--case", str(path), "--json"]) == 1
    assert said in capsys.readouterr().err


def test_every_case_that_comes_along_is_known_and_differs_from_the_paper():
    assert names() == ["paper", "paper-offset", "push"]
    assert Case.load("paper-offset") == PAPER.but(touch=({"x_mm": 83.6344},))
    assert tomllib.loads((Path(charts.__file__).parent / "cases/push.toml").read_text())["like"] == "paper"


def test_the_arm_yields_to_a_push_and_returns_and_the_torque_stays_below_the_limit():
    fastest = comply.fastest_m_s(PUSH)
    push, result = comply.pushed(PUSH, fastest)
    assert not result.events
    assert push.peak_torque_nm < 3.0
    assert np.abs(result.course["sensor_nm"]).max() == push.peak_torque_nm
    assert push.yields_m == pytest.approx(PUSH.touch[0].push_m, rel=0.25)
    assert push.back_s < PUSH.run.duration_s
    assert 0.2 * abs(result.course["angle_rad"][-1]) < comply.BACK_M
    beyond = comply.pushed(PUSH.but(run={"duration_s": 0.2}), fastest + 0.01)[0]
    assert beyond.peak_torque_nm >= 3.0
    assert fastest > 0.2


def test_a_slow_push_is_held_by_the_virtual_spring_alone():
    """While it is held: foam force times lever is the spring's torque; the foam takes its part of the way."""
    case = PUSH.but(touch=({"push_m_s": 0.1, "hold_s": 1.0},), run={"duration_s": 0.9})
    result = run(case, "torque")
    held = result.course[-1]
    spring = -case.control.virtual_stiffness * held["angle_rad"]
    assert held["sensor_nm"] == pytest.approx(spring, rel=0.02)
    assert 0.2 * held["force_n"] == pytest.approx(spring, rel=0.02)
    assert held["indentation_m"] - 0.2 * held["angle_rad"] == pytest.approx(0.03, rel=1e-6)


def test_a_push_of_an_arm_that_does_not_comply_is_refused():
    with pytest.raises(CaseError, match="behaviour is 'reverse'"):
        comply.pushed(PAPER, 0.1)


def test_the_push_case_prints_how_fast_it_may_be(capsys, monkeypatch):
    monkeypatch.setattr(comply, "fastest_m_s", lambda case: 0.25)
    monkeypatch.setattr(command, "SHARES", (1.0, 1.4))
    monkeypatch.setattr(comply, "pushed", functools.cache(comply.pushed))
    assert cli.main(["arm", "--case", "push", "--json"]) == 0
    known = json.loads(capsys.readouterr().out)
    assert [push["stopped"] for push in known["pushes"]] == [False, True]
    assert known["pushes"][0]["speed_m_s"] == known["fastest_m_s"] == 0.25
    assert known["pushes"][1]["back_s"] is None
    assert cli.main(["arm", "--case", "push"]) == 0
    said = capsys.readouterr().out
    assert "stays below 3 Nm up to a push of 0.250 m/s" in said
    assert "torque limit" in said


def test_safe_speed_lies_where_the_worst_force_so_far_crosses_the_limit():
    speeds = np.array([0.1, 0.2, 0.3, 0.4])
    forces = np.array([5.0, 10.0, 8.0, 20.0])
    assert sweep.safe_speed(speeds, forces, 7.5) == pytest.approx(0.15)
    assert sweep.safe_speed(speeds, forces, 15.0) == pytest.approx(0.35)
    assert math.isnan(sweep.safe_speed(speeds, forces, 4.9))
    assert math.isnan(sweep.safe_speed(speeds, forces, 20.0))


def test_the_naive_speed_is_the_papers_bound_and_no_safe_one():
    """paper-check: 0.240 m/s for 15 N, 4.156 N and 6 ms; the peak is above 15 N already at 0.23 m/s."""
    assert sweep.closing_n(PAPER) == pytest.approx(4.15555, abs=5e-6)
    assert sweep.naive_speed(PAPER, 15.0, 6e-3) == pytest.approx(0.240, abs=5e-4)
    assert run(PAPER, "latency", latency_s=6e-3).outcome.peak_force_n > 15


def test_the_bounds_hold_for_what_the_gateware_takes(nothing_kept):
    bounds = sweep.bounds_s(PAPER, Skin())
    for way, name in (("uart", "UART"), ("pin", "pin")):
        result = run(PAPER, way).outcome
        assert 0 < result.detected_s - result.closes_s <= bounds[name]
    assert bounds["UART"] > bounds["last byte"] > bounds["pin"]


def test_the_thinnest_foam_is_one_that_is_just_not_pressed_flat(nothing_kept):
    case = sweep.unlimited(PAPER).but(link={"speed_m_s": 0.4})
    point = sweep.Point(**sweep.work(Task(case, latency_s=6e-3, thickness=True)))
    for less, flat in ((0.0, False), (2 * sweep.RESOLUTION_M, True)):
        thick = case.but(foam={"thickness_m": point.thickness_m - less}, run={"step_s": 25e-6, "duration_s": 0.05})
        assert run(thick, "latency", latency_s=6e-3).outcome.bottomed == flat
    assert 4e-3 < point.thickness_m < 5e-3


def test_the_charts_command_draws_with_processes(nothing_kept, tmp_path, monkeypatch, capsys):
    few = charts.plan(PAPER, latencies=(6e-3,), speeds=(0.1, 0.23))
    few = dataclasses.replace(few, sheet={"uart": few.force, "pin": few.force}, thick={})
    monkeypatch.setattr(charts, "plan", lambda case: few)
    assert cli.main(["arm", "--charts", "--jobs", "1", "--output", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    ends = [f"{name}.{end}" for name in ("arm-force", "arm-speed", "arm-thickness") for end in ("png", "svg")]
    assert all(str(tmp_path / name) in said.replace("\n", "") for name in [*ends, "arm-charts.csv"])
    assert sorted(path.name for path in tmp_path.iterdir() if path.is_file()) == sorted([*ends, "arm-charts.csv"])


@pytest.mark.parametrize("latency", ["-1", "nan", "inf"])
def test_a_latency_that_cannot_be_is_refused(latency, capsys):
    assert cli.main(["arm", f"--latency={latency}"]) == 1
    assert "--latency is" in capsys.readouterr().err


def test_charts_of_an_arm_at_rest_are_refused(capsys):
    assert cli.main(["arm", "--case", "push", "--charts"]) == 1
    assert "behaviour is 'comply' at 0 m/s" in capsys.readouterr().err


def test_the_arm_needs_no_more_than_the_simulation():
    code = "import sys, contactfpga_sim.arm.command, contactfpga_sim.arm.charts; sys.exit('scipy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_charts_of_a_few_points(nothing_kept, tmp_path):
    tasks = charts.plan(PAPER, latencies=(1e-3, 6e-3), speeds=(0.1, 0.23))
    few = dataclasses.replace(tasks, sheet={}, speed={"6 ms": tasks.speed["6 ms"]}, thick={0.23: tasks.thick[0.23][1:]})
    steps = []
    with ThreadPoolExecutor(2) as workers:
        points = sweep.sweep(few.all, workers, lambda name, of: steps.append(of))
    assert steps == [len(few.all)] * len(few.all)
    found = dict(zip(few.all, points, strict=True))
    at = found[few.force[1]]
    set_run = run(sweep.unlimited(PAPER), "latency", latency_s=6e-3).outcome
    assert at.peak_force_n == pytest.approx(set_run.peak_force_n, rel=1e-3)
    assert at.force_before_n == pytest.approx(set_run.force_before_n, rel=1e-3)
    assert at.takes_s == pytest.approx(6e-3, abs=1e-9)
    slow, fast = (found[task] for task in few.speed["6 ms"])
    assert slow.peak_force_n < fast.peak_force_n == pytest.approx(at.peak_force_n)
    drawn = dataclasses.replace(few, sheet={"uart": few.force[:1], "pin": few.force[:1]})
    paths = charts.draw(PAPER, drawn, found, tmp_path, ("svg",))
    assert [path.name for path in paths] == ["arm-force.svg", "arm-speed.svg", "arm-thickness.svg"]
    texts = [path.read_text() for path in paths]
    assert all("<svg" in text for text in texts)
    assert "paper, 12 N" in texts[0]
    assert charts.draw(PAPER, drawn, found, tmp_path, ("svg",))[0].read_text() == texts[0]
    text = charts.write_csv(found, tmp_path / "arm.csv").read_text(encoding="utf-8")
    lines = list(csv.DictReader(text.splitlines()))
    assert len(lines) == len(found)
    assert float(lines[1]["peak_force_n"]) == pytest.approx(at.peak_force_n, rel=1e-5)


PAGE = (Path(__file__).parents[1] / "docs/arm.md").read_text(encoding="utf-8")


def test_the_pages_set_is_what_the_command_gives(found):
    assert study.update(PAGE, {"set": lambda: study.set_table(found)}) == PAGE


def test_the_page_has_a_section_for_every_table():
    assert re.findall(r"<!-- figures: (\w+) -->", PAGE) == ["set", "sheet", "speeds", "pushes", "failures", "steps"]
    assert study.update("<!-- figures: steps -->\nold\n<!-- end -->", {"steps": lambda: "new"}) == (
        "<!-- figures: steps -->\nnew\n<!-- end -->"
    )


@pytest.mark.campaign
@pytest.mark.timeout(3600)
def test_the_page_and_its_pictures_are_what_the_command_writes(tmp_path, monkeypatch):
    page = tmp_path / "arm.md"
    page.write_text(
        re.sub(r"(<!-- figures: \w+ -->).*?(<!-- end -->)", r"\1\n\2", PAGE, flags=re.DOTALL), encoding="utf-8"
    )
    monkeypatch.setattr(sys, "argv", ["study", str(page), str(tmp_path)])
    assert study.main() == 0
    assert page.read_text(encoding="utf-8") == PAGE
    drawn = sorted(tmp_path.glob("*.svg"))
    assert len(drawn) == 5
    for picture in drawn:
        assert picture.read_text() == (Path(__file__).parents[1] / "docs/images" / picture.name).read_text(), (
            picture.name
        )
