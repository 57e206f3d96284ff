"""What the view shows of a sheet and its contacts, without a browser: cameras that fit, words, rulers, foam, light, the
chart."""

import dataclasses
import json
import math
import re
from html.parser import HTMLParser
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest
from tracker_frames import frame, moments

from contactfpga import Skin
from contactfpga.tools.view import cameras, chart, contacts, glow, limb, page, panel, picture, ruler
from contactfpga.tools.view.cameras import Side, fitted
from contactfpga.tools.view.sources import Moment, Strip, paced
from contactfpga.tools.view.tiles import Tiles
from contactfpga.tracking.tracker import Tracker

FLAT = Tiles(Skin(pitch_y_mm=8.0).sheet)
AROUND = Skin(closed=True, surface="cylinder", radius_mm=45.0, rows=16, columns=16)
FOREARM = Tiles(AROUND.sheet)


# ---- cameras


def seen(points, placed, up, aspect):
    """(n, 2) shares of half the picture's width and height, by a pinhole at the camera's place."""
    z = placed.look_at - placed.position
    z = z / np.linalg.norm(z)
    y = up - (up @ z) * z
    y = y / np.linalg.norm(y)
    x = np.cross(z, y)
    rays = (points - placed.position) @ np.stack([x, y, z], -1)
    assert (rays[:, 2] > 0).all()
    half = math.tan(cameras.FOV_RAD / 2)
    return rays[:, :2] / rays[:, 2:] / (half * np.array([aspect, 1.0]))


@pytest.mark.parametrize("aspect", [1590 / 1080, 950 / 800, 470 / 600, 390 / 455, 3.0])
def test_a_camera_holds_all_and_is_as_near_as_it_can_be(aspect, rng):
    for _ in range(20):
        points = np.array([[rng.uniform(-s, s) for s in (0.2, 0.1, 0.05)] for _ in range(60)]) + [0.3, 0.0, -0.1]
        toward, up = (np.array([rng.uniform(-1, 1) for _ in range(3)]) for _ in range(2))
        places = seen(points, fitted(points, Side(toward, up), aspect), up, aspect)
        low, high = places.min(0), places.max(0)
        fills = int(np.argmax(high))
        rim = pytest.approx(1 / cameras.ROOM, abs=1e-9)
        assert (-low[fills], high[fills]) == (rim, rim), "from rim to rim"
        assert np.abs(places).max() == rim


