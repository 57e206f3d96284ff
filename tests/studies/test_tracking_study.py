"""How the tracker is judged: the truth of its scenes, the scores beside the baseline, and where it breaks."""

import csv
import importlib.util
import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from recorded_frames import path_of
from sample import sample
from study_pages import section

from contactfpga_sim.lab.tracking import scenes, scores, tables
from contactfpga_sim.lab.tracking.scores import Nearest

ROOT = Path(__file__).resolve().parents[2]
PITCH_MM = 10.0
PAGE_RATES = ("100", "10,000")
NAMES = [name for name in scores.TRACKERS if name != "Norfair" or importlib.util.find_spec("norfair")]
"""Norfair is compared where it is installed."""


@pytest.mark.parametrize("family", scenes.FAMILIES)
def test_truth_lies_where_a_zone_is_that_no_other_contact_has(family):
    fingers = scenes.FAMILIES[family](np.random.default_rng(3))
    seen = 0
    for shown in scenes.played(fingers, 40.0):
        places = [(zone.x_mm, zone.y_mm) for zone in shown.zones]
        alone = [place for place in places if place not in shown.shared]
        assert len(alone) + len(shown.shared) == len(places)
        for number, place in shown.truth.items():
            seen += 1
            near = [one for one in alone if math.dist(one, place) < PITCH_MM]
            assert near or fingers[number].bounces
    assert seen > 20


def test_a_tap_bounces_at_both_ends():
    finger = scenes.tapping(np.random.default_rng(1))[0]
    skin = scenes.SKIN
    some = [finger.cells(finger.begins_s + ms / 1000, skin).any() for ms in (-1, 0.5, 1.5, 2.5, 3.5)]
    assert some == [False, True, False, True, True]
    assert not finger.cells(finger.ends_s - 0.0015, skin).any()
    assert not finger.cells(finger.ends_s, skin).any()


def test_the_baseline_takes_the_closest_pairs_first():
    nearest = Nearest(gate_mm=20.0)

    def update(cells):
        pressed = np.zeros((16, 16), bool)
        for row, column in cells:
            pressed[row, column] = True
        return nearest.update(scenes.zones_of(pressed, 0)[0])

    assert update([(3, 3), (3, 6)]) == {1: (30.0, 30.0), 2: (60.0, 30.0)}
    assert update([(3, 4), (3, 7)]) == {1: (40.0, 30.0), 2: (70.0, 30.0)}
    assert update([(3, 6)]) == {2: (60.0, 30.0)}
    assert update([(9, 9)]) == {3: (90.0, 90.0)}


def test_scores_are_those_counted_by_hand():
    """Two contacts, four frames: one id changes, one is missed once, one is where nothing is."""
    pytest.importorskip("motmetrics")
    here, there, away = (0.0, 0.0), (50.0, 0.0), (150.0, 150.0)
    history = [
        ({0: here, 1: there}, {7: here, 8: there}),
        ({0: here, 1: there}, {7: here, 9: there}),
        ({0: here, 1: there}, {7: here}),
        ({0: here, 1: there}, {7: here, 9: there, 5: away}),
    ]
    found = scores.score([history])
    assert (found.frames, found.switches, found.switches_per_1000) == (4, 1, 250.0)
    assert found.mota == pytest.approx(1 - (1 + 1 + 1) / 8)
    assert found.idf1 == pytest.approx(2 * 6 / (8 + 8))


def test_on_the_page_it_is_behind_no_other_at_any_rate():
    rows = [line[2:-2].split(" | ") for line in section("tracking.md", "ahead").splitlines()[2:]]
    assert {(row[0].strip("`"), row[1]) for row in rows} == set(itertools.product(scenes.FAMILIES, PAGE_RATES))
    for row in rows:
        for gained, half in (map(float, cell.split(" ± ")) for cell in row[2:]):
            assert gained + half >= 0, row


def test_on_the_page_it_is_ahead_in_the_mean_at_each_rate():
    lines = section("tracking.md", "scores").splitlines()
    means = [line[2:-2].split(" | ") for line in lines if line.startswith("| mean of all | ")]
    assert [row[1] for row in means] == ["25", *PAGE_RATES]
    for ours, *others in ([float(cell.strip("*")) for cell in row[2:6]] for row in means):
        assert ours > max(others)


