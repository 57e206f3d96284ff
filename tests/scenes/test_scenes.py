"""Scenes and shapes: what touches the sheet."""

import math

import numpy as np
import pytest
from recorded_frames import RECORDINGS, path_of, recorded
from sample import sample
from scipy import ndimage
from scipy.optimize import brentq

from contactfpga.design.cover import BODIES, Cap, Cover, Switch
from contactfpga.design.cover.layers import COUPLING
from contactfpga.skin import Skin
from contactfpga_sim.model.scenes import contacts
from contactfpga_sim.model.scenes import scene as scenes
from contactfpga_sim.model.scenes.contacts import Contact, Swing, Track
from contactfpga_sim.model.scenes.families import placements, touches
from contactfpga_sim.model.scenes.recordings import DEFAULT_HZ, Recording
from contactfpga_sim.model.scenes.scene import Scene
from contactfpga_sim.model.scenes.shapes import SHAPES, variants


def zones(cells, connectivity=8):
    return ndimage.label(cells, np.ones((3, 3)) if connectivity == 8 else None)[1]


def small_face(force_n):
    """A switch that closes at the stress of the paper's with this force, with a face that is 0.8 mm wide."""
    return Switch(force_n * 0.64 / 12.6, 0.64e-6)


@pytest.mark.parametrize("sheet", [(16, 16), (8, 32), (64, 64), (3, 5), (1, 9), (9, 1), (1, 1)])
@pytest.mark.parametrize("name", scenes.NAMES)
def test_every_scene_fits_every_sheet(name, sheet):
    skin = Skin(rows=sheet[0], columns=sheet[1], settle_us=20.0)
    scene = scenes.scene(skin, name)
    for seconds in (0.0, 0.1, 7.3):
        cells = scene(seconds)
        assert (cells.shape, cells.dtype) == (sheet, bool)
    assert cells.any() == (name != "nothing") or sheet == (1, 1)


COUNTS = {"fingertip": 1, "two_fingers": 2, "palm": 1, "palm_and_fingers": 3, "edge": 1, "moving": 1, "nothing": 0}


@pytest.mark.parametrize(("name", "count"), COUNTS.items())
def test_contacts_have_the_zones_their_names_say(name, count):
    skin = Skin()
    assert scenes.CONTACTS[name](skin).truth(0.3, skin).count == count
    assert zones(scenes.scene(skin, name)(0.3)) == count


def test_a_foot_is_two_contacts_where_it_is_long_enough():
    skin = Skin(rows=64, columns=64, pitch_x_mm=4.0, pitch_y_mm=4.0, settle_us=20.0)
    assert scenes.sole(skin).truth(0.0, skin).count == 2
    assert zones(scenes.scene(skin, "sole")(0.0)) == 2
    assert scenes.sole(Skin()).truth(0.0, Skin()).count == 2


@pytest.mark.parametrize(
    ("name", "count"),
    [("spiral", 1), ("comb", 1), ("checkerboard", 1), ("nested_u", 4), ("rings", 4), ("tree", 1), ("dots", 64)],
)
def test_shapes_are_what_they_are_called(name, count):
    assert zones(SHAPES[name](16, 16)) == count


def test_variants_are_flips_and_transposes_without_doubles():
    found = dict(variants(8, 12))
    assert {cells.shape for cells in found.values()} == {(8, 12)}
    assert len({cells.tobytes() for cells in found.values()} | {b""}) > 3 * len(SHAPES)
    assert {name.split("-")[0] for name in found} == set(SHAPES)


def test_recordings_and_callbacks_are_scenes(tmp_path):
    skin = Skin(rows=2, columns=3)
    frames = np.zeros((2, 2, 3), bool)
    frames[1, 0, 2] = True
    path = tmp_path / "touch.npy"
    np.save(path, frames)
    scene = scenes.scene(skin, path)
    assert not scene(0.0).any()
    assert scene(1 / DEFAULT_HZ)[0, 2]
    assert not scene(2 / DEFAULT_HZ).any()
    assert scenes.scene(skin, lambda seconds: np.ones((2, 3), bool))(0.0).all()


def test_what_is_no_scene_is_refused(tmp_path):
    skin = Skin(rows=2, columns=3)
    with pytest.raises(ValueError, match=r"'elbow' is not known, and no \.npy or \.npz file; known are fingertip"):
        scenes.scene(skin, "elbow")
    with pytest.raises(ValueError, match=r"shape \(1, 3, 2\); the sheet takes \(frames, 2, 3\)"):
        scenes.scene(skin, np.zeros((3, 2), bool))
    with pytest.raises(ValueError, match=r"shape \(1,\); the sheet has 2x3"):
        scenes.scene(skin, lambda seconds: [True])(0.0)


