"""The limits of a fit, what a Skin costs, and which ones are tried."""

import itertools
import re

import pytest
from fits import BUMPER, chosen
from scipy.stats import binomtest

from contactfpga.design.cover.stopping import peak_forces
from contactfpga.design.cover.task import FIRST_DESIGN
from contactfpga.skin import Skin
from contactfpga.tools import cli
from contactfpga_sim.apps import speed
from contactfpga_sim.apps.fit import search
from contactfpga_sim.apps.fit.candidates import METHODS, ON_HOST, candidates, pitches_for, size_for
from contactfpga_sim.apps.fit.faces import Protection, faces
from contactfpga_sim.apps.fit.sources import source
from contactfpga_sim.apps.fit.trial import Goals, Measurement
from contactfpga_sim.apps.score import Interval
from contactfpga_sim.apps.speed import Speed

pytestmark = pytest.mark.usefixtures("alone")


MEASURE = speed.measure


# ---- limits


@pytest.mark.slow
def test_a_latency_that_is_too_long_is_refused_with_its_worst(file, shortcuts, monkeypatch):
    monkeypatch.setattr(speed, "measure", MEASURE)
    monkeypatch.setattr(search, "CHECKED", 0)  # compiles a board
    path, given = file(BUMPER), source(file(BUMPER))
    tried = candidates(Skin(), [(20.0, 20.0)], (80.0, 80.0), METHODS[:1], ["raster"])
    looked = given.looks(tried[0].skin, Skin(), [index * 100 // 6 for index in range(6)], 100)
    frames = [cells for cells, _ in looked]
    worst = MEASURE(tried[0].skin, frames, 0).worst_us
    found = chosen(path, tried=tried, latency_us=worst, barycenter_mm=8.0)
    assert found.answer.measured[0].speed.worst_us == worst
    refused = chosen(path, tried=tried, latency_us=worst - 1, barycenter_mm=8.0)
    assert refused.answer is None
    assert refused.cheaper[0].refusals == (f"latency {worst:.0f} us at worst, limit {worst - 1:.0f} us",)


def test_a_cover_that_lets_an_arm_press_too_hard_is_not_tried():
    """By the arm's force over each cover; the last limit lies between those of caps and tiles."""
    base, size = Skin(), (80.0, 80.0)
    by_kind = faces(("bare", "caps", "tiles"), [0.4], 5.0)
    late = {
        kind: peak_forces(FIRST_DESIGN, cover(10.0), 0.01, 0.01).late
        for kind, cover in by_kind.items()
        if kind != "bare"
    }
    low, high = sorted(late.values())
    for limit, tried in ((high + 1, {*late}), ((low + high) / 2, {min(late, key=late.get)})):
        found = candidates(
            base,
            [(10.0, 10.0)],
            size,
            METHODS[:1],
            ["raster"],
            covers=by_kind,
            protection=Protection(FIRST_DESIGN, limit),
        )
        assert {dict(one.settings)["cover"] for one in found if one.skin} == tried
        assert any("no foam" in one.refusal for one in found)
    with pytest.raises(ValueError, match=r"no cover protects; .* N if the stop comes 6 ms after the touch, limit 1 N"):
        candidates(base, [(10.0, 10.0)], size, covers=by_kind, protection=Protection(FIRST_DESIGN, 1.0))
    stopless = Protection(FIRST_DESIGN, no_stop_n=1.0)
    assert re.fullmatch(
        r"\S+ N without a stop, limit 1 N", stopless.refusal(by_kind["tiles, 0.4 N"](10.0), (10.0, 10.0))
    )


def test_limits_of_force_need_an_arm(capsys):
    assert cli.main(["fit", "fingers", "--late-n", "30"]) == 1
    assert "--arm names the arm of --late-n and --no-stop-n" in capsys.readouterr().err


def test_touches_of_the_answer_go_through_the_gateware_as_well(file, shortcuts):
    found = chosen(file(BUMPER))
    assert [one for one in shortcuts.checked if one[1]] == [(found.answer.skin, 2)]


def test_the_hosts_time_is_added_to_the_latency_of_a_map(file, shortcuts):
    path = file(BUMPER)
    tried = candidates(Skin(), [(20.0, 20.0)], (80.0, 80.0), [ON_HOST], ["raster"])
    alone, helped = (chosen(path, tried=tried, host_us=each, barycenter_mm=8.0).answer for each in (None, 100.0))
    assert helped.measured[0].speed.worst_us == alone.measured[0].speed.worst_us + 100


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
    return Measurement(usual | errors, Speed(100.0, 200.0, 50.0, 17.0, 60.0, 1e4))


def test_errors_are_judged_by_the_upper_end_and_what_is_reported_by_the_lower():
    goals = Goals(miscounted=0.05, latency_us=200.0)
    doubtful = measured(miscounted=Interval(0.04, 0.02, 0.08, 100))
    message = "miscounts 4 % of scenes (2 to 8), limit 5 %; more --placements may tell"
    assert list(goals.misses(doubtful)) == [(pytest.approx(1.6), message)]
    assert list(goals.misses(doubtful, sure=False)) == []
    assert list(goals.misses(measured(miscounted=Interval(0.06, 0.049, 0.07, 100)), sure=False)) == []
    wrong = measured(miscounted=Interval(0.06, 0.051, 0.07, 100))
    assert [words for _, words in goals.misses(wrong, sure=False)] == ["miscounts 6 % of scenes (5.1 to 7), limit 5 %"]
    assert goals.excess(measured()) == 1


@pytest.mark.slow
def test_a_share_that_so_few_scenes_cannot_show_is_refused():
    for limit in (0.5, 0.05, 0.003):
        need = next(n for n in itertools.count(1) if binomtest(0, n).proportion_ci(method="wilson").high <= limit)
        Goals(miscounted=limit, missed=None).check_count(need)
        with pytest.raises(ValueError, match=f"give --placements {need} or more"):
            Goals(miscounted=limit, missed=None).check_count(need - 1)


# ---- what it costs


def test_the_answer_alone_is_synthesized_and_nothing_dearer_is_measured(file, shortcuts):
    pitches = (5.0, 8.0, 10.0, 16.0, 20.0)
    found = chosen(file(BUMPER), pitches=pitches)
    assert shortcuts.sized == [found.answer.skin]
    assert all(one.cost < found.answer.cost for one in found.cheaper)
    everything = candidates(Skin(), [(pitch, pitch) for pitch in pitches], (80.0, 80.0))
    fewer = {one for one in everything if one.skin is not None and one.wires < found.answer.cost[0]}
    assert fewer == {one.candidate for one in found.cheaper if one.cost[0] < found.answer.cost[0]}


# ---- what is tried


def test_candidates_are_what_was_asked_for(file):
    base = Skin(
        rows=12, columns=9, pitch_x_mm=10, pitch_y_mm=5, debounce="sym_defer_pk", mask=((1, 2),), settle_us=40.0,
        precharge_us=1.0,  # so that reversal is tried, too
    )  # fmt: skip
    tried = candidates(base, pitches_for(base, [], None), size_for(base, []))
    assert {(round(one.skin.columns * one.skin.pitch_x_mm, 6), round(one.skin.rows * one.skin.pitch_y_mm, 6))
            for one in tried if one.skin} == {(90.0, 60.0)}  # fmt: skip
    for one in tried:
        if one.skin is None:
            continue
        assert one.skin.debounce == "sym_defer_pk"
        assert one.skin.mask == (((1, 2),) if (one.skin.rows, one.skin.columns) == (12, 9) else ())
    own = [one for one in tried if dict(one.settings)["rows"] == 12 and dict(one.settings)["columns"] == 9]
    assert len(own) == 2 * (len(METHODS) - 1)  # levels need light cells


def test_a_skin_that_cannot_be_is_listed_with_its_reason(file, shortcuts):
    found = chosen(file(BUMPER), pitches=(1.0, 20.0))
    refusals = [one.refusal for one in found.impossible if dict(one.settings)["rows"] == 80]
    assert all(one.startswith("Skin refuses: rows is 80; it must lie between 1 and 64") for one in refusals)
    assert len(refusals) == len(METHODS) - 1


def test_sheets_that_differ_are_refused(file):
    small = file(BUMPER, "a.toml")
    large = file(BUMPER.replace("80", "90"), "b.toml")
    with pytest.raises(ValueError, match="one sheet is 80 x 80 mm, another one 90 x 90 mm"):
        size_for(None, [source(small), source(large)])
    assert size_for(Skin(), [source(small), source(large)]) == (160.0, 160.0)
    assert size_for(None, [source("bumper")]) == (160.0, 160.0)
