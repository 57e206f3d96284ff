"""Barycenters from the sheet to the host, through the gateware: rounded exactly, and never later than exact moments."""

import contextlib
import itertools
import json
import math

import numpy as np
import pytest
from fake_board import FakeBoard
from recorded_frames import recorded
from sample import sample
from scipy import ndimage
from zone_oracles import nearest, zones_by_scipy

import contactfpga
from contactfpga import Skin
from contactfpga.tools import cli
from contactfpga_sim.apps import errors, speed
from contactfpga_sim.model.board import replay
from contactfpga_sim.model.golden import Timeline, predict, zones
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.scenes.shapes import variants
from contactfpga_sim.verify.cosim import bench_amaranth
from contactfpga_sim.verify.cosim.compare import compare

pytestmark = pytest.mark.usefixtures("_closed_ports")

SHEET = Skin(rows=13, columns=6, pitch_x_mm=3.4, pitch_y_mm=5.0, report="barycenter", barycenter_bits=3)


def rounded_zones(cells, bits, connectivity=8):
    """Sorted (area, x, y) of scipy's zones, x and y in steps."""
    zones = zones_by_scipy(cells, connectivity)
    return sorted((area, nearest(sum_x, area, bits), nearest(sum_y, area, bits)) for area, sum_x, sum_y in zones)


def assert_replayed(frames, bits, connectivity=8, most=None):
    most = most or replay.zones_bound(frames, connectivity)
    skin = replay.skin_for(*frames.shape[1:], connectivity, most, barycenter_bits=bits)
    count = 0
    for cells, result in zip(frames, replay.replay(frames, skin), strict=True):
        assert sorted(map(tuple, result.frame.barycenters.tolist())) == rounded_zones(cells, bits, connectivity)
        assert result.frame.flags == frozenset()
        count += 1
    assert count == len(frames)


# ---- through the compiled gateware


@pytest.mark.slow
def test_random_frames_and_shapes_that_break_labellers_have_scipys_barycenters_rounded(record_property):
    rng = np.random.default_rng(7)
    frames = rng.random((1500, 16, 16)) < rng.uniform(0, 1, (1500, 1, 1))
    frames = np.concatenate([frames, [cells for _, cells in variants(16, 16)]])
    assert_replayed(frames, 4, most=64)
    record_property("cases", len(frames))


LONG = ("sdh13x6", "feet45x52", "bed64x32", "popu64x27")


