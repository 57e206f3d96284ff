"""The study of levels of force: bodies on finite elements against a dense solution and closed forms, and what its
verdict rests on. No other test kills a body that presses with too little flesh, a narrow gap that parts a contact, a
cell that touches by its own preload, and a verdict within the intervals."""

import math

import numpy as np
import pytest

from contactfpga.design.cover import BODIES, Cover
from contactfpga_sim.apps import light
from contactfpga_sim.apps.covers import FOAM_M, sheet
from contactfpga_sim.apps.light import Reading, Sensed
from contactfpga_sim.apps.score import MODELS, Interval, Score
from contactfpga_sim.lab.benchmark import scenes
from contactfpga_sim.lab.benchmark.pressed import FOAM_MM, Contact, flesh, pressed, tiles
from contactfpga_sim.lab.benchmark.scenes import FAMILIES
from contactfpga_sim.lab.cover.elements import touching
from contactfpga_sim.lab.levels import compute, tables
from contactfpga_sim.lab.levels.compute import Judged
from contactfpga_sim.model.scenes import contacts
from contactfpga_sim.model.scenes.families import placements
from contactfpga_sim.model.scenes.scene import Scene

PITCH_MM = 6.4
SKIN = sheet(PITCH_MM)


# ---- bodies on finite elements


@pytest.mark.parametrize("thickness", [6, 10])
def test_flesh_yields_to_a_wide_flat_body_as_a_layer_does(thickness):
    """Under 1 MPa a layer of 1 MPa yields by its thickness, while strains are small."""
    quarter, step = flesh(float(thickness), 1.28), 1.28
    whole = 4 * quarter[1:, 1:].sum() + 2 * (quarter[0, 1:].sum() + quarter[1:, 0].sum()) + quarter[0, 0]
    assert whole * step**2 == pytest.approx(thickness, rel=0.1)


def test_a_tile_yields_to_a_flat_cap_as_its_foam_does():
    sheet = tiles(PITCH_MM)
    pressure = 1e-3
    force = np.full(sheet.per**2, pressure * (PITCH_MM - 0.6) ** 2 / sheet.per**2)
    assert (sheet.compliance @ force).mean() == pytest.approx(FOAM_MM * pressure / (Cover().modulus_pa / 1e6), rel=0.05)


@pytest.mark.parametrize("body", ["finger", "rigid"])
def test_a_light_touch_is_that_of_a_dense_solution(body):
    """All displacements by all forces, solved at the depth that the contact has."""
    per = tiles(PITCH_MM).per
    x = np.arange(3 * per) - 1.4 * per
    height = 2e-5 * (x**2 + (x[:, None] + 1) ** 2)
    contact = Contact(PITCH_MM, BODIES[body], height)
    compliance = np.array([contact.moved(unit).ravel() for unit in np.eye(height.size).reshape(-1, *height.shape)])
    force = contact.pressed(2e-4).ravel()
    depth = (compliance @ force + height.ravel())[force > force.max() / 2].mean()
    assert 4 < np.count_nonzero(force) < force.size
    assert force == pytest.approx(touching(compliance, depth - height.ravel()), abs=0.02 * force.max())


