"""No data: silence is an error or an event, and never an empty sheet."""

import contextlib

import pytest
from model_board import ModelBoard

import contactfpga
from contactfpga.driver.events import longest_pause_s
from contactfpga.tools.console import live
from contactfpga.wire.faults import Faults

SKIN = contactfpga.Skin(guard=True)
EVERY_S = 0.01


class Ticking(ModelBoard):
    """A port in simulated time whose board sends a frame every 10 ms, unless it is dead, mute or unplugged."""

    def __init__(self, skin=SKIN):
        super().__init__(skin)
        self.dead = self.noisy = self.unplugged = False
        self.seconds = 0.0
        self._next = EVERY_S
        self.out = b""

    def write(self, data):
        for _, hello in self.hear(data):
            if not self.dead:
                self.out += self.hello() + self.report() if hello else b""

    def report(self):
        return super().report() if self.wire.skin.guard else b""

    def read(self, seconds):
        if self.unplugged:
            raise contactfpga.PortLost("ticking is gone; plug it in")
        if not self.out:
            self.seconds += seconds
            while self.seconds >= self._next:
                self._next += EVERY_S
                self.time_us += round(EVERY_S * 1e6)
                if not self.dead:
                    self.out += self.frame()
                elif self.noisy:
                    self.out += b"?"
        data, self.out = self.out, b""
        return data

    def clock(self):
        return self.seconds

    def close(self):
        pass


@pytest.fixture
def port():
    return Ticking()


@pytest.fixture
def board(port):
    with contactfpga.open(port) as board:
        board.next()
        yield board


def test_silence_is_an_error_that_says_how_long_and_what_came_last(board, port):
    frames = board.subscribe(deadline_s=0.05)
    last = [frames.next() for _ in range(5)][-1]
    port.dead = True
    for _ in range(2):
        with pytest.raises(
            contactfpga.NoData, match=r"no data for 0\.\d+ s, the last was frame .*not one byte"
        ) as caught:
            frames.next()
    silence = caught.value.silence
    assert silence.last.sequence == last.sequence
    assert silence.seconds == pytest.approx(0.1, abs=0.02), "it goes on"
    port.noisy = True
    with pytest.raises(contactfpga.ReadTimeout, match="other bytes came"):  # which NoData is
        frames.next()
    port.out, port.dead = b"\0", False
    assert frames.next().sequence == (last.sequence + 1) % 256, "and goes on when frames do"


def test_a_board_that_keeps_up_is_never_silent(board):
    frames = board.subscribe(deadline_s=0.03)
    sequences = [frames.next().sequence for _ in range(300)]
    assert sequences == [(sequences[0] + index) % 256 for index in range(300)]


def test_events_are_frames_faults_and_silence_in_order(board, port):
    events = board.events(deadline_s=0.05)
    assert isinstance(events.next(), contactfpga.Zones)
    port.dead = True
    port.word = 1 << 3
    port.out += port.report()
    found = [events.next() for _ in range(3)]
    assert found[0] == Faults(rows_open=(3,)), "no frame was sent"
    assert [type(event) for event in found[1:]] == [contactfpga.Silence] * 2
    assert found[2].seconds > found[1].seconds >= 0.05
    assert board.faults.names == ("row 3 open",)
    port.dead = False
    assert isinstance(events.next(), contactfpga.Zones)
    assert board.events().next() == Faults(rows_open=(3,)), "faults that there are come first"


def test_a_pulled_plug_is_no_silence(board, port):
    frames, events = board.subscribe(deadline_s=0.05), board.events(deadline_s=0.05)
    port.unplugged = True
    for one in (frames, events):
        with pytest.raises(contactfpga.PortLost, match="plug it in"):
            one.next()


def test_the_latest_frame_may_not_be_older_than_asked_for(board, port):
    fresh = board.latest(max_age_s=0.05)
    port.dead = True
    assert fresh.arrived_s >= board.clock() - 0.05
    with pytest.raises(contactfpga.NoData, match="no data for"):
        board.latest(max_age_s=0.05)
    before = board.clock()
    with pytest.raises(contactfpga.NoData):
        board.latest(max_age_s=0.05)
    assert board.clock() == pytest.approx(before, abs=0.005), "no waiting for what can only be too late"
    port.dead = False
    port.read(0.02)
    port.out += port.frame()
    assert board.latest(max_age_s=0.05).sequence != fresh.sequence


