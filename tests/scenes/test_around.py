"""Contacts on a sheet whose ends meet: what they press on both sides of the seam, and the truth about them."""

import dataclasses
import json
import math

import numpy as np
import pytest

from contactfpga import examples
from contactfpga.design.cover import Cover
from contactfpga.skin import Skin
from contactfpga.tools import cli
from contactfpga_sim.model.scenes import contacts
from contactfpga_sim.model.scenes import scene as scenes
from contactfpga_sim.model.scenes.contacts import Contact
from contactfpga_sim.model.scenes.families import placements
from contactfpga_sim.model.scenes.file import SceneFile, scene_of
from contactfpga_sim.model.scenes.scene import Scene

FOREARM = Skin.load(examples() / "forearm.toml")
PITCH = FOREARM.pitch_x_mm
AROUND = 2 * math.pi * 45.0


def one(shape, x_mm=0.0, y_mm=75.0, **values):
    return Scene((Contact(shape=shape, x_mm=x_mm, y_mm=y_mm, **values),))


def turned(scene, by_mm):
    """The same scene further around the limb."""
    return Scene(tuple(dataclasses.replace(contact, x_mm=contact.x_mm + by_mm) for contact in scene.contacts))


@pytest.mark.parametrize("x_mm", [-0.5 * PITCH, 3.0, AROUND - 9.0, 0.4 * AROUND, AROUND + 4.0, -5 * AROUND])
def test_a_contact_presses_what_is_near_it_either_way_around(x_mm):
    places = np.arange(16) * PITCH
    beside = np.abs((places - x_mm + AROUND / 2) % AROUND - AROUND / 2)
    near = np.hypot(beside, np.arange(16)[:, None] * 10.0 - 75.0) <= 20.0
    assert near.sum() in (6, 7, 8, 9)
    assert np.array_equal(one(contacts.disc(20.0), x_mm).pressed(0.0, FOREARM), near)


@pytest.mark.parametrize("model", ["patch", "point", "foam"])
def test_the_cover_feels_no_seam(model):
    cover = Cover(model=model)
    scene = Scene(contacts.pair(5.0, 12.0, 6.3 * PITCH, 71.0, 30.0, force_n=60.0))
    middle = scene.pressed(0.0, FOREARM, cover)
    assert middle.any()
    for columns in (5, 9, 21, -8):
        moved = turned(scene, columns * PITCH)
        assert np.array_equal(moved.pressed(0.0, FOREARM, cover), np.roll(middle, columns, axis=1))


@pytest.mark.parametrize("family", ["bumper", "fingers", "palm", "edge"])
def test_truth_is_that_of_a_flat_sheet_wherever_the_seam_lies(rng, family):
    flat = Skin(columns=12, pitch_x_mm=PITCH)  # with room beside it, so that nothing meets round the back
    for scene in placements(family, 8, 5, flat):
        here = sorted(scene.truth(0.0, flat).contacts)
        by_mm = rng.uniform(-3 * AROUND, 3 * AROUND)
        there = sorted(turned(scene, by_mm).truth(0.0, FOREARM).contacts)
        assert len(here) == len(there)
        for (area, x, y), (other_area, other_x, other_y) in zip(here, there, strict=True):
            assert (other_area, other_y) == pytest.approx((area, y), rel=1e-6)
            assert 0 <= other_x < AROUND
            assert math.cos(2 * math.pi * (other_x - x - by_mm) / AROUND) == pytest.approx(1)


def test_a_grip_goes_all_the_way_round():
    scene = scenes.AROUND["grip"](FOREARM)
    (ring,) = scene.truth(0.0, FOREARM).contacts
    assert math.isnan(ring.x_mm)
    assert (ring.area_mm2, ring.y_mm) == pytest.approx((AROUND * 45.0, 75.0))
    assert np.array_equal(scene.pressed(0.0, FOREARM).all(axis=1), np.abs(np.arange(16) * 10 - 75) <= 22.5)


def test_arms_are_a_ring_from_where_they_meet_behind():
    """Two bars of 10 mm, shifted by 4 mm along the limb."""
    for long, rings in ((0.5 * AROUND - 0.1, 0), (0.5 * AROUND + 0.1, 1)):
        bars = contacts.edge(long, 10.0)
        places = ((0.1 * AROUND, 70.0), (0.6 * AROUND, 74.0))
        scene = Scene(tuple(Contact(shape=bars, x_mm=x, y_mm=y) for x, y in places))
        truth = scene.truth(0.0, FOREARM)
        assert truth.count == 2 - rings
        assert sum(math.isnan(contact.x_mm) for contact in truth.contacts) == rings
        assert truth.area_mm2 == pytest.approx(2 * long * 10.0 - rings * 2 * 0.1 * 6.0)


def test_a_spiral_is_no_ring_and_has_a_place():
    scene = one(contacts.edge(1.5 * AROUND, 8.0), AROUND / 3, 75.0, angle_deg=15.0)
    tall = FOREARM.replace(rows=32)
    (contact,) = scene.truth(0.0, tall).contacts
    assert contact == pytest.approx((1.5 * AROUND * 8.0, AROUND / 3, 75.0))


def test_a_finger_moves_around_the_limb_and_comes_back():
    finger = scenes.AROUND["around"](FOREARM)
    found = [finger.truth(seconds, FOREARM).contacts[0].x_mm for seconds in (0.0, 0.125, 0.25, 0.5, 7.125)]
    turns = (0.0, 0.25, 0.5, 0.0, 0.25)
    assert found == pytest.approx([(turn * AROUND - PITCH / 2) % AROUND for turn in turns])
    assert {len(finger.truth(t, FOREARM).contacts) for t in np.linspace(0, 0.5, 64)} == {1}


def test_contacts_of_a_file_keep_their_gap_over_the_seam(tmp_path):
    path = tmp_path / "scenes.toml"
    path.write_text('gap_mm = 30\n[[contact]]\nshape = "disc"\nradius_mm = 15\nnumber = [2, 3]\n')
    for number in range(40):
        scene, _ = scene_of(SceneFile.load(path), number, FOREARM)
        for one_of, other in zip(scene.contacts, scene.contacts[1:], strict=False):
            across = abs((one_of.x_mm - other.x_mm + AROUND / 2) % AROUND - AROUND / 2)
            assert math.hypot(across, one_of.y_mm - other.y_mm) >= 60 - 0.02


@pytest.mark.slow
@pytest.mark.parametrize(("name", "winding"), [("around", ""), ("grip", "ring")])
def test_zones_of_a_closed_sheet_are_printed_where_they_are(capsys, name, winding):
    port = f"sim://?scene={name}&skin={examples() / 'forearm.toml'}"
    assert cli.main(["zones", port, "--json", "--once"]) == 0
    zones = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    (zone,) = zones[-1]["zones"]
    assert (zone["winding"], zone["x_mm"] is None) == (winding, bool(winding))
    if not winding:
        assert zone["x_mm"] == pytest.approx(AROUND - PITCH / 2, abs=PITCH / 2)
        assert zone["area_cells"] > 1