@pytest.mark.parametrize("name", NAMES)
def test_a_contact_keeps_its_id_at_five_frames_per_second(name):
    cells = np.zeros((16, 16), bool)
    cells[5, 5] = True
    update = scores.TRACKERS[name]()
    assert [list(update(scenes.zones_of(cells, 200_000 * number)[0])) for number in range(3)] == [[1]] * 3


def scored(each, counted):
    """Scenes with these scores, that count for so much."""
    known = [(one, count) for one, count in zip(each, counted) if count]
    mean = sum(one * count for one, count in known) / sum(counted)
    return scores.Score(100, 0.0, mean, 0, each, counted)


def test_the_interval_of_scenes_that_count_alike_is_students():
    found = scored((0.9, 0.7, 0.8, math.nan), (10.0, 10.0, 10.0, 0.0))
    assert found.half == pytest.approx(4.303 * 0.1 / math.sqrt(3), rel=1e-3)


def test_the_interval_of_scenes_that_count_otherwise_covers_as_often_as_it_says(rng):
    """Scores of 0 or 1, of scenes of any length."""
    covered = 0
    for _ in range(1000):
        counted = tuple(rng.uniform(50, 150) for _ in range(40))
        found = scored(tuple(float(rng.random() < 0.7) for _ in counted), counted)
        covered += abs(found.idf1 - 0.7) <= found.half
    assert 0.92 < covered / 1000 < 0.975


def test_who_is_ahead_in_every_scene_by_the_same_is_ahead_for_sure():
    each, counted = np.array([0.2, 0.5, 0.9]), (10.0, 20.0, 30.0)
    gained, half = scores.ahead(scored(tuple(each + 0.1), counted), scored(tuple(each), counted))
    assert (gained, half) == (pytest.approx(0.1), pytest.approx(0.0, abs=1e-12))


@pytest.mark.slow  # 5 s
def test_a_row_of_the_scores_is_up_to_date():
    pytest.importorskip("motmetrics")
    found = scores.of_family("meeting", 100.0, names=tuple(NAMES))
    with open(ROOT / "docs/tables/tracking-scores.csv", encoding="utf-8") as file:
        row = next(row for row in csv.reader(file) if row[:2] == ["`meeting`", "100"])
    cells = [f"{100 * one.idf1:.1f} ± {100 * one.half:.1f}" for one in found.values()]
    assert row[2 : 2 + len(cells)] == cells


def test_ten_thousand_frames_per_second_with_two_contacts():
    """Of processor time, so that nothing else counts; a slower machine decodes slower, too."""
    found = tables.measure(2, 2048)
    assert found.tracked > 10_000 or found.ratio < 2


def test_overlap_links_the_frames_of_a_recording(tmp_path):
    cells = np.zeros((4, 8, 12), bool)
    for number in range(4):
        cells[number, 2:4, number : number + 2] = True
        cells[number, 6, 11 - number] = True  # one cell that moves on by one: no overlap, so it is another one
    np.savez(tmp_path / "one.npz", pressed=cells, rate_hz=50.0, pitch_mm=5.0, segment=np.array([0, 0, 0, 1]))
    first, second = scores.histories(tmp_path / "one.npz", 1)
    assert [sorted(shown.truth) for shown in first] == [[0, 1], [0, 2], [0, 3]]
    assert [shown.zones.time_us for shown in first] == [0, 20_000, 40_000]
    assert first[1].truth[0] == (7.5, 12.5)
    assert sorted(second[0].truth) == [0, 1]


@pytest.mark.recordings
@pytest.mark.parametrize("name", sample(["sdh13x6", "feet45x52"], quick=["sdh13x6"]))
def test_on_recordings_it_is_no_worse_than_the_nearest_zone(name):
    pytest.importorskip("motmetrics")
    stretches = [stretch[:200] for stretch in scores.histories(path_of(name), 1)[:2]]
    ours, nearest = (
        scores.score([scores.followed(scores.TRACKERS[name](), one, scores.JUDGED_HZ) for one in stretches])
        for name in ("`Tracker`", "nearest zone")
    )
    assert ours.idf1 >= nearest.idf1 - 0.01