@pytest.mark.parametrize("tiles", [FLAT, FOREARM])
def test_each_side_of_a_sheet_can_be_looked_at(tiles):
    sides = cameras.sides_of(tiles)
    assert list(sides) == ["overview", "front", "side", "back"]
    for side in sides.values():
        assert np.linalg.norm(np.cross(side.toward, side.up)) > 0.3 * np.linalg.norm(side.toward)
    outward = sides["front"].toward @ tiles.normals[tiles.sheet.columns // 8]
    assert outward == pytest.approx(np.linalg.norm(sides["front"].toward))


def test_a_forearm_lies_with_its_rows_from_left_to_right():
    side = cameras.sides_of(FOREARM)["front"]
    points = FOREARM.points_mm / 1000
    places = seen(points, fitted(points, side, 1.5), side.up, 1.5)[:, 0].reshape(16, 16)
    assert (np.diff(places, axis=0) > 0).all()


# ---- contacts


def moment(frames, pushes=()):
    tracker = Tracker()
    for one in frames:
        tracks = tracker.update(one)
    return Moment(frames[-1], tracks, pushes=pushes)


def test_a_contact_has_its_place_area_and_age_beside_it():
    (row,) = contacts.rows(moment([frame(1000, [(4, 6, 9)]), frame(2_501_000, [(4, 6, 9)])]))
    assert row.lines == ("#1   40.0, 60.0 mm", "900 mm²   2.5 s")


def test_a_force_is_that_of_the_zone_it_was_measured_at():
    now = frame(2000, [(4, 6, 9), (12, 6, 4)])
    before = frame(1000, [(12.1, 6, 4), (4, 6, 9)])
    rows = contacts.rows(moment([now], pushes=[(zone, 2.5 if zone.x_mm > 100 else None) for zone in before]))
    assert {row.x_mm: row.force_n for row in rows} == {40.0: None, 120.0: 2.5}
    assert "2.5 N" in rows[-1].lines[1]
    far = list(frame(1000, [(1, 1, 9)]))
    assert contacts.force_at(next(iter(now)), [(far[0], 7.0)]) is None
    assert contacts.force_at(next(iter(now)), []) is None


class Cells(HTMLParser):
    """The texts of a table's cells, and all tags."""

    def __init__(self, text):
        super().__init__()
        self.texts, self.tags, self._open = [], set(), None
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        if tag in ("td", "th"):
            self.texts.append("")

    def handle_data(self, data):
        if self.texts:
            self.texts[-1] += data


def test_the_table_has_all_that_is_known_of_each_contact():
    """Also forces, where one is known, and mean levels of a sheet that has several."""
    before, now = (frame(time_us, [(4, 6, 9), (12, 6, 4)]) for time_us in (0, 300_000))
    head = ["", "x, y in mm", "mm²", "age, s"]
    one, two = ["#1", "40.0, 60.0", "900", "0.3"], ["#2", "120.0, 60.0", "400", "0.3"]
    plain = contacts.rows(moment([before, now]))
    felt = contacts.rows(moment([before, now], pushes=[(next(iter(now)), 3.25)]))
    assert Cells(contacts.table(plain)).texts == [*head, *one, *two]
    assert Cells(contacts.table(felt)).texts == [*head, "N", *one, "3.2", *two, ""]
    leveled = [dataclasses.replace(row, pressure=level) for row, level in zip(plain, (1.25, 3.0), strict=True)]
    assert Cells(contacts.table(leveled)).texts == [*head, "level", *one, "1.2", *two, "3.0"]
    assert leveled[1].lines[1].endswith("   level 3.0")
    assert "Nothing touches" in contacts.table([])
    assert ">1 contact<" in contacts.table(plain[:1])


def test_a_zone_all_round_a_limb_is_in_the_table_without_an_id():
    ring = moments(0, [(16, 120, 16 * 4)], skin=AROUND, before=None)
    zone = SimpleNamespace(x_mm=None, y_mm=40.0, area_mm2=2827.0, area_cells=16, pressure=None)
    tracks = SimpleNamespace(active=(), unsure=(zone,), time_us=0)
    (row,) = contacts.rows(Moment(ring, tracks))
    assert Cells(contacts.table([row])).texts[4:] == ["", "all round, 40.0", "2,827", ""]


@pytest.mark.parametrize("name", ["<img src=x onerror=hostile=1>", "</table><script>1</script>", "a & b <b>"])
def test_a_links_name_is_shown_as_it_is_written(name):
    rows = contacts.rows(moment([frame(0, [(4, 6, 9)])]), link=name)
    found = Cells(contacts.table(rows))
    assert found.tags == {"div", "b", "table", "thead", "tbody", "tr", "th", "td"}
    assert found.texts[4] == f"{name} #1"


@pytest.mark.parametrize("line", ["a'b\"c", "\u2028</script>", "`${hostile}`", "\\"])
def test_a_picture_takes_any_text(line):
    sent = []
    client = SimpleNamespace(_websock_connection=SimpleNamespace(queue_message=sent.append))
    pytest.importorskip("viser")
    page.picture(client, [line])
    (found,) = re.fullmatch(r"window\.contactfpgaPicture\((.*)\)", sent[0].source).groups()
    assert found.isascii()
    assert json.loads(found) == [line]


# ---- words


@pytest.mark.parametrize(
    ("frames_per_s", "says"),
    [
        (0.0, "nothing yet"),
        (10.02, "at rest, a keep-alive every 0.1 s"),
        (1.0, "at rest, a keep-alive every 1.0 s"),
        (1042.3, "1,042 frames per second"),
    ],
)
def test_how_often_frames_come_is_said_in_words(frames_per_s, says):
    assert paced(frames_per_s) == says


def test_the_panel_names_no_color_twice():
    source = SimpleNamespace(sheet=SimpleNamespace(report="cells", extent=False, ghosts=True, levels=1), cells=object())
    marks = re.findall(r"color:(#\w+)", panel.legend(source, virtual=True))
    assert len(marks) == len(set(marks)) == 5


# ---- beside and around the sheet


def test_rows_columns_and_origin_are_where_the_cells_are():
    found = ruler.ruler(FLAT, lift_mm=0.0)
    texts = {mark.text: mark.point * 1000 for mark in found.marks}
    assert texts["row 0"][1] == pytest.approx(0)
    assert texts["8: 64 mm"][1] == pytest.approx(64)
    assert texts["8: 80 mm"][0] == pytest.approx(80)
    assert texts["row 0"][0] < -5
    assert texts["column 0"][1] < -4
    assert found.axes[0, 0] == pytest.approx(np.zeros(3))
    assert texts["x"] == pytest.approx([10 * ruler.AXIS, 0, 0])
    assert texts["y"] == pytest.approx([0, 8 * ruler.AXIS, 0])


def closed(*cells):
    found = np.zeros((16, 16), bool)
    for row, column in cells:
        found[row, column] = True
    return found.ravel()


def test_foam_gives_way_over_closed_cells_alone_also_across_the_seam():
    vertices, _ = limb.revolved(limb.foam_profile(45.0, -10.0, 160.0))
    bent = limb.dented(vertices, FOREARM, closed((8, 0)))
    before, after = (np.hypot(each[:, 0], each[:, 1]) for each in (vertices, bent))
    turns = np.arctan2(vertices[:, 1], vertices[:, 0])
    outside = before > 49.9
    over = outside & (np.abs(turns) < 0.1) & (np.abs(vertices[:, 2] - 80) < 3)
    assert (turns[over] < 0).any()
    assert (turns[over] > 0).any()
    assert over.sum() >= 4
    assert after[over] == pytest.approx(45 + limb.LEFT_MM, abs=0.6)
    far = outside & ((np.abs(turns) > 1.0) | (np.abs(vertices[:, 2] - 80) > 25))
    assert after[far] == pytest.approx(50, abs=1e-6)
    assert limb.dented(vertices, FOREARM, closed()) == pytest.approx(vertices)


def test_only_closed_cells_shine():
    colors = picture.tile_colors(frame(0, []), closed((3, 5), (3, 6)).reshape(16, 16))
    tints, opacities = glow.shine(colors)
    cells = [3 * 16 + 5, 3 * 16 + 6]
    assert np.flatnonzero(opacities).tolist() == cells + [256 + cell for cell in cells]
    assert tuple(tints[256 + cells[0]]) == picture.TRUE
    assert (tints[cells[0]] > picture.TRUE).all()
    for dark in (picture.OPEN, picture.UNKNOWN):
        assert not glow.shine(np.tile(np.array(dark, np.uint8), (256, 1)))[1].any()


# ---- the chart


def test_the_chart_draws_each_value_on_its_axis():
    strip = Strip(np.array([-10.0, -5.0, 0.0]), np.array([0, 2, 1]), np.array([0.0, 1500.0, 5000.0]))
    picture_ = ElementTree.fromstring(chart.chart(strip))
    area, count = (
        np.array([point.split(",") for point in line.get("points").split()], float)
        for line in picture_.iter("polyline")
    )
    texts = {
        text: (float(each.get("x")), float(each.get("y"))) for each in picture_.iter("text") for text in each.itertext()
    }
    assert {"50", "25", "seconds of board time, now at 0", " contacts", " area, cm²"} <= set(texts)
    assert count[:, 0] == pytest.approx(
        [texts["−10"][0], (texts["−6"][0] + texts["−4"][0]) / 2, chart.WIDTH - chart.RIGHT]
    )
    low, high = texts["25"][1], texts["50"][1]
    assert area[2, 1] == pytest.approx(high - 3.5, abs=0.1), "50 cm² of 50"
    assert area[1, 1] == pytest.approx(low - 3.5 + (low - high) * 0.4, abs=0.1), "15 cm²"
    assert count[1, 1] == pytest.approx(chart.TOP)


@pytest.mark.parametrize(("most", "top"), [(0, 2), (2, 2), (3, 5), (6, 10), (11, 20), (99.5, 100), (101, 200)])
def test_an_axis_ends_at_a_round_number(most, top):
    assert chart.top(np.array([0.0, most]), 2) == top
