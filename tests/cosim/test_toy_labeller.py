"""A labeller of your own, in one file: Skin, lockstep, virtual board, chart and fit know it with no other edit."""

import json
import re
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import toy_labeller
from toy_labeller import TOY

import contactfpga
from contactfpga import Skin, SkinError, boards
from contactfpga.choices.choice import own_files
from contactfpga.errors import UNSOLVED
from contactfpga.tools import cli
from contactfpga_sim.apps import result_cache
from contactfpga_sim.lab.chart import methods, numbers, times_picture
from contactfpga_sim.lab.chart.compute import Task, study
from contactfpga_sim.model.board.virtual import VirtualBoard
from contactfpga_sim.model.golden import Timeline, predict
from contactfpga_sim.verify.cosim import bench_amaranth, bench_native
from contactfpga_sim.verify.cosim.compare import compare

SKIN = Skin(rows=4, columns=6, labeller=TOY, settle_us=6.0)
CYCLES = 6000


def test_a_skin_takes_the_object_or_its_name(tmp_path):
    assert Skin(rows=4, columns=6, labeller="toy_labeller:TOY", settle_us=6.0) == SKIN
    path = tmp_path / "skin.toml"
    path.write_text(SKIN.to_toml())
    assert Skin.load(path, trust=True) == SKIN
    assert SKIN.fingerprint != SKIN.replace(labeller="run").fingerprint


@pytest.mark.parametrize(
    ("labeller", "message"),
    [
        ("toy", "labeller is 'toy'; it must be one of 'run', 'serial', 'projection', 'single', or 'module:attribute'"),
        ("no_such:TOY", "labeller is 'no_such:TOY', which cannot be loaded: No module named 'no_such'"),
        ("toy_labeller:NONE", "labeller is 'toy_labeller:NONE', which cannot be loaded: module 'toy_labeller' has no"),
        ("toy_labeller:RULE", "labeller is 'toy_labeller:RULE', which is a LabellerRule; it must be a Labeller"),
        (":", "labeller is ':', which cannot be loaded"),
        (".toy:TOY", "labeller is '.toy:TOY', which cannot be loaded: TypeError: the 'package' argument is required"),
        (TOY.__class__(**{**vars(TOY), "name": "run"}), "labeller is an object called 'run', but another object is"),
        (3, "labeller is 3; it must be one of"),
    ],
)
def test_what_is_no_labeller_is_refused(labeller, message):
    with pytest.raises(SkinError, match=re.escape(message)):
        Skin(labeller=labeller)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("TOY = (", "SyntaxError: '(' was never closed"),
        ("TOY = 1 / 0", "ZeroDivisionError: division by zero"),
        ("raise SystemExit('bye')", "SystemExit: bye"),
    ],
)
def test_a_module_that_fails_is_refused_in_one_sentence(tmp_path, monkeypatch, text, reason):
    (tmp_path / "failing.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(SkinError, match=re.escape(f"labeller is 'failing:TOY', which cannot be loaded: {reason}")):
        Skin(labeller="failing:TOY")
    with pytest.raises(SkinError, match=re.escape(f"the board 'failing:TOY' cannot be loaded: {reason}")):
        boards.find("failing:TOY")


def test_a_module_is_found_beside_its_skin_and_only_with_trust(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "path", [*sys.path])
    text = Path(toy_labeller.__file__).read_text().replace("toy_labeller:", "beside_it:")
    try:
        for folder in (tmp_path / "one", tmp_path / "other"):
            folder.mkdir()
            (folder / "beside_it.py").write_text(text)
            (folder / "skin.toml").write_text('rows = 4\nlabeller = "beside_it:TOY"\n')
        command = ["settle", "--skin", str(tmp_path / "one" / "skin.toml")]
        assert cli.main(command) == 1
        assert "allow that by --trust" in capsys.readouterr().err
        assert "beside_it" not in sys.modules
        assert cli.main([*command, "--trust"]) in (0, UNSOLVED)
        with pytest.raises(SkinError, match=r"other/beside_it.py, but .*/one/beside_it.py has the same name; rename"):
            Skin.load(tmp_path / "other" / "skin.toml", trust=True)
    finally:
        sys.modules.pop("beside_it", None)


def test_a_board_is_found_in_this_folder(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.chdir(tmp_path)
    (tmp_path / "board_in_it.py").write_text("from contactfpga.boards.ulx3s import ULX3S_85F as MINE\n")
    try:
        assert cli.main(["build", "board_in_it:MINE", "--wiring"]) == 0
        assert "ULX3S" in capsys.readouterr().out
    finally:
        sys.modules.pop("board_in_it", None)


@pytest.mark.slow
@pytest.mark.parametrize(("run", "scan"), [(bench_native.run, "raster"), (bench_amaranth.run, "reversal")])
def test_it_runs_in_lockstep_with_its_golden_rule(run, scan):
    skin = SKIN.replace(scan=scan, precharge_us=0.5 if scan == "reversal" else 0.0)
    frames = np.random.default_rng(5).random((8, 4, 6)) < 0.3
    timeline = Timeline.frames(skin, frames)
    assert compare(predict(skin, timeline, CYCLES), run(skin, timeline, CYCLES)) > 100


@pytest.mark.slow  # a board is compiled for it
def test_the_virtual_board_and_the_driver_use_it():
    cells = np.zeros((4, 6), bool)
    cells[1, 2:5] = cells[2, 3] = True
    zones = contactfpga.read_zones(VirtualBoard(SKIN, lambda seconds: cells))
    assert [(zone.area_cells, zone.sum_x, zone.sum_y) for zone in zones] == [(3, 9, 3), (1, 3, 2)]


def test_what_is_kept_of_it_depends_on_its_file():
    assert own_files(SKIN) == {Path(toy_labeller.__file__)}
    assert own_files(Skin()) == set()
    toy, run = (result_cache.made_by(result_cache.__name__, SKIN.replace(labeller=each)) for each in (TOY, "run"))
    assert toy != run


@pytest.mark.slow
def test_the_chart_draws_it(tmp_path):
    name = "toy, 20 mm, tiles"
    made = methods.by(TOY)
    tasks = [Task(name, *made[name], "fingers", 4, 0, checked=0)]
    with ThreadPoolExecutor(1) as pool:
        points = study(tasks, pool, with_size=False)
    numbers.write(points, tmp_path / "chart.csv")
    drawn = times_picture.save(numbers.read(tmp_path / "chart.csv", made), tmp_path / "times.svg")
    assert name in drawn.read_text()


@pytest.mark.slow
def test_fit_tries_it(capsys):
    asked = "fit bumper --labeller toy_labeller:TOY --labeller single --pitch-mm 20 --cover bare --scan raster"
    cli.main(f"{asked} --placements 8 --jobs 1 --miscounted none --missed none --json".split())
    found = json.loads(capsys.readouterr().out)
    assert "toy_labeller:TOY" in json.dumps(found)
