"""Losses, restarts and other Skins in a conversation."""

import pytest
from model_board import SCAN_US, SKIN, Line, ModelBoard
from wire import Wire, old_frame, old_hello

import contactfpga
from contactfpga.driver.conversation import frames_in


def errors(events):
    return [event for event in events if isinstance(event, Exception)]


# ---- losses


@pytest.mark.parametrize("missing", [1, 254, 255, 256, 257, 512, 70_000])
def test_losses_are_exact_from_the_next_hello_on(missing):
    line = Line()
    line.board.sent = 1000
    line.hello()
    line.frame()
    for _ in range(missing):
        line.board.sent += 1
        line.board.time_us += 10
    line.frame()
    assert line.stats.lost == missing % 256
    line.hello()
    assert line.stats.lost == missing
    assert line.stats.restarts == 0


def test_frames_sent_before_the_port_was_opened_are_no_loss():
    line = Line()
    line.board.sent = 12345
    line.frame()
    line.hello()
    line.frame()
    assert (line.stats.lost, line.stats.before_hello) == (0, 1)


@pytest.mark.parametrize("second", range(0, 34, 1))
def test_a_lost_frame_is_no_restart_at_any_time_of_the_wrap(second):
    """A frame lost at any time is no restart; in one second of every 16.8, the first frame of 256 once counted as the
    first since power-up."""
    line = Line()
    line.board.time_us, line.board.sent = second * 500_000 + SCAN_US, 250
    line.board.heard = 5
    line.hello()
    line.frame()
    for sequence in range(251, 256):
        assert line.board.frame()
        assert line.board.sent == sequence + 1
    expected = line.board.time_us
    assert line.frame()[0].time_us == expected
    assert (line.stats.restarts, line.stats.lost, line.stats.unexplained) == (0, 5, 0)


def test_frames_that_come_twice_are_passed_on_once(rng):
    """Repeated frames are delivered once; after them no frame is delivered until the next hello, as the board may have
    restarted."""
    for _ in range(30):
        line, sent = Line(), []
        line.board.heard = 3
        line.hello()
        for _ in range(rng.randrange(1, 300)):
            sent.append(line.board.frame())
        passed = line.give(*sent)
        start = rng.randrange(len(sent))
        assert line.give(*sent[start : start + rng.randrange(1, 100)]) == []
        line.hello()
        assert line.give(*sent[start : start + 3]) == []
        line.hello()
        passed += line.frame()
        assert [zones.time_us for zones in passed] == [SCAN_US * (1 + index) for index in range(len(sent) + 1)]
        assert (line.stats.lost, line.stats.restarts) == (0, 0)


# ---- restarts


def test_a_restart_is_reported_by_its_hello():
    line = Line()
    line.board.sent, line.board.time_us, line.board.heard = 100, 5_000_000, 3
    line.hello()
    line.frame()
    line.board.power_up()
    line.hello()
    assert [zones.time_us for zones in line.frame() + line.frame()] == [SCAN_US, 2 * SCAN_US]
    assert (line.stats.restarts, line.stats.lost) == (1, 0)


@pytest.mark.parametrize("up_us", [300_000, 3_000_000, 2**24 - 1000, 2**24 - 1, 2**25 - 100_000])
@pytest.mark.parametrize(("before", "after"), [(3, 0), (3, 12), (0, 0), (0, 12)])
def test_a_restart_whose_hello_is_lost_gives_no_wrong_time(up_us, before, after):
    line = Line()
    line.board.sent, line.board.time_us, line.board.heard = 1100, up_us, before
    line.hello()
    line.frame()
    line.board.power_up()
    line.board.heard = after
    for _ in range(7):
        assert line.frame() == []
    assert line.stats.unexplained == 7
    line.hello()
    assert line.stats.restarts == 1
    assert line.stats.lost == 0
    expected = line.board.time_us
    assert line.frame()[0].time_us == expected


@pytest.mark.parametrize("pieces", [1, 2])
def test_a_run_ends_at_a_restart_whose_hello_is_lost(pieces):
    """The board heard no request, and its time was about to wrap. In two pieces the second begins with the restart."""
    line = Line()
    line.board.sent, line.board.time_us = 1100, 2**24 - 40 * SCAN_US
    line.hello()
    before = b"".join(line.board.frame() for _ in range(20))
    line.board.power_up()
    after = b"".join(line.board.frame() for _ in range(20))
    events = [
        event
        for piece in ((before + after,) if pieces == 1 else (before, after))
        for event in line.host.receive(piece, line.now)
    ]
    assert len(frames_in(events)) == 20
    assert line.stats.unexplained == 20


# ---- other Skins, old boards


def test_frames_of_the_board_before_do_not_pass_after_another_bitstream_was_loaded():
    """The old board stops inside a packet, and the new one's first hello follows without a pause."""
    for cut in range(1, 16):
        line = Line()
        line.board.sent = 500
        line.hello()
        torn = line.board.frame()[:cut]
        new = ModelBoard(SKIN.replace(pitch_x_mm=20.0))
        events = line.host.receive(torn + new.hello() + new.frame(), 0.0)
        assert [zones[0].x_mm for zones in frames_in(events)] == [50.0]
        assert "now has a 16x16 Skin" in str(errors(events)[0])


def test_frames_of_a_new_board_whose_hello_is_lost_do_not_pass():
    line = Line()
    line.hello()
    line.frame()
    new = ModelBoard(SKIN.replace(pitch_x_mm=20.0))
    assert line.give(*(new.frame() for _ in range(100))) == []
    assert line.stats.damaged == {"crc": 100}


@pytest.mark.parametrize("where", ["first", "later"])
def test_a_board_of_protocol_1_is_named(where):
    line = Line()
    if where == "later":
        line.hello()
        line.frame()
    events = line.host.receive(old_frame() + old_hello() + old_frame(), 0.0)
    (error,) = errors(events)
    assert isinstance(error, contactfpga.VersionMismatch)
    assert "speaks protocol version 1, this host version 2" in str(error)
    assert line.stats.foreign_version == 3
    assert line.host.sheet is None


def test_a_foreign_skin_is_refused_in_words_that_say_what_differs():
    line = Line(SKIN.replace(rows=8), expected=SKIN)
    (error,) = errors(line.hello())
    assert "rows is 8, asked for was 16" in str(error)
    assert "columns" not in str(error)
    assert line.frame() == []
    assert line.stats.foreign_skin == 1


def test_skins_that_differ_in_what_no_hello_tells_are_said_to():
    line = Line(SKIN, expected=SKIN.replace(settle_us=6.0))
    (error,) = errors(line.hello())
    assert "differ in fields that a hello does not tell" in str(error)
    assert "settle_us = 6.0" in str(error)


def test_a_new_name_is_no_new_skin():
    line = Line(SKIN.replace(name="left"))
    line.hello()
    line.board.wire = Wire(SKIN.replace(name="right"))
    assert not errors(line.hello())
    assert line.host.hello.name == "right"
    assert line.stats.skin_changes == 0
