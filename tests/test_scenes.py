"""Scenes and shapes: what touches the sheet."""

import numpy as np
import pytest
from scipy import ndimage

from contactfpga.skin import Skin
from contactfpga_sim import scenes
from contactfpga_sim.shapes import SHAPES, variants


def zones(cells, connectivity=8):
    return ndimage.label(cells, np.ones((3, 3)) if connectivity == 8 else None)[1]


@pytest.mark.parametrize("sheet", [(16, 16), (8, 32), (64, 64), (3, 5), (1, 9), (9, 1), (1, 1)])
@pytest.mark.parametrize("name", scenes.NAMES)
def test_every_scene_fits_every_sheet(name, sheet):
    skin = Skin(rows=sheet[0], columns=sheet[1], settle_us=20.0)
    scene = scenes.scene(skin, name)
    for seconds in (0.0, 0.1, 7.3):
        cells = scene(seconds)
        assert (cells.shape, cells.dtype) == (sheet, bool)
    assert cells.any() == (name != "nothing") or sheet == (1, 1)


@pytest.mark.parametrize(("name", "count"), [("fingertip", 1), ("two_fingers", 2), ("edge", 1), ("moving", 1)])
def test_contacts_have_the_zones_their_names_say(name, count):
    assert zones(scenes.scene(Skin(), name)(0.0)) == count


def test_a_moving_contact_moves():
    scene = scenes.scene(Skin(), "moving")
    assert not np.array_equal(scene(0.0), scene(0.1))


@pytest.mark.parametrize(
    ("name", "count"),
    [("spiral", 1), ("comb", 1), ("checkerboard", 1), ("nested_u", 4), ("rings", 4), ("tree", 1), ("dots", 64)],
)
def test_shapes_are_what_they_are_called(name, count):
    assert zones(SHAPES[name](16, 16)) == count


def test_checkerboard_is_the_worst_case_of_4_connectivity_and_dots_of_8():
    skin = Skin()
    assert zones(SHAPES["checkerboard"](16, 16), 4) == skin.replace(connectivity=4).max_zones()
    assert zones(SHAPES["dots"](16, 16), 8) == skin.max_zones()


def test_variants_are_flips_and_transposes_without_doubles():
    found = dict(variants(8, 12))
    assert {cells.shape for cells in found.values()} == {(8, 12)}
    assert len({cells.tobytes() for cells in found.values()} | {b""}) > 3 * len(SHAPES)
    assert {name.split("-")[0] for name in found} == set(SHAPES)


def test_recordings_and_callbacks_are_scenes(tmp_path):
    skin = Skin(rows=2, columns=3)
    frames = np.zeros((2, 2, 3), np.uint8)
    frames[1, 0, 2] = 9
    path = tmp_path / "touch.npy"
    np.save(path, frames)
    scene = scenes.scene(skin, path)
    assert not scene(0.0).any()
    assert scene(1 / scenes.RECORDING_HZ)[0, 2]
    assert not scene(2 / scenes.RECORDING_HZ).any()
    assert scenes.scene(skin, lambda seconds: np.ones((2, 3)))(0.0).all()


def test_what_is_no_scene_is_refused(tmp_path):
    skin = Skin(rows=2, columns=3)
    with pytest.raises(ValueError, match=r"'elbow' is not known; take a \.npy file or one of fingertip"):
        scenes.scene(skin, "elbow")
    with pytest.raises(ValueError, match=r"shape \(1, 3, 2\); the sheet takes \(frames, 2, 3\)"):
        scenes.scene(skin, np.zeros((3, 2)))
    with pytest.raises(ValueError, match=r"shape \(1,\); the sheet has 2x3"):
        scenes.scene(skin, lambda seconds: [True])(0.0)
