"""The cheapest Skin that meets the limits: against a search that tries everything, and in other orders."""

import dataclasses
import itertools
import json
import math
import random
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np
import pytest
from amaranth.back import rtlil
from scipy.stats import binomtest

from contactfpga import cli
from contactfpga.skin import Skin
from contactfpga_hdl.board import sizes
from contactfpga_hdl.top import Top
from contactfpga_sim.pages import figures, fit_page, writer
from contactfpga_sim.studies import kept, pool, size
from contactfpga_sim.studies.chart import speed
from contactfpga_sim.studies.chart.errors import Interval, interval
from contactfpga_sim.studies.chart.speed import Speed
from contactfpga_sim.studies.fit import cost, search, sources
from contactfpga_sim.studies.fit.candidates import METHODS, candidates, pitches_for, size_for
from contactfpga_sim.studies.fit.goals import Goals, Measured
from contactfpga_sim.studies.fit.search import fit
from contactfpga_sim.studies.fit.sources import source
from contactfpga_sim.studies.fit.trial import Task

UNSOLVED = 3
ROOT = Path(__file__).resolve().parents[2]

BUMPER = 'width_mm = 80\nheight_mm = 80\ncount = 100\n[[contact]]\nshape = "disc"\nradius_mm = [12, 18]\n'
SECOND = '[[contact]]\nshape = "disc"\nradius_mm = 12\n'
APART = "gap_mm = 16\n"
HANDS = APART + BUMPER.replace("[12, 18]", "12") + "number = [2, 3]\n"

LUTS = {"cells": 300, "single": 500, "serial": 520, "projection": 560, "run": 800}


def made_up(skin):
    """LUT4 in the order that synthesis finds, without its minutes."""
    by = "cells" if skin.report == "cells" else skin.labeller
    more = 150 * (skin.scan == "adaptive") + 20 * (skin.connectivity == 4 and by in ("serial", "run"))
    return LUTS[by] + more + 5 * (skin.rows + skin.columns)


@pytest.fixture(autouse=True)
def alone(tmp_path, monkeypatch):
    """Results of this test only, in threads of this process."""
    monkeypatch.setattr(kept, "cache_folder", lambda: tmp_path / "kept")
    monkeypatch.setattr(pool, "executor", lambda jobs, dask: ThreadPoolExecutor(1))


class Shortcuts:
    """What was asked of them."""

    def __init__(self):
        self.sized = []
        self.checked = []

    def luts_of(self, skin):
        self.sized.append(skin)
        return made_up(skin)

    def measure(self, skin, frames, checked):
        self.checked.append((skin, checked))
        size = 12 + skin.rows * math.ceil(skin.columns / 8) if skin.report == "cells" else 17
        scan = 6.0 * skin.rows * (0.5 if skin.scan == "adaptive" else 1)
        return Speed(1.5 * scan + 10 * size / 3, 2 * scan + 10 * size / 3, scan, size, scan, 1e6 / scan)


MEASURE = speed.measure


@pytest.fixture
def shortcuts(monkeypatch):
    """Sizes and times by formulas: seconds in the place of minutes. Some tests take the real ones."""
    used = Shortcuts()
    monkeypatch.setattr(cost, "luts_of", used.luts_of)
    monkeypatch.setattr(speed, "measure", used.measure)
    return used


@pytest.fixture
def file(tmp_path):
    def file(text, name="scenes.toml"):
        (tmp_path / name).write_text(text)
        return str(tmp_path / name)

    return file


def chosen(*names, pitches=(10.0, 20.0), shuffled=None, tried=None, **limits):
    """The fit on these scenes, and the candidates in the order of ``shuffled``."""
    given = tuple(map(source, names))
    options = {name: limits.pop(name) for name in ("host_us", "quick", "base") if name in limits}
    base = options.pop("base", None)
    if tried is None:
        tried = candidates(base or Skin(), pitches_for(base, given, pitches), size_for(base, given))
    if shuffled is not None:
        random.Random(shuffled).shuffle(tried)
    task = Task(given, names, base or Skin(), Goals(**limits), sources.default_count(given), timed=6, **options)
    with ThreadPoolExecutor(1) as executor:
        return fit(task, tried, executor)