@pytest.mark.parametrize(("force_n", "touching"), [(2e-4, 1), (0.5, 13)])
def test_a_body_that_first_touches_with_one_patch_presses_as_many_as_it_reaches(force_n, touching):
    per = tiles(PITCH_MM).per
    away = np.abs(np.arange(3 * per) - 3 * per // 2)
    contact = Contact(PITCH_MM, BODIES["rigid"], 0.31 * np.hypot(away, away[:, None]))
    force = contact.pressed(force_n)
    assert force.sum() == pytest.approx(force_n)
    assert force.max() == force[away == 0][:, away == 0]
    assert np.count_nonzero(force) == touching


@pytest.mark.parametrize("family", FAMILIES)
def test_the_cells_carry_each_body(family):
    (scene,) = placements(family, 1, 4, SKIN)
    found, model = pressed(scene, SKIN), scenes.pressed_by("model", scene, SKIN)
    assert found.forces_n.sum() == pytest.approx(sum(contact.force_n for contact in scene.contacts), rel=1e-6)
    assert len(found.joined) == len(model.contacts)
    for one, other in zip(
        *(sorted(way, key=lambda one: (one.y_mm, one.x_mm)) for way in (found.joined, model.contacts))
    ):
        assert one.area_mm2 == pytest.approx(other.area_mm2, rel=0.2)
        assert math.dist((one.x_mm, one.y_mm), (other.x_mm, other.y_mm)) < 1.5


# ---- what counts as one contact


def test_gaps_narrower_than_the_foam_may_join():
    """Two fingers, by the distance of their pressed rims."""
    for gap in np.arange(7.0, 13.0, 0.5):
        scene = Scene(contacts.pair(gap, 6.0, 80.0, 75.0, force_n=10.0))
        found = scenes.pressed_by("model", scene, SKIN)
        one, other = sorted(found.contacts, key=lambda one: one.x_mm)
        between = other.x_mm - one.x_mm - 2 * math.sqrt(one.area_mm2 / math.pi)
        assert len(found.joined) == (1 if between < 1e3 * FOAM_M else 2), gap
    assert len({len(pressed(Scene(contacts.pair(gap, 6.0, 80.0, 75.0)), SKIN).joined) for gap in (4.0, 13.0)}) == 2


# ---- cells


def test_an_untouched_sheet_reads_nothing_however_old_its_preload(monkeypatch):
    """Without the guard in the mask some sheets do."""
    reading, rest = Reading((0.05, 0.2)), np.zeros((40, 40))
    assert not any(Sensed(rest, seed).levels(reading).any() for seed in range(100))
    monkeypatch.setattr(light, "GUARD", 1.0)
    assert any(Sensed(rest, seed).levels(reading).any() for seed in range(100))


def test_levels_are_the_forces_that_are_reached():
    read = np.mean(
        [Sensed(np.full((40, 40), force), 3).levels(Reading((0.1, 0.4, 1.6))) for force in (0.2, 0.8, 3.2)], (1, 2)
    )
    assert read == pytest.approx([1, 2, 3], abs=0.02)


# ---- choice and verdict


def test_the_choice_is_the_least_of_the_worst_families():
    readings = (Reading((0.1,)), Reading((0.2,)), Reading((0.1, 0.4)), Reading((0.1, 0.8)))

    def piece(*wrong, place=1.0):
        return [[(one, one, math.nan if one else place - 0.1 * at) for at, one in enumerate(wrong)]]

    even = piece(0, 0, 0, 0)
    found = [piece(1, 0, 1, 1), piece(0, 1, 1, 0), even]
    assert compute.choices(readings, ["pair", "palm", "palm"], found, 1) == (readings[1], readings[3])
    assert compute.choices(readings, ["pair"], [even], 1) == (readings[1], readings[3])
    assert compute.choices(readings, ["pair"], [even], 2) == (*readings[1::-1], *readings[:1:-1])


def judged(pitch_mm, count, low, high):
    best, worst = Interval(0, 0, 0, 400), Interval((low + high) / 2, low, high, 400)
    scores = {(family, model): Score(*[best] * 5) for model in MODELS for family in (*FAMILIES, "all")}
    scores["palm", "elements"] = scores["pair", "model"] = Score(worst, *[best] * 4)
    return Judged(pitch_mm, Reading(tuple(0.1 * 4.0**level for level in range(count))), scores)


def test_levels_win_beyond_the_intervals_alone():
    assert judged(5.0, 3, 0.1, 0.2).beats(judged(5.0, 1, 0.21, 0.3))
    assert not judged(5.0, 3, 0.1, 0.2).beats(judged(5.0, 1, 0.19, 0.3))
    one_model = judged(5.0, 3, 0.1, 0.2)
    one_model.scores["edge", "elements"] = Score(*[Interval(0.5, 0.4, 0.6, 400)] * 5)
    assert not one_model.beats(judged(5.0, 1, 0.21, 0.3))


def test_rivals_cost_no_more():
    found = [judged(pitch, count, 0.1, 0.2) for pitch in scenes.PITCHES_MM for count in (1, 2, 3, 4)]
    pairs = tables.rivals(found)
    places = [(three.pitch_mm, one.pitch_mm) for three, one in pairs]
    assert places == [(4, 4), (5, 5), (5, 4), (6.4, 6.4), (6.4, 5), (8, 8), (8, 6.4)]
    assert all(len(three.reading.forces_n) == 3 and one.map_bytes <= three.map_bytes for three, one in pairs)
    assert (found[6].map_bytes, found[6].wires, found[6].row_time) == (32 * 32 * 2 / 8, 64, 1)