def test_a_recording_comes_with_its_rate_and_pitch(tmp_path):
    path = tmp_path / "touch.npz"
    frames = np.eye(4, dtype=bool)[:, None, :]
    np.savez(path, pressed=frames, rate_hz=np.float32(50), pitch_mm=np.float32(3.5))
    recording = Recording.load(path)
    assert (recording.rate_hz, recording.pitch_mm) == (50, 3.5)
    played = scenes.scene(Skin(rows=1, columns=4, settle_us=20.0), path)
    assert [int(played(seconds).argmax()) for seconds in (0.0, 0.019, 0.02, 0.06, 0.08)] == [0, 0, 1, 3, 0]


def test_what_is_no_recording_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"the array has shape \(4,\); a recording has \(frames, rows, columns\)"):
        Recording.of(np.zeros(4), "the array")
    path = tmp_path / "other.npz"
    np.savez(path, cells=np.zeros((1, 2, 2)))
    with pytest.raises(ValueError, match=r"other\.npz holds cells; a recording has an array `pressed`"):
        scenes.scene(Skin(rows=2, columns=2, settle_us=20.0), path)


@pytest.mark.recordings
@pytest.mark.parametrize("name", RECORDINGS)
def test_real_recordings_are_played_frame_by_frame(name, record_property):
    path, frames = path_of(name), recorded(name)
    recording = Recording.load(path)
    skin = Skin(rows=frames.shape[1], columns=frames.shape[2], settle_us=20.0)
    played = scenes.scene(skin, path)
    for number in range(len(frames)):
        assert np.array_equal(played(number / recording.rate_hz), frames[number])
    record_property("cases", len(frames))


# ---- contacts over time


def sheet_of(pitch_x, pitch_y=None, size=48):
    return Skin(rows=size, columns=size, pitch_x_mm=pitch_x, pitch_y_mm=pitch_y or pitch_x, settle_us=20.0)


def one(shape, x_mm=0.0, y_mm=0.0, **values):
    return Scene((Contact(shape=shape, x_mm=x_mm, y_mm=y_mm, **values),))


def test_a_contact_touches_while_it_is_pressed():
    press = Track((1.0, 2.0, 3.0), (0.0, 8.0, -1.0))
    scene = one(contacts.disc(6), 30, 40, force_n=press)
    skin = sheet_of(2.0)
    assert [scene.truth(seconds).count for seconds in (0.0, 1.0, 1.001, 2.0, 2.88, 2.9, 9.0)] == [0, 0, 1, 1, 1, 0, 0]
    assert [bool(scene.pressed(seconds, skin).any()) for seconds in (1.0, 1.5, 4.0)] == [False, True, False]
    assert scene.on(skin)(1.5).any()
    assert not scene.on(skin)(0.5).any()


def test_a_body_sinks_in_and_its_patch_grows_with_its_force():
    """A ball on foam alone, in closed form: F = 2 pi R E t (-x - ln(1 - x)) (1 + c t/(2 R x)) at the depth x t."""
    cover, radius, thick, modulus = Cover("foam", 5e-3, modulus_pa=1e5, cap=Cap(9e-3), cut=True), 20e-3, 5e-3, 1e5
    shape = (BODIES["rigid"].ball(radius),)
    force = Track((0.0, 1.0), (0.0, 12.0))
    scene = Scene((Contact(shape=shape, body="rigid", force_n=force, x_mm=20.0, y_mm=30.0),)).on_cover(Skin(), cover)
    assert scene.truth(0.0).count == 0

    def force_n(x):
        columns = 2 * math.pi * radius * modulus * thick * (9 / 10) ** 2 * (-x - math.log1p(-x))  # on caps of 9 mm
        return columns * (1 + COUPLING * thick / (2 * radius * x))

    for seconds in (0.2, 0.5, 1.0):
        x = brentq(lambda x, force=12 * seconds: force_n(x) - force, 1e-6, 0.99)
        assert scene.truth(seconds).area_mm2 == pytest.approx(2e6 * math.pi * radius * thick * x, rel=2e-3)
    contact = Contact(shape=shape, body="rigid", force_n=12.0, speed_mm_s=100.0, x_mm=20.0, y_mm=30.0)
    touch = Scene((contact,)).on_cover(Skin(), cover)
    assert touch.settled_s == pytest.approx(thick * x / 0.1, rel=1e-3)
    assert touch.loads(thick * x / 0.2)[0].force_n == pytest.approx(force_n(x / 2), rel=2e-3)


