"""Scenes in files: what is said is drawn, where it is said, as far apart as it is said, and nothing else is taken."""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from contactfpga.skin import Skin
from contactfpga_sim.model.scenes import contacts
from contactfpga_sim.model.scenes.contacts import M, Track
from contactfpga_sim.model.scenes.file import Range, SceneFile, SceneFileError, distance_mm, scene_of

ROOT = Path(__file__).resolve().parents[2]
SHEETS = [Skin(rows=200 // pitch, columns=200 // pitch, pitch_x_mm=pitch, pitch_y_mm=pitch) for pitch in (10, 20, 25)]
DISC = '[[contact]]\nshape = "disc"\nradius_mm = 10\n'


@pytest.fixture
def load(tmp_path):
    def load(text, name="scenes.toml"):
        (tmp_path / name).write_text(text)
        return SceneFile.load(tmp_path / name)

    return load


def from_corner(scene, skin, seconds=0.0):
    """Contacts (area, x, y) in mm, counted from the sheet's corner."""
    half_x, half_y = skin.pitch_x_mm / 2, skin.pitch_y_mm / 2
    return [(one.area_mm2, one.x_mm + half_x, one.y_mm + half_y) for one in scene.truth(seconds, skin).contacts]


def test_places_count_from_the_corner_whatever_the_pitch(load):
    file = load(DISC + "x_mm = 40\ny_mm = 70\n")
    for skin in SHEETS:
        assert from_corner(scene_of(file, 0, skin)[0], skin) == [pytest.approx((math.pi * 100, 40, 70))]


def test_a_scene_goes_by_what_the_file_says_and_not_by_its_name(load):
    text = DISC + "number = 2\n[[contact]]\nshape = 'palm'\n"
    file, same, other = load(text), load("seed = 0\n" + text, "b.toml"), load("seed = 1\n" + text)
    scenes = [[scene_of(each, number, SHEETS[0]) for number in range(5)] for each in (file, same, other)]
    assert scenes[0] == scenes[1]
    assert len({repr(scene) for scene in scenes[0] + scenes[2]}) == 10


def test_all_of_a_range_is_drawn_and_nothing_else(load):
    text = (
        '[[contact]]\nshape = "ellipse"\nlength_mm = [20, 30]\nwidth_mm = 10\nnumber = [1, 3]\nx_mm = [50, 60]\n'
        "y_mm = 70\nangle_deg = [0, 90]\nforce_n = [2, 20]\n"
    )
    file = load(text)
    drawn = [scene_of(file, number, SHEETS[0])[0].contacts for number in range(300)]
    every = [contact for scene in drawn for contact in scene]
    assert {len(scene) for scene in drawn} == {1, 2, 3}
    corner = -SHEETS[0].pitch_x_mm / 2
    values = {
        "length": ([2 * one.shape[0].half_x_m / M for one in every], 20, 30),
        "width": ([2 * one.shape[0].half_y_m / M for one in every], 10, 10),
        "x": ([one.x_mm - corner for one in every], 50, 60),
        "y": ([one.y_mm - corner for one in every], 70, 70),
        "angle": ([one.angle_deg for one in every], 0, 90),
        "force": ([one.force_n for one in every], 2, 20),
    }
    for found, low, high in values.values():
        reach = high - low
        assert min(found) == pytest.approx(low, abs=0.02 * reach + 1e-9)
        assert max(found) == pytest.approx(high, abs=0.02 * reach + 1e-9)
        assert np.mean(found) == pytest.approx((low + high) / 2, abs=0.06 * reach + 1e-9)


def outline(shape, count=2000):
    """Points on the boundaries of the parts, in mm."""
    points = []
    for part in shape:
        low, high = part.y_m - part.half_box_m[1], part.y_m + part.half_box_m[1]
        y = part.y_m - (high - low) / 2 * np.cos(np.linspace(1e-4, math.pi - 1e-4, count))
        points += [np.column_stack([x, y]) for x in part.span(y)]
    return np.concatenate(points) / M


def test_distances_are_those_of_the_outlines():
    rng = np.random.default_rng(4)
    kinds = [contacts.disc(8), contacts.ellipse(15, 5), contacts.edge(30, 6), contacts.palm(), contacts.sole(230)]
    for one, other in itertools.product(kinds, kinds):
        angles = rng.uniform(0, 7, 2)
        first = tuple(part.placed(0, 0, angles[0]) for part in one)
        second = tuple(part.placed(0.3 * math.cos(angles[1]), 0.3 * math.sin(angles[1]), angles[1]) for part in other)
        a, b = outline(first, 200), outline(second, 200)
        nearest = float(cdist(a, b).min())
        assert nearest - 0.6 <= distance_mm(first, second) <= nearest + 1e-9
    assert distance_mm(contacts.disc(8), tuple(part.placed(0.01, 0, 0) for part in contacts.disc(8))) < 0


def test_contacts_keep_their_distance(load):
    text = 'gap_mm = 10\n[[contact]]\nshape = "palm"\nscale = 0.7\n[[contact]]\nshape = "edge"\nlength_mm = 40\n'
    file = load(text + "width_mm = 8\nnumber = 2\nangle_deg = [0, 180]\n")
    closest = []
    for number in range(40):
        scene, _ = scene_of(file, number, SHEETS[0])
        shapes = [contact.load(0.0).parts for contact in scene.contacts]
        closest.append(min(distance_mm(a, b) for a, b in itertools.combinations(shapes, 2)))
        assert scene.truth(0.0, SHEETS[0]).count == 3
    assert 10 <= min(closest) < 13


def test_contacts_that_cannot_keep_their_distance_are_refused(load):
    file = load("gap_mm = 300\n" + DISC + "number = 2\n")
    message = r"gap_mm is 300; contacts found no places so far apart in 200 tries on a sheet of 200 x 200 mm"
    with pytest.raises(SceneFileError, match=message):
        scene_of(file, 0, SHEETS[0])


def test_a_contact_follows_its_track_and_touches_while_it_presses(load):
    text = "seconds = 2\n" + DISC + "x_mm = {seconds = [0, 2], values = [20, 180]}\ny_mm = 50\n"
    file = load(text + "force_n = {seconds = [0, 1], values = [-0.0, 10]}\n")
    scene, _ = scene_of(file, 0, SHEETS[0])
    assert scene.truth(0.0).count == 0
    for seconds, x in ((0.5, 60), (1.5, 140)):
        assert from_corner(scene, SHEETS[0], seconds) == [pytest.approx((math.pi * 100, x, 50))]


def test_a_contact_slides_with_its_speed(load):
    file = load("seconds = 0.5\n" + DISC + "x_mm = 60\ny_mm = 60\nspeed_mm_s = 100\nheading_deg = 30\n")
    scene, _ = scene_of(file, 0, SHEETS[0])
    ((_, x, y),) = from_corner(scene, SHEETS[0], 0.25)
    assert (x, y) == pytest.approx((60 + 25 * math.cos(math.pi / 6), 60 + 12.5))


def test_instants_are_spread_over_the_scene(load):
    file = load("seconds = 3\n" + DISC)
    instants = [scene_of(file, number, SHEETS[0])[1] for number in range(200)]
    assert 0 <= min(instants) < 0.1
    assert 2.9 < max(instants) <= 3
    assert scene_of(load(DISC), 5, SHEETS[0])[1] == 0


def test_what_a_file_says_is_what_is_read(load):
    file = load(
        "width_mm = 100\nheight_mm = 50.5\ncount = 40\nseed = 7\ngap_mm = 2\nseconds = 1\n"
        '[[contact]]\nshape = "sole"\nnumber = [0, 2]\nforce_n = {seconds = [0.0], values = [3]}\n'
    )
    (kind,) = file.kinds
    assert (file.width_mm, file.height_mm, file.count, file.seed, file.gap_mm, file.seconds) == (100, 50.5, 40, 7, 2, 1)
    assert kind.sizes == (("length_mm", Range(260, 260)),)
    assert kind.number == (0, 2)
    assert kind.force_n == Track((0.0,), (3.0,))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "contact is None; a scene file has one part [[contact]] at least"),
        ("contact = [3]", "contact 1 is 3; it must be a part, [[contact]]"),
        ("x = = 1", "not a TOML file"),
        ("color = 1\n" + DISC, "a scene file has the key 'color'; known are contact, width_mm"),
        ("width_mm = 0\n" + DISC, "width_mm is 0; it must lie between 0.1 and 100000"),
        ("count = 1\n" + DISC, "count is 1; it must lie between 2 and 1000000"),
        ("[[contact]]\n", "contact 1: shape is None; it must be one of disc, ellipse, edge, palm, sole"),
        ('[[contact]]\nshape = "cube"', "contact 1: shape is 'cube'; it must be one of disc"),
        ('[[contact]]\nshape = "disc"', "contact 1: radius_mm is missing"),
        (
            DISC + "length_mm = 3",
            "contact 1, a disc, has the key 'length_mm'; known are radius_mm, shape, body, number",
        ),
        (DISC.replace("10", "0"), "contact 1: radius_mm is 0; it must lie between 0.01 and 100000"),
        (DISC.replace("10", "[9, 8]"), "contact 1: radius_mm is [9, 8]; the least comes first"),
        (DISC + "number = [3, 2]", "contact 1: number is [3, 2]; it must be 1 or more"),
        (DISC + "number = 0", "contact 1: number is 0; it must be 1 or more, or [least, most]"),
        (DISC + "number = 65", "contact 1: number is 65; it must lie between 0 and 64"),
        (DISC + "x_mm = {seconds = 1}", "contact 1: x_mm is {'seconds': 1}; it must be {seconds = [...], values"),
        (DISC + "x_mm = {seconds = [0], values = ['a']}", "contact 1: x_mm: values is 'a'; it must be a finite number"),
        (DISC + 'body = "foot"', "contact 1: body is 'foot'; it must be one of finger, palm, forearm, rigid"),
        (
            DISC + "speed_mm_s = 1\nx_mm = {seconds = [0], values = [1]}",
            "contact 1 has speed_mm_s and a track; leave one of them out",
        ),
    ],
)
def test_what_cannot_be_is_refused_with_value_and_limit(load, text, message):
    with pytest.raises(SceneFileError) as caught:
        load(text)
    assert message in str(caught.value)
    assert "scenes.toml: " in str(caught.value)


@pytest.mark.parametrize("name", ["bumper", "hands", "sole"])
def test_the_examples_are_read(name):
    file = SceneFile.load(ROOT / "examples" / f"scenes-{name}.toml")
    width, height = file.width_mm, file.height_mm
    skin = Skin(rows=round(height / 10), columns=round(width / 10), settle_us=20.0)
    counts = {scene_of(file, number, skin)[0].truth(0.0, skin).count for number in range(25)}
    assert counts == {"bumper": {1}, "hands": {2, 3, 4}, "sole": {2}}[name]
