"""Tables that other programs read."""

import csv
import json
import tomllib
from types import SimpleNamespace

import numpy as np
import pytest
from model_board import ModelBoard
from recorded_stream import StreamPort, recorded, written

import contactfpga
from contactfpga import Skin
from contactfpga.recordings import Recording
from contactfpga.tools import cli
from contactfpga.tools.recordings.export import COLUMNS, pieces
from contactfpga.wire.protocol import Frame, no_records


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    folder = tmp_path_factory.mktemp("export")
    port = StreamPort(frames=200)
    port.empty_every = 7
    recorded(folder, port)
    return folder / "touches.mcap"


def expected(file):
    """A row for each zone and for each frame without one, from the frames."""
    rows, tracker = [], contactfpga.Tracker()
    for frame, (t_s, link, zones) in enumerate(Recording(file).frames()):
        tracks = tracker.update(zones).active
        for number, zone in enumerate(zones):
            (track,) = [one.id for one in tracks if one.zone is zone]
            rows.append((t_s, link, frame, zones.time_us, number, track, zone.area_mm2, zone.x_mm, zone.y_mm))
        if not zones:
            rows.append((t_s, link, frame, zones.time_us, -1, -1, np.nan, np.nan, np.nan))
    return rows


def same(rows, file):
    wanted = expected(file)
    assert len(rows) == len(wanted) > 200
    assert any(row[4] == -1 for row in wanted)
    for row, one in zip(rows, wanted, strict=True):
        assert tuple(row[1:6]) == one[1:6]
        np.testing.assert_array_equal((row[0], *row[6:9]), (one[0], *one[6:]))


def test_parquet_has_the_skin_in_its_schema(file, tmp_path, capsys):
    from pyarrow import parquet

    assert cli.main(["export", str(file), str(tmp_path / "x.parquet")]) == 0
    read = parquet.read_table(tmp_path / "x.parquet")
    assert read.column_names == list(COLUMNS)
    same(list(zip(*(read.column(name).to_pylist() for name in read.column_names))), file)
    facts = json.loads(read.schema.metadata[b"contactfpga"])
    assert Skin(**tomllib.loads(facts["links"]["left hand"]["skin"])) == Skin()
    assert facts["links"]["left hand"]["sheet"]["rows"] == 16
    assert facts["start_s"] == Recording(file).start_s
    assert read.schema.field("x_mm").metadata[b"meaning"].startswith(b"barycenter along the columns in mm")
    assert f"{read.num_rows:,} rows" in capsys.readouterr().out


def test_npz(file, tmp_path):
    assert cli.main(["export", str(file), str(tmp_path / "x.npz")]) == 0
    with np.load(tmp_path / "x.npz") as read:
        same(list(zip(*(read[name].tolist() for name in COLUMNS))), file)
        assert json.loads(str(read["contactfpga"]))["links"]["left hand"]["name"] == ""
        assert read["area_mm2"].dtype == np.float64


def test_csv(file, tmp_path):
    assert cli.main(["export", str(file), str(tmp_path / "x.CSV")]) == 0
    with open(tmp_path / "x.CSV", newline="", encoding="utf-8") as opened:
        head, *rows = csv.reader(opened)
    assert head == list(COLUMNS)
    same([(float(r[0]), r[1], *map(int, r[2:6]), *map(float, r[6:9])) for r in rows], file)


def test_bytes_that_could_not_be_used_are_counted(tmp_path, capsys):
    board = ModelBoard(Skin())
    hello, frames = board.hello(), [board.frame() for _ in range(20)]
    broken = bytes([frames[5][0] ^ 1]) + frames[5][1:]
    sent = {
        "whole": hello + b"".join(frames),
        "late": b"".join(frames[:3]) + hello + b"".join(frames[3:]),
        "damaged": hello + b"".join([*frames[:5], broken, *frames[6:]]),
        "deaf": b"".join(frames),
    }
    written(tmp_path / "x.mcap", sent)
    words = ["export", str(tmp_path / "x.mcap"), str(tmp_path / "x.csv")]
    assert cli.main([*words, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["unused_bytes"].keys() == {"late", "damaged", "deaf"}
    assert answer["unused_bytes"]["deaf"] == len(b"".join(frames))
    assert (answer["file"], answer["duration_s"]) == (words[2], 0)
    assert answer["rows"] == len((tmp_path / "x.csv").read_text().splitlines()) - 1
    assert cli.main(words) == 0
    said = [
        line.split(" bytes could not be used")[0] for line in capsys.readouterr().out.splitlines() if "used" in line
    ]
    sizes = {"late": frames[:3], "damaged": frames[5:6], "deaf": frames}
    assert sorted(said) == sorted(f"{link}: {len(b''.join(lost)):,}" for link, lost in sizes.items())


def test_pieces_are_one_table(file):
    whole, *none = pieces(Recording(file))
    assert none == []
    parts = list(pieces(Recording(file), rows=50))
    assert len(parts) > 3
    for name in COLUMNS:
        np.testing.assert_array_equal(np.concatenate([part[name] for part in parts]), whole[name])


@pytest.mark.parametrize(("name", "said"), [("x.xlsx", "take one of: .parquet, .npz, .csv"), ("no", "ends in ''")])
def test_a_table_of_no_known_kind(file, tmp_path, capsys, name, said):
    assert cli.main(["export", str(file), str(tmp_path / name)]) == 1
    assert said in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_without_pyarrow_the_extra_is_named(file, tmp_path, monkeypatch, capsys):
    import sys

    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert cli.main(["export", str(file), str(tmp_path / "x.parquet")]) == 1
    assert "pip install 'contactfpga[analysis]'" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_ring_is_named_and_has_no_x():
    skin = Skin(rows=4, columns=8, surface="cylinder", radius_mm=20.0, closed=True, report="cells")
    cells = np.zeros((4, 8), bool)
    cells[1] = True
    zones = contactfpga.Zones(Frame(0, 0, frozenset(), 0, 0, 0, 8, no_records(skin.sheet), cells), skin.sheet, 0)
    (piece,) = pieces(SimpleNamespace(frames=lambda: [(0.0, "arm", zones)]))
    assert piece["winding"].tolist() == ["ring"]
    assert np.isnan(piece["x_mm"]).all()
    assert piece["y_mm"].tolist() == [skin.pitch_y_mm]