def test_place_and_angle_follow_the_time():
    scene = one(
        contacts.ellipse(12.4, 4.4), Swing(50, 20, 0.5), Track((0, 2), (10, 30)), angle_deg=Track((0, 1), (0, 90))
    )
    skin = sheet_of(1.0, size=64)
    for seconds, x, y in ((0.0, 70, 10), (1.0, 30, 20), (2.0, 70, 30)):
        (contact,) = scene.truth(seconds).contacts
        assert (contact.x_mm, contact.y_mm) == pytest.approx((x, y))
        assert contact.area_mm2 == pytest.approx(12.4 * 4.4 * math.pi)
    cells = scene.pressed(1.0, skin)
    assert np.ptp(np.nonzero(cells)[0]) == 24
    assert np.ptp(np.nonzero(cells)[1]) == 8


def test_angles_turn_from_x_toward_y():
    cells = one(contacts.edge(40, 4), 30, 30, angle_deg=30.0).pressed(0.0, sheet_of(1.0, size=64))
    for along in (-18, -9, 0, 9, 18):
        row, column = (30 + along * ratio for ratio in (math.sin(math.pi / 6), math.cos(math.pi / 6)))
        assert cells[round(row), round(column)]
    assert not cells[30 + 9, 30 - 15]


def test_a_track_that_cannot_be_is_refused():
    with pytest.raises(ValueError, match="a track has 2 times and 1 values"):
        Track((0, 1), (0,))
    with pytest.raises(ValueError, match=r"times of a track are \(0, 1, 1\)"):
        Track((0, 1, 1), (0, 1, 2))


@pytest.mark.parametrize("angle", [0.0, 33.0, 90.0])
def test_a_pair_is_two_from_the_gap_on(angle):
    for gap, count in ((-4.0, 1), (0.0, 1), (0.001, 2), (7.0, 2)):
        scene = Scene(contacts.pair(gap, 6.0, 40, 30, angle))
        truth = scene.truth(0.0)
        assert truth.count == count
        middle = np.average([one[1:] for one in truth.contacts], axis=0)
        assert middle == pytest.approx((40, 30))
    with pytest.raises(ValueError, match=r"gap_mm is -12.0; two discs of 6.0 mm need more than -12 mm"):
        contacts.pair(-12.0, 6.0, 40, 30)


# ---- cells against the continuous shape


@pytest.mark.parametrize("model", ["patch", "point", "foam"])
def test_moved_by_one_pitch_the_cells_move_by_one_switch(model):
    skin = sheet_of(3.0, 4.0, size=24)
    cover = Cover(model, switch=small_face(0.1))
    shape = contacts.palm(0.4)
    here = one(shape, 30.3, 41.7, angle_deg=25.0, force_n=20.0).pressed(0.0, skin, cover)
    for columns, rows in ((1, 0), (0, 1), (-3, 2)):
        moved = one(shape, 30.3 + 3 * columns, 41.7 + 4 * rows, angle_deg=25.0, force_n=20.0)
        assert np.array_equal(moved.pressed(0.0, skin, cover), np.roll(here, (rows, columns), axis=(0, 1)))
    assert here.sum() > 5
    assert not here[[0, 1, -1, -2]].any()


def disc_on_a_grid(ratio, cover, steps=120):
    """Over all places in a cell: mean count of cells, and RMS distance of their barycenter from the disc's middle."""
    place = (np.arange(steps) + 0.5) / steps - 0.5
    reach = int(ratio) + 2
    x = np.arange(-reach, reach + 1.0)
    counts, squares = [], []
    for y_mm in place:
        scenes_here = [one(contacts.disc(ratio), x_mm, y_mm) for x_mm in place]
        for scene in scenes_here:
            cells = cover.under(scene.loads(0.0), x * 1e-3, x[:, None] * 1e-3)
            count = cells.sum()
            counts.append(count)
            if count:
                contact = scene.contacts[0]
                dx = (cells * x).sum() / count - contact.x_mm
                dy = (cells * x[:, None]).sum() / count - contact.y_mm
                squares.append(dx * dx + dy * dy)
    return float(np.mean(counts)), math.sqrt(np.mean(squares))


@pytest.mark.parametrize(
    ("ratio", "rms"),
    sample(
        [
            *[(0.5, 0.35358), (0.7071, 0.26820), (1, 0.23136), (1.5, 0.20504)],
            *[(2, 0.15045), (3, 0.13091), (5, 0.10970), (8, 0.06943)],
        ],
        quick=[(0.5, 0.35358), (3, 0.13091)],
        slow=[(1, 0.23136)],
    ),
)
def test_a_disc_on_a_grid_has_its_reference_values(ratio, rms):
    count, found = disc_on_a_grid(ratio, Cover())
    assert count == pytest.approx(math.pi * ratio**2, rel=5e-3)
    assert found == pytest.approx(rms, rel=5e-3)


