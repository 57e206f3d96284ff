"""Pitch and cover of `contactfpga fit`: against a search that tries everything, and against binomial chances."""

import dataclasses
import math

import numpy as np
import pytest
from fits import chosen
from scipy import ndimage
from scipy.stats import binom

from contactfpga.design.cover import Cells, Ellipse, Switch, load_cover
from contactfpga.design.cover.felt import BODY, Touch
from contactfpga.skin import Skin
from contactfpga.tools import cli
from contactfpga_sim.apps import stats
from contactfpga_sim.apps.covers import tiled
from contactfpga_sim.apps.fit import faces, measuring, search
from contactfpga_sim.apps.fit.candidates import candidates
from contactfpga_sim.apps.fit.sources import source
from contactfpga_sim.apps.fit.trial import Goals

pytestmark = pytest.mark.usefixtures("alone")

PITCHES = (8.0, 10.0, 40 / 3, 20.0)
LIMIT = 0.15
SURELY = 0.02
"""Three standard deviations of either count more than this are still below the limit's interval."""
NEW = 200
"""Scenes on which everything is tried."""


def random_file(seed):
    """One or two small contacts on a small sheet, as a file."""
    rng = np.random.default_rng(seed)
    size, force = rng.uniform(6, 16), rng.uniform(1, 6)
    contacts = f'shape = "disc"\nradius_mm = {size / 2}\nforce_n = {force}\nnumber = [1, 2]\napproach_mm_s = 100\n'
    return f"width_mm = 80\nheight_mm = 80\ngap_mm = {rng.uniform(6, 16)}\nseed = {seed}\n[[contact]]\n{contacts}"


def miscounted(given, lines, cover, numbers, structure):
    """Share of scenes with another number of pieces of closed switches than contacts were drawn."""
    skin = Skin(rows=lines, columns=lines, pitch_x_mm=80 / lines, pitch_y_mm=80 / lines, settle_us=20.0)
    cells = Cells(cover, lines, lines, 0.08 / lines, 0.08 / lines)
    wrong = 0
    for number in numbers:
        scene, seconds = given.at(skin, skin, number)
        _, count = ndimage.label(cells.closed(scene.loads(seconds)), structure)
        wrong += count != len(scene.contacts)
    return wrong / len(numbers)


def agrees(path):
    """Whether the chosen sheet is the coarsest that is good enough on many newly drawn scenes, within chance."""
    made = faces.faces(("caps", "tiles"), (0.4,))
    given, count = source(path), 200
    methods = [{"labeller": "serial", "report": "moments", "connectivity": c} for c in (4, 8)]
    tried = candidates(Skin(), [(p, p) for p in PITCHES], (80.0, 80.0), methods, ["raster"], covers=made)
    found = chosen(path, tried=tried, count=count, miscounted=LIMIT, missed=None, barycenter_mm=None, unfelt=None)
    shares = {
        (lines, name, connectivity): miscounted(
            given, lines, made[name](80 / lines), range(1000, 1000 + NEW), structure
        )
        for lines in (4, 6, 8, 10)
        for name in made
        for connectivity, structure in ((4, None), (8, np.ones((3, 3))))
    }
    surely = {one for one, share in shares.items() if share <= SURELY}
    perhaps = {one for one, share in shares.items() if share < LIMIT + 2 * math.sqrt(LIMIT * (1 - LIMIT) / NEW)}
    if found.answer is None:
        return not surely
    settings = dict(found.answer.candidate.settings)
    good = (settings["rows"], settings["cover"], settings["connectivity"]) in perhaps
    return good and settings["rows"] <= min((lines for lines, _, _ in surely), default=10)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_the_sheet_is_the_coarsest_of_all_that_are_good_enough(seed, file, shortcuts):
    assert agrees(file(random_file(seed)))


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


def test_a_fingertip_is_felt_where_the_least_closing_force_is_reached():
    """Without spread as `cover felt` says, which other tests judge."""
    cover = dataclasses.replace(tiled(10.0), switch=Switch(0.4))
    for force, expected in ((0.39, 1.0), (8.0, 0.0)):
        assert set(faces.unfelt(cover, (10.0, 10.0), force, range(20))) == {expected}
    cells, rng = Cells(cover, 9, 9, 0.01, 0.01), np.random.default_rng(1)
    touch = Touch(cells, Ellipse(6e-3, 5e-3), BODY)
    places = zip(*rng.uniform(35e-3, 45e-3, (2, 400)), rng.uniform(0, math.pi, 400))
    least = np.array([touch.closing_n(cells.thresholds_n[None], *place)[0][0] for place in places])
    for force in (0.6, 0.8, 1.0):
        share = np.mean(faces.unfelt(cover, (10.0, 10.0), force, range(50)))
        assert share == pytest.approx(np.mean(least > force), abs=4 * 0.5 / math.sqrt(400) * math.sqrt(2))


def test_the_answers_file_has_the_cover_that_was_chosen(file, tmp_path, shortcuts, monkeypatch):
    monkeypatch.setattr(search, "CHECKED", 0)
    output = tmp_path / "my.toml"
    text = 'width_mm = 80\nheight_mm = 80\n[[contact]]\nshape = "disc"\nradius_mm = 8\nforce_n = 10\n'
    options = ["--placements", "100", "--pitch-mm", "16", "--labeller", "single", "--dome-n", "0.25", "--miscounted",
               "10", "--missed", "10"]  # fmt: skip
    assert cli.main(["fit", file(text), *options, "--cover", "tiles", "--output", str(output)]) == 0
    cover = load_cover(output)
    assert cover == faces.faces(("tiles",), (0.25,))["tiles, 0.25 N"](16.0)
    assert cli.main(["fit", file(text), *options, "--skin", str(output), "--cover", "caps"]) == 1
    again = tmp_path / "again.toml"
    own = [one for one in options if one not in ("--dome-n", "0.25")]
    assert cli.main(["fit", file(text), *own, "--skin", str(output), "--output", str(again)]) == 0
    assert load_cover(again) == cover
