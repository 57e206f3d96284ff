"""Messages that only recordings hold are what rosbags makes of the same values."""

import pytest
import ros_messages

from contactfpga.tools.recordings import mcap, messages
from contactfpga.zones.units import UnitSamples

NS = 1_700_000_000_123_456_789


def read_back(data, name):
    """The message as rosbags reads it, after a look whether rosbags would write the same bytes."""
    message = ros_messages.store().deserialize_cdr(data, ros_messages.full(name))
    assert bytes(ros_messages.store().serialize_cdr(message, ros_messages.full(name))) == data
    return ros_messages.plain(message)


def head(link):
    return {"stamp": {"sec": NS // 10**9, "nanosec": NS % 10**9}, "frame_id": link}


@pytest.mark.parametrize("link", ["", "a", "left_hand", "\u00e4 link", "four"])
@pytest.mark.parametrize("data", [b"", b"\0", b"\0abc\0" * 77])
def test_bytes(link, data):
    message = messages.of_bytes(data, NS, link)
    assert read_back(message, messages.BYTES) == {"header": head(link), "data": data}
    assert mcap.data_of(message) == data


def test_faults_and_units():
    read = read_back(messages.of_faults(("row 1 open", "x"), NS, "link"), messages.FAULTS)
    assert read == {"header": head("link"), "names": ["row 1 open", "x"]}
    samples = UnitSamples(77, (1.0, 4095.0), (0.25, 0.5), (False, True))
    read = read_back(messages.of_units(samples, NS, "link"), messages.UNITS)
    assert (read["device_time_us"], read["readings"], read["saturated"]) == (77, [1.0, 4095.0], [False, True])
    assert read["sigma"] == [0.25, 0.5]