# ---- what is chosen


def test_one_contact_needs_single_and_a_second_one_an_exact_labeller(file, shortcuts):
    one = chosen(file(BUMPER), barycenter_mm=8.0)
    two = chosen(file(APART + BUMPER + SECOND), barycenter_mm=8.0)
    assert (one.answer.skin.labeller, one.runner_up.skin.labeller) == ("single", "serial")
    assert two.answer.skin.labeller == "serial"
    assert (one.broken, two.broken) == ((), ())
    refused = {trial.skin.labeller: trial for trial in two.cheaper if trial.skin.report == "moments"}
    assert refused["single"].measured[0].errors["miscounted"].mean == 1
    assert refused["single"].refusals[0].startswith("miscounts 100 % of scenes (96.3 to 100), limit 5 %")


def test_hands_need_an_exact_labeller(file, shortcuts):
    found = chosen(file(HANDS), barycenter_mm=4.0)
    assert found.answer.skin.labeller == "serial"
    assert found.answer.measured[0].errors["miscounted"].mean == 0


def test_neither_names_nor_orders_make_a_difference(file, shortcuts):
    texts = [BUMPER, HANDS]
    names = [("bumper.toml", "hands.toml"), ("x.toml", "0.toml")]
    answers = set()
    for shuffled, ((one, other), turned) in enumerate(itertools.product(names, (False, True))):
        paths = [file(text, name) for text, name in zip(texts, (one, other))]
        found = chosen(*(paths[::-1] if turned else paths), shuffled=shuffled)
        costs = [trial.cost for trial in (found.answer, found.runner_up, *found.cheaper)]
        answers.add((found.answer.skin, found.runner_up.skin, *(one.skin for one in found.cheaper), *costs))
    assert len(answers) == 1


def test_what_is_called_hands_is_no_hand(file, shortcuts):
    bumper, renamed = (chosen(file(BUMPER, name)) for name in ("bumper.toml", "hands.toml"))
    assert renamed.answer == bumper.answer
    swapped = chosen(file(HANDS, "bumper.toml"))
    assert swapped.answer.skin.labeller == "serial"


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
            passing.append((made_up(skin), skin.rows + skin.columns))
    assert found.answer.cost[:2] == min(passing)
    assert found.answer.skin.rows > min(one.skin.rows for one in found.cheaper)
    for trial in found.cheaper:
        assert trial.cost <= found.answer.cost
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


# ---- limits


