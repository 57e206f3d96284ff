"""What is published of a board, and when: a board of frames that a test hands over."""

import types

import pytest
import ros_messages
from ros_messages import hello
from tracker_frames import SKIN, frame

from contactfpga import Skin
from contactfpga.driver.stats import Stats
from contactfpga.errors import ReadTimeout, ReplayEnded
from contactfpga.robot.haptics import LoadCells, Plane, Unit, contacts
from contactfpga.robot.ros.feed import Feed, Moments
from contactfpga.robot.ros.settings import TOPICS, Settings
from contactfpga.zones.zone import HostLine

NOW_NS = 1_795_000_000_000_000_000


class Board:
    """Its clock stands at a frame's time; a None is a time without frames."""

    def __init__(self, frames, skin=SKIN):
        self._frames = iter(frames)
        self.hello = hello(skin)
        self.sheet, self.name, self.fingerprint, self.port = skin.sheet, skin.name, skin.fingerprint, "port"
        self.stats = Stats()
        self.now_s = 0.0

    def clock(self):
        return self.now_s

    def next(self, timeout=1.0):
        try:
            zones = next(self._frames)
        except StopIteration:
            raise ReplayEnded("ended") from None
        if zones is None:
            self.now_s += timeout
            raise ReadTimeout("silent")
        self.now_s = zones.time_us / 1e6
        zones._line = HostLine(self.now_s, 0, 0.0, 1.0, 2e-6)
        self.stats.frames += 1
        return zones


class Sent(list):
    """(topic, message) of all that was published, as rosbags reads it."""

    def __call__(self, topic, data):
        self.append((topic, ros_messages.store().deserialize_cdr(data, ros_messages.full(TOPICS[topic].type))))

    def of(self, topic):
        return [message for name, message in self if name == topic]


def fed(frames, settings=None, skin=SKIN, felt=None, board=Board):
    board, sent = board(frames, skin), Sent()
    feed = Feed(board, sent, settings, felt, lambda: NOW_NS + round(board.now_s * 1e9))
    feed.run(board)
    return sent, feed


def test_a_touch_is_published_with_its_track():
    sent, _ = fed([frame(0, []), frame(1000, [(3, 4)]), frame(2000, [(3, 4)])])
    assert [len(one.zones) for one in sent.of("zones")] == [0, 1, 1]
    assert [[event.kind for event in one.events] for one in sent.of("tracks")] == [[], [0], []]
    assert [[contact.name for contact in one.contacts] for one in sent.of("contacts")] == [[], ["skin/1"], ["skin/1"]]
    (skin,) = sent.of("skin")
    assert (skin.rows, skin.columns, bytes(skin.fingerprint)) == (16, 16, SKIN.fingerprint)


def test_the_stamp_is_the_moment_of_the_sample():
    sent, _ = fed([frame(250_000, [])])
    (zones,) = sent.of("zones")
    assert zones.header.stamp.sec * 10**9 + zones.header.stamp.nanosec == NOW_NS + 250_000_000
    assert (zones.device_time_us, zones.stamp_sigma) == (250_000, 2e-6)


def test_clocks_are_compared_where_nothing_came_between():
    """The process may rest between two looks at the clocks; that moves no stamp."""
    clock = iter([0.0, 0.0, 5.0, 5.0, 5.001, 5.001, 9.0, 9.0, 9.1, 9.1, 9.2])
    wall = iter([NOW_NS + 4_000_000_000, NOW_NS + 5_000_500_000, *[NOW_NS + 9_050_000_000] * 3])
    zones = types.SimpleNamespace(host_time_s=2.0)
    assert Moments(lambda: next(wall), lambda: next(clock)).of(zones) == NOW_NS + 2_000_000_000


def test_faster_frames_are_left_out_and_counted_and_no_event_is_lost():
    quick = [frame(100 * number, [(3 + number / 100, 4)]) for number in range(200)]
    sent, feed = fed(quick, Settings(zones_hz=1000))
    assert len(sent.of("zones")) == 20
    assert feed.left_out == 180
    assert [event.kind for one in sent.of("tracks") for event in one.events].count(0) == 1
    moved = [event for one in sent.of("tracks") for event in one.events if event.kind == 1]
    assert len(moved) == 3  # 20 mm in steps of 5; the last is not reached


def test_a_touch_shorter_than_the_period_is_published():
    frames = [frame(100 * number, [(3, 4)] if 55 <= number < 57 else []) for number in range(85)]
    sent, _ = fed(frames, Settings(zones_hz=100))
    assert [len(one.zones) for one in sent.of("zones")] == [0, 1, 0]


class Busy(Board):
    """Frames waited for 400 ms before they are taken."""

    def next(self, timeout=1.0):
        zones = super().next(timeout)
        self.now_s += 0.4
        return zones


def test_a_feed_that_is_behind_leaves_frames_out_until_it_is_not():
    quick = [frame(1000 * number, [(3, 4)] if number == 500 else []) for number in range(1000)]
    sent, feed = fed(quick, Settings(zones_hz=1000), board=Busy)
    assert 10 <= len(sent.of("zones")) <= 13
    assert feed.left_out + len(sent.of("zones")) == 1000
    assert [len(one.zones) for one in sent.of("zones")].count(1) == 1
    assert "frames waited for 0.4 s: the computer is too busy" in sent.of("/diagnostics")[-1].status[0].message