@pytest.mark.slow  # it shares the board of the slow test above
@pytest.mark.recordings
@pytest.mark.parametrize("name", ["dtmf16x16", *(pytest.param(name, marks=pytest.mark.campaign) for name in LONG)])
def test_recordings_have_scipys_barycenters_rounded(record_property, name):
    frames = recorded(name)
    frames = frames[:: max(1, len(frames) // 1000)]
    assert_replayed(frames, 4, most=64)  # the board of the test above where the sheet is the same
    record_property("cases", len(frames))


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A Skin's file, a scene's, and its cells."""
    folder = tmp_path_factory.mktemp("scene")
    (folder / "skin.toml").write_text(SHEET.to_toml())
    cells = np.zeros((13, 6), bool)
    cells[0:2, 1:4] = cells[5, 0] = cells[8:13, 2:6] = True
    cells[8, 2] = cells[12, 5] = cells[0, 1] = False
    np.save(folder / "cells.npy", cells[None])
    return folder / "skin.toml", folder / "cells.npy", cells


@pytest.mark.slow
def test_read_zones_needs_no_skin_and_gives_what_scipy_says_rounded(scene):
    skin, frames, cells = scene
    zones = contactfpga.read_zones(f"sim://?scene={frames}&skin={skin}")
    assert zones.sheet.barycenter_bits == 3
    wanted = sorted(rounded_zones(cells, 3), key=lambda zone: (zone[2], zone[1]))
    assert len(zones) == 3
    for zone, (area, x, y) in zip(zones, wanted, strict=True):
        assert zone.area_cells == area
        assert (zone.x_mm, zone.y_mm) == pytest.approx((x / 8 * 3.4, y / 8 * 5.0), rel=1e-12)
        assert zone.point_mm == (zone.x_mm, zone.y_mm, 0.0)
        assert zone.area_mm2 == pytest.approx(area * 17.0)
        assert (zone.sum_x, zone.sum_y) == (None, None)
    assert zones.rounding_mm == (3.4 / 16, 5.0 / 16)
    exact = ndimage.center_of_mass(cells, ndimage.label(cells, np.ones((3, 3)))[0], [1, 2, 3])
    for zone, (y, x) in zip(zones, exact, strict=True):
        assert abs(zone.x_mm - x * 3.4) <= zones.rounding_mm[0] + 1e-9
        assert abs(zone.y_mm - y * 5.0) <= zones.rounding_mm[1] + 1e-9


CROWDED = [(4, 12, 4, 8), (9, 8, 8, 5), (2, 16, 8, 0)]


@pytest.mark.slow  # test_top.py has one frame after the other at the shortest row time
@pytest.mark.parametrize(
    ("rows", "columns", "connectivity", "bits", "debounce"),
    sample(
        [(*sheet, debounce) for sheet in CROWDED for debounce in ("none", "sym_defer_pk")],
        quick=[(*CROWDED[0], "none"), (*CROWDED[1], "sym_defer_pk")],
    ),
)
def test_a_frame_full_of_zones_keeps_its_own_time_at_the_shortest_row_time(rows, columns, connectivity, bits, debounce):
    """Division ends so late that the next frame is nearly over; each trailer must still be its own frame's."""
    fields = {"rows": rows, "columns": columns, "connectivity": connectivity, "debounce": debounce}
    fields |= {"report": "barycenter", "barycenter_bits": bits, "debounce_press_us": 0, "debounce_release_us": 0}
    skin = next(skin for clocks in range(5, 400) if (skin := skin_with_rows_of(clocks, fields)))
    y, x = np.indices((rows, columns))
    most = (x % 2 == 0) & (y % 2 == 0) if connectivity == 8 else (x + y) % 2 == 0
    late, early = most.copy(), most.copy()
    late[: rows // 2] = early[rows // 2 :] = False
    frames = [most, late, early, most, ~most, late, late, early, np.zeros_like(most)] * 2
    cycles = len(frames) * facts(skin).scan_clocks
    timeline = Timeline.frames(skin, frames)
    expected = predict(skin, timeline, cycles)
    assert compare(expected, bench_amaranth.run(skin, timeline, cycles)) > 300
    assert len(expected.items) > 6 * len(zones(most, connectivity))


def skin_with_rows_of(clocks, fields):
    with contextlib.suppress(contactfpga.SkinError):
        return Skin(settle_us=(clocks - 1) / 12, release_us=1 / 12, baud=6_000_000, **fields)


def test_a_skin_with_other_fraction_bits_is_another_one():
    with FakeBoard(SHEET) as board:
        contactfpga.open(board.path, SHEET, timeout=60.0).close()
        with pytest.raises(contactfpga.SkinMismatch, match="barycenter_bits is 3, asked for was 4"):
            contactfpga.open(board.path, SHEET.replace(barycenter_bits=4), timeout=60.0)


@pytest.mark.slow
def test_commands(scene, tmp_path, capsys):
    skin, frames, cells = scene
    port = f"sim://?scene={frames}&skin={skin}"
    recorded = tmp_path / "bytes"
    assert cli.main(["zones", port, "--once", "--json", "--record", str(recorded)]) == 0
    frame = json.loads(capsys.readouterr().out)
    assert [zone["area_cells"] for zone in frame["zones"]] == [5, 1, 18]
    assert frame["zones"][0]["sum_x"] is None
    assert frame["rounding_mm"] == [3.4 / 16, 5.0 / 16]
    with contactfpga.open(f"replay://{recorded}") as board:
        again = next(zones for zones in board if zones.sequence == frame["sequence"])
    assert json.loads(json.dumps(again.to_dict())) == frame | dict.fromkeys(
        ("arrived_s", "host_time_s", "host_sigma_s")
    )
    assert cli.main(["zones", port, "--once"]) == 0
    assert "3 zones" in capsys.readouterr().out
    assert cli.main(["doctor", port, "--seconds", "0.05"]) == 0
    assert "report 'barycenter' of 3 fraction bits" in capsys.readouterr().out
    assert cli.main(["replay", str(frames), "--barycenter-bits", "2", "--pitch-mm", "2", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["zones"]
    wanted = [(area, x / 2, y / 2) for area, x, y in rounded_zones(cells, 2)]
    assert sorted((zone["area_cells"], zone["x_mm"], zone["y_mm"]) for zone in found) == wanted


# ---- time, bytes, netlists

SKINS = {
    "reference": Skin(),
    "reference, 6 Mbaud": Skin(baud=6_000_000),
    "32x32, serial": Skin(rows=32, columns=32, labeller="serial"),
    "64x64, 6 Mbaud": Skin(rows=64, columns=64, baud=6_000_000),
}


def late_frames(skin, rng):
    """Cells whose zones end as late and as close together as they can, within what a frame can carry, and others."""
    rows, columns = skin.rows, skin.columns
    dots = np.zeros((rows, columns), bool)
    dots[-1, ::2] = True
    grid = np.zeros((rows, columns), bool)
    grid[1 - rows % 2 :: 2, ::2] = True
    grid[: rows - 2 * (64 // (columns // 2))] = False
    corner, first = np.zeros((rows, columns), bool), np.zeros((rows, columns), bool)
    corner[-1, -1] = first[0, 0] = True
    some = rng.random((rows, columns)) < 20 / rows / columns
    return [dots, grid, corner, first, np.ones((rows, columns), bool), some]


@pytest.mark.parametrize("name", SKINS)
def test_the_last_byte_is_never_later_than_with_exact_moments(name):
    moments = SKINS[name].replace(zone_capacity=64)
    divided = moments.replace(report="barycenter", zone_capacity=64)
    saved = moments.derived.record_bytes - divided.derived.record_bytes
    assert saved == (2 if moments.rows == 64 else 1)
    sooner = []
    for number, cells in enumerate(late_frames(moments, np.random.default_rng(1))):
        (before, longer), (after, shorter) = (speed.touch(skin, cells, number / 7) for skin in (moments, divided))
        zones = len(rounded_zones(cells, 0))
        assert saved * zones <= longer - shorter <= saved * zones + 1, "a stuffing byte may go, too"
        sooner.append(before - after)
        assert after <= before
    assert max(sooner) > 10 * moments.derived.bit_clocks


def test_rounding_is_charged_to_the_method_on_the_chart():
    cells = np.zeros((16, 16), bool)
    cells[2, 3:5] = cells[7:10, 8] = cells[9, 9] = True
    exact = errors.exact_zones(cells, Skin())
    for bits, worst in ((0, 5 * math.sqrt(2)), (4, 5 / 16 * math.sqrt(2))):
        found = errors.method_zones(cells, Skin(report="barycenter", barycenter_bits=bits))
        error = errors.errors(found, exact)
        assert (error.miscounted, error.missed, error.area) == (False, 0.0, 0.0)
        wanted = [math.dist((a.x_mm, a.y_mm), (b.x_mm, b.y_mm)) for a, b in zip(found, exact, strict=True)]
        assert error.barycenter_mm == pytest.approx(np.mean(wanted))
        assert max(wanted) <= worst
        assert (error.barycenter_mm > 0) == (bits == 0 or any(wanted))
    assert errors.errors(errors.method_zones(cells, Skin()), exact).barycenter_mm == 0
    assert any(a != b for a, b in itertools.combinations(found, 2))
