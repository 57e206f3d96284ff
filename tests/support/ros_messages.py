"""Messages of all kinds that we publish, from frames, hellos and tracks; and our types as rosbags knows them, which
reads and writes them on its own."""

import dataclasses
import functools
import random

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from tracker_frames import SKIN, frame

import contactfpga
from contactfpga import Skin, Zones
from contactfpga.driver.conversation import Conversation
from contactfpga.robot.ros import PACKAGE, convert, feed, messages
from contactfpga.wire.hello import encode_hello
from contactfpga.wire.protocol import Frame

HEAD = convert.header(1_795_354_580_123_456_789, "forearm")


def hello(skin):
    conversation = Conversation("", live=False)
    conversation.receive(encode_hello(skin), 0.0)
    return conversation.hello


def bitmap_frame(rng, skin):
    cells = np.array([[rng.random() < 0.3 for _ in range(skin.columns)] for _ in range(skin.rows)])
    sent = Frame(0, 0, frozenset(), 0, 0, 0, int(cells.sum()), moments=None, bitmap=cells, barycenters=None)
    return Zones(sent, skin.sheet)


def samples():
    """(type, message) of all that we publish, with what is odd about it."""
    rng = random.Random(5)
    tracker = contactfpga.Tracker()
    said = [tracker.update(frame(time, [(3, 4), (time / 1e4, 9.5, 30)])) for time in (0, 1000, 80_000)]
    events = [event for one in said for event in one.events]
    curved, odd = (
        Skin(surface="cylinder", radius_mm=40.0, name="forearm é"),
        frame(7, [(3, 4)], flags={"mismatch", "fault"}),
    )
    nowhere = dataclasses.replace(odd[0], x_mm=None, y_mm=None, point_mm=None, normal=None, ghost=True)
    yield "contactfpga_msgs/Skin", convert.skin(hello(SKIN), HEAD)
    yield "contactfpga_msgs/Skin", convert.skin(hello(curved), convert.header(0, ""))
    yield "contactfpga_msgs/Zone", convert.zone(nowhere)
    for zones in (frame(0, []), odd, frame(1, [(1, 2), (9, 3), (15, 15)], skin=curved)):
        yield "contactfpga_msgs/Zones", convert.zones(zones, HEAD, 1e-5)
    yield "contactfpga_msgs/Zones", convert.zones(bitmap_frame(rng, Skin(rows=5, columns=11, report="cells")), HEAD)
    yield "contactfpga_msgs/Tracks", convert.tracks(said[-1], events, True, HEAD)
    yield "contactfpga_msgs/Contacts", convert.contacts(said[-1].active, HEAD)
    yield "visualization_msgs/MarkerArray", convert.markers(convert.outline(SKIN.sheet), said[-1].active, HEAD)
    yield "tf2_msgs/TFMessage", convert.transform(HEAD, "skin", (1.0, 2.0, 3.0), (0.1, 0.2, 0.3))
    yield "diagnostic_msgs/DiagnosticArray", feed.lost_board("forearm", "unplugged", HEAD)


STORES = (Stores.ROS2_JAZZY, Stores.ROS2_KILTED)
OURS = sorted(f"{PACKAGE}/{path.stem}" for path in messages().glob("*.msg"))


def full(name):
    package, _, short = name.partition("/")
    return f"{package}/msg/{short}"


@functools.cache
def store(which=Stores.ROS2_KILTED):
    made = get_typestore(which)
    for name in OURS:
        path = messages() / f"{name.partition('/')[2]}.msg"
        made.register(get_types_from_msg(path.read_text(encoding="utf-8"), full(name)))
    return made


def plain(value):
    """What rosbags read, as mappings, lists, bytes, numbers and strings."""
    if hasattr(value, "__msgtype__"):
        names = [field.name for field in dataclasses.fields(value)]
        return {name: plain(getattr(value, name)) for name in names if name.islower() and name != "__msgtype__"}
    if isinstance(value, np.ndarray):
        return value.tobytes() if value.dtype == np.uint8 else value.tolist()
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    return value
