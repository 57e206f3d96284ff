"""Messages of ROS 2 are what rosbags makes of the same values."""

import math

import numpy as np
import pytest
from model_board import SCAN_US, ModelBoard

from contactfpga import Skin, Tracker
from contactfpga.driver.conversation import Arrival, Conversation
from contactfpga.recordings import messages
from contactfpga.ros.types import schema
from contactfpga.zones.units import UnitSamples

NS = 1_700_000_000_123_456_789


def store():
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    made = get_typestore(Stores.ROS2_JAZZY)
    for name in (messages.BYTES, messages.FAULTS, messages.UNITS, messages.ZONES, messages.TRACKS):
        package, _, short = name.partition("/")
        found = get_types_from_msg(schema(name), f"{package}/msg/{short}")
        made.register({key: value for key, value in found.items() if "contactfpga" in key})
    return made


STORE = store()


def read_back(data, name):
    """The message as rosbags reads it, after a look whether rosbags would write the same bytes."""
    name = name.replace("/", "/msg/")
    message = STORE.deserialize_cdr(data, name)
    assert bytes(STORE.serialize_cdr(message, name)) == data
    return message


def frames(skin, count=1, moments=((4, 10, 6), (1, 3, 3)), **options):
    model, said = ModelBoard(skin), Conversation("a board", skin, live=False)
    model.moments = list(moments)
    data = model.hello() + b"".join(model.frame(**options) for _ in range(count))
    return [event.zones for event in said.receive(data, 0.0) if isinstance(event, Arrival)]


@pytest.mark.parametrize("moments", [(), ((4, 10, 6),), ((4, 10, 6), (1, 3, 3), (2, 21, 20))])
@pytest.mark.parametrize("link", ["", "a", "left_hand", "ä link"])
def test_a_frame(moments, link):
    (zones,) = frames(Skin(), moments=moments)
    read = read_back(messages.of_zones(zones, NS, link, 1e-5), messages.ZONES)
    assert (read.header.stamp.sec, read.header.stamp.nanosec, read.header.frame_id) == (*divmod(NS, 10**9), link)
    assert (read.stamp_sigma, read.device_time_us, read.sequence, read.flags) == (1e-5, SCAN_US, 0, 0)
    assert (read.pressed, read.total_zones) == (sum(area for area, *_ in moments), len(moments))
    for told, zone in zip(read.zones, zones, strict=True):
        assert (told.area_cells, told.sum_x, told.sum_y) == (zone.area_cells, zone.sum_x, zone.sum_y)
        assert (told.position.x, told.position.y) == pytest.approx((zone.x_mm / 1e3, zone.y_mm / 1e3))
        assert (told.normal.x, told.normal.y, told.normal.z) == zone.normal
        assert (told.x, told.y, told.area) == pytest.approx((zone.x_mm / 1e3, zone.y_mm / 1e3, zone.area_mm2 / 1e6))


def test_faults_and_flags_of_a_frame():
    (zones,) = frames(Skin(), flags=("fault",))
    read = read_back(messages.of_zones(zones, NS, "link"), messages.ZONES)
    assert read.faults == ["stuck"]
    assert read.flags == 4
    assert math.isnan(read.stamp_sigma)
    assert [zone.area_cells for zone in read.zones] == [zone.area_cells for zone in zones]


def test_cells_of_a_frame():
    (zones,) = frames(Skin(rows=3, columns=6, report="cells", settle_us=20.0))
    read = read_back(messages.of_zones(zones, NS, "link"), messages.ZONES)
    assert (np.unpackbits(read.cells)[:18].reshape(3, 6) == zones.cells).all()
    assert read.total_zones == len(zones) == len(read.zones)


def test_tracks():
    tracker = Tracker()
    *_, tracks = map(tracker.update, frames(Skin(), 3))
    read = read_back(messages.of_tracks(tracks, NS, "link"), messages.TRACKS)
    assert [one.id for one in read.active] == [one.id for one in tracks.active] == [1, 2]
    assert [one.seen_us for one in read.active] == [one.seen_us for one in tracks.active]
    tracks = Tracker().update(frames(Skin())[0])
    read = read_back(messages.of_tracks(tracks, NS, "link"), messages.TRACKS)
    assert [(one.kind, one.id) for one in read.events] == [(0, 1), (0, 2)]


def test_bytes_faults_and_units():
    assert bytes(read_back(messages.of_bytes(b"\0abc", NS, "link"), messages.BYTES).data) == b"\0abc"
    assert read_back(messages.of_faults(("row 1 open", "x"), NS, "link"), messages.FAULTS).names == ["row 1 open", "x"]
    samples = UnitSamples(77, (1.0, 4095.0), (0.25, 0.5), (False, True))
    read = read_back(messages.of_units(samples, NS, "link"), messages.UNITS)
    assert (read.device_time_us, list(read.readings), list(read.saturated)) == (77, [1.0, 4095.0], [False, True])


@pytest.mark.parametrize("radius", [None, 60.0])
def test_markers_lie_on_the_surface_and_have_the_zones_areas(radius):
    skin = Skin() if radius is None else Skin(surface="cylinder", radius_mm=radius)
    (zones,) = frames(skin)
    clear, *drawn = read_back(messages.of_markers(zones, NS, "link"), messages.MARKERS).markers
    assert clear.action == clear.DELETEALL
    for marker, zone in zip(drawn, zones, strict=True):
        assert marker.type == marker.CYLINDER
        assert math.pi * (marker.scale.x / 2) ** 2 == pytest.approx(zone.area_mm2 / 1e6)
        assert marker.pose.position.z == pytest.approx(zone.point_mm[2] / 1e3)
        assert turned_up(marker.pose.orientation) == pytest.approx(zone.normal, abs=1e-9)


def turned_up(q):
    """The z axis, turned."""
    x, y, z, w = q.x, q.y, q.z, q.w
    return 2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)


@pytest.mark.parametrize(
    "normal", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.6, -0.8, 0.0), (0.0, 0.6, -0.8)]
)
def test_a_turn_leads_to_the_normal(normal):
    from types import SimpleNamespace

    q = messages._upright(normal)
    assert math.hypot(*q) == pytest.approx(1)
    assert turned_up(SimpleNamespace(**dict(zip("xyzw", q)))) == pytest.approx(normal, abs=1e-9)


def test_transforms():
    data = messages.of_transforms([("world", "link", (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0))], NS)
    (one,) = read_back(data, messages.TRANSFORMS).transforms
    assert (one.header.frame_id, one.child_frame_id, one.transform.translation.z) == ("world", "link", 3.0)
