"""The chart of speed against accuracy: its numbers against other ways to get them."""

import csv
import dataclasses
import itertools
import math
import shlex
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage
from scipy.stats import binomtest
from study_pages import outdated

from contactfpga.design.cover import BODIES, Cells
from contactfpga.tools import cli
from contactfpga.wire import protocol
from contactfpga_sim.apps import errors, result_cache, score, speed, stats
from contactfpga_sim.apps.errors import Blob
from contactfpga_sim.lab.benchmark import entries
from contactfpga_sim.lab.chart import compute, front_picture, host, numbers, tables, times
from contactfpga_sim.lab.chart.compute import FAMILIES_DRAWN, Task
from contactfpga_sim.lab.chart.methods import METHODS
from contactfpga_sim.lab.levels.tables import SCORES
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.golden import predict, zones
from contactfpga_sim.model.scenes import contacts
from contactfpga_sim.model.scenes.families import placements, touches
from contactfpga_sim.model.scenes.scene import Scene
from contactfpga_sim.verify.cosim.compare import Mismatch

ROOT = Path(__file__).resolve().parents[2]
SMALL = METHODS["run, 20 mm, tiles"].skin


@pytest.fixture(autouse=True)
def results_of_this_test_only(tmp_path, monkeypatch):
    compiled = result_cache.cache_folder()
    monkeypatch.setattr(result_cache, "cache_folder", lambda: tmp_path / "kept")
    return compiled


def task(method="run, 20 mm, tiles", family="pair", count=20, checked=0):
    """One that needs no compiled board unless some scenes are checked on it."""
    return Task(method, *METHODS[method], family, count, seed=3, checked=checked)


def test_found_and_there_are_paired_at_the_least_total_distance():
    rng = np.random.default_rng(1)
    for found_count, there_count in itertools.product(range(1, 5), repeat=2):
        found, there = (
            [Blob(*map(float, rng.uniform(1, 50, 3))) for _ in range(count)] for count in (found_count, there_count)
        )
        few, many = sorted((found, there), key=len)
        least = min(
            sum(math.hypot(one.x_mm - other.x_mm, one.y_mm - other.y_mm) for one, other in zip(few, chosen))
            for chosen in itertools.permutations(many, len(few))
        )
        got = errors.errors(found, there)
        assert got.barycenter_mm * len(few) == pytest.approx(least)
        assert got.missed == pytest.approx(max(0, there_count - found_count) / there_count)
        assert got.miscounted == (found_count != there_count)


@pytest.mark.parametrize(("hits", "count"), [(0, 1000), (1, 1000), (500, 1000), (7, 7)])
def test_shares_have_wilsons_interval(hits, count):
    got = score.interval([1.0] * hits + [0.0] * (count - hits))
    want = binomtest(hits, count).proportion_ci(method="wilson")
    assert (got.mean, got.low, got.high) == pytest.approx((hits / count, want.low, want.high), abs=1e-12)


def test_the_interval_of_a_mean_holds_it_95_times_of_100():
    rng = np.random.default_rng(5)
    inside = 0
    for _ in range(1000):
        got = score.interval(rng.exponential(2.0, 400).tolist())
        inside += got.low <= 2.0 <= got.high
    assert 925 <= inside <= 970


def test_the_front_holds_what_nothing_else_beats():
    rng = np.random.default_rng(2)
    points = [tuple(map(float, rng.integers(0, 12, 2))) for _ in range(60)] + [(math.nan, 0.0)]
    best = [points[index] for index in compute.front(points)]
    for x, y in points[:-1]:
        beaten = any(u <= x and v <= y and (u, v) != (x, y) for u, v in points[:-1])
        assert ((x, y) in best) == (not beaten)
    assert best == sorted(best)


@pytest.mark.slow
def test_the_time_is_that_of_the_compiled_board():
    cells = np.zeros((8, 8), bool)
    cells[2:4, 3] = True
    for share in (0.0, 0.3, 0.77):
        clocks, size = speed.touch(SMALL, cells, share)
        start = speed.touch_cycle(SMALL, share)
        with CompiledBoard(SMALL) as board:
            board.hold(np.zeros((1, 8, 8), bool), start)
            board.hold(cells[None], clocks + 1)
            got = board.take("received")
        assert got["data"][-1] == protocol.DELIMITER
        assert int(got["cycle"][-1]) == pytest.approx(start + clocks, abs=SMALL.derived.bit_clocks)
        assert list(got["data"][-size:]).count(protocol.DELIMITER) == 1


