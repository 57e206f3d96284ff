"""Cells that the folding cover presses: learned over the joint's range, marked, never dropped."""

from __future__ import annotations

import io
import json
import math

import numpy as np
import pytest
from model_board import DirectPort

import contactfpga
from contactfpga import Board
from contactfpga.robot.body import BodyError, Snapshot
from contactfpga.robot.body.body import Body
from contactfpga.robot.body.folds import Folds, learn
from contactfpga.robot.body.state import LinkState
from contactfpga.tools import cli
from contactfpga.wire.protocol import Frame, no_records
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.body import folding

SKIN = contactfpga.Skin(rows=4, columns=6, report="cells")
ROBOT = '[[links]]\nname = "arm"\nskin = "skin.toml"\nport = "a"\n'
PATIENT = "late_s = 60.0\nsilent_s = 90.0\n"  # on a busy machine as well
LEVELS = contactfpga.Skin.load(contactfpga.examples() / "levels.toml").replace(rows=4, columns=6)


def frame(*cells, skin=SKIN):
    bitmap = np.zeros((skin.rows, skin.columns), bool)
    for cell in cells:
        bitmap[cell] = True
    return frame_of(bitmap, skin)


def frame_of(levels, skin=LEVELS):
    cells, told = levels > 0, levels if skin.levels > 1 else None
    sent = Frame(0, 0, frozenset(), 0, 0, 0, int(cells.sum()), no_records(skin.sheet), cells, told)
    return Zones(sent, skin.sheet, 0)


CREASE = [(0, 1), (0, 2), (0, 3)]
SEEN = [(0.01, frame()), (0.11, frame(*CREASE[:2])), (0.12, frame(*CREASE[1:])), (0.31, frame(*CREASE))]


@pytest.fixture
def robot(tmp_path):
    (tmp_path / "skin.toml").write_text(SKIN.to_toml())
    learn("elbow", SEEN, 0.1).save(tmp_path / "folds.json")
    (tmp_path / "robot.toml").write_text(ROBOT + 'folds = "folds.json"\n')
    return tmp_path / "robot.toml"


def snapshot(robot, zones, joints):
    return Snapshot(Body.load(robot), 1.0, {"arm": LinkState(zones, 0.0, "ok", "", 1.0)}, joints)


def test_contacts_say_how_much_of_them_the_cover_presses(robot):
    zones = frame(*CREASE, (1, 4), (3, 0), (3, 1))
    for angle, expected in ((0.15, [3 / 4, 0.0]), (0.05, [0.0, 0.0]), (0.25, [None, None]), (-2.0, [None, None])):
        found = snapshot(robot, zones, lambda _, angle=angle: {"elbow": angle}).contacts("link")
        assert [one.fold for one in found] == expected, angle
        assert [one.zone.area_cells for one in found] == [4, 2], "marked, and there"
    (only,) = snapshot(robot, frame(*CREASE), lambda _: {"elbow": 0.15}).contacts("link")
    assert only.fold == 1.0


def test_fold_over_the_seam_of_a_closed_sheet():
    skin = SKIN.replace(closed=True, surface="cylinder", radius_mm=30.0)
    crease, finger = [(0, 5), (0, 0)], [(3, 2)]
    known = learn("elbow", [(0.0, frame(*crease, skin=skin))], 0.1)
    shown = frame(*crease, *finger, skin=skin)
    found = [known.share(0.0, shown.cells_of(zone)) for zone in shown]
    assert found == [1.0, 0.0]


def test_without_the_angle_nothing_is_marked(robot):
    for joints in (None, lambda _: {"wrist": 0.15}):
        (only,) = snapshot(robot, frame(*CREASE), joints).contacts("link")
        assert only.fold is None


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"lines": [4, 600]}, "lines is [4, 600]; it must be rows and columns, 64 at most"),
        ({"steps": [{"step": 0, "frames": 1, "cells": [[4, 0, 1]]}]}, "a cell is [4, 0, 1]; the sheet has 4x6"),
        ({"steps": [{"step": 0, "frames": 1, "cells": [[0, 1, 2]]}]}, "the sheet has 4x6 and 1 levels"),
        ({"version": 3}, "it must have version 2 at most"),
        ({"levels": 4}, "it must have version 2 at most, and from 1 to 3 levels"),
        ({"levels": 3}, "folds have 3 levels, the Skin 1; learn them again with `contactfpga body learn`"),
        ({"steps": 7}, "not a file of `contactfpga body learn`"),
        ({"lines": [4, 5]}, "folds are of (4, 5) cells; the Skin has (4, 6)"),
    ],
)
def test_odd_files_are_refused_in_one_line(robot, capsys, change, says):
    path = robot.parent / "folds.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    assert cli.main(["body", str(robot)]) == 1
    assert says in capsys.readouterr().err.replace("\n  ", " ")


