"""The benchmark: its scorer beside scipy, files of strangers, scenes beside the models that they are of, and the page's
example. No other test kills a pairing that is not the least, a size that is not checked, places from the first cell in
place of the sheet's corner, and a least error that is not that of the likelihood."""

import csv
import dataclasses
import io
import itertools
import math
import re
import subprocess
import sys
import zipfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from contactfpga.tools import cli
from contactfpga_sim.apps import score, stats
from contactfpga_sim.lab.benchmark import bounds, entries, scenes
from contactfpga_sim.lab.benchmark.scenes import PITCHES_MM, Work
from contactfpga_sim.lab.chart import front_picture

ROOT = Path(__file__).resolve().parents[2]
COUNT = 3


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Scenes of two families, whose bodies are quick on finite elements."""
    place = tmp_path_factory.mktemp("scenes")
    with ThreadPoolExecutor(1) as workers:
        for family in ("pair", "edge"):
            scenes.save(place / f"{family}.npz", scenes.arrays(family, 7, COUNT, workers))
    return place


def padded(places):
    return np.array(places, float).reshape(-1, 2)


# ---- scores


def test_places_are_paired_at_the_least_sum():
    rng = np.random.default_rng(1)
    for count, _ in itertools.product(range(1, 8), range(20)):
        found, true = rng.uniform(0, 20, (2, count, 2))
        distance = np.linalg.norm(found[:, None] - true[None], axis=2)
        assert score.paired(found, true) == pytest.approx(distance[linear_sum_assignment(distance)].mean())


def test_either_count_is_right_across_a_narrow_gap():
    one, two, three = (padded([(10.0 * at, 5.0) for at in range(count)]) for count in (1, 2, 3))
    blank = np.full((1, 2), np.nan)
    assert score.judged(np.concatenate([two + 1, blank]), two, two) == (False, False, pytest.approx(math.sqrt(2)))
    assert score.judged(one, two, one) == (False, True, 0)
    assert score.judged(two, three, one)[:2] == (False, True)
    assert math.isnan(score.judged(two, three, one)[2])  # which of the three are two is unknown
    assert score.judged(three, two, one)[:2] == score.judged(blank, two, one)[:2] == (True, True)


@pytest.mark.parametrize("part", [0.5, 0.95])
def test_quantiles_and_their_ends_are_those_of_the_binomial_ranks(part):
    values = np.random.default_rng(3).exponential(1.0, 400)
    values[:10] = math.inf
    want, got = stats.quantile(values.tolist(), part), score.quantile(values, part)
    places = {value: rank for rank, value in enumerate(np.unique(values).tolist())}
    assert got.mean == want.value
    assert abs(places[got.low] - places[want.low]) <= 1
    assert abs(places[got.high] - places[want.high]) <= 1
    assert math.isnan(score.quantile(np.append(values, np.nan), part).mean)


# ---- files


def test_scenes_are_those_of_the_models(folder):
    """Cells carry the contacts' forces, and the middle of a bar's forces is its place."""
    for pitch, model in itertools.product(PITCHES_MM, score.MODELS):
        edge, head = np.load(folder / "edge.npz"), f"{model}_{pitch:g}mm"
        (there, *_) = scenes.drawn(Work(pitch, model, "edge", 7, 0, 1))
        assert edge[f"{head}_forces"][0] == pytest.approx(there.forces_n, abs=1e-4)
        force = edge[f"{head}_forces"][0]
        middle = [force.sum(axis=axis) @ np.arange(len(force)) / force.sum() * pitch + pitch / 2 for axis in (0, 1)]
        assert math.dist(middle, edge[f"{head}_contacts"][0, 0]) < 1.0
    rise = edge["8mm_rise_n"]
    assert (np.diff(rise) >= 0).all()
    assert rise[:, -1] == pytest.approx(edge["model_8mm_forces"].max(axis=(1, 2)), rel=1e-3)
    with ThreadPoolExecutor(1) as workers:
        again = scenes.save(folder / "again", scenes.arrays("edge", 7, COUNT, workers))
    assert again.read_bytes() == (folder / "edge.npz").read_bytes()
    again.unlink()


def test_the_pages_example_is_scored_by_the_file_alone(folder, tmp_path):
    """The scorer in a folder of its own, in an interpreter that has no other package of ours."""
    example = re.search(r"```python\n(.*?)```", (ROOT / "docs/benchmark.md").read_text(encoding="utf-8"), re.DOTALL)[1]
    exec(example.replace("build/benchmark/scenes", str(folder)).replace("mine.npz", str(tmp_path / "mine.npz")), {})
    (tmp_path / "score.py").write_bytes(Path(score.__file__).read_bytes())
    command = [sys.executable, "-I", "score.py", folder, "mine.npz", "--csv", "mine.csv"]
    shown = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert shown.startswith("mine (example, 6.4 mm)\n  model, ")
    (line,) = (
        line
        for line in csv.DictReader((tmp_path / "mine.csv").read_text().splitlines())
        if (line["family"], line["model"]) == ("pair", "model")
    )
    assert int(line["scenes"]) == COUNT
    assert 0 < float(line["place_mm"]) < 6.4


@pytest.fixture
def mine(folder):
    """Arrays of results with one contact at (80, 80) in each scene."""
    place = {f"{family}_{model}": np.full((COUNT, 1, 2), 80.0) for family in ("pair", "edge") for model in score.MODELS}
    late = {f"{family}_seconds": np.full(COUNT, 0.003) for family in ("pair", "edge")}
    return {"name": np.array("mine"), "kind": np.array("model"), "pitch_mm": np.array(6.4)} | place | late


class Runs:
    def __reduce__(self):
        return print, ("ran",)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"pair_model": np.zeros((COUNT + 1, 1, 2))},
            r"float64 of shape \(4, 1, 2\); it must be of kind",
        ),
        ({"pair_model": np.zeros((COUNT, 65, 2))}, "at most 64 contacts a scene"),
        ({"pair_model": np.array([[[1.0, np.nan]]] * COUNT)}, "finite x and y, or NaN in both"),
        ({"edge_seconds": np.array([0.1, -1.0, 0.2])}, "edge_seconds has -1; times count from the touch"),
        ({"name": np.array("a\x1b[2J")}, "1 to 80 printable letters"),
        ({"pitch_mm": np.array(7.0)}, "has no array 'model_7mm_contacts'; it has"),
        ({"edge_model": np.array([Runs()] * COUNT)}, "edge_model cannot be read: Object arrays"),
        ({"edge_model": None}, "has no array 'edge_model'"),
    ],
)
def test_results_that_cannot_be_judged_are_refused_in_one_line(change, message, mine, folder, tmp_path, capsys):
    values = {name: value for name, value in (mine | change).items() if value is not None}
    np.savez(tmp_path / "mine.npz", allow_pickle=True, **values)
    with pytest.raises(score.ScoreError, match=message) as refused:
        score.load(tmp_path / "mine.npz", folder)
    assert "\n" not in str(refused.value)
    assert "ran" not in capsys.readouterr().out


def test_a_head_that_promises_more_than_there_is_takes_no_memory(mine, folder, tmp_path):
    data = io.BytesIO()
    np.lib.format.write_array_header_1_0(data, {"descr": "<f8", "fortran_order": False, "shape": (1 << 40, 1, 2)})
    with zipfile.ZipFile(tmp_path / "mine.npz", "w") as file:
        for name, value in mine.items():
            npy = io.BytesIO()
            np.save(npy, value)
            file.writestr(f"{name}.npy", data.getvalue() if name == "pair_model" else npy.getvalue())
    with pytest.raises(score.ScoreError, match=r"pair_model cannot be read: shape .* promises more than its"):
        score.load(tmp_path / "mine.npz", folder)
    (tmp_path / "text.npz").write_text("no archive")
    with pytest.raises(score.ScoreError, match=r"text\.npz is no NPZ file"):
        score.load(tmp_path / "text.npz", folder)


# ---- our entries


def test_methods_have_the_forces_of_the_page_of_levels():
    with open(ROOT / "docs/tables/levels-levels.csv", newline="", encoding="utf-8") as file:
        chosen = {(line["pitch"], line["levels"]): line["forces"] for line in csv.DictReader(file)}
    for pitch, one, three in zip(PITCHES_MM, entries.ONE_N, entries.THREE_N, strict=True):
        assert chosen[f"{pitch:g} mm", "1"] == f"{one:g} N"
        assert chosen[f"{pitch:g} mm", "3"] == ", ".join(f"{force:g}" for force in three) + " N"


def test_an_array_places_by_force_and_a_time_has_all_its_parts():
    forces = np.zeros((25, 25))
    forces[4, 5:7] = 4.0, 2.0
    ((x, y),) = entries.analog(forces, 6.4, (1,))
    assert (x, y) == (pytest.approx(6.4 * (5.5 + 1 / 3), abs=0.5), pytest.approx(6.4 * 4.5, abs=0.1))
    pace = entries.Pace(scan_us=100.0, work_us=30.0, wire_us=50.0, slot_us=1000.0)
    late = pace.late_s(10_000, np.random.default_rng(1)) * 1e6
    assert (late.min(), late.max()) == (pytest.approx(80, abs=30), pytest.approx(1310, abs=30))
    assert late.mean() == pytest.approx(65 + 50 + 30 + 500 + 50, rel=0.02)


def test_the_command_scores_and_draws_entries_of_others(folder, mine, tmp_path, capsys):
    np.savez(tmp_path / "mine.npz", **mine)
    given = ["--scenes", str(folder), "--entry", str(tmp_path / "mine.npz"), "--jobs", "1", "-o", str(tmp_path / "out")]
    assert cli.main(["study", "benchmark", *given]) == 0
    assert "mine (model)\n  model, " in capsys.readouterr().out
    lines = list(csv.DictReader((tmp_path / "out/scores.csv").read_text().splitlines()))
    assert {line["entry"] for line in lines} == {*entries.METHODS, "mine"}
    top, _ = front_picture.picture(lines).axes
    marks = {tuple(line.get_xydata()[0].round(6)) for line in top.lines if line.get_marker() == "*"}
    assert marks == {(3.0, 100.0)}
    assert top.get_xlim()[0] < 3.0
    assert cli.main(["study", "benchmark", "--scenes", str(tmp_path), "-o", str(tmp_path / "out")]) == 1
    np.savez(tmp_path / "mine.npz", **mine | {"name": np.array("OpenCV")})
    assert cli.main(["study", "benchmark", *given]) == 1
    assert "two entries have the name 'OpenCV'" in capsys.readouterr().err


# ---- the least error


def test_the_estimate_is_the_mean_of_the_place():
    """A likelihood may be narrow, even within the pitch, or cut by the pitch."""
    half = entries.KITS_MM / 2
    narrow = bounds.estimate(lambda x, y: -((x - 1.3) ** 2 + (y + 2.1) ** 2) / 2 / 0.05**2)
    assert narrow == pytest.approx([1.3, -2.1], abs=0.02)
    assert bounds.estimate(lambda x, y: 0.0) == pytest.approx([0, 0], abs=1e-9)
    assert bounds.estimate(lambda x, y: 0.0 if x > 0 else -99.0) == pytest.approx([half / 2, 0], abs=0.2)


@pytest.mark.slow
def test_the_least_error_goes_with_the_spread_of_the_domes(monkeypatch):
    """Domes that close at a known force tell the place, by their moments to a tenth of a millimeter; and a frame tells
    less than all moments."""
    touch, off = bounds.Touch("bumper", 2), []
    for spread in (0.005, 0.1):
        monkeypatch.setattr(bounds, "DOME", dataclasses.replace(bounds.DOME, spread=spread))
        off.append(np.mean([touch.off_mm(np.random.default_rng(seed)) for seed in range(2)], axis=0))
    (known, exact), (frame, closings) = off
    assert exact < 0.1 < closings < frame < entries.KITS_MM / 2
    assert known < frame