def test_a_latency_that_is_too_long_is_refused_with_its_worst(file, shortcuts, monkeypatch):
    monkeypatch.setattr(speed, "measure", MEASURE)
    monkeypatch.setattr(search, "CHECKED", 0)  # compiles a board
    path, given = file(BUMPER), source(file(BUMPER))
    tried = candidates(Skin(), [(20.0, 20.0)], (80.0, 80.0), METHODS[:1], ["raster"])
    frames = given.cells(tried[0].skin, Skin(), [index * 100 // 6 for index in range(6)], 100)
    worst = MEASURE(tried[0].skin, frames, 0).worst_us
    found = chosen(path, tried=tried, latency_us=worst, barycenter_mm=8.0)
    assert found.answer.measured[0].speed.worst_us == worst
    refused = chosen(path, tried=tried, latency_us=worst - 1, barycenter_mm=8.0)
    assert refused.answer is None
    assert refused.cheaper[0].refusals == (f"latency {worst:.0f} us at worst, limit {worst - 1:.0f} us",)


def test_touches_of_the_answer_go_through_the_gateware_as_well(file, shortcuts):
    found = chosen(file(BUMPER))
    assert [one for one in shortcuts.checked if one[1]] == [(found.answer.skin, 2)]


def test_bitmaps_need_a_host_that_says_its_time(file, shortcuts):
    path = file(HANDS)
    refused = next(one for one in chosen(path).cheaper if one.skin.report == "cells")
    assert refused.refusals[0] == "reports no zones: say with --host-us how long the host takes to find them"
    admitted = chosen(path, host_us=100.0)
    assert admitted.answer.skin.report == "cells"
    alike = next(one for one in chosen(path).cheaper if one.skin == admitted.answer.skin)
    assert admitted.answer.measured[0].speed.worst_us == alike.measured[0].speed.worst_us + 100


def test_nothing_that_meets_the_limits_gives_the_nearest(file, shortcuts):
    found = chosen(file(BUMPER), barycenter_mm=0.1)
    assert found.answer is None
    assert shortcuts.sized == []
    nearest = found.cheaper[0]
    assert nearest.excess == min(one.excess for one in found.cheaper) > 1
    assert nearest.skin.pitch_x_mm == 10
    assert nearest.measured[0].errors["barycenter_mm"].high / 0.1 == pytest.approx(nearest.excess)


def measured(**errors):
    usual = {name: Interval(0.0, 0.0, 0.0, 100) for name in ("miscounted", "missed", "barycenter_mm", "area")}
    return Measured(usual | errors, Speed(100.0, 200.0, 50.0, 17.0, 60.0, 1e4))


def test_errors_are_judged_by_the_upper_end_and_what_is_reported_by_the_mean():
    goals = Goals(miscounted=0.05, latency_us=200.0)
    doubtful = measured(miscounted=Interval(0.04, 0.02, 0.08, 100))
    message = "miscounts 4 % of scenes (2 to 8), limit 5 %: too few scenes to tell"
    assert list(goals.misses(doubtful)) == [(pytest.approx(1.6), message)]
    assert list(goals.misses(doubtful, sure=False)) == []
    wrong = measured(miscounted=Interval(0.06, 0.05, 0.07, 100))
    assert [words for _, words in goals.misses(wrong, sure=False)] == ["miscounts 6 % of scenes (5 to 7), limit 5 %"]
    assert goals.excess(measured()) == 1


def test_what_was_never_found_meets_no_limit():
    nothing = Interval(math.nan, math.nan, math.nan, 0)
    assert list(Goals().misses(measured(barycenter_mm=nothing))) == [(math.inf, "finds no contact")]
    assert list(Goals(barycenter_mm=None).misses(measured(barycenter_mm=nothing))) == []


def test_a_single_value_tells_nothing_of_the_mean():
    one = interval([2.5])
    assert (one.mean, one.low, one.high, one.count) == (2.5, -math.inf, math.inf, 1)
    words = [words for _, words in Goals().misses(measured(barycenter_mm=one))]
    assert words == ["barycenter off by 2.5 mm (0 to inf), limit 5 mm: too few scenes to tell"]


def test_a_share_that_so_few_scenes_cannot_show_is_refused():
    for limit in (0.5, 0.05, 0.003):
        need = next(n for n in itertools.count(1) if binomtest(0, n).proportion_ci(method="wilson").high <= limit)
        Goals(miscounted=limit, missed=None).check_count(need)
        with pytest.raises(ValueError, match=f"take {need} scenes or more"):
            Goals(miscounted=limit, missed=None).check_count(need - 1)


# ---- what it costs


def test_no_more_is_synthesized_than_the_order_of_the_cheapest_needs(file, shortcuts):
    pitches = (5.0, 8.0, 10.0, 16.0, 20.0)
    found = chosen(file(BUMPER), pitches=pitches)
    asked = len(shortcuts.sized)
    everything = candidates(Skin(), [(pitch, pitch) for pitch in pitches], (80.0, 80.0))
    possible = [one for one in everything if one.skin is not None]
    assert asked < 0.7 * len(possible)
    assert len(set(shortcuts.sized)) == asked
    below = [one for one in possible if made_up(one.skin) < found.answer.luts]
    assert {one.skin for one in below} == {one.skin for one in found.cheaper if one.luts < found.answer.luts}
    assert found.dearer == len(possible) - len(found.cheaper) - 1
    rest = [made_up(one.skin) for one in possible if one.skin not in {trial.skin for trial in found.cheaper}]
    assert sorted(rest)[:1] == [found.answer.luts]


def test_quick_synthesizes_no_refused_ones(file, shortcuts):
    path = file(HANDS)
    slow = chosen(path)
    every = len(shortcuts.sized)
    shortcuts.sized.clear()
    quick = chosen(path, quick=True)
    assert (quick.answer, quick.runner_up, quick.cheaper) == (slow.answer, slow.runner_up, ())
    assert len(shortcuts.sized) < every
    assert {skin.labeller for skin in shortcuts.sized} == {"serial", "run"}


def test_wires_then_bytes_decide_between_equal_luts(file, shortcuts, monkeypatch):
    monkeypatch.setattr(cost, "luts_of", lambda skin: 500)
    found = chosen(file(BUMPER), pitches=(10.0, 20.0), barycenter_mm=None, host_us=0.0)
    assert found.answer.wires == 8
    assert found.answer.bytes == min(one.bytes for one in (found.answer, found.runner_up))
    assert found.answer.cost <= found.runner_up.cost


@pytest.mark.campaign
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("method", METHODS, ids=lambda method: " ".join(map(str, method.values())))
def test_no_method_needs_fewer_luts_on_a_finer_sheet(method, monkeypatch):
    monkeypatch.undo()  # what was synthesized before is kept
    for scan in ("raster", "adaptive"):
        tried = candidates(
            Skin(), [(p, p) for p in (32.0, 20.0, 16.0, 10.0, 8.0, 5.0)], (160.0, 160.0), [method], [scan]
        )
        luts = [cost.luts_of(one.skin) for one in tried if one.skin is not None]
        assert luts == sorted(luts)
        assert len(set(luts)) == len(luts)


# ---- what is tried


def test_candidates_are_what_was_asked_for(file):
    base = Skin(
        rows=12, columns=9, pitch_x_mm=10, pitch_y_mm=5, debounce="sym_defer_pk", mask=((1, 2),), settle_us=40.0
    )
    tried = candidates(base, pitches_for(base, [], None), size_for(base, []))
    assert {(round(one.skin.columns * one.skin.pitch_x_mm, 6), round(one.skin.rows * one.skin.pitch_y_mm, 6))
            for one in tried if one.skin} == {(90.0, 60.0)}  # fmt: skip
    for one in tried:
        if one.skin is None:
            continue
        assert one.skin.debounce == "sym_defer_pk"
        assert one.skin.mask == (((1, 2),) if (one.skin.rows, one.skin.columns) == (12, 9) else ())
    own = [one for one in tried if dict(one.settings)["rows"] == 12 and dict(one.settings)["columns"] == 9]
    assert len(own) == 2 * len(METHODS)


def test_a_skin_that_cannot_be_is_listed_with_its_reason(file, shortcuts):
    found = chosen(file(BUMPER), pitches=(1.0, 20.0))
    assert all(one.refusals[0].startswith("Skin refuses: rows is 80; it must lie between 1 and 64") for one in
               found.impossible if dict(one.candidate.settings)["rows"] == 80)  # fmt: skip
    assert len([one for one in found.impossible if dict(one.candidate.settings)["rows"] == 80]) == 14


@pytest.mark.parametrize("pitch", [5.0, 10.0, 20.0])
def test_a_built_in_scene_is_the_same_on_every_pitch(pitch):
    base, lines = Skin(), round(160 / pitch)
    skin = Skin(rows=lines, columns=lines, pitch_x_mm=pitch, pitch_y_mm=pitch, settle_us=20.0)
    for number in range(5):
        reference, seconds = source("two_fingers").at(base, base, number)
        scene, same = source("two_fingers").at(skin, base, number)
        assert seconds == same
        for one, other in zip(reference.truth(seconds).contacts, scene.truth(seconds).contacts, strict=True):
            assert one.x_mm + 5 == pytest.approx(other.x_mm + pitch / 2)
            assert one.y_mm + 5 == pytest.approx(other.y_mm + pitch / 2)


def test_sheets_that_differ_are_refused(file):
    small = file(BUMPER, "a.toml")
    large = file(BUMPER.replace("80", "90"), "b.toml")
    with pytest.raises(ValueError, match="one sheet is 80 x 80 mm, another one 90 x 90 mm"):
        size_for(None, [source(small), source(large)])
    assert size_for(Skin(), [source(small), source(large)]) == (160.0, 160.0)
    assert size_for(None, [source("bumper")]) == (160.0, 160.0)


# ---- the command


def test_the_command_writes_a_skin_that_loads_and_builds(file, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(search, "CHECKED", 0)  # compiles a board
    built = []
    monkeypatch.setattr(size, "luts", lambda component, _: built.append(rtlil.convert(component())) or 423)
    output = tmp_path / "my.toml"
    options = ["--pitch-mm", "20", "--labeller", "single", "--scan", "raster", "--placements", "73"]
    limits = ["--barycenter-mm", "none", "--miscounted", "10", "--missed", "10"]
    path = file(BUMPER.replace("[12, 18]", "[16, 20]"))
    assert cli.main(["fit", path, *options, *limits, "--json", "--output", str(output)]) == 0
    said = json.loads(capsys.readouterr().out)
    skin = Skin.load(output)
    assert skin == Skin(rows=4, columns=4, pitch_x_mm=20.0, pitch_y_mm=20.0, labeller="single")
    assert said["meets"]
    assert said["answer"]["settings"]["labeller"] == "single"
    assert said["answer"]["luts"] == 423
    assert "# 423 LUT4 on iCE40UP5K, 8 wires" in output.read_text()
    assert len(built) == 1
    assert "top" in built[0]


@pytest.mark.campaign
def test_the_luts_are_those_of_place_and_route():
    skin = Skin(rows=4, columns=4, labeller="single")
    found = sizes.luts(lambda: Top(skin), sizes.UP5K)
    assert 300 < found < 700
    assert (
        found == sizes.measure(lambda: Top(skin), sizes.UP5K, seeds=1).luts == size.luts(lambda: Top(skin), cost.DEVICE)
    )


def test_the_command_says_what_it_chose_and_why(file, shortcuts, capsys):
    assert cli.main(["fit", file(HANDS), "--pitch-mm", "10", "--barycenter-mm", "4"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "miscounts 100 % of scenes (96.3 to 100), limit 5 %" in said
    assert "the answer" in said
    assert "runner-up" in said
    assert "On scenes not used to choose the answer meets all limits." in said


def test_the_command_fails_where_nothing_meets_the_limits(file, tmp_path, shortcuts, capsys):
    output = tmp_path / "none.toml"
    arguments = ["fit", file(BUMPER), "--pitch-mm", "20", "--barycenter-mm", "0.1", "--output", str(output)]
    assert cli.main(arguments) == UNSOLVED
    said = " ".join(capsys.readouterr().out.split())
    assert "No Skin that was tried meets the limits. The nearest is" in said
    assert "it misses: barycenter off by" in said
    assert not output.exists()
    assert cli.main([*arguments, "--json"]) == UNSOLVED
    found = json.loads(capsys.readouterr().out)
    assert (found["meets"], found["answer"]) == (False, None)
    assert found["nearest"]["reported"]


def test_the_command_fails_where_other_scenes_break_a_limit(tmp_path, shortcuts, capsys):
    cells = np.zeros((200, 8, 8), bool)
    cells[:, 1:3, 1:3] = True
    cells[100:, 5:7, 5:7] = True
    path = tmp_path / "recording.npy"
    np.save(path, cells)
    assert cli.main(["fit", str(path)]) == UNSOLVED
    said = " ".join(capsys.readouterr().out.split())
    assert "On scenes not used to choose the answer misses its limits: miscounts 100 % of scenes" in said
    assert "Of a recording nobody knows what touched" in said


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["guess"], "scene 'guess' is not known; take a .toml, .npz or .npy file, or one of bumper, fingers"),
        (["none.toml"], "No such file"),
        (["bumper", "--placements", "50"], "the limit of miscounted is 5 %; take 73 scenes or more"),
        (["bumper", "--labeller", "x"], "labeller is 'x'; it must be one of 'run', 'serial', 'projection', 'single'"),
        (["bumper", "--scan", "x"], "--scan 'x' is not known; take one of: raster; adaptive; reversal"),
    ],
)
def test_what_cannot_be_asked_is_refused(arguments, message, capsys):
    assert cli.main(["fit", *arguments]) == 1
    assert message in capsys.readouterr().err


def test_a_recording_of_few_frames_is_refused(tmp_path, capsys):
    np.save(tmp_path / "few.npy", np.ones((3, 4, 4), bool))
    assert cli.main(["fit", str(tmp_path / "few.npy")]) == 1
    assert "few.npy has 3 frames; two to choose with and two to report are the least" in capsys.readouterr().err


@pytest.mark.parametrize("name", fit_page.EXAMPLES)
def test_the_page_shows_what_the_examples_say(name):
    command = f"contactfpga fit {fit_page.EXAMPLES[name]}"
    assert command in (ROOT / fit_page.EXAMPLES[name].split()[0]).read_text()
    section = (
        (ROOT / "docs" / "fit.md").read_text().partition(f"<!-- figures: {name} -->")[2].partition("<!-- end -->")[0]
    )
    assert f"\n    {command}\n" in section
    assert section.count("| the answer |") == section.count("| runner-up |") == 1


def test_a_section_of_the_page_has_the_command_and_all_it_says(file, shortcuts):
    path = file(HANDS)
    section = fit_page.section(f"{path} --pitch-mm 10 --scan raster")
    lines = section.splitlines()
    assert lines[0] == f"    contactfpga fit {path} --pitch-mm 10 --scan raster"
    assert lines[2:4] == [
        "| zones by | scan | sheet | pitch mm | LUT4 | wires | bytes | latency us | verdict |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    verdicts = [line.split(" | ")[-1].removesuffix(" |") for line in lines[4:] if line.count(" | ") == 8]
    assert verdicts[-2:] == ["the answer", "runner-up"]
    assert verdicts[1].startswith("miscounts 100 % of scenes")
    assert section.endswith("cheaper ones are refused; 4 others cost more. Skin itself refuses 0 more settings.")


@pytest.mark.campaign
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("name", fit_page.EXAMPLES)
def test_the_page_is_up_to_date(name, monkeypatch):
    monkeypatch.undo()  # what was synthesized before is kept
    text = (ROOT / "docs" / "fit.md").read_text()
    assert writer.update(text, {name: fit_page.TABLES[name]}) == text


@pytest.mark.campaign
@pytest.mark.timeout(3600)
def test_a_second_contact_in_the_bumpers_file_changes_the_answer(file, monkeypatch):
    """With real sizes and times."""
    monkeypatch.undo()  # what was synthesized before is kept
    text = (ROOT / "examples" / "scenes-bumper.toml").read_text()
    limits = {"barycenter_mm": 3.0, "latency_us": 500.0, "pitches": None, "quick": True}
    one, two = chosen(file(text), **limits), chosen(file(APART + text + SECOND), **limits)
    assert one.answer.skin == Skin(labeller="single")
    assert two.answer.skin == Skin(labeller="serial")
    assert (one.broken, two.broken) == ((), ())


@pytest.mark.recordings
def test_real_contacts_need_an_exact_labeller(shortcuts):
    path = figures.RECORDINGS / "dtmf16x16.dev.npz"
    if not path.exists():
        pytest.skip("the recordings are not there")
    found = chosen(str(path), pitches=None, latency_us=None)
    assert found.answer.skin.labeller == "serial"
    assert found.answer.skin.connectivity == 8


def test_dataclasses_of_a_task_can_be_sent_to_another_process(file):
    import pickle

    task = Task((source(file(HANDS)), source("moving")), ("a", "b"), Skin(), Goals(), 10)
    assert pickle.loads(pickle.dumps(task)) == task
    assert dataclasses.replace(task, count=11) != task
