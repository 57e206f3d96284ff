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
from scipy.stats import binomtest
from study_pages import section

from contactfpga.skin import Skin
from contactfpga.tools import cli
from contactfpga.wire import protocol
from contactfpga_sim.lab import kept
from contactfpga_sim.lab.chart import compute, errors, front_picture, host, numbers, picture, speed, tables
from contactfpga_sim.lab.chart.compute import FAMILIES_DRAWN, Task
from contactfpga_sim.lab.chart.errors import Blob, Interval
from contactfpga_sim.lab.chart.methods import EXTENT_MM, METHODS
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.golden import predict, zones
from contactfpga_sim.model.scenes.scene import edge, fingertip, palm, two_fingers
from contactfpga_sim.verify.cosim.compare import Mismatch

ROOT = Path(__file__).resolve().parents[2]
SMALL = METHODS["run, 20 mm"]


@pytest.fixture(autouse=True)
def results_of_this_test_only(tmp_path, monkeypatch):
    compiled = kept.cache_folder()
    monkeypatch.setattr(kept, "cache_folder", lambda: tmp_path / "kept")
    return compiled


def task(method="run, 20 mm", family="pair", count=20, checked=0):
    """One that needs no compiled board unless some scenes are checked on it."""
    return Task(method, METHODS[method], family, count, seed=3, timed=4, checked=checked)


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


def test_what_is_not_there_has_no_distance():
    nothing = errors.errors([], [Blob(1.0, 0.0, 0.0)])
    assert nothing.missed == 1
    assert nothing.miscounted
    assert math.isnan(nothing.barycenter_mm)
    assert math.isnan(nothing.area)


def test_area_errors_are_relative_to_what_is_there():
    assert errors.errors([Blob(150.0, 3.0, 4.0)], [Blob(100.0, 0.0, 0.0)]) == errors.Errors(False, 0.0, 5.0, 0.5)


@pytest.mark.parametrize(("hits", "count"), [(0, 1000), (1, 1000), (500, 1000), (7, 7)])
def test_shares_have_wilsons_interval(hits, count):
    got = errors.interval([1.0] * hits + [0.0] * (count - hits))
    want = binomtest(hits, count).proportion_ci(method="wilson")
    assert (got.mean, got.low, got.high) == pytest.approx((hits / count, want.low, want.high), abs=1e-12)


def test_the_interval_of_a_mean_holds_it_95_times_of_100():
    rng = np.random.default_rng(5)
    inside = 0
    for _ in range(1000):
        got = errors.interval(rng.exponential(2.0, 400).tolist())
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


def test_no_touch_is_faster_than_the_bound():
    cells = np.zeros((8, 8), bool)
    cells[0, 0] = True
    assert speed.measure(SMALL, [cells] * 9, 0).bound_us < speed.measure(SMALL, [cells] * 9, 0).median_us


@pytest.mark.slow
@pytest.mark.parametrize("method", ["adaptive, 10 mm", "adaptive, 20 mm", "adaptive, 5 mm, 24 MHz"])
def test_a_frame_of_an_adaptive_scan_takes_at_most_2_percent_more_than_the_bound(method, record_property):
    skin, over = METHODS[method], []
    for scene in (fingertip, two_fingers, palm, edge):
        cells = scene(skin).pressed(0.0, skin)
        if not cells.any():  # fingers between switches 20 mm apart
            continue
        _, size = speed.touch(skin, cells, 0.3)
        bound = (int(cells.any(axis=1).sum()) + 1) * skin.derived.row_clocks + size * 10 * skin.derived.bit_clocks
        over.append(speed.frame_clocks(skin, cells, size) / bound - 1)
    assert min(over) > 0
    assert max(over) <= 0.02
    record_property("worst", f"{100 * max(over):.2f} %")


def test_a_steady_frame_takes_its_scan_and_its_bytes():
    """A raster scan: 8 rows of 72 clocks and the bytes. The stages between take 22 clocks, 12 of which the last row is
    released in, after its sample."""
    cells = np.zeros((8, 8), bool)
    cells[7, 7] = True
    _, size = speed.touch(SMALL, cells, 0.1)
    assert speed.frame_clocks(SMALL, cells, size) == 8 * 72 - 12 + 22 + size * 10 * 4
    assert speed.frames_per_second(SMALL, cells, size) == pytest.approx(12e6 / max(8 * 72, size * 10 * 4), rel=0.01)


def test_the_host_finds_the_zones_that_the_board_finds():
    rng = np.random.default_rng(8)
    for connectivity in (4, 8):
        for _ in range(50):
            cells = rng.random((12, 9)) < rng.random()
            want = [(a, x / a, y / a) for a, x, y in zones(cells, connectivity)]
            np.testing.assert_allclose(sorted(host.zones(cells, connectivity)), sorted(want), atol=1e-12)


