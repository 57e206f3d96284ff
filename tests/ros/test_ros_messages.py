"""Messages and their types against rosbags, which has its own."""

import math

import numpy as np
import pytest
import ros_messages
from ros_messages import HEAD, hello, samples
from rosbags.typesys import get_types_from_msg
from tracker_frames import SKIN, frame

import contactfpga
from contactfpga import Skin
from contactfpga.robot.ros import cdr, convert, types
from contactfpga.robot.ros.types import STANDARD


@pytest.mark.parametrize(("name", "message"), list(samples()), ids=lambda one: one if isinstance(one, str) else "")
def test_rosbags_reads_what_we_write_and_writes_the_same(name, message):
    store, full = ros_messages.store(), ros_messages.full(name)
    data = cdr.encode(name, message)
    read = store.deserialize_cdr(data, full)
    assert bytes(store.serialize_cdr(read, full)) == data
    assert_same(ros_messages.plain(read), message)


def assert_same(read, meant):
    if isinstance(meant, dict):
        assert list(read) == list(meant)
        for name in meant:
            assert_same(read[name], meant[name])
    elif isinstance(meant, (list, tuple)):
        assert len(read) == len(meant)
        for one, other in zip(read, meant):
            assert_same(one, other)
    elif isinstance(meant, float):
        assert read == pytest.approx(meant, rel=1e-6, nan_ok=True)  # a color's numbers have 24 bits
    else:
        assert read == meant


@pytest.mark.parametrize("which", ros_messages.STORES, ids=lambda which: which.value)
def test_hashes_are_those_of_rosbags_in_each_distribution(which):
    store = ros_messages.store(which)
    for name in [*ros_messages.OURS, *STANDARD]:
        assert types.type_hash(name) == store.hash_rihs01(ros_messages.full(name)), name


@pytest.mark.parametrize("name", ros_messages.OURS)
def test_schemas_hold_all_that_a_reader_needs(name):
    """A recording has the schema alone."""
    found = get_types_from_msg(types.schema(name), ros_messages.full(name))
    assert set(found) == {ros_messages.full(name), *(ros_messages.full(one.name) for one in types.needed(name))}


def test_the_package_builds_every_message_that_there_is():
    listed = (types.messages().parent / "CMakeLists.txt").read_text(encoding="utf-8")
    assert {f"contactfpga_msgs/{line.strip()[5:-5]}" for line in listed.splitlines() if ".msg" in line} == set(
        ros_messages.OURS
    )


def test_flags_events_and_reports_have_a_number_each():
    assert set(convert.FLAGS) == {"overflow", "mismatch", "fault", "motion", "ghost"}
    assert set(convert.EVENTS) == {"down", "move", "merge", "split", "up"}
    assert set(convert.REPORTS) == {"moments", "cells", "barycenter"}


def test_lengths_are_in_meters():
    (zone,) = convert.zones(frame(0, [(3, 4)]), HEAD)["zones"]
    assert (zone["position"], zone["x"], zone["y"]) == ({"x": 0.03, "y": 0.04, "z": 0.0}, 0.03, 0.04)
    assert zone["area"] == pytest.approx(9e-4)
    assert convert.skin(hello(Skin(surface="cylinder", radius_mm=40.0)), HEAD)["radius"] == 0.04


def test_a_force_that_is_not_known_is_no_force_of_zero():
    tracks = contactfpga.Tracker().update(frame(0, [(3, 4)]))
    (contact,) = convert.contacts(tracks.active, HEAD)["contacts"]
    assert contact["name"] == "forearm/1"
    assert all(math.isnan(one) for part in contact["wrench"].values() for one in part.values())


def test_the_turn_of_a_frame_is_that_of_a_urdf():
    """Roll, pitch and yaw about fixed axes: the last one turns what the others made."""
    turn = convert.transform(HEAD, "skin", (0, 0, 0), (math.pi / 2, 0, math.pi / 2))["transforms"][0]["transform"]
    x, y, z, w = turn["rotation"].values()
    matrix = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    assert np.round(matrix, 9).tolist() == [[0, 0, 1], [1, 0, 0], [0, 1, 0]]


def test_an_array_of_another_length_is_refused():
    message = convert.skin(hello(SKIN), HEAD) | {"fingerprint": b"1234567"}
    with pytest.raises(ValueError, match="fingerprint has 7 elements; it must have 8"):
        cdr.encode("contactfpga_msgs/Skin", message)
