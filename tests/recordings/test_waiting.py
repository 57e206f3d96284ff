"""Frames that wait to be written as messages when a recording ends."""

import re
import threading
import time

import pytest
import ros_messages
from fake_board import wait_until
from net_processes import Streaming
from recorded_stream import replayed

import contactfpga
from contactfpga.recordings import Session
from contactfpga.tools.recordings import link_recorder
from contactfpga.tools.recordings.link_recorder import LinkMessages


@pytest.mark.parametrize("end_s", [0.05, 60.0])
def test_each_has_a_message_or_is_reported(monkeypatch, tmp_path, end_s):
    """Writing is slow, until the end where there is time then."""
    write, ends = LinkMessages.frame, threading.Event()

    def slowly(self, *frame):
        if end_s < 1 or not ends.is_set():
            time.sleep(0.02)
        write(self, *frame)

    monkeypatch.setattr(LinkMessages, "frame", slowly)
    monkeypatch.setattr(link_recorder, "END_S", end_s)
    file = tmp_path / "touches.mcap"
    with Streaming(contactfpga.Skin()) as board, Session(file) as session:
        session.add(board.path, timeout=60.0)
        time.sleep(0.6)  # in which other boards are opened
        session.start()
        (link,) = session.links
        wait_until(lambda: link.frames > 5 and len(link._events._frames) > 60)
        ends.set()
    reported = sum(int(re.search(r"(\d+) frames came faster", note)[1]) for note in link.notes)
    assert (reported > 10) == (end_s < 1)
    assert link.frames > 5
    reported_us = messages(file)
    assert len(reported_us) == link.frames
    assert times_us(file)[: link.frames] == reported_us
    assert len(times_us(file)) == link.frames + reported


def times_us(file):
    """Device times of the frames in its bytes, as the driver reads them."""
    return [zones["time_us"] for zones in replayed(file)]


def messages(file):
    """Those of its messages, as other programs read them."""
    from mcap.reader import make_reader

    kind = ros_messages.full("contactfpga_msgs/Zones")
    with open(file, "rb") as opened:
        found = make_reader(opened).iter_messages(log_time_order=False)
        return [
            ros_messages.store().deserialize_cdr(message.data, kind).device_time_us
            for _, channel, message in found
            if channel.topic.endswith("/zones")
        ]