def test_a_frame_that_waits_too_long_is_not_the_latest(board, port):
    port.read(0.02)
    port.out += port.frame()
    other = board.subscribe()
    assert other.next().sequence, "it waits in the board's own queue as well"
    port.dead = True
    port.seconds += 1.0
    with pytest.raises(contactfpga.NoData):
        board.latest(max_age_s=0.05)


def test_a_frame_that_waited_on_its_way_is_not_the_latest(board, port):
    """After the network or this program stood still, a frame that has just come but was scanned long ago is not the
    latest."""
    for _ in range(10):
        board.next()
    late, port.dead = port.frame(), True
    port.seconds += 0.6
    port.out += late
    with pytest.raises(
        contactfpga.NoData, match=r"frame \d+ waited on its way, 0\.\d+ s or more \(allowed are 0\.05 s\)"
    ):
        board.latest(max_age_s=0.05)
    port.dead = False
    port.time_us += round(0.6 * 1e6)
    assert board.latest(max_age_s=0.05).sequence
    port.out += port.frame()
    assert board.latest(), "without a limit"


def test_where_the_clock_jumped_and_no_frame_waited_the_answer_to_a_request_shows_it(board, port):
    for _ in range(10):
        board.next()
    port.seconds += 2.0
    port._next += 2.0
    found, frames = [], board.subscribe()
    for _ in range(50):
        frames.next()
        with contextlib.suppress(contactfpga.NoData):
            found.append(board.latest(max_age_s=0.05))
    assert len(found) > 30


def test_the_timeout_may_be_shorter_than_the_deadline(board, port):
    port.dead = True
    with pytest.raises(contactfpga.ReadTimeout) as caught:
        board.subscribe(deadline_s=10.0).next(timeout=0.05)
    assert not isinstance(caught.value, contactfpga.NoData)


@pytest.mark.parametrize("deadline_s", [0, -1, float("nan"), float("inf"), "1"])
def test_deadlines_that_cannot_be(board, deadline_s):
    for call in (board.subscribe, board.events):
        with pytest.raises(ValueError, match="must be a positive number of seconds"):
            call(deadline_s=deadline_s)
    with pytest.raises(ValueError, match="max_age_s is"):
        board.latest(max_age_s=deadline_s)


def test_with_a_keep_alive_the_deadline_has_to_be_longer():
    """A deadline below the keep-alive is refused: with a known Skin by its keep-alive, otherwise by the longest that
    there is."""
    skin = contactfpga.Skin(send="on_change", keep_alive_ms=20.0)
    for given, least_s in ((skin, 0.02), (None, 0.1)):
        with contactfpga.open(Ticking(skin), given) as board:
            with pytest.raises(ValueError, match=r"deadline_s is 0\.01; this board may be silent for .*on_change"):
                board.subscribe(deadline_s=0.01)
            with pytest.raises(ValueError, match="max_age_s is"):
                board.latest(max_age_s=least_s)
            board.subscribe(deadline_s=least_s + 0.005)


def test_the_longest_pause_is_a_scan_and_a_frame_on_the_wire():
    """16 rows of 6 us; a frame of 64 zones of 4 bytes takes 273 bytes, at 0.3 bytes per us."""
    with contactfpga.open(Ticking()) as board:
        assert longest_pause_s(board.hello, SKIN) == pytest.approx(96e-6 + (273 + 160) / 0.3e6, abs=30e-6)


def test_a_recording_has_no_deadline(tmp_path):
    model = ModelBoard(SKIN)
    (tmp_path / "x.bin").write_bytes(model.hello() + model.frame() + model.frame())
    with contactfpga.open(f"replay://{tmp_path}/x.bin") as board:
        assert [board.latest(max_age_s=0.01).sequence for _ in range(2)] == [0, 1]
        with pytest.raises(contactfpga.ReplayEnded):
            board.latest(max_age_s=0.01)


def test_a_display_shows_silence_in_the_place_of_a_table_that_stands_still(board, port):
    shown = live._paced(board, board.subscribe(), 1.0, lambda zones: None, tell_silence=True)
    assert isinstance(next(shown), contactfpga.Zones)
    port.dead = True
    silence = next(one for one in shown if isinstance(one, contactfpga.Silence))
    assert 0.2 <= silence.seconds < 0.3
    assert "no data for 0.2" in str(silence)
    port.dead = False
    assert isinstance(next(shown), contactfpga.Zones)
    port.dead = True
    with pytest.raises(contactfpga.ReadTimeout):
        list(shown)
    assert board.silence.seconds >= 1.0
