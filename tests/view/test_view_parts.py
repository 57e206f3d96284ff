"""The parts of the view that know no browser: places, fingers, pace, counters, what is drawn."""

import itertools
import math
import re
from types import SimpleNamespace

import numpy as np
import pytest
from fake_board import wait_until
from tracker_frames import frame

from contactfpga import Skin
from contactfpga.body import ContactSurfaces
from contactfpga.driver import driver
from contactfpga.driver.stats import Stats
from contactfpga.errors import ContactFPGAError
from contactfpga.surfaces import Cone
from contactfpga.tools.view import opening, picture
from contactfpga.tools.view.fingers import Hand
from contactfpga.tools.view.sources import CHART_S, Meter
from contactfpga.tools.view.tiles import Tiles
from contactfpga.tracking.tracker import Tracker
from contactfpga.wire.protocol import Frame
from contactfpga.zones.batch import Batch
from contactfpga.zones.zone import Zones

TILES = {
    "plane": Tiles(Skin().sheet),
    "unequal pitches": Tiles(Skin(rows=4, columns=20, pitch_x_mm=5.0, pitch_y_mm=12.0).sheet),
    "cylinder": Tiles(Skin(surface="cylinder", radius_mm=40.0).sheet),
    "cone": Tiles(Skin(rows=8).sheet, Cone(60.0, 0.2)),
}


@pytest.fixture(params=TILES)
def tiles(request):
    return TILES[request.param]


# ---- places


def test_a_ray_onto_a_tile_meets_the_place_that_it_came_from(tiles, rng):
    """Places are put onto the surface by its own formula, and found from the ray alone."""
    sheet = tiles.sheet
    for _ in range(50):
        row, column = rng.randrange(sheet.rows), rng.randrange(sheet.columns)
        x_mm = (column + rng.uniform(-0.1, 0.1)) * sheet.pitch_x_mm
        y_mm = (row + rng.uniform(-0.1, 0.1)) * sheet.pitch_y_mm
        point, normal = tiles.surface.place(x_mm, y_mm)
        aside = np.array([rng.uniform(-0.3, 0.3) for _ in range(3)])
        eye = np.array(point) + 100 * (np.array(normal) + aside)
        found = tiles.met(eye, np.array(point) - eye)
        assert found == pytest.approx((x_mm, y_mm), abs=0.3), (row, column)


def test_a_ray_beside_the_sheet_or_from_below_meets_nothing():
    tiles = TILES["plane"]
    assert tiles.met(np.array([75.0, 75.0, 100.0]), np.array([0.0, 0.0, -1.0])) == pytest.approx((75, 75))
    assert tiles.met(np.array([75.0, 75.0, 100.0]), np.array([0.0, 0.0, 1.0])) is None
    assert tiles.met(np.array([75.0, 75.0, -100.0]), np.array([0.0, 0.0, 1.0])) is None
    assert tiles.met(np.array([-40.0, 75.0, 100.0]), np.array([0.0, 0.0, -1.0])) is None
    around = Tiles(Skin(columns=25, surface="cylinder", radius_mm=40.0).sheet)
    x_mm, _ = around.met(np.array([200.0, 0.0, 70.0]), np.array([-1.0, 0.0, 0.0]))
    assert x_mm == pytest.approx(0.0, abs=0.01), "its front and not its back"


def test_tiles_lie_on_the_surface_and_face_outward(tiles):
    """Each quaternion, as a rotation, turns z into the normal and x into the way in which x grows."""
    w, x, y, z = tiles.wxyzs.T
    up = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], -1)
    along = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], -1)
    np.testing.assert_allclose(up, tiles.normals, atol=1e-9)
    np.testing.assert_allclose(along, tiles.along_x, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(tiles.wxyzs, axis=1), 1)
    ahead, _ = tiles.surface.place(tiles.x_mm + 1e-3, tiles.y_mm)
    step = (np.array(ahead) - tiles.points_mm) / 1e-3
    assert np.all((step * tiles.along_x).sum(-1) > 0.99)
    up_the_sheet, _ = tiles.surface.place(tiles.x_mm, tiles.y_mm + 1e-3)
    assert np.all((((np.array(up_the_sheet) - tiles.points_mm) / 1e-3) * tiles.along_y).sum(-1) > 0.99)


# ---- fingers


class Sheet:
    def __init__(self):
        self.fingers = []

    def touch(self, fingers):
        self.fingers = [(finger.x_mm, finger.y_mm, finger.radius_mm) for finger in fingers]


