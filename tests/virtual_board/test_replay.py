"""Recorded frames through the compiled gateware and back, as `contactfpga replay` does it."""

import functools
import itertools
import json

import numpy as np
import pytest
from recorded_frames import RECORDINGS, recorded
from sample import sample
from zone_oracles import zones_by_scipy

from contactfpga.tools import cli
from contactfpga_sim.model.board import replay
from contactfpga_sim.model.scenes.shapes import variants


def assert_zones_are_scipys(frames, connectivity):
    """Through the board for any number of zones: one for each size of sheet, as it has to be compiled."""
    _, rows, columns = frames.shape
    skin = replay.skin_for(rows, columns, connectivity, rows * columns)
    assert skin.zone_capacity >= replay.zones_bound(frames, connectivity)
    count = 0
    for cells, result in zip(frames, replay.replay(frames, skin), strict=True):
        assert sorted(map(tuple, result.frame.moments.tolist())) == zones_by_scipy(cells, connectivity)
        assert result.frame.flags == frozenset()
        count += 1
    assert count == len(frames)


SHAPES = [(4, 5), (16, 16), (1, 1)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "connectivity"),
    sample(itertools.product(SHAPES, (8, 4)), quick=[((16, 16), 8)]),
)
def test_every_frame_comes_back_once_with_scipys_zones(record_property, shape, connectivity):
    rng = np.random.default_rng(7)
    frames = rng.random((1500, *shape)) < rng.uniform(0, 1, (1500, 1, 1))
    assert_zones_are_scipys(frames, connectivity)
    record_property("cases", len(frames))


@pytest.mark.slow
def test_shapes_that_break_labellers(record_property):
    frames = np.stack([cells for _, cells in variants(16, 16)])
    assert_zones_are_scipys(frames, 8)
    record_property("cases", len(frames))


@pytest.mark.slow
@pytest.mark.recordings
@pytest.mark.parametrize(
    ("name", "most"),
    sample([("dtmf16x16", 3000), *((name, None) for name in RECORDINGS)], quick=[("dtmf16x16", 3000)]),
)
def test_recordings_have_scipys_zones(record_property, name, most):
    frames = recorded(name)[:most]
    assert_zones_are_scipys(frames, 8)
    record_property("cases", len(frames))


def test_the_bound_is_never_below_the_zones():
    rng = np.random.default_rng(5)
    for density in (0.02, 0.2, 0.4, 0.6):
        frames = rng.random((50, 9, 11)) < density
        for connectivity in (8, 4):
            zones = max(len(zones_by_scipy(cells, connectivity)) for cells in frames)
            assert zones <= replay.zones_bound(frames, connectivity) <= 60
    assert replay.zones_bound(np.zeros((3, 4, 4), bool), 8) == 0


def test_scans_with_a_hello_are_left_out_of_the_plan():
    plan = replay._Plan(replay.skin_for(2, 3, 8, 2), 200_000)
    assert plan.frame_of.count(None) > 20
    assert [frame for frame in plan.frame_of if frame is not None] == list(range(200_000))


@pytest.mark.slow
def test_a_lost_frame_is_an_error(monkeypatch):
    frames = np.ones((300, 16, 16), bool)
    skin = replay.skin_for(16, 16, 8, 256)  # which another test compiles
    take = replay.CompiledBoard.take

    def lossy(board, boundary):
        events = take(board, boundary)
        if boundary != "received":
            return events
        ends = np.flatnonzero(events["data"] == 0)
        return np.delete(events, np.arange(ends[40] + 1, ends[41] + 1)) if len(ends) > 41 else events

    monkeypatch.setattr(replay.CompiledBoard, "take", lossy)
    with pytest.raises(replay.ReplayError, match="did not reach the host"):
        list(replay.replay(frames, skin))


@pytest.fixture
def run(run):
    """Runs `contactfpga replay`; returns status, output and errors."""
    return functools.partial(run, "replay")


@pytest.mark.slow
def test_json_lines_have_the_names_of_zones(tmp_path, run, capsys):
    values = np.zeros((3, 4, 5), np.uint8)
    values[1, 1:3, 2] = 40
    values[1, 3, 0] = 31
    values[2, 0, 0] = 30
    path = tmp_path / "frames.npy"
    np.save(path, values)
    status, out, errors = run(path, "--threshold", 30, "--pitch-mm", 2.5, "--json")
    assert status == 0, errors
    lines = [json.loads(line) for line in out.splitlines()]
    assert [line["frame"] for line in lines] == [0, 1, 2]
    assert lines[0]["zones"] == lines[2]["zones"] == []
    assert lines[0]["cycles"]["last_row_to_first_record"] is None
    names = ("area_cells", "sum_x", "sum_y", "area_mm2", "x_mm", "y_mm")
    found = [tuple(zone[name] for name in names) for zone in lines[1]["zones"]]
    assert found == [(2, 4, 3, 12.5, 5.0, 3.75), (1, 0, 3, 6.25, 0.0, 7.5)]
    # Last row: the zone in column 0 is one step, the one in column 2 that ended a row before is the second.
    assert lines[1]["cycles"]["last_row_to_first_record"] == 4
    assert lines[1]["cycles"]["last_row_to_last_record"] == 5
    assert lines[1]["flags"] == []
    assert cli.main(["zones", "sim://?scene=two_fingers", "--once", "--json"]) == 0
    live = json.loads(capsys.readouterr().out)
    assert list(lines[1]) == ["frame", *live, "cycles"]
    assert [*lines[1]["zones"][0]] == [*live["zones"][0]]
    _, out, _ = run(path, "--threshold", 30, "--pitch-mm", 2.5)
    assert "3 of 4x5" in out


@pytest.mark.parametrize(
    ("array", "options", "message"),
    [
        (np.zeros(4, bool), (), "shape (4,)"),
        (np.zeros((0, 4, 4), bool), (), "it holds no frame"),
        (np.zeros((1, 65, 4), bool), (), "frames of 65x4; a sheet has 1 to 64 lines"),
        (np.zeros((1, 0, 4), bool), (), "frames of 0x4"),
        (np.zeros((1, 4, 4)), (), "--threshold"),
        (np.full((1, 4, 4), np.nan), ("--threshold", 1), "16 NaN"),
        (np.zeros((1, 4, 4), complex), ("--threshold", 1), "complex128"),
    ],
)
def test_bad_input_is_named(tmp_path, run, array, options, message):
    path = tmp_path / "frames.npy"
    np.save(path, array)
    status, _, errors = run(path, *options)
    assert status == 1
    assert message in errors


def test_a_missing_or_foreign_file_is_named(tmp_path, run):
    assert "nothing.npy" in run(tmp_path / "nothing.npy")[2]
    (tmp_path / "text.npy").write_text("hello")
    status, _, errors = run(tmp_path / "text.npy")
    assert status == 1
    assert "no .npy or .npz file" in errors
