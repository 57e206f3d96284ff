"""Frames as tables of pandas and Arrow: every field of every zone, in its column."""

import math

import pytest
from wire import Wire

import contactfpga
from contactfpga.driver.conversation import Conversation
from contactfpga.zones.batch import Batch
from contactfpga_sim import VirtualBoard

PLANE = contactfpga.Skin(rows=12, columns=20, pitch_x_mm=4.0, settle_us=20.0)
SHEETS = {
    "plane": PLANE,
    "rounded": PLANE.replace(report="barycenter"),
    "closed": contactfpga.Skin(rows=12, columns=20, surface="cylinder", radius_mm=40.0, closed=True, settle_us=20.0),
}
SHEETS |= {f"{name} with extents": skin.replace(extent=True) for name, skin in SHEETS.items()}
MOMENTS = {
    "plane": [(4, 34, 6), (1, 5, 3)],
    "rounded": [(4, 17 << 3, 6), (1, 40, 24)],
    "closed": [(4, 34, 6, 0), (20, 190, 60, 20)],
    "plane with extents": [(4, 34, 6, 8, 9, 1, 2), (1, 5, 3, 5, 5, 3, 3)],
    "rounded with extents": [(4, 17 << 3, 24, 8, 9, 1, 2), (1, 5 << 4, 3 << 4, 5, 5, 3, 3)],
    "closed with extents": [(4, 38, 6, 2, 19, 0, 1, 2), (20, 190, 60, 20, 0, 19, 3, 3)],
}

VECTORS = {
    "point_mm": ["point_x_mm", "point_y_mm", "point_z_mm"],
    "normal": ["normal_x", "normal_y", "normal_z"],
    "box": ["left", "right", "top", "bottom"],
    "box_mm": ["box_x_mm", "box_y_mm", "box_width_mm", "box_height_mm"],
}


def frames_of(name):
    """Three frames; nothing touches in the middle one."""
    skin = SHEETS[name]
    host, wire = Conversation("x"), Wire(skin)
    host.receive(wire.hello(), 0.0)
    packets = b"".join(
        wire.zones(MOMENTS[name] if index != 1 else [], sequence=index, time=2000 * index) for index in range(3)
    )
    return [zones for run in host.receive(packets, 0.0) for zones in run]


def expected(zones):
    """A row for each zone, from its attributes."""
    rows = []
    for zone in zones:
        row = {"time_us": zones.time_us, "sequence": zones.sequence}
        for name in zones.array.dtype.names:
            value = getattr(zone, name)
            if name in VECTORS:
                row |= dict(zip(VECTORS[name], value or (None,) * 3, strict=True))
            else:
                row[name] = value
        rows.append(row)
    return rows


def plain(rows):
    """None for what a DataFrame holds as NaN."""
    return [
        {name: None if isinstance(value, float) and math.isnan(value) else value for name, value in row.items()}
        for row in rows
    ]


@pytest.mark.parametrize("name", SHEETS)
def test_a_row_for_each_zone(name):
    pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    frames = frames_of(name)
    assert [len(zones) for zones in frames] == [2, 0, 2]
    for zones in frames:
        assert plain(zones.to_pandas().to_dict("records")) == zones.to_arrow().to_pylist() == expected(zones)
    rows = [{"frame": index, **row} for index, zones in enumerate(frames) for row in expected(zones)]
    batch = Batch.of(frames)
    assert plain(batch.to_pandas().to_dict("records")) == batch.to_arrow().to_pylist() == rows


def test_frames_of_successive_batches_are_numbered_on():
    """As whoever appends one table to another sees them; a batch's own arrays begin at 0."""
    pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    port = VirtualBoard(scene="two_fingers")
    with contactfpga.open(port) as board:
        batches = [board.batch() for _ in range(3)]
    sent = [sequence for batch in batches for sequence in batch.frames["sequence"].tolist()]
    assert len(sent) > len(batches) == 3
    for tables in ([batch.to_arrow().to_pandas() for batch in batches], [batch.to_pandas() for batch in batches]):
        numbers = [number for table in tables for number in table["frame"].tolist()]
        assert sorted(set(numbers)) == list(range(len(sent)))
    assert [int(batch.zones["frame"][0]) for batch in batches] == [0, 0, 0]


def test_frames_without_zones_keep_their_columns():
    pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    touched, empty, _ = frames_of("plane")
    assert list(empty.to_pandas().dtypes) == list(touched.to_pandas().dtypes)
    assert empty.to_arrow().schema == touched.to_arrow().schema


@pytest.mark.parametrize(("method", "package"), [("to_pandas", "pandas"), ("to_arrow", "pyarrow")])
def test_what_is_not_installed_is_named(method, package, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, package, None)
    zones = frames_of("plane")[0]
    for table in (zones, Batch.of([zones])):
        with pytest.raises(
            contactfpga.MissingExtra, match=rf"^{method}\(\) .*{package}.*pip install .*\[analysis\]"
        ) as caught:
            getattr(table, method)()
        assert "\n" not in str(caught.value)


def test_neither_is_imported_before_it_is_asked_for(python):
    code = (
        "import sys, contactfpga; contactfpga.Zones, contactfpga.Batch; print({'pandas', 'pyarrow'} & set(sys.modules))"
    )
    assert python(code).stdout.strip() == "set()"


def test_names_that_people_type_first():
    frames = frames_of("closed")
    assert [zones.time_s for zones in frames] == [zones.time_us / 1e6 for zones in frames]
    assert frames[1].time_s > 0
    (place, ring) = sorted(frames[0], key=lambda zone: bool(zone.winding))
    assert place.centroid_mm == (place.x_mm, place.y_mm)
    assert ring.winding == "ring"
    assert ring.centroid_mm is None
