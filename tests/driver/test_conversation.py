"""Bytes and the clock in, events out: chunks, counters, times, restarts, other Skins, old boards."""

import pytest
from model_board import SCAN_US, SKIN, Line
from wire import EPOCH_US, Wire, last_byte

from contactfpga.driver.conversation import Conversation
from contactfpga.skin.derived import LONGEST_PACKET


def test_noise_without_a_single_zero_keeps_no_more_than_a_packet():
    host = Conversation("x")
    for _ in range(100):
        host.receive(b"\xaa" * 4096, 0.0)
        assert len(host._rest) <= LONGEST_PACKET
    assert host.stats.damaged["noise"] > 10


def test_packets_without_a_meaning_are_counted():
    line, wire = Line(expected=SKIN), Wire(SKIN)
    line.give(line.board.frame())
    line.hello()
    line.give(wire.seal(bytes(8) + last_byte(9)), wire.seal(last_byte(14)), wire.cells([[0] * 16] * 16))
    assert line.stats.before_hello == 1
    assert line.stats.unknown_kinds == 2
    assert line.stats.damaged == {"kind": 1}


def test_a_frame_arrives_with_its_last_byte():
    line = Line()
    line.hello()
    data = line.board.frame()
    line.now = 3.0
    assert line.give(data[:5]) == []
    line.now = 4.0
    assert line.give(data[5:])[0].arrived_s == 4.0
    recording = Line(live=False)
    recording.hello()
    (zones,) = recording.frame()
    assert (zones.arrived_s, zones.host_time_s, zones.host_sigma_s) == (None, None, None)


# ---- times


@pytest.mark.parametrize("live", [True, False])
def test_time_goes_on_past_its_24_bits(live):
    line, times = Line(live=live), []
    for index in range(200):
        if index % 2 == 0:
            line.hello()
        expected = line.board.time_us
        (zones,) = line.frame()
        assert zones.time_us == expected
        times.append(zones.time_us)
        line.pause(0.9)
    assert times[-1] > 10 * 2**24


@pytest.mark.parametrize("up_s", [0, 4.1, 4.2, 16.7, 16.8, 3600, 1e6])
def test_a_board_that_has_run_for_long_tells_its_time_since_power_up(up_s):
    for late in range(0, 2 * EPOCH_US, EPOCH_US // 7):
        line = Line()
        line.board.time_us = round(up_s * 1e6) + late + SCAN_US
        line.hello()
        expected = line.board.time_us
        assert line.frame()[0].time_us == expected


def test_a_frame_that_waited_while_the_hello_was_sent_may_be_of_the_epoch_before():
    line = Line()
    line.board.time_us = 5 * EPOCH_US - 1000
    line.hello(epoch=5)
    assert line.frame()[0].time_us == 5 * EPOCH_US - 1000


@pytest.mark.parametrize("pause_s", [8.9, 14.0, 17.0, 100.0, 900.0, 4000.0])
@pytest.mark.parametrize("live", [True, False])
def test_after_a_pause_no_frame_is_passed_on_before_a_hello(pause_s, live):
    line = Line(live=live)
    line.hello()
    line.frame()
    line.pause(pause_s)
    if live or pause_s % 16.777216 > 4.2:
        assert line.frame() == []
        assert line.stats.unexplained == 1
    line.board.sent += 1000
    if live:
        line.host.receive(b"", line.now)
        line.pause(1.0)
    line.hello()
    expected = line.board.time_us
    assert line.frame()[0].time_us == expected
    assert line.stats.lost == 1000
    assert line.stats.restarts == 0


def test_a_hello_that_waited_while_nobody_read_tells_no_time():
    """A computer that slept: its buffer holds a hello, and what came after it was dropped."""
    line = Line()
    line.hello()
    line.frame()
    waiting = line.board.hello()
    line.pause(100.0)
    assert line.give(waiting, line.board.frame(), line.board.frame()) == []
    line.pause(0.1)
    assert line.frame() == []
    line.pause(1.0)
    line.hello()
    expected = line.board.time_us
    assert line.frame()[0].time_us == expected


def test_frames_that_wait_some_seconds_keep_their_times():
    line = Line()
    stream = line.board.hello() + b"".join(line.board.frame() for _ in range(1000))
    line.now = 3.0
    assert [zones.time_us for zones in line.give(stream)] == [SCAN_US * (1 + index) for index in range(1000)]
    line.now = 9.0
    assert len(line.frame()) == 1
