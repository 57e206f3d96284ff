"""Where parts lie, what is refused with its limit, and the cap layer as trimesh reads it."""

import csv
import io
import itertools
import math
import re

import cv2
import numpy as np
import pytest
import trimesh

from contactfpga import Skin
from contactfpga.design import kits
from contactfpga.design.sheet import SheetError, files, gerber, lay_out, tube
from contactfpga.design.sheet.caps import caps, feet, stl
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
        (
            {"columns": 2, "rows": 2, "pitch_x_mm": 5.6, "surface": "cylinder", "radius_mm": 1.9},
            "dome",
            r"radius_mm is 1\.9; it must be 2 or more, 10 times the thickness of a flexible board \(IPC-2223\)",
        ),
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


@pytest.mark.parametrize("tab", [7.0, 12.0])
def test_tabs_meet_over_the_seam_and_clamps_leave_room_for_tube_sheet_and_screws(tab):
    """Angles and radii are those of a wrapped sheet, computed here; OpenCV and trimesh measure."""
    layout = lay_out(Skin(rows=6, columns=12, radius_mm=30.0, row_drive="74hc595", **CLOSED), margin_mm=tab)
    edge = gerber.files(layout.drawing, "a")["a-Edge_Cuts.gm1"]
    starts = re.findall(r"X(-?\d+)Y(-?\d+)D02", edge)
    board = np.array([(int(x) / 1e6, int(y) / 1e6) for x, y in starts], np.float32)
    assert cv2.contourArea(board) == pytest.approx(2 * math.pi * 30.0 * board[:, 1].max() + 2 * tab**2, rel=1e-6)
    places = [layout.drawing.corner(*one.spot(pad.x, pad.y)) for one in layout.drawing.placed for pad in one.part.pads]
    assert min(cv2.pointPolygonTest(board, place, True) for place in places) > 0.6
    holes = [layout.drawing.corner(hole.x, hole.y) for hole in layout.drawing.holes]
    assert [cv2.pointPolygonTest(board, hole, True) for hole in holes] == pytest.approx([tab / 2] * 6, abs=1e-3)
    angles = sorted({round((x / 30.0 + math.pi) % (2 * math.pi) - math.pi, 6) for x, _ in holes})
    assert angles == pytest.approx([-tab / 60.0, tab / 60.0], abs=1e-5)
    bars = sorted(printed(tube.clamps(layout.skin, tab)), key=lambda body: body.bounds[0, 1])
    for number, (inside, outside) in enumerate([(30 - 2.1, 30 - 0.1), (30 + 0.3, 30 + 2.3)] * 2):
        plate = trimesh.util.concatenate(bars[5 * number : 5 * number + 5])
        plate.apply_translation((0, -12.0 * number, 0))
        radii = np.hypot(plate.vertices[:, 0], plate.vertices[:, 1])
        assert (radii.min(), radii.max()) == pytest.approx((inside, outside), abs=1e-3)
        for angle, (away, hit) in itertools.product(angles, [(0, False), (1.65, False), (1.75, True), (3.4, True)]):
            at = angle + np.array([-away, away, 0, 0]) / 30.0
            rays = np.column_stack([np.sin(at), np.cos(at), np.zeros(4)])
            starts = [(0, 0, tab / 2 + up) for up in (0, 0, -away, away)]
            assert list(plate.ray.intersects_any(starts, rays)) == [hit] * 4


def test_tabs_longer_than_the_radius_are_refused():
    with pytest.raises(SheetError, match=r"radius_mm is 12; it must be 20 or more, .* tabs .* --edge-mm"):
        lay_out(Skin(rows=6, columns=12, radius_mm=12.0, **CLOSED), margin_mm=20.0)


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


def printed(corners):
    """The closed bodies of an STL file, by volume."""
    bodies = trimesh.load(io.BytesIO(stl(corners)), file_type="stl").split()
    assert all(body.is_watertight and body.is_winding_consistent for body in bodies)
    return sorted(bodies, key=lambda body: body.volume)


SPARSE = Skin(rows=3, columns=4, pitch_x_mm=7.4, pitch_y_mm=7.2, mask=((0, 0),))


