"""Frames that wait to be written as messages when a recording ends."""

import re
import time

import pytest
from net_processes import Streaming

import contactfpga
from contactfpga.recordings import link_recorder
from contactfpga.recordings.link_messages import LinkMessages
from contactfpga.recordings.session import Session


@pytest.mark.parametrize(("slow_s", "end_s"), [(9.0, 0.05), (0.8, 60.0)])
def test_each_has_a_message_or_is_told(monkeypatch, tmp_path, slow_s, end_s):
    write, begun_s = LinkMessages.frame, time.monotonic()

    def slowly(self, *frame):
        if time.monotonic() < begun_s + slow_s:
            time.sleep(0.02)
        write(self, *frame)

    monkeypatch.setattr(LinkMessages, "frame", slowly)
    monkeypatch.setattr(link_recorder, "END_S", end_s)
    file = tmp_path / "touches.mcap"
    with Streaming(contactfpga.Skin()) as board, Session(file) as session:
        session.add(board.path)
        time.sleep(0.6)  # in which other boards are opened
        session.start()
        time.sleep(0.5)
    (link,) = session.links
    told = sum(int(re.search(r"(\d+) frames came faster", note)[1]) for note in link.notes)
    with contactfpga.open(f"replay://{file}") as again:
        recorded = sum(1 for _ in again)
    assert (told > 10) == (end_s < 1)
    assert link.frames > 5
    assert 0 <= recorded - link.frames - told <= 60, "but for what came while it was opened"
