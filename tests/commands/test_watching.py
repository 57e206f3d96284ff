"""`doctor --watch` and `wire --bounce` on the compiled gateware, through the driver."""

import json
import tomllib

import numpy as np
import pytest
from fake_board import FakeBoard, patiently

from contactfpga import Skin

SKIN = Skin(rows=4, columns=4, report="cells", settle_us=20.0, precharge_us=0.5)
RATE_HZ = 2500.0


@pytest.fixture
def simulated(tmp_path):
    """``simulated(cells)``: the arguments of a board that plays these (n, rows, columns) bool cells."""

    def simulated(cells):
        scene, file = tmp_path / "scene.npz", tmp_path / "skin.toml"
        np.savez(scene, pressed=cells, rate_hz=RATE_HZ)
        file.write_text(SKIN.to_toml())
        return "--skin", file, f"sim://?scene={scene}&skin={file}"

    return simulated


def touched(seconds, frames_each=8):
    """(n, 4, 4) bool: one switch after the other, over and over."""
    cells = np.zeros((round(seconds * RATE_HZ), 4, 4), bool)
    for index in range(len(cells)):
        turn, phase = divmod(index, frames_each)
        cells[index].flat[turn % 16] = phase < frames_each // 2
    return cells


@pytest.fixture
def watched(run, simulated):
    """Status and output of a watch of these cells for 0.2 s: ``watched(cells, *options)``."""

    def watched(cells, *options):
        arguments = ("--seconds", 0.2, "--stuck-s", 0.1, *options, *simulated(cells))
        status, out, errors = run("doctor", "--watch", *arguments)
        assert errors == "" or "building the 4x4 board" in errors
        return status, out

    return watched


def test_a_watch_says_what_is_stuck_and_what_is_dead(watched):
    cells = touched(0.25)
    cells[:, 3, 1] = True
    cells[:, 0, 2] = False
    cells[:, 2, 0] = False
    status, out = watched(cells)
    assert status == 1
    found = [line for line in out.splitlines() if line.startswith("fault")]
    assert len(found) == 2
    assert found[0].startswith("fault cell (3, 1) pressed for 0.1 s, since the first frame, while ")
    assert found[1] == "fault cells (0, 2), (2, 0) never read pressed: not touched, or dead"
    assert tomllib.loads(out.splitlines()[-1]) == {"mask": [[3, 1]]}


def test_a_watch_in_json(watched):
    cells = touched(0.25)
    cells[:, 3, 1] = True
    cells[:, :, 2] = False
    status, out = watched(cells, "--json")
    answer = json.loads(out)
    assert (status, answer["faults"]) == (1, 2)
    assert answer["seen"] == [[1, 1, 0, 1]] * 4
    assert answer["never"] == [[row, 2] for row in range(4)]
    assert (answer["stuck"], answer["mask_line"]) == ([[3, 1]], "mask = [[3, 1]]")
    assert answer["findings"][1]["sentence"].startswith("column 2 never read pressed")
    assert 0.2 <= answer["seconds"] < 0.21


def test_a_sheet_that_nobody_touches_is_a_fault_and_a_sound_one_is_not(watched):
    assert watched(touched(0.25))[1].splitlines()[1:] == ["ok    every switch read pressed at least once"]
    status, out = watched(np.zeros((1, 4, 4), bool))
    assert status == 1
    assert "fault no switch read pressed; was the sheet touched?" in out


@pytest.mark.parametrize(
    ("skin", "says"),
    [
        (Skin(), 'report = "cells"'),
        (SKIN, "note  the mask of this board is not known, so absent switches look dead; give --skin FILE"),
    ],
)
def test_a_watch_says_what_it_cannot_tell(run, skin, says):
    """The board falls silent after its hello."""
    with FakeBoard(skin) as board:
        status, out = patiently(
            lambda timeout_s: run("doctor", "--watch", "--timeout", timeout_s, board.path)[:2],
            lambda found: "Touch every switch" in found[1],
            (0.3, 3.0, 60.0),
        )
    assert status == 1
    assert says in out
    assert "fault " in out


def test_a_time_without_a_watch_is_refused(run):
    assert run("doctor", "--stuck-s", 3)[2] == "contactfpga: --stuck-s needs --watch\n"


# ---- bounce


def bouncing(seconds=0.28):
    """Three switches that are pressed three times; one of them bounces for 4 ms, the others for 0.8 ms."""
    cells = np.zeros((round(seconds * RATE_HZ), 4, 4), bool)
    for start in range(50, len(cells) - 200, 200):
        for row, column, frames in ((1, 2, 3), (0, 0, 10), (3, 3, 3)):
            for first, level in ((start, True), (start + 100, False)):
                cells[first:, row, column] = level
                cells[first + 1 : first + frames : 2, row, column] = not level
    return cells


def test_bounce_is_measured_and_a_debounce_proposed(run, simulated):
    status, out, errors = run("wire", "--bounce", "--seconds", 0.25, *simulated(bouncing()))
    assert (status, errors) == (0, "")
    fields = tomllib.loads("\n".join(line for line in out.splitlines() if line.startswith("debounce")))
    assert SKIN.replace(**fields).debounce == "asym_eager_defer_pk"
    assert 2 * 4000 <= fields["debounce_press_us"] <= 2 * (4000 + 4 * 200)
    assert "1 slow: (0, 0) " in out
    assert "9 presses: 50 % within 0." in out
    assert "3 of 16 switches were used." in out
    assert "Frames come 0.084 ms apart" in out


def test_bounce_in_json(run, simulated):
    status, out, _ = run("wire", "--bounce", "--json", "--seconds", 0.25, *simulated(bouncing()))
    answer = json.loads(out)
    assert (status, answer["presses"], answer["releases"], answer["blips"]) == (0, 9, 9, 0)
    found = {tuple(one["cell"]): one["longest_us"] for one in answer["cells"]}
    assert found.keys() == {(0, 0), (1, 2), (3, 3)}
    assert found[0, 0] == pytest.approx(4000, abs=300)
    assert found[1, 2] == pytest.approx(800, abs=300)
    assert answer["resolution_us"] == 84
    assert answer["proposal"]["debounce"] == "asym_eager_defer_pk"


def test_without_a_press_nothing_is_measured(run, simulated):
    status, out, _ = run("wire", "--bounce", "--seconds", 0.05, *simulated(np.zeros((1, 4, 4), bool)))
    assert status == 1
    assert "No press and no release ended" in out


DEBOUNCED = SKIN.replace(debounce="sym_defer_pk")


@pytest.mark.parametrize(
    ("skin", "options", "says"),
    [
        (DEBOUNCED, ["--skin", "skin.toml"], "debounces ('sym_defer_pk'), which hides the bounce"),
        (SKIN, [], "give the Skin that it was built from: --skin FILE"),
        (Skin(), [], 'report = "cells"'),
    ],
)
def test_a_board_whose_bounce_does_not_show_is_refused(run, tmp_path, monkeypatch, skin, options, says):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "skin.toml").write_text(skin.to_toml())
    with FakeBoard(skin) as board:
        status, _, errors = run("wire", "--bounce", "--timeout", 60, board.path, *options)
    assert status == 1
    assert says in errors


@pytest.mark.parametrize("flags", [("--seconds", 1), ("--json",)])
def test_flags_of_a_measurement_need_one(run, flags):
    assert "add --bounce" in run("wire", *flags, "sim://")[2]
    assert "--once shows one frame" in run("wire", "--bounce", "--once", "sim://")[2]
