"""The command `contactfpga fit`."""

import json

import numpy as np
import pytest
from amaranth.back import rtlil
from fits import BUMPER, HANDS

from contactfpga.skin import Skin
from contactfpga.tools import cli
from contactfpga_sim.apps import size
from contactfpga_sim.apps.fit import search

pytestmark = pytest.mark.usefixtures("alone")

UNSOLVED = 3


@pytest.mark.slow
def test_the_command_writes_a_skin_that_loads_and_builds(file, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(search, "CHECKED", 0)  # compiles a board
    built = []
    monkeypatch.setattr(size, "luts", lambda component, _: built.append(rtlil.convert(component())) or 423)
    monkeypatch.setattr(size, "tools", lambda _: ())  # which may not be installed
    output = tmp_path / "my.toml"
    options = ["--cover", "bare", "--pitch-mm", "20", "--labeller", "single", "--scan", "raster", "--placements", "73"]
    limits = ["--barycenter-mm", "none", "--miscounted", "10", "--missed", "10"]
    path = file(BUMPER.replace("[12, 18]", "[16, 20]"))
    assert cli.main(["fit", path, *options, *limits, "--json", "--output", str(output)]) == 0
    said = json.loads(capsys.readouterr().out)
    skin = Skin.load(output)
    assert skin == Skin(rows=4, columns=4, pitch_x_mm=20.0, pitch_y_mm=20.0, labeller="single")
    assert said["meets"]
    assert said["answer"]["settings"]["labeller"] == "single"
    assert said["answer"]["luts"] == 423
    assert "# 423 LUT4 on iCE40UP5K, 8 wires" in output.read_text()
    assert len(built) == 1
    assert "top" in built[0]


@pytest.mark.slow
def test_the_command_says_what_it_chose_and_why(file, shortcuts, capsys):
    assert cli.main(["fit", file(HANDS), "--cover", "bare", "--pitch-mm", "10", "--barycenter-mm", "4"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "miscounts 100 % of scenes (83.9 to 100), limit 5 %" in said
    assert "the answer" in said
    assert "Other scenes agree that it meets all limits." in said


def test_the_command_fails_where_nothing_meets_the_limits(file, tmp_path, shortcuts, capsys):
    output = tmp_path / "none.toml"
    arguments = ["fit", file(BUMPER), "--cover", "bare", "--pitch-mm", "20", "--barycenter-mm", "0.1"]
    arguments += ["--output", str(output)]
    assert cli.main(arguments) == UNSOLVED
    said = " ".join(capsys.readouterr().out.split())
    assert "No Skin that was tried meets the limits. The nearest is" in said
    assert "it misses: barycenter off by" in said
    assert not output.exists()
    assert cli.main([*arguments, "--json"]) == UNSOLVED
    found = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert (found["meets"], found["answer"]) == (False, None)
    assert found["nearest"]["reported"]


def test_the_command_fails_where_other_scenes_break_a_limit(tmp_path, shortcuts, capsys):
    cells = np.zeros((200, 8, 8), bool)
    cells[:, 1:3, 1:3] = True
    cells[100:, 5:7, 5:7] = True
    path = tmp_path / "recording.npy"
    np.save(path, cells)
    assert cli.main(["fit", str(path)]) == UNSOLVED
    said = " ".join(capsys.readouterr().out.split())
    assert "On scenes not used to choose the answer misses its limits: miscounts 100 % of scenes" in said
    assert "Of a recording nobody knows what touched" in said


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["guess"], "scene 'guess' is not known; take a .toml, .npz or .npy file, or one of bumper, fingers"),
        (["none.toml"], "No such file"),
        (["bumper", "--placements", "50"], "the limit of miscounted is 5 %; give --placements 73 or more"),
        (["bumper", "--labeller", "x"], "labeller is 'x'; it must be one of 'run', 'serial', 'projection', 'single'"),
        (["bumper", "--scan", "x"], "scan is 'x'; it must be one of 'raster', 'reversal', or 'module:"),
        (["bumper", "--scan", "adaptive"], "scan is 'adaptive', which no longer exists; use 'reversal'"),
    ],
)
def test_what_cannot_be_asked_is_refused(arguments, message, capsys):
    assert cli.main(["fit", *arguments]) == 1
    assert message in capsys.readouterr().err


def test_a_recording_of_few_frames_is_refused(tmp_path, capsys):
    np.save(tmp_path / "few.npy", np.ones((3, 4, 4), bool))
    assert cli.main(["fit", str(tmp_path / "few.npy")]) == 1
    assert "few.npy has 3 frames; two to choose with and two to report are the least" in capsys.readouterr().err