def test_a_board_that_takes_longer_is_noticed(monkeypatch):
    later = dataclasses.replace(SMALL, settle_us=6.0)
    monkeypatch.setattr(speed.bench_native, "run", lambda _, *rest: predict(later, *rest))
    cells = np.ones((8, 8), bool)
    with pytest.raises(Mismatch):
        speed.touch(SMALL, cells, 0.5, check=True)


def test_a_steady_frame_takes_its_scan_and_its_bytes():
    """A raster scan: 8 rows of 72 clocks and the bytes. The stages between take 23 clocks, 12 of which the last row is
    released in, after its sample."""
    cells = np.zeros((8, 8), bool)
    cells[7, 7] = True
    _, size = speed.touch(SMALL, cells, 0.1)
    assert speed.frame_clocks(SMALL, cells, size) == 8 * 72 - 12 + 23 + size * 10 * 4
    assert speed.frames_per_second(SMALL, cells, size) == pytest.approx(12e6 / max(8 * 72, size * 10 * 4), rel=0.01)


def test_the_host_finds_the_zones_that_the_board_finds():
    rng = np.random.default_rng(8)
    for connectivity in (4, 8):
        for _ in range(50):
            cells = rng.random((12, 9)) < rng.random()
            want = [(a, x / a, y / a) for a, x, y in zones(cells, connectivity)]
            np.testing.assert_allclose(sorted(host.zones(cells, connectivity)), sorted(want), atol=1e-12)


def test_numbers_are_read_as_they_were_written(tmp_path):
    with ThreadPoolExecutor(1) as pool:
        points = compute.study([task(), task("cells, 6.4 mm, tiles", "palm")], pool, with_size=False)
    run, cells = map(host.timed, points)
    assert run.host_us == 0 < cells.host_us  # which finds zones of cells itself
    numbers.write(points, tmp_path / "one.csv")
    back = numbers.read(tmp_path / "one.csv")
    numbers.write(back, tmp_path / "two.csv")
    assert (tmp_path / "one.csv").read_text() == (tmp_path / "two.csv").read_text()
    for point, other in zip(points, back, strict=True):
        assert other.task == dataclasses.replace(point.task, checked=other.task.checked)
        found, want = (dataclasses.astuple(one.times)[:4] for one in (other, point))
        for value, shown in zip(itertools.chain(*want), itertools.chain(*found), strict=True):
            assert shown == pytest.approx(value, abs=0.051)
        assert other.errors["total"]["miscounted"].mean == pytest.approx(point.errors["total"]["miscounted"].mean)


def test_exact_labellers_add_no_error_and_the_others_do():
    names = [f"{labeller}, 6.4 mm, tiles" for labeller in ("run", "serial", "cells", "projection", "single")]
    found = {name: compute.accuracy(task(name, "pair", 60), 0) for name in names}
    wrong = {name: sum(kinds["labeller"]["miscounted"]) for name, kinds in found.items()}
    assert wrong[names[0]] == wrong[names[1]] == wrong[names[2]] == 0
    assert 0 < wrong[names[3]] < wrong[names[4]]
    for name in names:
        assert found[name]["sensing"] == found[names[0]]["sensing"]
    assert sum(found[names[-1]]["total"]["miscounted"]) > 50


def test_a_point_is_what_other_code_finds():
    """Forces by the cover's cells, zones by scipy, pairs by trying all."""
    one = task("run, 10 mm, tiles", "fingers", 60)
    skin, pitch = one.skin, 10.0
    cells = Cells(one.cover, 16, 16, 0.01, 0.01)
    counted, missed, away = [], [], []
    for scene in placements("fingers", 60, 3, skin):
        pressed = scene.on_cover(skin, one.cover)  # its patches may reach over the sheet's edge
        closed = cells.forces_n(pressed.loads(0.0)) >= cells.drawn(pressed.drawn)
        labels, count = ndimage.label(closed)
        found = [(pitch * x, pitch * y) for y, x in ndimage.center_of_mass(closed, labels, range(1, count + 1))]
        there = [(contact.x_mm, contact.y_mm) for contact in pressed.truth(0.0, skin).contacts]
        few, many = sorted((found, there), key=len)
        counted.append(count != len(there))
        missed.append(1 - min(count, len(there)) / len(there))
        least = min(sum(map(math.dist, few, chosen)) for chosen in itertools.permutations(many, len(few)))
        if few:
            away.append(least / len(few))
    got = compute.accuracy(one, 0)["total"]
    assert got["miscounted"] == counted
    assert got["missed"] == pytest.approx(missed)
    assert [one for one in got["barycenter_mm"] if not math.isnan(one)] == pytest.approx(away, abs=1e-6)
    assert 0 < sum(counted) < 60