@pytest.mark.parametrize("switch", [DOME, TACT])
def test_caps_are_closed_bodies_with_the_stated_clearances(switch):
    layer = caps(SPARSE, switch, 6.6)
    bodies = printed(layer.caps())
    webs, plates = bodies[:-11], bodies[-11:]
    foot_mm = switch.travel_mm + 0.3
    volume = 6.6**2 * 1.2 + 2.0**2 * (6 + foot_mm) + 1.5**2 * foot_mm
    assert [body.volume for body in plates] == pytest.approx([volume] * 11, rel=1e-4)
    centers = {tuple(np.round(body.bounds.mean(axis=0)[:2], 3) + 0.0) for body in plates}
    assert centers == {(round(c * 7.4, 3), round(-r * 7.2, 3)) for r in range(3) for c in range(4) if (r, c) != (0, 0)}
    ends = sorted({round(float(body.bounds[0, 1]), 3) for body in plates})
    assert ends[1] - (ends[0] + 6.6) == pytest.approx(layer.gap_mm, abs=1e-3)
    assert layer.gap_mm == pytest.approx(0.6)
    assert len(webs) == (8 - 1) + (9 - 1)
    assert all(sum(touch(web.bounds, plate.bounds) for plate in plates) == 2 for web in webs)


@pytest.mark.parametrize("switch", [DOME, TACT])
def test_the_frame_is_one_piece_that_lets_each_cap_sink(switch):
    """Stems have their play, plates their room to sink, and posts stand beside the switches, by boxes and volumes."""
    layer = caps(SPARSE, switch, 6.6)
    frame, plates = printed(layer.frame()), printed(layer.caps())[-11:]
    joined, left = [frame[-1]], frame[:-1]
    while near := [one for one in left if any(touch(one.bounds, other.bounds) for other in joined)]:
        joined += near
        left = [one for one in left if not any(one is other for other in near)]
    assert not left
    tubes = [one for one in frame if one.bounds[1, 2] == max(each.bounds[1, 2] for each in frame)]
    assert len(tubes) == 12
    top = tubes[0].bounds[1, 2]
    for plate in plates:
        assert plate.bounds[1, 2] - 1.2 - switch.travel_mm - top == pytest.approx(0.3, abs=1e-3)
        around = next(one for one in tubes if np.allclose(one.bounds.mean(axis=0)[:2], plate.bounds.mean(axis=0)[:2]))
        hole = (around.bounds[1, 0] - around.bounds[0, 0]) ** 2 - around.volume / 6.0
        assert np.sqrt(hole) == pytest.approx(2.0 + 2 * 0.05, rel=1e-3)
    on_board = [one for one in frame[:-1] if one.bounds[0, 2] == pytest.approx(-switch.height_mm)]
    assert len(on_board) == 9 + 8
    centers = np.array([(column * 7.4, -row * 7.2) for row in range(3) for column in range(4)])
    for post in on_board:
        away = np.maximum(0, np.maximum(post.bounds[0, :2] - centers, centers - post.bounds[1, :2]))
        assert np.hypot(*away.T).min() >= switch.part.width / 2


def touch(one, other):
    return bool(np.all(np.minimum(one[1], other[1]) - np.maximum(one[0], other[0]) >= 0))


def test_feet_take_a_screw_and_its_head():
    volume = 20**2 * 4 - 3.4**2 * (4 - 2.8) - 6.4**2 * 2.8
    assert [one.volume for one in printed(feet(20.0))] == pytest.approx([volume] * 4)


def test_the_frame_of_the_starter_kit_meets_no_pin_of_a_header():
    kit = kits.kit("starter")
    rim = printed(caps(kit.skin, kit.layout.switch).frame())[-1].bounds
    pins = [one.spot(pad.x, pad.y) for one in kit.layout.drawing.placed for pad in one.part.pads if pad.drill]
    assert len(pins) == 3 * 12 + 6
    assert max(y for _, y in pins) + 1 < -rim[1, 1]


def test_switches_too_close_for_posts_or_on_a_tube_have_no_frame():
    assert caps(Skin(pitch_x_mm=5.55, pitch_y_mm=5.55), DOME).frame() is None
    assert caps(Skin(surface="cylinder", radius_mm=40.0, **TILE), DOME).frame() is None


@pytest.mark.parametrize(
    ("side", "message"),
    [
        (
            6.2,
            r"side_m in \[cover.cap\] is 0\.0062; at a pitch of 6\.4 mm .* 0\.2 mm apart, .* take caps of 0\.0061 m",
        ),
        (1.0, r"side_m in \[cover.cap\] is 0\.001; it must be more than 0\.002"),
    ],
)
def test_caps_that_touch_or_vanish_are_refused(side, message):
    with pytest.raises(SheetError, match=message):
        caps(Skin(rows=2, columns=2, **TILE), DOME, side)
