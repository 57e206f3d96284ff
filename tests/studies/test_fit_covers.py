"""Pitch, cover and levels of `contactfpga fit`: against a search that tries everything, and against binomial chances.
No other test kills an order from dear to cheap."""

import dataclasses
import math

import numpy as np
import pytest
from fits import chosen
from scipy.stats import binom, binomtest
from zone_oracles import counted

from contactfpga.design.circuit import CircuitError, falling, load_circuit
from contactfpga.design.cover import Cells, Ellipse, Switch, load_cover
from contactfpga.design.cover.felt import BODY, Touch
from contactfpga.skin import Skin
from contactfpga.tools import cli
from contactfpga_sim.apps import stats
from contactfpga_sim.apps.covers import tiled
from contactfpga_sim.apps.fit import faces, measuring, search
from contactfpga_sim.apps.fit.candidates import LEVELS, candidates
from contactfpga_sim.apps.fit.sources import source
from contactfpga_sim.apps.fit.trial import Goals
from contactfpga_sim.apps.light import Reading, Sensed

pytestmark = pytest.mark.usefixtures("alone")

PITCHES = (8.0, 10.0, 40 / 3, 20.0)
LIMIT = 0.15
SURELY = 0.03
"""Distance from the limit beyond which the race must decide."""
NEW = 300
"""Scenes on which everything is tried."""


def random_file(seed):
    """One or two small contacts on a small sheet, as a file."""
    rng = np.random.default_rng(seed)
    size, force = rng.uniform(6, 16), rng.uniform(1, 6)
    contacts = f'shape = "disc"\nradius_mm = {size / 2}\nforce_n = {force}\nnumber = [1, 2]\napproach_mm_s = 100\n'
    return f"width_mm = 80\nheight_mm = 80\ngap_mm = {rng.uniform(6, 16)}\nseed = {seed}\n[[contact]]\n{contacts}"


def miscounted(given, one, numbers):
    """Share of scenes with another number of pieces, or of parts that last, than contacts were drawn."""
    skin, settings, wrong = one.skin, dict(one.settings), 0
    lines = settings["rows"]
    cells = Cells(one.cover, lines, lines, 0.08 / lines, 0.08 / lines)
    for number in numbers:
        scene, seconds = given.at(skin, skin, number)
        forces = cells.forces_n(scene.on_cover(skin, one.cover).loads(seconds))
        if one.cover.cell is None:
            read = (forces >= cells.thresholds_n).astype(int)
        else:
            level_n, count = one.cover.cell.level_n, settings.get("levels", 1)
            steps = tuple(level_n * 4.0**level for level in range(count))
            read = Sensed(forces, scene.drawn, number).levels(Reading(steps))
        wrong += counted(read, settings["connectivity"], 2 if "levels" in settings else 1) != len(scene.contacts)
    return wrong


def check(path):
    """Fail unless the answer is good enough on newly drawn scenes, and nothing cheaper surely is, within chance."""
    made = {
        name: face for name, face in faces.faces().items() if name in ("caps, 0.4 N", "tiles, 0.4 N", "light, 0.1 N")
    }
    methods = [{"labeller": "serial", "report": "moments", "connectivity": 4}, LEVELS]
    tried = candidates(Skin(), [(p, p) for p in PITCHES], (80.0, 80.0), methods, ["raster"], covers=made)
    found = chosen(path, tried=tried, count=200, miscounted=LIMIT, missed=None, barycenter_mm=None, unfelt=None)
    given, good = source(path), [(math.inf,)]
    for one in tried:
        settings = dict(one.settings)
        cost = (2 * settings["rows"], settings["cover"].startswith("light"), "levels" in settings)
        chance = binomtest(miscounted(given, one, range(10_000, 10_000 + NEW)), NEW).proportion_ci(0.998, "wilson")
        if found.answer and one == found.answer.candidate:
            assert chance.low <= LIMIT
            answer = cost
        if chance.high <= LIMIT - SURELY:
            good.append(cost)
    assert (answer if found.answer else (math.inf,)) <= min(good)


@pytest.mark.parametrize("seed", range(3))
def test_the_answer_is_the_cheapest_of_all_that_are_good_enough(seed, file, shortcuts):
    check(file(random_file(seed)))


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(3, 53))
def test_answers_to_more_files_are_the_cheapest(seed, file, shortcuts):
    check(file(random_file(seed)))


def test_a_share_lies_beyond_its_bound_no_more_often_than_said():
    """Over all numbers of successes, by the binomial distribution."""
    for count, chance, err in ((20, 0.05, 0.01), (160, 0.05, 0.005), (500, 0.01, 0.005)):
        beyond = [0.0, 0.0]
        for wrong in range(count + 1):
            low, high = (stats.chernoff(wrong / count, count, err, end) for end in (0.0, 1.0))
            beyond[0] += (low > chance) * binom.pmf(wrong, count, chance)
            beyond[1] += (high < chance) * binom.pmf(wrong, count, chance)
        assert max(beyond) <= err
        assert max(beyond) > err / 50