def test_folds_are_of_cells(robot):
    (robot.parent / "skin.toml").write_text(SKIN.replace(report="moments").to_toml())
    with pytest.raises(BodyError, match="folds are marked cell by cell, with report = 'cells'"):
        Body.load(robot)
    board = DirectPort(contactfpga.Skin())
    with contactfpga.open(board) as opened, pytest.raises(BodyError, match="the board reports 'moments'"):
        learn("elbow", [(0.0, opened.read())])


def test_command_learns_from_angles_on_standard_input(robot, capsys, monkeypatch):
    monkeypatch.setattr("contactfpga.driver.driver.open", lambda *_, **__: Board(Sweeping(), SKIN))
    robot.write_text(ROBOT + PATIENT)
    output = robot.parent / "new.json"
    asked = ["body", "learn", str(robot), "arm", "elbow", str(output), "--step", "0.1"]
    monkeypatch.setattr("sys.stdin", io.StringIO("0.05\n0.15\n\n0.35\n"))
    assert cli.main(asked) == 0
    printed = capsys.readouterr().out
    assert "new.json: 3 frames from 0.00 to 0.40 rad, 12 cells pressed somewhere, at 3 of 3 steps" in printed
    assert "no frame came at 1 of the 2 steps between: move more slowly, or folds there are not marked" in printed
    assert Folds.load(output).frames == {0: 1, 1: 1, 3: 1}
    monkeypatch.setattr("sys.stdin", io.StringIO("0.05\n0.15\n\n0.35\n"))
    assert cli.main([*asked, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["file"], answer["frames"], answer["from_rad"]) == (str(output), 3, 0)
    assert answer["to_rad"] == pytest.approx(0.4)
    assert [answer[name] for name in ("cells", "steps", "steps_pressed", "steps_missed")] == [12, 3, 3, 1]
    for text, says in (
        ("x\n", "line 1 of standard input is 'x'; it must be an angle in rad"),
        ("", "no angle came on standard"),
    ):
        monkeypatch.setattr("sys.stdin", io.StringIO(text))
        assert cli.main(asked) == 1
        assert says in capsys.readouterr().err.replace("\n  ", " ")


@pytest.mark.parametrize(
    ("joint", "says"),
    [
        ("L_ELBOW_P", 'its Skin has report = "moments"; folds are learned cell by cell'),
        ("L_ELBOW", "joint 'L_ELBOW' is no joint of the URDF; it has R_HIP_P"),
    ],
)
def test_what_cannot_be_learned_is_said_before_anybody_moves_the_robot(joint, says, tmp_path, monkeypatch, capsys):
    pytest.importorskip("jvrc_description")
    monkeypatch.setattr("contactfpga.driver.driver.open", lambda *_, **__: pytest.fail("a board was opened"))
    robot = contactfpga.examples() / "robot.toml"
    assert cli.main(["body", "learn", str(robot), "left_forearm", joint, str(tmp_path / "new.json")]) == 1
    assert says in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


class Sweeping(DirectPort):
    """A transport of its own: every other column is pressed."""

    name, live, threaded = "sweeping", True, False

    def __init__(self):
        super().__init__(SKIN)


# ---- boards that tell levels of force


def explains(history, apart, row, column, level, levels):
    """Whether a frame of the history explains one cell's level; ``apart`` counts steps of the angle to each frame."""
    near = history[:, max(0, row - 1) : row + 2, max(0, column - 1) : column + 2].any((1, 2))
    reaches = (history[:, row, column] >= level) | (near & (levels > level == 1))
    return bool((reaches & (apart <= (levels > 1))).any())


@pytest.mark.parametrize("skin", [SKIN, LEVELS], ids=["one level", "three levels"])
def test_random_histories(skin, rng, tmp_path):
    """By angles of 0.25 rad a step, read back from the file."""
    shares = set()
    for _ in range(40):
        draw = np.random.default_rng(rng.getrandbits(32))
        history = draw.integers(0, skin.levels + 1, (9, 4, 6)) * (draw.random((9, 4, 6)) < 0.3)
        steps, angle, zone = draw.integers(-4, 4, 9), draw.uniform(-1.2, 1.2), draw.integers(0, skin.levels + 1, (4, 6))
        pairs = zip((steps / 4 + 0.1).tolist(), (frame_of(one, skin) for one in history))
        learn("elbow", pairs, 0.25).save(tmp_path / "folds.json")
        apart = abs(steps - math.floor(4 * angle))
        counted = [explains(history, apart, *cell, zone[cell], skin.levels) for cell in zip(*np.nonzero(zone))]
        expected = pytest.approx(np.mean(counted)) if 0 in apart else None
        assert Folds.load(tmp_path / "folds.json").share(angle, zone) == expected
        shares.add(str(expected))
    assert "None" in shares
    assert len(shares) > 10


def test_harder_than_the_fold_is_a_touch(robot):
    """In one contact with the fold, whose cells none but the level tells from it."""
    (robot.parent / "skin.toml").write_text(LEVELS.to_toml())
    crease = np.array([[0, 1, 2, 2, 1, 0]] * 2 + [[0] * 6] * 2)
    learn("elbow", [(0.15, frame_of(crease))], 0.1).save(robot.parent / "folds.json")
    touched = crease.copy()
    touched[1, 2] = 3
    for levels, expected in ((crease, 1.0), (touched, 7 / 8)):
        (only,) = snapshot(robot, frame_of(levels), lambda _: {"elbow": 0.15}).contacts("link")
        assert only.fold == expected


def test_a_file_without_a_version_has_cells_of_one_level(robot):
    file = robot.parent / "folds.json"
    steps = [{"step": 1, "frames": 2, "cells": [[0, 1], [0, 2]]}]
    file.write_text(json.dumps({"joint": "elbow", "step_rad": 0.1, "lines": [4, 6], "steps": steps}))
    (only,) = snapshot(robot, frame(*CREASE), lambda _: {"elbow": 0.15}).contacts("link")
    assert only.fold == pytest.approx(2 / 3)


@pytest.mark.slow
def test_command_learns_levels_of_a_virtual_board_with_a_margin(tmp_path, monkeypatch):
    """Under a palm: each level from two thirds of its force on; the samples are as the Skin says again in the end."""
    file, robot, asked, usual = contactfpga.examples() / "levels.toml", tmp_path / "robot.toml", [], Board.sample_at
    robot.write_text(ROBOT.replace("skin.toml", f"{file}").replace('"a"', f'"sim://?scene=palm&skin={file}"') + PATIENT)

    def sample_at(board, clocks=0, timeout=60.0, *, level=1):
        asked.append((level, clocks))
        return usual(board, clocks, 60.0, level=level)

    monkeypatch.setattr(Board, "sample_at", sample_at)
    monkeypatch.setattr("sys.stdin", io.StringIO("0.05\n0.06\n"))
    output = tmp_path / "folds.json"
    assert cli.main(["body", "learn", str(robot), "arm", "elbow", str(output)]) == 0
    assert asked == [(2, 36), (3, 9), (1, 0), (2, 0), (3, 0)]
    (learned,) = Folds.load(output).reached.values()
    with contactfpga.open(f"sim://?scene=palm&skin={file}", timeout=60.0) as board:
        read = board.read(60.0).levels
    assert ((learned > 0) == (read > 0)).all()
    assert (learned >= read).all()
    assert (learned == 2).sum() > 1.2 * (read == 2).sum()


def test_rates_in_simulation():
    """Three levels find most touches in a fold that one level cannot tell from it, and no fold passes for a touch."""
    one, three = folding.trials(contactfpga.examples() / "kits/soft/skin.toml", 0.5, folds=100, touches=200).values()
    assert sum(three.folds) <= 1 < 20 < sum(one.folds)
    assert np.mean(three.within) > 0.5 > 0.2 > np.mean(one.within)