def test_the_host_takes_time_for_cells_only():
    with ThreadPoolExecutor(1) as pool:
        run, cells = compute.study([task(), task("cells, 20 mm")], pool, with_size=False)
    assert host.timed(run).host_us == 0
    assert 1 < host.timed(cells).host_us < 1000


def test_numbers_are_read_as_they_were_written(tmp_path):
    with ThreadPoolExecutor(1) as pool:
        points = compute.study([task(), task("cells, 20 mm", "palm")], pool, with_size=False)
    numbers.write(points, tmp_path / "one.csv")
    back = numbers.read(tmp_path / "one.csv")
    numbers.write(back, tmp_path / "two.csv")
    assert (tmp_path / "one.csv").read_text() == (tmp_path / "two.csv").read_text()
    for point, other in zip(points, back, strict=True):
        assert point.task.skin == other.task.skin
        assert dataclasses.astuple(other.speed) == pytest.approx(dataclasses.astuple(point.speed), abs=0.051)
        assert other.errors["total"]["miscounted"].mean == pytest.approx(point.errors["total"]["miscounted"].mean)


def test_exact_labellers_add_no_error_and_the_others_do():
    names = [f"{labeller}, 10 mm" for labeller in ("run", "serial", "cells", "projection", "single")]
    found = {name: compute.accuracy(task(name, "fingers", 60), 0) for name in names}
    wrong = {name: sum(kinds["labeller"]["miscounted"]) for name, kinds in found.items()}
    assert wrong["run, 10 mm"] == wrong["serial, 10 mm"] == wrong["cells, 10 mm"] == 0
    assert 0 < wrong["projection, 10 mm"] < wrong["single, 10 mm"]
    for name in names:
        assert found[name]["sensing"] == found[names[0]]["sensing"]
    assert sum(found[names[-1]]["total"]["miscounted"]) > 50


@pytest.mark.slow
def test_every_executor_gives_the_same_points(monkeypatch, tmp_path):
    distributed = pytest.importorskip("distributed")
    tasks = [task(checked=1), task("single, 20 mm", "bumper", 130)]
    with ThreadPoolExecutor(2) as pool:
        points = compute.study(tasks, pool, with_size=False)
    monkeypatch.setattr(kept, "cache_folder", lambda: tmp_path / "others")
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        assert compute.study(tasks, client.get_executor(), with_size=False) == points


def test_what_was_worked_out_is_kept_and_other_code_works_it_out_anew(monkeypatch):
    calls = []
    monkeypatch.setattr(compute, "_scene_errors", lambda *args: calls.append(1) or (errors.Errors(False, 0, 0, 0),) * 3)
    compute.accuracy(task(), 0)
    compute.accuracy(task(), 0)
    assert len(calls) == 20
    monkeypatch.setattr(kept.sources, "digest", lambda *_: "other code")
    compute.accuracy(task(), 0)
    assert len(calls) == 40


@pytest.mark.slow
def test_the_command_draws_and_each_line_says_how_to_get_it_again(tmp_path, capsys):
    options = ["--no-size", "--jobs", "1", "--output"]
    first, second = tmp_path / "first", tmp_path / "second"
    names = ("run, 20 mm", "run, 10 mm")  # boards that other tests compile as well
    methods = [word for name in names for word in ("--method", name)]
    assert (
        cli.main(["study", "chart", *methods, "--family", "fingers", "--placements", "12", *options, str(first)]) == 0
    )
    assert "chart.png" in capsys.readouterr().out
    assert (first / "chart.png").stat().st_size > 10_000
    assert (first / "chart.svg").read_text().count("<svg") == 1
    lines = list(csv.DictReader((first / "chart.csv").read_text().splitlines()))
    assert [line["method"] for line in lines] == list(names)
    again = shlex.split(lines[1]["command"])[1:]
    assert cli.main([*again, *options, str(second)]) == 0
    assert (second / "chart.csv").read_text().splitlines()[1] == (first / "chart.csv").read_text().splitlines()[2]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--method", "guess"], "--method 'guess' is not known; take one of: reversal, 10 mm"),
        (["--family", "guess"], "--family 'guess' is not known; take one of: bumper"),
    ],
)
def test_what_cannot_be_charted_is_refused(arguments, message, capsys):
    assert cli.main(["study", "chart", *arguments]) == 1
    assert message in capsys.readouterr().err


@pytest.mark.slow
def test_the_page_shows_what_its_numbers_say(tmp_path, monkeypatch):
    """Pictures and table of docs/chart.md and README.md come from docs/chart/chart.csv."""
    monkeypatch.chdir(ROOT)
    points = numbers.read(tables.NUMBERS)
    assert {point.task.method for point in points} == set(METHODS)
    assert {point.task.family for point in points} == set(FAMILIES_DRAWN)
    assert min(point.task.count for point in points) >= 1000
    picture.save(points, tmp_path)
    assert (tmp_path / "chart.svg").read_text() == (ROOT / "docs/chart/chart.svg").read_text()
    front_picture.save(points, tmp_path / "front.svg")
    assert (tmp_path / "front.svg").read_text() == (ROOT / "docs/images/front.svg").read_text()
    assert section("chart.md", "front") == tables.front_table(points)