class Interrupted(Board):
    """The computer rests for 100 ms at frame 500, and takes what waited meanwhile at once."""

    def next(self, timeout=1.0):
        zones = super().next(timeout)
        if 500_000 <= zones.time_us < 600_000:
            self.now_s = 0.6
        return zones


def test_a_feed_that_caught_up_publishes_at_its_rate_again():
    sent, feed = fed([frame(1000 * number, []) for number in range(1000)], Settings(zones_hz=1000), board=Interrupted)
    times_us = [one.device_time_us for one in sent.of("zones")]
    old = [one for one in times_us if 500_000 <= one < 580_000]
    assert old == [500_000]
    assert [one for one in times_us if one > 600_000] == [1000 * number for number in range(601, 1000)]
    assert feed.left_out == 1000 - len(times_us)


def test_markers_come_at_their_rate_and_vanish_without_news():
    frames = [frame(10_000 * number, [(3, 4)]) for number in range(101)]
    sent, _ = fed([*frames, *[None] * 50], Settings(markers_hz=20))
    shown = sent.of("markers")
    assert 20 <= len(shown) <= 21 + 10  # silence_s = 0.5 of 20 per second
    assert all(0 < marker.lifetime.nanosec <= 500_000_000 for marker in shown[-1].markers)
    last = shown[-1].markers[0].header.stamp
    assert last.sec * 10**9 + last.nanosec == NOW_NS + 1_000_000_000
    assert [marker.ns for marker in shown[-1].markers] == ["", "sheet", "contacts", "forces", "ids"]


def test_silence_is_an_error_and_no_frame():
    sent, _ = fed([frame(0, []), *[None] * 30])
    levels = [one.status[0].level for one in sent.of("/diagnostics")]
    assert levels[0] == 0
    assert levels[-1] == 2
    assert "may be touched" in sent.of("/diagnostics")[-1].status[0].message
    assert len(sent.of("zones")) == 1


@pytest.mark.parametrize(("send", "levels"), [("always", {0, 2}), ("on_change", {0})])
def test_a_board_that_tells_changes_may_keep_still_for_its_keep_alive(send, levels):
    settings = Settings(silence_s=0.05, diagnostics_hz=1000)
    sent, _ = fed([frame(0, []), None, frame(110_000, []), None], settings, Skin(send=send))
    assert {one.status[0].level for one in sent.of("/diagnostics")} == levels


@pytest.mark.parametrize(
    ("flags", "said"), [({"overflow"}, "flagged overflow"), ({"mismatch"}, "flagged mismatch"), ({"fault"}, "stuck")]
)
def test_what_is_odd_is_a_warning(flags, said):
    sent, _ = fed([frame(0, []), frame(1_500_000, [], flags=flags)], Settings(silence_s=2))
    status = sent.of("/diagnostics")[-1].status[0]
    assert (status.level, status.message) == (1, said)


def test_the_sheets_frame_is_published_where_its_parent_is_named():
    sent, _ = fed([], Settings(frame="forearm", parent="base", place_m=(0.1, 0.2, 0.3)))
    (moved,) = sent.of("/tf_static")[0].transforms
    assert (moved.header.frame_id, moved.child_frame_id) == ("base", "forearm")
    assert (moved.transform.translation.x, moved.transform.rotation.w) == (0.1, 1.0)
    assert not fed([])[0].of("/tf_static")


def test_forces_are_published_at_their_contacts():
    around = [(0.0, 0.1, 0.0), (0.1, 0.0, 0.0), (0.0, 0.0, 0.0)]
    cells = LoadCells([Unit(point_m=place, axis=(0.0, 0.0, 1.0)) for place in around], frame="/bumper")

    def felt(zones, tracks):
        return contacts(cells.wrench([1.0, 2.0, 3.0]), zones, Plane(), tracks=tracks)

    sent, _ = fed([frame(0, [(3, 2)])], felt=felt, skin=SKIN.replace(name="/arm"))
    (wrench,), (found,) = sent.of("wrench"), sent.of("contacts")
    assert (wrench.header.frame_id, found.header.frame_id) == ("bumper", "arm")  # tf2 refuses a leading slash
    assert wrench.wrench.force.z == pytest.approx(-6.0)
    assert found.contacts[0].wrench.force.z == pytest.approx(-6.0, rel=1e-3)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"frame": "a b"}, "frame is 'a b'; a frame's name has letters"),
        ({"frame": "/arm"}, "frame is '/arm'; .*begins with no slash"),
        ({"place_m": (1.0, 2.0)}, "place_m is .*; it must be three finite numbers"),
        ({"turn_rad": (1.0, 2.0, float("nan"))}, "turn_rad is .*; it must be three finite numbers"),
        ({"zones_hz": 0.0}, "zones_hz is 0.0; it must be above 0 and at most 100000"),
        ({"silence_s": -1.0}, "silence_s is -1.0; it must be a positive number"),
    ],
)
def test_settings_that_cannot_be_are_refused(given, said):
    with pytest.raises(ValueError, match=said):
        Settings(**given)