def test_a_click_over_the_seam_lifts_the_finger_on_the_other_side():
    sheet = Sheet()
    skin = Skin(rows=4, columns=12, surface="cylinder", radius_mm=60 / np.pi, closed=True)
    hand = Hand.on(sheet, skin.sheet)
    hand.click(1, 10)
    hand.click(60, 10)
    hand.click(118, 12)  # 3.6 mm from the first one
    assert [finger[0] for finger in sheet.fingers] == [60]
    hand.drag("mouse", 60, 10)
    hand.drag("mouse", 119, 10)
    hand.drop("mouse")
    hand.drag("mouse", 2, 10)
    assert [finger[0] for finger in sheet.fingers] == [2]


def test_a_drag_presses_while_it_lasts_several_do_at_once_and_a_finger_stays_where_it_is_left():
    sheet = Sheet()
    hand = Hand(sheet, 9.0)
    hand.drag("one mouse", 10, 10)
    hand.drag("another", 80, 80)
    hand.drag("one mouse", 20, 12)
    assert sorted(sheet.fingers) == [(20, 12, 9.0), (80, 80, 9.0)]
    hand.drop("one mouse")
    hand.drop("one mouse")
    assert sheet.fingers == [(80, 80, 9.0)]
    hand.drop("another")
    hand.click(10, 10)
    hand.drag("mouse", 12, 10)
    hand.drag("mouse", 90, 40)
    hand.drop("mouse")
    assert sheet.fingers == [(90, 40, 9.0)]
    hand.resize(radius_mm=20.0)
    assert sheet.fingers == [(90, 40, 20.0)]


# ---- counters


def test_rates_and_the_strip_are_of_device_time():
    meter = Meter()
    for start in range(0, 3_000_000, 20_000):
        zones = [frame(start + 5000 * step, [(5, 5, 4)] if start >= 2_000_000 else []) for step in range(4)]
        meter.take(Batch.of(zones), Stats(), 0)
    assert meter.frames_per_s == pytest.approx(200, rel=0.02)
    strip = meter.strip
    assert strip.seconds[-1] == 0
    assert strip.seconds[0] == pytest.approx(-2.95, abs=0.06)
    pressed = strip.zones > 0
    assert pressed.sum() == pytest.approx(20, abs=1)
    assert np.all(strip.area_mm2[pressed] == 400)


def test_a_touch_shorter_than_a_step_of_the_strip_shows():
    meter = Meter()
    touches = [frame(t, [(5, 5, 1), (9, 9, 2)] if t == 123_000 else []) for t in range(100_000, 200_000, 1000)]
    meter.take(Batch.of(touches), Stats(), 0)
    assert (meter.strip.zones.max(), meter.strip.area_mm2.max()) == (2, 300)


def test_a_board_that_starts_again_starts_the_strip_again():
    meter = Meter()
    meter.take(Batch.of([frame(t, []) for t in (9_000_000, 9_100_000)]), Stats(), 0)
    meter.take(Batch.of([frame(t, []) for t in (1000, 101_000)]), Stats(), 0)
    assert meter.strip.seconds.min() > -CHART_S
    assert meter.frames_per_s == pytest.approx(0)


# ---- what is drawn


@pytest.mark.parametrize("name", ["plane", "cylinder"])
def test_a_circle_has_its_zones_area_and_lies_around_its_barycenter(name):
    surface, lift = TILES[name].surface, 0.5
    found = picture.spots(frame(0, [(4, 6, 9)]), surface, lift)
    point, normal = surface.place(40.0, 60.0)
    np.testing.assert_allclose(found.points, [(np.array(point) + lift * np.array(normal)) / 1000])
    rim = found.circles[:, 0] * 1000 - lift * (np.array(normal) if name == "plane" else 0)
    if name == "plane":
        x, y = rim[:, 0], rim[:, 1]
        area = 0.5 * abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1)))
        assert area == pytest.approx(900, rel=0.005)
    else:
        assert np.allclose(np.hypot(rim[:, 0], rim[:, 1]), 40 + lift)
    assert len(found.circles) == picture.SIDES


@pytest.mark.parametrize("name", ["plane", "cylinder"])
def test_a_polygon_is_drawn_half_a_pitch_around_its_cells(name):
    sheet, surface, lift = Skin(extent=True).sheet, TILES[name].surface, 0.5
    records, extents = np.array([[4, 6, 9]]), np.array([[1, 2, 2, 3]])
    one = Zones(Frame(0, 0, frozenset(), 0, 0, 1, 4, records, None, extents=extents), sheet)
    lines = picture.outlines(ContactSurfaces(sheet, surface=surface).supports(one), lift)
    assert np.array_equal(lines[:, 1], np.roll(lines[:, 0], -1, axis=0))
    most_m = 0.031 if name == "plane" else 0.0101  # around a cylinder a point per pitch
    assert np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).max() < most_m
    for x, y in itertools.product((0.0, 30.0), (10.0, 40.0)):
        point, normal = surface.place(x, y)
        corner = (np.array(point) + lift * np.array(normal)) / 1000
        assert np.linalg.norm(lines[:, 0] - corner, axis=1).min() < 1e-9
    assert not len(picture.outlines([], lift))


