"""Where parts lie, what is refused with its limit, and the cap layer as trimesh reads it."""

import csv
import itertools
import math

import numpy as np
import pytest
import trimesh

from contactfpga import Skin
from contactfpga.design.sheet import SheetError, files, lay_out
from contactfpga.design.sheet.caps import caps
from contactfpga.design.sheet.parts import DOME, HC595, TACT, header

TILE = {"pitch_x_mm": 6.4, "pitch_y_mm": 6.4}
CLOSED = {"closed": True, "surface": "cylinder"}


@pytest.mark.parametrize(
    ("changes", "part", "message"),
    [
        (
            {"pitch_x_mm": 5.0},
            "dome",
            r"pitch_x_mm is 5; a cell with DOME_5MM_4LEG, .* needs 5\.52 mm: set pitch_x_mm = 5\.52",
        ),
        ({"pitch_y_mm": 5.0}, "dome", r"pitch_y_mm is 5; a cell with DOME_5MM_4LEG, .* needs 5\.2 mm"),
        ({"pitch_x_mm": 6.9}, "tact", r"pitch_x_mm is 6\.9; a cell with TACT_4\.5MM, .* needs 7 mm"),
        ({}, "spring", r"part is 'spring'; it must be one of dome, tact"),
        (dict(rows=20, columns=8, radius_mm=12.0, **CLOSED), "dome", r"rows is 20; .* place for at most 14 rows, 2"),
        (
            dict(rows=3, columns=4, row_drive="74hc595", column_read="74hc165", radius_mm=5.0, **CLOSED),
            "dome",
            r"radius_mm is 5: connectors, .* edges at -3\.9 and 27\.5",
        ),
    ],
)
def test_what_cannot_be_laid_out_is_refused_with_the_limit(changes, part, message):
    with pytest.raises(SheetError, match=message):
        lay_out(Skin(**changes), part=part)


def test_a_closed_sheet_goes_on_over_its_seam():
    skin = Skin(rows=10, columns=16, radius_mm=45.0, guard=True, **CLOSED)
    layout = lay_out(skin)
    left, _, right, _ = layout.drawing.outline
    assert right - left == pytest.approx(2 * math.pi * 45.0)
    assert (right - 15 * skin.pitch_x_mm) + (0 - left) == pytest.approx(skin.pitch_x_mm)
    copper = [x for track in layout.drawing.tracks for x in (track.x1 - track.width / 2, track.x2 + track.width / 2)]
    assert min(copper) >= left + 0.3
    assert max(copper) <= right - 0.3


def test_the_board_ends_half_a_pitch_and_its_margin_below_the_last_row_with_holes_in_the_margin():
    drawing = lay_out(Skin(rows=3, columns=4), margin_mm=9.0).drawing
    left, top, right, bottom = drawing.outline
    assert bottom == 2 * 10 + 5 + 9
    corners = itertools.product((left + 4.5, right - 4.5), (top + 4.5, bottom - 4.5))
    assert {(hole.x, hole.y) for hole in drawing.holes} == set(corners)


def test_the_guard_lines_are_on_the_outermost_wires():
    skin = Skin(rows=11, columns=9, guard=True)
    layout = lay_out(skin)
    rows = list(csv.DictReader(files.connectors_list(layout).splitlines()))
    last = {row["connector"]: row for row in rows}
    assert {row["line"] for row in last.values()} == {"ROW_GUARD", "COL_GUARD"}
    assert {row["wire"] for row in last.values()} == {"rows[11]", "columns[9]"}
    for name in last:
        wires = [row["wire"] for row in rows if row["connector"] == name]
        lines = [wire for wire in wires if "[" in wire]
        assert lines == sorted(lines, key=lambda wire: int(wire.split("[")[1][:-1]))
        assert wires.count("GND") >= len(lines) // 4


def test_packages_have_the_distances_of_their_standards():
    """JEDEC MS-012 and a header of 2.54 mm: written down here by hand."""
    pads = {pad.number: (pad.x, pad.y) for pad in HC595.pads}
    assert pads["1"] == pytest.approx((-4.445, 2.475))
    assert np.subtract(pads["8"], pads["1"]) == pytest.approx((7 * 1.27, 0))
    assert np.subtract(pads["9"], pads["8"]) == pytest.approx((0, -4.95))
    assert np.subtract(pads["16"], pads["1"]) == pytest.approx((0, -4.95))
    pins = {pad.number: (pad.x, pad.y) for pad in header(20).pads}
    assert np.subtract(pins["2"], pins["1"]) == pytest.approx((0, -2.54))
    assert np.subtract(pins["19"], pins["1"]) == pytest.approx((9 * 2.54, 0))


@pytest.mark.parametrize("switch", [DOME, TACT])
def test_caps_are_closed_bodies_with_the_stated_clearances(tmp_path, switch):
    skin = Skin(rows=3, columns=4, pitch_x_mm=7.4, pitch_y_mm=7.2, mask=((0, 0),))
    layer = caps(skin, switch, 6.6)
    (tmp_path / "caps.stl").write_bytes(layer.stl())
    mesh = trimesh.load(tmp_path / "caps.stl")
    bodies = mesh.split()
    assert len(bodies) == 11
    assert all(body.is_watertight and body.is_winding_consistent for body in bodies)
    assert all(
        body.volume == pytest.approx(6.6**2 * 1.2 + 1.5**2 * (switch.travel_mm + 0.3), rel=1e-4) for body in bodies
    )
    centers = {tuple(np.round(body.bounds.mean(axis=0)[:2], 3) + 0.0) for body in bodies}
    assert centers == {(round(c * 7.4, 3), round(-r * 7.2, 3)) for r in range(3) for c in range(4) if (r, c) != (0, 0)}
    ends = sorted({round(float(body.bounds[0, 1]), 3) for body in bodies})
    assert ends[1] - (ends[0] + 6.6) == pytest.approx(layer.gap_mm, abs=1e-3)
    assert layer.gap_mm == pytest.approx(0.6)


@pytest.mark.parametrize(
    ("side", "message"),
    [
        (
            6.2,
            r"side_m in \[cover.cap\] is 0\.0062; at a pitch of 6\.4 mm .* 0\.2 mm apart, .* take caps of 0\.0061 m",
        ),
        (1.0, r"side_m in \[cover.cap\] is 0\.001; it must be more than 0\.0015"),
    ],
)
def test_caps_that_touch_or_vanish_are_refused(side, message):
    with pytest.raises(SheetError, match=message):
        caps(Skin(rows=2, columns=2, **TILE), DOME, side)
