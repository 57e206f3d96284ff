"""Touches of the arm anywhere on the sheet, and which part of the sheet takes how many newtons."""

import itertools
import json
import re

import numpy as np
import pytest
from arm_oracle import Layers, paper_set
from scipy.stats import binom

from contactfpga.design.cover import BODIES, Cap, Cover, Switch, cells_of
from contactfpga.skin import Skin
from contactfpga.tools import cli
from contactfpga_sim.apps import result_cache
from contactfpga_sim.lab.arm import anywhere, kits, places
from contactfpga_sim.lab.arm.anywhere import BEST, FLUSH, GEOMETRIES, WAYS, Geometry
from contactfpga_sim.lab.arm.case import Case
from contactfpga_sim.lab.arm.places import Peaks
from contactfpga_sim.lab.arm.run import run
from contactfpga_sim.lab.arm.world import Switches, shares

RUN = {"step_s": 25e-6, "lead_s": 0.25e-3, "duration_s": 0.03}


def tiled(pitch_mm=6.4):
    return Skin(pitch_x_mm=pitch_mm, pitch_y_mm=pitch_mm)


SOFT = "forearm", (15e-3, 40e3)


@pytest.mark.parametrize(("x_mm", "y_mm"), [(0.0, 0.0), (3.1, 2.6)])
@pytest.mark.parametrize(
    ("body", "flesh", "foam"),
    [("rigid", None, (2e-3, 1.16e5)), ("rigid", None, (5e-3, 3.45e5)), (*SOFT, (2e-3, 1.16e5))],
)
def test_a_touch_off_a_switch_under_tiles_against_a_second_integration(body, flesh, foam, x_mm, y_mm):
    """Stopped by a switch, between two samples, and the rigid ones also by the torque limit alone."""
    layers = Layers((foam[0], foam[1] * (5.8 / 6.4) ** 2), flesh, 0.4 / 0.2e-3 / 6.4e-3**2)
    cover = Cover("foam", foam[0], Switch(0.4, travel_m=0.2e-3), cap=Cap(5.8e-3), cut=True, modulus_pa=foam[1])
    place = {"x_mm": 7 * 6.4 + x_mm, "y_mm": 7 * 6.4 + y_mm}
    case = Case.load("paper").wearing(cover).but(body=body, touch=(place,), run=RUN)
    closing = layers.tile_closes_n(x_mm, y_mm, 6.4, 0.4)
    before, period = run(case, "torque", skin=tiled(), to_peak=True).outcome, case.control.period_s
    latency_s = (before.closes_s // period + 9.5) * period - before.closes_s
    found = run(case, "latency", latency_s=latency_s, skin=tiled(), to_peak=True).outcome
    for ours, late in ((found, latency_s), *([(before, 1.0)] if body == "rigid" else [])):
        again = paper_set(closing, late, force=layers)
        assert ours.closes_s == pytest.approx(again.closes_s, abs=50e-6)
        assert ours.reacts_s == pytest.approx(again.reacts_s, abs=1e-9)
        assert ours.peak_force_n == pytest.approx(again.peak_force_n, rel=0.01)


@pytest.mark.parametrize("face", ["flush, point force", "buttons", "tiles"])
def test_a_lower_threshold_raises_no_touchs_peak(face):
    forces = []
    for threshold in (1.0, 0.4, 0.2):
        case = Geometry(face, 10.0, threshold, 5.0).case()
        (found,) = places._touched(places.Batch(case, Skin(), ((0.8e-3,),), 4, 0))
        forces.append([force for force, *_ in found])
    assert all((np.array(lower) <= 1.005 * np.array(higher)).all() for higher, lower in itertools.pairwise(forces))
    assert np.mean(forces[2]) < np.mean(forces[0]) - 0.5


def test_places_phases_and_latencies_fill_their_ranges_evenly():
    for seed in (0, 1, 5):
        found = places.evenly(60, seed)
        assert np.histogram2d(*found[:, :2].T, bins=5, range=((0, 1), (0, 1)))[0].min() >= 1
        for dimension in range(2, 6):
            assert (np.histogram(found[:, dimension], 60, (0, 1))[0] == 1).all()
    assert (places.evenly(60, 0) != places.evenly(60, 1)).all()


@pytest.mark.parametrize(("count", "low", "high"), [(16, 6, 9), (5, 0, 3), (4, 0, 3), (2, 0, 1), (1, 0, 0.5)])
def test_places_lie_in_the_sheets_middle(count, low, high):
    found = [places._place_mm(*shares, count, 8.0) / 8.0 for shares in np.random.default_rng(0).random((500, 2))]
    assert low <= min(found) < low + 0.1
    assert high - 0.1 < max(found) <= high


def test_each_touch_meets_another_sheet():
    """A kit's worst force on a single drawn sheet was a third above another sheet's."""
    case = BEST.case().but(run=RUN, touch=({"x_mm": 45.0, "y_mm": 44.0},))
    found = {run(case, "torque", skin=tiled(), sheet=sheet, to_peak=True).outcome.closes_s for sheet in range(4)}
    assert len(found) == 4
    seen = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(places, "run", lambda *given, sheet, **rest: seen.append(sheet) or run(*given, **rest))
        for batch in places.batches(case, tiled(), ((0.8e-3,),), 4):
            places._touched(batch)
    assert sorted(seen) == [0, 1, 2, 3]


def test_a_run_to_its_peak_has_the_whole_runs_peak():
    case = BEST.case().but(run=RUN, touch=({"x_mm": 45.0, "y_mm": 44.0},))
    for latency in (0.5e-3, 6e-3):
        whole, short = (run(case, "latency", latency_s=latency, skin=tiled(), to_peak=early) for early in (False, True))
        assert short.outcome.peak_force_n == whole.outcome.peak_force_n
        assert len(short.course) < len(whole.course)


def test_forces_between_those_looked_at_follow_the_cells_themselves():
    case = Geometry("flush", 10.0, 1.0, 5.0).case().but(touch=({"x_mm": 83.0, "y_mm": 81.0},))
    switches, cells = Switches(case, Skin()), cells_of(case.cover, 16, 16, 0.01, 0.01)
    rigid = BODIES["rigid"]
    indentation = cells.indentation([rigid.ball(0.038)], rigid)
    for force in (0.5, 3.33, 17.1):
        found = switches.forces_n((force,))
        exact = force * shares(cells, indentation, 83.0, 81.0, force)
        assert found == pytest.approx(exact, abs=2e-3 * exact.max())


def halves(first, second, limited=0.0):
    marks = np.arange(len(first)) < limited * len(first)
    return [
        Peaks(np.asarray(one, float), np.full(len(one), 2e-3), marks, np.full(len(one), np.nan))
        for one in (first, second)
    ]


def test_a_worst_value_that_another_seed_changes_gives_way_to_a_quantile():
    even = np.linspace(5.0, 10.0, 60)
    assert anywhere.worst_text(halves(even, even + 0.2)) == "10.2"
    assert anywhere.peak_text(halves(even, even + 1000)) == "solid"
    found = anywhere.worst_text(halves(even, np.append(even[:-1], 12.0)))
    values = np.sort([*even, *even[:-1], 12.0])
    low, high = (values[int(binom.ppf(share, 120, 0.95)) - 1 + after] for share, after in ((0.025, 0), (0.975, 1)))
    value, low_said, high_said = (
        float(word.strip("()")) for word in found.removeprefix("95 %: ").replace(" to ", " ").split()
    )
    assert value == pytest.approx(np.quantile(values, 0.95), abs=0.1)
    assert low_said == pytest.approx(low, abs=0.1)
    assert high_said == pytest.approx(high, abs=0.1)
    few = anywhere.worst_text(halves(even[::3], np.append(even[3::3], 12.0)))
    assert re.fullmatch(r"95 %: 9\.\d \(at least 9\.\d\)", few)


def made_up(newtons):
    """Every geometry with the same mean for each way, but what ``newtons`` says."""
    found = {}
    for geometry in GEOMETRIES:
        means = [newtons.get((geometry, way), newtons.get(geometry, 15.0)) for way in WAYS]
        found[geometry] = [halves([mean] * 4, [mean] * 4) for mean in means]
    return found


def test_the_sentence_names_what_takes_the_most():
    latency = {(FLUSH, "6 ms"): 18.0, (FLUSH, "pin"): 14.0}
    for field, value, what in (("face", "tiles", "face: tiles"), ("threshold_n", 0.2, "threshold: 0.2")):
        found = anywhere.matters(made_up({FLUSH._replace(**{field: value}): 10.0} | latency))
        assert f"What matters most against a rigid body is the {what} -5.0 N in" in found
        assert "latency pin -4.0 N" in found
    assert "rigid body is the latency: pin -4.0 N" in anywhere.matters(made_up(latency))


def test_cut_foam_and_a_cap_come_from_a_file(tmp_path):
    path = tmp_path / "tiles.toml"
    path.write_text(
        'like = "paper"\nmodel = "foam"\n[foam]\ncut = true\n[cap]\nside_m = 0.0058\n'
        "[switch]\nforce_n = 0.4\ntravel_m = 0.2e-3\nspread = 0.1\n"
    )
    assert Case.load(path) == BEST.case().but(cap={"side_m": 0.0058})


@pytest.mark.slow
def test_the_command_says_what_touches_anywhere_come_to(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(result_cache, "cache_folder", lambda: tmp_path / "kept")
    monkeypatch.setattr("contactfpga_sim.lab.arm.report.columns", lambda *given: {})
    monkeypatch.setattr("contactfpga_sim.lab.arm.report.as_json", lambda *given: {})
    assert cli.main(["study", "arm", "--json", "--places", "6", "--latency-us", "3000", "--jobs", "1"]) == 0
    known = json.loads(capsys.readouterr().out)["anywhere"]
    assert list(known) == ["3 ms", "UART", "pin", "limit alone"]
    forces = np.array([one["peak_force_n"] for one in known.values()])
    assert forces.shape == (4, 6)
    assert (forces[1] <= forces[0]).all()
    assert (forces[2] <= forces[1] + 0.3).all()
    assert all(known["limit alone"]["torque_limit_first"])


def test_the_depth_at_the_contact_is_that_of_the_course():
    """No other test kills a depth taken at another time, or a touch without detection that counts as one."""
    record = run(Case.load("paper"), "latency", latency_s=1e-3)
    outcome, course = record.outcome, record.course
    after = int(np.searchsorted(course["time_s"], outcome.detected_s))
    low, high = course["indentation_m"][after - 1 : after + 1]
    assert low <= outcome.detected_m <= high
    assert 0 < outcome.detected_m < outcome.peak_indentation_m
    assert run(Case.load("paper"), "torque").outcome.detected_m is None
    told = kits.depth_text([Peaks(*np.zeros((3, 2)), np.array(depths)) for depths in ([1e-3, np.nan], [2e-3, 4e-3])])
    assert told == "4.00 / 2.33"