def test_cells_are_colored_by_what_is_known_of_them():
    zones = frame(0, [(4, 6, 9)])
    assert set(map(tuple, picture.tile_colors(zones).tolist())) == {picture.OPEN}
    truth = np.zeros((16, 16), bool)
    truth[3, 5] = True
    colors = picture.tile_colors(zones, truth).reshape(16, 16, 3)
    assert tuple(colors[3, 5]) == picture.TRUE
    assert (colors != picture.OPEN).any(-1).sum() == 1


def test_levels_of_force_are_shades():
    skin = Skin(report="cells", ruler=64, harder=(16, 4), guard=True, precharge_us=1.0)
    levels = np.arange(256).reshape(16, 16) % 4
    frame = SimpleNamespace(flags=frozenset(), time_us=0, bitmap=levels > 0, levels=levels)
    colors = picture.tile_colors(Zones(frame, skin.sheet)).astype(int)
    away = np.abs(colors - picture.OPEN).sum(axis=1)
    assert [set(away[levels.ravel() == level]) for level in (0, 3)] == [
        {0},
        {np.abs(np.subtract(picture.REPORTED, picture.OPEN)).sum()},
    ]
    assert away[2] == pytest.approx(2 * away[1], abs=2)
    assert (np.diff(away[:4]) > 20).all()


def test_a_trail_shows_the_last_second_of_each_contact():
    tracker, trails = Tracker(), picture.Trails(TILES["plane"].surface, 0.0, seconds=1.0)
    for step in range(31):
        trails.add(tracker.update(frame(step * 50_000, [(step / 10, 5), (12, 12)])))
    lines = trails.lines
    assert len(lines) == 2 * 20
    moving = lines[np.isclose(lines[:, 0, 1], 0.05)]
    assert moving[:, 0, 0].min() == pytest.approx(0.010)
    assert moving[:, 1, 0].max() == pytest.approx(0.030)
    assert math.dist(lines[-1][0], lines[-1][1]) == pytest.approx(0)


def test_latency_is_from_the_sample_to_the_last_byte():
    """Of a board with a clock of its own it takes the host's estimate of the sample's moment."""
    names = ["time_us", "host_time_s", "arrived_s"]
    frames = np.zeros(5, [(name, float) for name in names])
    frames["time_us"], frames["arrived_s"] = 1e6 * np.arange(5), np.arange(5) + 250e-6
    frames["host_time_s"] = np.arange(5) + 100e-6
    for virtual, late_s in ((True, 250e-6), (False, 150e-6)):
        meter = Meter()
        assert meter.late_s is None
        meter.take_latency(SimpleNamespace(frames=frames), virtual)
        assert meter.late_s == pytest.approx(late_s)


def test_silence_is_said(board):
    """No data is never no contact: what is drawn then is said to be old."""
    import contactfpga
    from contactfpga.tools.view.sources import BoardSource

    with contactfpga.open(board.path, timeout=60.0) as port:
        source = BoardSource(port, "board")

        def told(silent_s):
            port._link.last_s = port.clock() - silent_s
            return dict(source.facts())

        wait_until(lambda: "no data" not in told(0.0))
        wait_until(lambda: told(2.0)["no data"].startswith("for 2."))


@pytest.mark.parametrize(
    ("port", "given", "says"),
    [
        ("robot.toml", {"units": "units.toml"}, "--units is for a board; robot.toml sets it for each link"),
        ("robot.toml", {"baud": 9600}, "--baud is for a board; robot.toml sets it for each link"),
        ("replay://a.bin", {"skin": "skin.toml"}, "--skin is for a board; replay://a.bin is a recording"),
        ("replay://a.bin", {"units": "units.toml"}, "--units is for a board; replay://a.bin is a recording"),
        ("sim://", {"link": "arm"}, "--link is for a recording; sim:// is not one"),
        (None, {"link": "arm"}, "--link is for a recording; name one"),
        ("sim://?pace=2", {}, "sim://?pace=2: the view shows a virtual board in real time; leave out pace"),
    ],
)
def test_what_would_be_left_out_is_refused(port, given, says):
    with (
        pytest.raises(ContactFPGAError, match=f"^{re.escape(says)}$"),
        opening.opened(opening.ViewRequest(port, **given)),
    ):
        pass


def test_no_board_is_opened_for_units_that_cannot_be_read(tmp_path, monkeypatch):
    """Nobody would give its port back."""
    opened = []
    monkeypatch.setattr(driver, "open", lambda *named, **more: opened.append(named))
    with pytest.raises(OSError, match=r"none\.toml"):
        opening._source(opening.ViewRequest("/dev/ttyUSB0", units=tmp_path / "none.toml"))
    assert not opened