def test_a_switch_closes_when_the_force_on_its_tile_has_risen_to_its_own():
    """A disc that lies on one tile alone, as deep as its layers are at that force."""
    _, cover = METHODS["run, 20 mm, tiles"]
    disc = contacts.disc(6.0)
    scene = Scene((contacts.Contact(shape=disc, x_mm=60.0, y_mm=40.0, force_n=5.0, speed_mm_s=100.0),))
    seconds, cells = times.closing(scene.on_cover(SMALL, cover), SMALL, cover)
    sheet = Cells(cover, 8, 8, 0.02, 0.02)
    depth_m = sheet.indentation(disc, BODIES["finger"]).depth_m(sheet.thresholds_n[2, 3])
    assert seconds == pytest.approx(depth_m / 0.1, abs=1e-3 / 2**times.HALVINGS * 100)
    ((late, pressed),) = cells
    assert late == 0
    assert np.argwhere(pressed).tolist() == [[2, 3]]


def test_a_touch_takes_mechanics_and_electronics():
    skin, cover = METHODS["run, 10 mm, tiles"]
    scenes = touches("fingers", 12, 5, skin, cover)
    raw = times.measured(scenes, skin, cover, 0, 0)
    first = [times.closing(scene, skin, cover)[0] for scene in scenes]
    np.testing.assert_allclose(np.subtract(raw["touch"], raw["electric"]), np.multiply(first, 1e6))
    found = times.summed([raw], skin)
    assert found.lower_bound_us == pytest.approx(found.bytes * 10 / 3)
    assert found.lower_bound_us < min(raw["electric"])
    bare = times.measured(scenes, skin, None, 0, 0)
    assert bare["touch"] == bare["electric"]


def test_a_touch_that_closes_nothing_takes_forever():
    skin, cover = METHODS["run, 6.4 mm, paper"]
    light, firm = (
        Scene(
            (contacts.Contact(shape=contacts.disc(6.0), x_mm=60.0, y_mm=40.0, force_n=force, speed_mm_s=100.0),)
        ).on_cover(skin, cover)
        for force in (0.2, 60.0)
    )
    found = times.summed([times.measured([light, firm, light], skin, cover, 0, 0)], skin)
    assert math.isinf(found.touch_median_us.value)
    assert found.electric_median_us.value < 1000
    assert found.not_felt.mean == pytest.approx(2 / 3)


@pytest.mark.parametrize("share", [0.5, 0.95])
def test_the_interval_of_a_quantile_holds_it_95_times_of_100(share):
    rng = np.random.default_rng(6)
    want, inside = -math.log(1 - share), 0
    for _ in range(1000):
        got = stats.quantile(rng.exponential(1.0, 200).tolist(), share)
        inside += got.low <= want <= got.high
    assert 930 <= inside <= 985


def test_a_quantile_of_few_values_or_of_some_that_never_come_has_no_upper_end():
    assert stats.quantile([3.0, 1.0, 2.0], 0.5) == stats.Quantile(2.0, 0.0, math.inf, 3)
    felt = [float(value) for value in range(180)]
    assert math.isinf(stats.quantile([*felt, *[math.inf] * 20], 0.95).value)
    assert stats.quantile([*felt, *[math.inf] * 20], 0.5).value == 99


@pytest.mark.slow
def test_every_executor_gives_the_same_points(monkeypatch, tmp_path):
    distributed = pytest.importorskip("distributed")
    tasks = [task(checked=1), task("run, 10 mm, tiles", "bumper", 130)]
    with ThreadPoolExecutor(2) as pool:
        points = compute.study(tasks, pool, with_size=False)
    monkeypatch.setattr(result_cache, "cache_folder", lambda: tmp_path / "others")
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        assert compute.study(tasks, client.get_executor(), with_size=False) == points


