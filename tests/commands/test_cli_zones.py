"""`contactfpga zones` and `contactfpga wire`: what they print and keep."""

import json
import re
import subprocess
import sys

import pytest
from fake_board import FakeBoard

import contactfpga
from contactfpga import Places
from contactfpga.tracking.places import Row, Spread

CELLS = contactfpga.Skin(rows=3, columns=6, report="cells", settle_us=20.0)


# ---- zones


def test_zones_once_shows_table_and_sheet(board, run):
    status, out, errors = run("zones", "--once", "--timeout", 60, board.path)
    assert (status, errors) == (0, "")
    assert "1 zone" in out
    for number in ("400", "25.00", "15.00"):  # mm2, x mm, y mm
        assert f" {number} " in out
    assert "4 cells pressed" in out
    assert out.count("◎") == 2  # on the sheet and in the line that says what it is


def test_zones_json_is_one_object_a_line(board, run):
    status, out, _ = run("zones", "--once", "--json", "--timeout", 60, board.path)
    frame = json.loads(out)
    assert status == 0
    assert (frame["flags"], frame["faults"]) == ([], [])
    assert frame["pressed"] == 4
    (zone,) = frame["zones"]
    assert (zone["area_cells"], zone["sum_x"], zone["sum_y"]) == (4, 10, 6)
    assert zone["point_mm"] == [25.0, 15.0, 0.0]
    assert zone["normal"] == [0.0, 0.0, 1.0]


def test_zones_of_a_recording_until_its_end(board, tmp_path, run):
    file = tmp_path / "frames.bin"
    file.write_bytes(board.hello() + b"".join(board.frame() for _ in range(30)))
    status, out, _ = run("zones", "--json", f"replay://{file}")
    assert status == 0
    assert [json.loads(line)["sequence"] for line in out.splitlines()] == list(range(30))
    status, out, _ = run("zones", f"replay://{file}")
    assert status == 0
    assert "frame at 0.003 s" in out  # the last one
    assert "30 frames" in out


def recorded_touches(board, path):
    """Two touches, one after the other, the second beside the first."""
    parts = [board.hello()]
    for moments in ([], [(4, 10, 6)], [(4, 10, 6), (4, 40, 30)], [(4, 12, 6), (4, 40, 30)], [(4, 40, 30)]):
        board.moments = moments
        parts += [board.frame() for _ in range(100)]
    path.write_bytes(b"".join(parts))


def test_zones_with_tracks_as_json_has_ids_and_events(board, tmp_path, run):
    recorded_touches(board, tmp_path / "touches.rec")
    status, out, errors = run("zones", "--tracks", "--json", f"replay://{tmp_path / 'touches.rec'}")
    assert (status, errors) == (0, "")
    frames = [json.loads(line) for line in out.splitlines()]
    said = [(event["kind"], event["id"]) for one in frames for event in one["events"]]
    assert said == [("down", 1), ("down", 2), ("move", 1), ("up", 1)]
    assert [[track["id"] for track in frames[number]["tracks"]] for number in (50, 150, 250, 350, 499)] == [
        *([], [1], [1, 2], [1, 2], [2]),
    ]
    assert all(one.keys() >= {"zones", "unsure", "restarted"} for one in frames)


def test_zones_with_tracks_follows_frames_that_are_not_shown(board, tmp_path, run):
    recorded_touches(board, tmp_path / "touches.rec")
    status, out, _ = run("zones", "--tracks", f"replay://{tmp_path / 'touches.rec'}")
    assert status == 0
    assert len(re.findall(r"│ +2 │ +4 │ 400 │", out)) == 1


def test_zones_with_a_table_of_places_shows_contacts_there(board, tmp_path, run):
    """The first of two cells has the weight 3/4, so x is 2.5 mm where the barycenter's is 5 mm."""
    parts = [board.hello()]
    for board.moments in ([(1, 0, 3)], [(2, 1, 6)]):
        parts.append(board.frame())
    (tmp_path / "touches.rec").write_bytes(b"".join(parts))
    table = Places(10.0, 10.0, 0.0, (Row(1, -1.0, 0.0, 9.0),), (Spread(1.0, 0.0),) * 6)
    (tmp_path / "places.toml").write_text(table.toml())
    status, out, _ = run("zones", "--place-by", tmp_path / "places.toml", f"replay://{tmp_path / 'touches.rec'}")
    assert status == 0
    assert re.search(r"│ +2 │ 200 │ +2.50 │ 30.00 │", out)


def test_zones_records(board, tmp_path, run):
    file = tmp_path / "frames.bin"
    run("zones", "--once", "--json", "--record", file, "--timeout", 60, board.path)
    status, out, _ = run("zones", "--json", f"replay://{file}")
    assert status == 0
    assert {json.loads(line)["pressed"] for line in out.splitlines()} == {4}


@pytest.mark.parametrize(("form", "shows"), [("--json", '"pressed": 4'), ("--baud=3000000", "cells pressed")])
def test_a_reader_has_the_first_frame_at_once_and_may_end_first(board, form, shows):
    """`contactfpga zones | head -1`: nothing may wait for the end of what has none."""
    board.stream = board.frame
    command = [sys.executable, "-m", "contactfpga", "zones", form, "--timeout", "60", board.path]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert any(shows in line for line in iter(process.stdout.readline, ""))
        assert process.poll() is None
        process.stdout.close()
        assert process.wait() == 0
        assert process.stderr.read() == ""


@pytest.mark.parametrize("form", ["--json", "--tracks"])
def test_zones_end_after_the_seconds_asked_for(board, tmp_path, run, form):
    recorded_touches(board, tmp_path / "touches.rec")
    first, *_, last = (json.loads(line)["time_us"] for line in run(*replayed(tmp_path), "--json")[1].splitlines())
    assert last - first > 20_000
    status, out, errors = run(*replayed(tmp_path), form, "--seconds", 0.01)
    assert (status, errors) == (0, "")
    if form == "--json":
        times = [json.loads(line)["time_us"] for line in out.splitlines()]
        assert times[0] == first
        assert first + 9_000 < times[-1] < first + 10_000
    else:
        assert out.count("cells pressed") == 2  # the first and the last


def replayed(folder):
    return "zones", f"replay://{folder / 'touches.rec'}"


# ---- wire


def test_wire_shows_the_pressed_cells(run):
    with FakeBoard(CELLS) as board:
        status, out, _ = run("wire", "--once", "--timeout", 60, board.path)
    assert status == 0
    assert out.splitlines()[:3] == ["· ██· ██· ██"] * 3
    assert "(0, 1), (0, 3), (0, 5), (1, 1)" in out


def test_wire_names_no_more_cells_than_fit_a_line(run):
    with FakeBoard(CELLS.replace(rows=16)) as board:
        _, out, _ = run("wire", "--once", "--timeout", 60, board.path)
    assert "and 36 more" in out


def test_wire_needs_a_board_that_sends_cells(board, run):
    status, out, errors = run("wire", "--timeout", 60, board.path)
    assert (status, out) == (1, "")
    assert 'report = "cells"' in errors
