"""The control loop of examples/reflex.py: it stops on contact, on silence and on a frame that may be wrong, and brakes
whatever ends it."""

import asyncio
import itertools

import pytest
from model_board import SCAN_US, DirectPort, ModelBoard

import contactfpga
from contactfpga_sim.lab.reader import reflex

SKIN = contactfpga.Skin()
LOOP = reflex.example()


class SendingPort(DirectPort):
    """A port that sends a frame every scan, untouched until ``touch_s``, and nothing from ``silent_s`` on."""

    def __init__(self, touch_s=float("inf"), silent_s=float("inf"), flags=(), moments=((4, 10, 6),)):
        super().__init__(SKIN)
        self.moments, self.touch = [], list(moments)
        self.touch_s, self.silent_s, self.flags = touch_s, silent_s, flags

    def read(self, seconds):
        if self._out:
            return super().read(seconds)
        due = self.time_us / 1e6
        if due >= self.silent_s or due > self._seconds + seconds:
            self._seconds += seconds
            return b""
        self._seconds = max(self._seconds, due)
        if due >= self.touch_s:
            self.moments = self.touch
            return self.frame(flags=self.flags)
        return self.frame()


def run(port):
    steps, braked = [], []
    with contactfpga.open(port, SKIN) as board:
        stop = LOOP.guard(board, lambda: steps.append(board.clock()), lambda: braked.append(board))
    assert braked == [board]
    return stop, steps, board


def test_it_stops_within_a_scan_of_a_touch():
    stop, steps, _ = run(SendingPort(touch_s=0.0205))
    assert stop.reason == "contact"
    assert stop.zones.pressed == 4
    assert 0 <= stop.decided_s - 0.0205 <= 2 * SCAN_US / 1e6
    assert len(steps) == pytest.approx(21, abs=1)


def test_it_steps_every_millisecond():
    _, steps, _ = run(SendingPort(touch_s=0.1))
    between = [b - a for a, b in itertools.pairwise(steps)]
    assert between == [pytest.approx(0.001, abs=2 * SCAN_US / 1e6)] * (len(steps) - 1)
    assert len(steps) == pytest.approx(100, abs=2)


def test_silence_stops_it_like_a_contact():
    stop, _, _ = run(SendingPort(silent_s=0.03))
    assert (stop.reason, stop.zones) == ("silence", None)
    assert stop.decided_s - 0.03 == pytest.approx(LOOP.SILENCE_S, abs=2 * LOOP.PERIOD_S)


@pytest.mark.parametrize(("flag", "reason"), [("mismatch", "fault"), ("fault", "fault"), ("motion", "contact")])
def test_a_frame_that_may_be_wrong_stops_it(flag, reason):
    stop, _, _ = run(SendingPort(touch_s=0.01, flags=[flag], moments=[]))
    assert stop.reason == reason


class GonePort(SendingPort):
    """A port that is pulled at 20 ms, or whose board then has another bitstream."""

    def __init__(self, error):
        super().__init__()
        self.error = error

    def read(self, seconds):
        if self._seconds > 0.02 and self.error is contactfpga.PortLost:
            raise contactfpga.PortLost("the port is gone")
        if self._seconds > 0.02 and self.error:
            self.error = None
            self.send(ModelBoard(SKIN.replace(columns=8)).hello())
        return super().read(seconds)


@pytest.mark.parametrize("error", [contactfpga.PortLost, contactfpga.SkinMismatch])
def test_a_board_that_is_gone_stops_it(error):
    stop, steps, _ = run(GonePort(error))
    assert (stop.reason, stop.zones, type(stop.error)) == ("silence", None, error)
    assert len(steps) == pytest.approx(21, abs=1)


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError, asyncio.CancelledError])
def test_it_brakes_however_it_is_left(error):
    braked = []

    def step():
        raise error

    with contactfpga.open(SendingPort(), SKIN) as board, pytest.raises(error):
        LOOP.guard(board, step, lambda: braked.append(board))
    assert len(braked) == 1


def test_the_example_says_what_stopped_it(capsys, monkeypatch):
    monkeypatch.setattr("sys.argv", ["reflex.py", "sim://"])
    assert LOOP.main() == 0
    assert "brake\nstopped after 1 steps: contact\n<Zones: 1 zone," in capsys.readouterr().out


def test_the_measurement_counts_touches():
    found = reflex.measured(reflex.PACE._replace(seconds=2.0))
    assert found.found_us == sorted(found.found_us)
    assert all(time_us > 0 for time_us in found.found_us)
    assert len(found.found_us) + found.silent > 0