@pytest.mark.slow
def test_the_command_draws_and_each_line_says_how_to_get_it_again(tmp_path, capsys):
    options = ["--no-size", "--jobs", "1", "--output"]
    first, second = tmp_path / "first", tmp_path / "second"
    names = ("run, 20 mm, tiles", "run, 10 mm, tiles")  # boards that other tests compile as well
    methods = [word for name in names for word in ("--method", name)]
    assert cli.main(["study", "chart", *methods, "--family", "pair", "--placements", "12", *options, str(first)]) == 0
    assert "times.svg" in capsys.readouterr().out
    assert all(name in (first / "times.svg").read_text() for name in ("pair, to the last byte", *names))
    lines = list(csv.DictReader((first / "chart.csv").read_text().splitlines()))
    assert [line["method"] for line in lines] == list(names)
    again = shlex.split(lines[1]["command"])[1:]
    assert cli.main([*again, *options, str(second)]) == 0
    assert (second / "chart.csv").read_text().splitlines()[1] == (first / "chart.csv").read_text().splitlines()[2]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--method", "guess"], "--method 'guess' is not known; take one of: run, 6.4 mm, tiles"),
        (["--family", "guess"], "--family 'guess' is not known; take one of: bumper"),
    ],
)
def test_what_cannot_be_charted_is_refused(arguments, message, capsys):
    assert cli.main(["study", "chart", *arguments]) == 1
    assert message in capsys.readouterr().err


@pytest.mark.slow
def test_the_page_shows_what_its_numbers_say(tmp_path):
    """Pictures and tables of docs/chart.md and README.md come from docs/chart/chart.csv."""
    points = numbers.read(ROOT / tables.NUMBERS)
    assert {point.task.method for point in points} == set(METHODS)
    assert {point.task.family for point in points} == set(FAMILIES_DRAWN)
    assert not outdated("chart", points, "front", "families", "methods")
    for folder in ("chart", "images"):
        (tmp_path / folder).mkdir()
    for path in tables.draw(tmp_path / "images", points):
        assert path.read_text() == (ROOT / "docs" / path.relative_to(tmp_path)).read_text()


def test_the_picture_of_the_front_has_its_entries_where_their_scores_say():
    """Each panel by the worst family and the mean of the worse model, and the kits in a ring."""
    with open(ROOT / SCORES, newline="", encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    figure = front_picture.picture(lines)
    for axes, field, factor in zip(figure.axes, ("wrong", "place_mm"), (100, 1), strict=True):
        marks = {tuple(line.get_xydata()[0]) for line in axes.lines if len(line.get_xydata()) == 1}
        left, right, bottom, top = *axes.get_xlim(), *axes.get_ylim()
        for entry in entries.METHODS:
            of = [line for line in lines if line["entry"] == entry]
            (x,) = {1e3 * float(line["median_s"]) for line in of if line["family"] == "all"}
            counted = [one for one in of if field == "wrong" or int(one["scenes"]) * (1 - float(one["wrong"])) >= 30]
            for family in ({"all"}, set(FAMILIES_DRAWN)):
                y = factor * max(float(line[field]) for line in counted if line["family"] in family)
                assert any((x, max(y, bottom)) == pytest.approx(mark) for mark in marks), (entry, field)
                assert left < x < right
                assert y < top
    assert sum(len(axes.texts) - 1 for axes in figure.axes) <= 20
    rings = [line.get_ydata()[0] for line in figure.axes[0].lines if line.get_markersize() > 10]
    for ring, entry in zip(rings, ("domes, 6.4 mm", "soft kit"), strict=True):
        kit = [line for line in lines if line["entry"] == entry and line["family"] != "all"]
        assert ring == pytest.approx(100 * max(float(line["wrong"]) for line in kit))
    walls = [float(line["place_mm"]) for line in lines if line["kind"] == "bound"]
    drawn = [line.get_ydata()[0] for line in figure.axes[1].lines if line.get_linestyle() == "--"]
    assert drawn == pytest.approx([max(walls[:3]), max(walls[3:])])