def test_a_race_ends_as_soon_as_a_limit_is_surely_met_or_missed():
    goals = Goals(miscounted=0.05, missed=None, barycenter_mm=None)
    assert stats.looks(20, 500) == [20, 40, 80, 160, 320, 500]
    assert measuring.decided(goals, {"miscounted": [1.0] * 10 + [0.0] * 10}, 6) is False
    assert measuring.decided(goals, {"miscounted": [0.0] * 20}, 6) is None
    assert measuring.decided(goals, {"miscounted": [0.0] * 160}, 6) is True
    assert measuring.decided(goals, {"miscounted": [0.0] * 160, "unfelt": [1.0, *[0.0] * 159]}, 6) is None


def unfelt(cover, force, numbers):
    return faces.unfelt(cover, (10.0, 10.0), faces.touches(cover, (10.0, 10.0), force, numbers))


def test_a_fingertip_is_felt_where_the_least_closing_force_is_reached():
    """Without spread as `cover felt` says, which other tests judge."""
    cover = dataclasses.replace(tiled(10.0), switch=Switch(0.4))
    for force, expected in ((0.39, 1.0), (8.0, 0.0)):
        assert set(unfelt(cover, force, range(20))) == {expected}
    cells, rng = Cells(cover, 9, 9, 0.01, 0.01), np.random.default_rng(1)
    touch = Touch(cells, Ellipse(6e-3, 5e-3), BODY)
    places = zip(*rng.uniform(35e-3, 45e-3, (2, 400)), rng.uniform(0, math.pi, 400))
    least = np.array([touch.closing_n(cells.thresholds_n[None], *place)[0][0] for place in places])
    for force in (0.6, 0.8, 1.0):
        share = np.mean(unfelt(cover, force, range(50)))
        assert share == pytest.approx(np.mean(least > force), abs=4 * 0.5 / math.sqrt(400) * math.sqrt(2))


def test_the_answers_file_has_the_cover_that_was_chosen(file, tmp_path, shortcuts, monkeypatch):
    monkeypatch.setattr(search, "CHECKED", 0)
    output = tmp_path / "my.toml"
    text = 'width_mm = 80\nheight_mm = 80\n[[contact]]\nshape = "disc"\nradius_mm = 8\nforce_n = 10\n'
    chosen = "--placements 100 --pitch-mm 16 --labeller single --dome-n 0.25 --miscounted 10 --missed 10"
    options = chosen.split()
    assert cli.main(["fit", file(text), *options, "--cover", "tiles", "--output", str(output)]) == 0
    cover = load_cover(output)
    assert cover == faces.faces(("tiles",), (0.25,))["tiles, 0.25 N"](16.0)
    assert cli.main(["fit", file(text), *options, "--skin", str(output), "--cover", "caps"]) == 1
    again = tmp_path / "again.toml"
    own = [one for one in options if one not in ("--dome-n", "0.25")]
    assert cli.main(["fit", file(text), *own, "--skin", str(output), "--output", str(again)]) == 0
    assert load_cover(again) == cover


def test_an_answer_with_levels_is_a_file_whose_circuit_reads_its_forces(file, tmp_path, shortcuts, monkeypatch):
    """No other test kills a circuit that does not fit the written ruler, or a table that reads back otherwise."""
    monkeypatch.setattr(search, "CHECKED", 0)
    output = tmp_path / "my.toml"
    text = 'width_mm = 80\nheight_mm = 80\n[[contact]]\nshape = "disc"\nradius_mm = 8\nforce_n = 10\n'
    options = ["--placements", "100", "--pitch-mm", "16", "--cover", "light", "--labeller", "levels"]
    loose = ["--miscounted", "10", "--missed", "10", "--barycenter-mm", "none"]
    assert cli.main(["fit", file(text), *options, *loose, "--output", str(output)]) == 0
    skin, circuit, cover = Skin.load(output), load_circuit(output), load_cover(output)
    falling.check(circuit, skin)
    with pytest.raises(CircuitError, match="the latest sample comes after"):
        falling.check(circuit, skin.replace(settle_us=skin.settle_us - 1))
    for level, ruler in enumerate(skin.derived.rulers):
        ohm = float(cover.cell.ohm(np.array(cover.cell.level_n * 4.0**level)))
        assert falling.sixteenths(circuit, skin, ohm) == pytest.approx(ruler, rel=0.1, abs=1)
