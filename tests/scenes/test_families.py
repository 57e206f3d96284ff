"""Families of scenes: the same ones for the same seed, on the sheet, and what their names say."""

import itertools

import numpy as np
import pytest

from contactfpga.skin import Skin
from contactfpga_sim.model.scenes.families import FAMILIES, placements

FINE = Skin(rows=64, columns=64, pitch_x_mm=5.0, pitch_y_mm=5.0, settle_us=20.0)
SMALL = Skin(rows=13, columns=6, pitch_x_mm=3.4, pitch_y_mm=3.4, settle_us=20.0)


@pytest.mark.parametrize("family", FAMILIES)
def test_the_same_seed_gives_the_same_scenes(family):
    scenes = placements(family, 6, 11, FINE)
    assert scenes == placements(family, 6, 11, FINE)
    assert scenes[4:] == placements(family, 2, 11, FINE, first=4)
    assert len({repr(scene) for scene in (*scenes, *placements(family, 6, 12, FINE))}) == 12


def test_families_do_not_share_their_places():
    # Both draw a size and then an angle, one of a full turn and one of half a turn.
    hand, bar = (placements(family, 1, 0, FINE)[0].contacts[0] for family in ("palm", "edge"))
    assert hand.angle_deg / 360 != pytest.approx(bar.angle_deg / 180)


COUNTS = {
    "bumper": {1},
    "fingers": {2, 3, 4, 5},
    "pair": {2},
    "palm": {1},
    "sole": {2},
    "edge": {1},
    "moving": {1},
    "finger": {1},
}


@pytest.mark.parametrize("family", FAMILIES)
def test_scenes_lie_on_the_sheet_and_have_the_contacts_their_family_says(family):
    found = set()
    for scene in placements(family, 20, 1, FINE):
        for seconds in (0.0, 0.37):
            truth = scene.truth(seconds, FINE)
            found.add(truth.count)
            # What is on the sheet is all there is, to the accuracy of the integral over its rows.
            assert truth.area_mm2 == pytest.approx(scene.truth(seconds).area_mm2, rel=1e-6)
            assert scene.pressed(seconds, FINE).any()
    assert found == COUNTS[family]


@pytest.mark.parametrize("family", FAMILIES)
def test_places_fill_the_sheet(family):
    centers = np.array([scene.truth(0.0, FINE).contacts[0][1:] for scene in placements(family, 60, 2, FINE)])
    for axis in (0, 1):
        low, high = centers[:, axis].min(), centers[:, axis].max()
        assert high - low > (20 if family == "sole" else 100)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_sheet_that_is_too_small_gets_what_fits(family):
    for scene in placements(family, 20, 3, SMALL):
        truth = scene.truth(0.0, SMALL)
        assert truth.count >= 1
        assert truth.area_mm2 <= 13 * 6 * 3.4**2 * (1 + 1e-9)


def test_another_pitch_over_the_same_extents_gets_the_same_scenes():
    coarse = Skin(rows=16, columns=16, pitch_x_mm=20.0, pitch_y_mm=20.0, settle_us=20.0)
    for family in FAMILIES:
        for here, there in zip(placements(family, 5, 4, FINE), placements(family, 5, 4, coarse), strict=True):
            for one, other in zip(here.truth(0.2).contacts, there.truth(0.2).contacts, strict=True):
                assert other.area_mm2 == pytest.approx(one.area_mm2)
                # Cell (0, 0) lies at 0 mm, half a pitch from the corner.
                assert (other.x_mm + 10, other.y_mm + 10) == pytest.approx((one.x_mm + 2.5, one.y_mm + 2.5))


@pytest.mark.parametrize("gap", [0.5, 8.0, 20.0])
def test_gaps_are_as_asked_for(gap):
    for scene in placements("pair", 10, 5, FINE, gap_mm=gap):
        one, other = scene.truth(0.0).contacts
        assert np.hypot(one.x_mm - other.x_mm, one.y_mm - other.y_mm) == pytest.approx(12 + gap)
    for scene in placements("fingers", 30, 5, FINE, gap_mm=gap):
        parts = [load.parts[0] for load in scene.loads(0.0)]
        for one, other in itertools.combinations(parts, 2):
            apart = np.hypot(one.x_m - other.x_m, one.y_m - other.y_m)
            assert apart * 1e3 >= (one.half_x_m + other.half_x_m) * 1e3 + gap - 1e-9


def test_a_finger_is_one_of_the_fingers_and_may_have_a_size():
    radii = [
        (part.half_x_m, part.half_y_m)
        for scene in placements("finger", 20, 5, FINE, half_mm=(7.0, 7.0), ratio=(1.0, 1.0))
        for part in scene.loads(0.0)[0].parts
    ]
    assert np.allclose(radii, 7e-3)
    for family in ("finger", "fingers"):
        loads = [load for scene in placements(family, 150, 5, FINE) for load in scene.loads(0.0)]
        halves = [load.parts[0].half_x_m * 1e3 for load in loads]
        ratios = [load.parts[0].half_y_m / load.parts[0].half_x_m for load in loads]
        for values, (low, high) in ((halves, (5, 10)), (ratios, (0.6, 1)), ([load.force_n for load in loads], (2, 20))):
            assert low <= min(values) < low + 0.1 * (high - low) < high - 0.1 * (high - low) < max(values) <= high


def test_a_moving_finger_has_its_speed():
    for scene in placements("moving", 10, 6, FINE, speed_mm_s=300.0):
        step = 1e-5
        (before,), (after,) = (scene.truth(seconds).contacts for seconds in (0.4, 0.4 + step))
        assert np.hypot(after.x_mm - before.x_mm, after.y_mm - before.y_mm) / step == pytest.approx(300, rel=1e-3)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: placements("elbows", 1, 0, FINE), r"family 'elbows' is not known; take one of bumper, fingers, pair"),
        (lambda: placements("pair", -1, 0, FINE), r"count is -1, seed is 0, first is 0; each must be 0 or above"),
        (lambda: placements("pair", 1, 0, FINE, gap_mm=-12.0), r"gap_mm is -12.0; two discs of 6.0 mm need more"),
        (lambda: placements("fingers", 1, 0, FINE, most=1), r"gap_mm is 5.0 and most is 1; they must be at least 0"),
    ],
)
def test_what_is_no_family_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