def test_the_picture_of_the_front_names_it_and_what_it_is_compared_with(tmp_path):
    points = [point for point in numbers.read(ROOT / tables.NUMBERS) if point.task.family == front_picture.FAMILY]
    best = compute.front([(picture.reached_us(one), one.errors["total"]["barycenter_mm"].mean) for one in points])
    host = {point.task.method for point in points if point.task.skin.report == "cells"}
    (panel,) = front_picture.picture(points).axes
    named = {text.get_text() for text in panel.texts}
    assert named == {points[index].task.method for index in best} | host | {one.label for one in front_picture.OTHERS}
    times = {float(line.get_xdata()[0]) for line in panel.lines if list(line.get_ydata()) == [0, 1]}
    assert times == {1000.0, 6000.0}
    assert all(panel.get_xlim()[0] < picture.reached_us(point) < panel.get_xlim()[1] for point in points)


def test_zero_has_a_place_of_its_own_on_the_axis_of_shares():
    panels = picture.picture(numbers.read(ROOT / tables.NUMBERS)).axes
    for panel in panels[1::2]:
        zero, least, most = panel.transData.transform([(100, 0), (100, 0.01), (100, 1)])[:, 1]
        assert panel.bbox.y0 < zero < least - 5 < most < panel.bbox.y1
        assert "0 %" in [label.get_text() for label in panel.get_yticklabels()]


def test_no_point_lies_outside_its_panel():
    points = numbers.read(ROOT / tables.NUMBERS)[:24]
    far = dataclasses.replace(points[0].speed, median_us=9_000.0, worst_us=30_000.0)
    wrong = {
        kind: errors | {"barycenter_mm": Interval(170.0, 160.0, 180.0, 9)} for kind, errors in points[0].errors.items()
    }
    points.append(dataclasses.replace(points[0], speed=far, errors=wrong))
    figures_ = [picture.picture(points), front_picture.picture(points)]
    for panel in (panel for figure in figures_ for panel in figure.axes):
        for x, y in (place for line in panel.lines if line.get_marker() != "None" for place in line.get_xydata()):
            assert panel.get_xlim()[0] < x < panel.get_xlim()[1]
            assert panel.get_ylim()[0] < y < panel.get_ylim()[1]
    for name, panel in zip("ab", (figures_[0].axes[0], figures_[1].axes[0])):
        assert max(x for line in panel.lines for x in line.get_xdata()) >= 9_000, name
    points = [point for point in points if point.task.method in ("run, 5 mm", "run, 10 mm")][:2]
    figure = picture.picture(points)
    figure.draw_without_rendering()
    least, most = figure.axes[0].get_xlim()
    assert [tick for tick in figure.axes[0].get_xticks() if least < tick < most] == [100, 200, 500, 1000]


def test_a_labeller_that_nobody_has_drawn_gets_its_name_and_a_color_of_its_own():
    points = numbers.read(ROOT / tables.NUMBERS)[:24]
    toy = Skin(pitch_x_mm=7.0, labeller="toy_labeller:TOY")
    points.append(dataclasses.replace(points[0], task=dataclasses.replace(points[0].task, method="toy", skin=toy)))
    before, found = picture.colors(points[:24]), picture.colors(points)
    assert found == before | {"toy": found["toy"]}
    assert len(set(found.values())) == len(found)
    (legend,) = picture.picture(points).legends
    assert {"toy", "pitch 7 mm"} <= {text.get_text() for text in legend.get_texts()}


@pytest.mark.campaign
@pytest.mark.timeout(7200)
def test_the_pages_numbers_are_found_again(tmp_path):
    assert cli.main(["study", "chart", "--output", str(tmp_path)]) == 0
    for found, shown in zip(numbers.read(tmp_path / "chart.csv"), numbers.read(ROOT / tables.NUMBERS), strict=True):
        assert dataclasses.replace(found, host_us=shown.host_us) == shown


@pytest.mark.slow
def test_zones_are_faster_from_the_board_until_there_are_many(monkeypatch):
    monkeypatch.setattr(tables, "SHEETS", (16,))
    monkeypatch.setattr(tables.host, "label_us", lambda frames, connectivity: 13.0)
    faster = {int(line.split("|")[2]): line.split("|")[6].strip() for line in tables.host_table().splitlines()[2:]}
    # 4 bytes per zone against 32 bytes of cells; in 13 us the wire carries 4 bytes, and a tenth of a zone is left
    assert faster == {1: "board", 5: "board", 8: "board", 9: "host", 64: "host"}


def test_all_sheets_have_the_same_extent():
    for skin in METHODS.values():
        assert skin.rows * skin.pitch_y_mm == skin.columns * skin.pitch_x_mm == EXTENT_MM
        assert isinstance(skin, Skin)