def test_cells_come_to_the_truth_as_the_pitch_goes_to_nothing():
    # For smooth shapes the center rule is off by pitch^1.5 in area and barycenter: 32 times finer, 181 times less.
    rng = np.random.default_rng(3)
    errors = {}
    for pitch in (4.0, 0.5, 0.125):
        found = []
        for _ in range(40):
            x_mm, y_mm, angle = rng.uniform(0, 4), rng.uniform(0, 4), rng.uniform(0, 180)
            scene = Scene((Contact(shape=contacts.ellipse(24, 15), x_mm=x_mm, y_mm=y_mm, angle_deg=angle),))
            axis = np.arange(-round(32 / pitch), round(36 / pitch) + 1) * pitch
            cells = Cover().under(scene.loads(0.0), axis * 1e-3, axis[:, None] * 1e-3)
            (truth,) = scene.truth(0.0).contacts
            row, column = np.nonzero(cells)
            found.append(
                (
                    len(row) * pitch**2 / truth.area_mm2 - 1,
                    axis[column].mean() - truth.x_mm,
                    axis[row].mean() - truth.y_mm,
                )
            )
        errors[pitch] = np.sqrt(np.mean(np.square(found), axis=0))
    for finer, coarser, factor in ((0.5, 4.0, 8), (0.125, 0.5, 4)):
        gain = errors[coarser] / errors[finer]
        assert (gain > 0.5 * factor**1.5).all()
        assert (gain < 2 * factor**1.5).all()
    assert errors[0.125][0] < 1e-3
    assert errors[0.125][1:].max() < 5e-3


def test_the_truth_on_a_sheet_ends_half_a_pitch_beyond_its_switches():
    skin = Skin(rows=4, columns=8, pitch_x_mm=5.0, pitch_y_mm=10.0, settle_us=20.0)
    scene = one(contacts.edge(1000, 6), 0, 20)
    assert scene.truth(0.0).area_mm2 == pytest.approx(6000)
    (contact,) = scene.truth(0.0, skin).contacts
    assert contact.area_mm2 == pytest.approx(8 * 5 * 6)
    assert (contact.x_mm, contact.y_mm) == pytest.approx((17.5, 20))
    assert one(contacts.disc(3), -5.6, 0).truth(0.0, skin).count == 0


@pytest.mark.parametrize("family", ["bumper", "fingers", "pair", "palm", "edge"])
def test_a_touch_ends_as_the_scene_that_it_rises_to(family):
    for still, touch in zip(placements(family, 5, 3, Skin()), touches(family, 5, 3, Skin()), strict=True):
        assert 0 < touch.settled_s < 2.0
        assert touch.loads(0.0) == []
        for one, other in zip(touch.truth(touch.settled_s).contacts, still.truth(0.0).contacts, strict=True):
            assert tuple(one) == pytest.approx(tuple(other))
        forces = [sum(load.force_n for load in touch.loads(share * touch.settled_s)) for share in (0.1, 0.5, 0.9, 2)]
        assert forces == sorted(forces)
        assert forces[-1] == pytest.approx(sum(load.force_n for load in still.loads(0.0)))


def test_a_switch_with_hysteresis_remembers():
    """A finger that comes and goes: the switch closes at 0.5 N on its cap and opens at 0.4 N."""
    force = contacts.Track((0.0, 1.0, 2.0), (0.0, 1.0, 0.0))
    finger = Scene((Contact(shape=contacts.disc(3.0), x_mm=50.0, y_mm=50.0, force_n=force),))
    cover = Cover("foam", 1e-3, Switch(0.5, hysteresis=0.2), cap=Cap(9e-3), cut=True)
    cells = finger.on(Skin(), cover)
    assert [int(cells(t).sum()) for t in (0.45, 0.55, 1.0, 1.55, 1.65)] == [0, 1, 1, 1, 0]


def test_each_scene_of_a_family_is_on_a_sheet_drawn_for_it():
    """The switch that gives way first is another one on other sheets, and the same on the same."""
    cover = Cover("foam", 2e-3, Switch(0.4, 5.8e-3**2, spread=0.3), cap=Cap(5.8e-3), cut=True)
    skin = Skin(pitch_x_mm=6.4, pitch_y_mm=6.4)
    scenes = [placements("palm", 4, seed, skin) for seed in (0, 0, 1)]
    plate = (Contact(shape=contacts.edge(102.4, 102.4), x_mm=48.0, y_mm=48.0, force_n=0.4 * 256, body="rigid"),)
    first, again, other = (
        [Scene(plate, one.drawn).pressed(0.0, skin, cover).tobytes() for one in some] for some in scenes
    )
    assert first == again
    assert len({*first, *other}) == 8
