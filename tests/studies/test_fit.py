"""The cheapest Skin that meets the limits: against a search that tries everything."""

import itertools
import math

import cv2
import numpy as np
import pytest
from fits import HANDS, chosen, made_up
from scipy.stats import binomtest

from contactfpga.skin import Skin
from contactfpga_sim.apps.fit.candidates import candidates, pitches_for
from contactfpga_sim.apps.fit.sources import source

pytestmark = pytest.mark.usefixtures("alone")


# ---- what is chosen


@pytest.mark.slow
def test_the_answer_is_the_cheapest_of_all_that_pass(file, shortcuts):
    """Counted and placed by OpenCV, on newly drawn scenes."""
    found = chosen(file(HANDS), miscounted=0.1, barycenter_mm=2.2, pitches=(8.0, 10.0, 16.0))
    given = source(file(HANDS))
    passing = []
    for one in candidates(Skin(), pitches_for(None, [given], (8.0, 10.0, 16.0)), (80.0, 80.0)):
        skin = one.skin
        if skin is None or skin.report == "cells" or skin.labeller in ("single", "projection"):
            continue  # these miscount, see above
        wrong, apart = [], []
        for cells, there in given.looks(skin, Skin(), range(100), 100):
            picture = cells.astype(np.uint8)
            count, _, _, centers = cv2.connectedComponentsWithStats(picture, connectivity=skin.connectivity)
            wrong.append(count - 1 != len(there))
            pairs = []
            for order in itertools.permutations(range(1, count), min(count - 1, len(there))):
                found_mm = centers[list(order)] * (skin.pitch_x_mm, skin.pitch_y_mm)
                for chosen_there in itertools.combinations(there, len(order)):
                    there_mm = np.array([(blob.x_mm, blob.y_mm) for blob in chosen_there])
                    pairs.append(np.hypot(*(found_mm - there_mm).T).mean())
            if pairs:
                apart.append(min(pairs))
        most_wrong = binomtest(sum(wrong), len(wrong)).proportion_ci(method="wilson").high
        most_apart = np.mean(apart) + 1.96 * np.std(apart, ddof=1) / math.sqrt(len(apart))
        if most_wrong <= 0.1 and most_apart <= 2.2:
            passing.append((skin.rows + skin.columns, made_up(skin)))
    assert found.answer.cost[:2] == min(passing)
    assert found.answer.skin.rows > min(one.skin.rows for one in found.cheaper)
    for trial in found.cheaper:
        assert trial.cost[:2] <= found.answer.cost[:2]
        assert trial.refusals


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
    assert (skin.rows, skin.columns, skin.pitch_x_mm, skin.labeller) == (10, 12, 4.0, "serial")
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
    assert found.reported[0][0].errors["miscounted"].mean == 1
    assert found.broken[0].startswith("miscounts 100 % of scenes")
    assert found.reported[1][0].errors["miscounted"].mean == 0  # of `serial`, the runner-up


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
        looked = given.cells(skin, skin, range(2 * count), count)
        assert [int(np.flatnonzero(one[0])[0]) for one in looked] == numbers
