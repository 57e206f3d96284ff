"""Scenes and recordings of a fit: those that choose, and those that check. No other test kills scenes that do both."""

import numpy as np
import pytest
from fits import chosen

from contactfpga.skin import Skin
from contactfpga_sim.apps.fit.sources import source

pytestmark = pytest.mark.usefixtures("alone")


# ---- what is chosen


def test_a_recording_has_its_own_sheet_and_no_error_of_the_exact_ones(tmp_path, shortcuts):
    rng = np.random.default_rng(3)
    cells = np.zeros((120, 10, 12), bool)
    for frame in cells:
        for row, column in ((rng.integers(0, 3), rng.integers(0, 4)), (rng.integers(5, 8), rng.integers(5, 10))):
            frame[row : row + 2, column : column + 2] = True
    path = str(tmp_path / "recording.npz")
    np.savez(path, pressed=cells, pitch_mm=4.0)
    found = chosen(path, pitches=None, miscounted=0.1, missed=0.1)
    skin = found.answer.skin
    assert (skin.rows, skin.columns, skin.pitch_x_mm, skin.labeller) == (10, 12, 4.0, "projection")
    errors = found.answer.measured[0].errors
    assert [errors[name].mean for name in errors] == [0, 0, 0, 0]
    single = next(one for one in found.cheaper if one.skin.labeller == "single" and one.skin.report == "moments")
    assert single.measured[0].errors["miscounted"].mean == 1
    with pytest.raises(ValueError, match=r"--pitch-mm is \[10.0\]; a recording has one pitch, here 4 mm"):
        chosen(path, pitches=[10.0])


def test_reported_errors_come_from_scenes_that_were_not_used_to_choose(tmp_path, file, shortcuts):
    """The second half of this recording has a second contact."""
    cells = np.zeros((200, 8, 8), bool)
    cells[:, 1:3, 1:3] = True
    cells[100:, 5:7, 5:7] = True
    path = str(tmp_path / "recording.npy")
    np.save(path, cells)
    found = chosen(path, pitches=None)
    assert found.answer.skin.labeller == "single"
    assert found.reported[0].errors["miscounted"].mean == 1
    assert found.broken[0].startswith("miscounts 100 % of scenes")


@pytest.mark.parametrize("name", ["bumper", "two_fingers", "moving"])
def test_no_scene_is_both_used_to_choose_and_reported(name, file):
    given = source(name)
    skin = Skin(settle_us=20.0)
    used, others = ([repr(given.at(skin, skin, n)) for n in range(*ends)] for ends in ((0, 30), (30, 60)))
    assert len({*used, *others}) == 60


def test_frames_of_a_recording_are_split_in_the_middle(tmp_path):
    cells = np.zeros((21, 1, 32), bool)
    cells[np.arange(21), 0, np.arange(21)] = True
    path = str(tmp_path / "recording.npy")
    np.save(path, cells)
    given, skin = source(path), Skin(rows=1, columns=32, settle_us=20.0)
    assert given.most(500) == 10
    for count, numbers in ((10, [*range(20)]), (5, [0, 2, 4, 6, 8, 10, 12, 14, 16, 18])):
        looked = given.looks(skin, skin, range(2 * count), count)
        assert [int(np.flatnonzero(cells[0])[0]) for cells, _ in looked] == numbers
