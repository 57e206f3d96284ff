"""Pressure units from bytes to what a program sees: times, interpolation, uncertainty, and what doctor says."""

import numpy as np
import pytest
from model_board import SCAN_US, ModelBoard
from wire import digits, seal

from contactfpga import Skin, UnitSamples
from contactfpga.driver.conversation import Conversation, frames_in
from contactfpga.wire.units import Sweep, UnitFacts
from contactfpga.zones.units import UnitHistory, only

SKIN = Skin(units=2)
FACTS = UnitFacts(2, 12, 0, 0, 240, 480)
SWEEP_US, SPACING_US = 40, 20


class Line:
    """A board with units whose bytes go straight to a conversation."""

    def __init__(self, skin=SKIN):
        self.board, self.host, self.swept = ModelBoard(skin), Conversation("x"), 0
        self.give(self.board.hello(), self.board.frame())

    def give(self, *packets):
        return self.host.receive(b"".join(packets), 0.0)

    def sweep(self, time_us, *readings, flags=0):
        data = b"".join(digits(reading, 2) for reading in readings)
        data += digits(time_us % 2**24 + self.swept % 256 * 2**24, 5) + bytes([0x80 + flags])
        self.swept += 1
        return self.give(seal(data, self.board.wire.known.fingerprint[:2]))

    def frame(self):
        (zones,) = frames_in(self.give(self.board.frame()))
        return zones


def test_units_of_a_frame_are_known_once_a_sweep_before_and_one_after_have_come():
    line = Line()
    (samples,) = line.sweep(2 * SCAN_US - 30, 100, 2000)
    assert samples == UnitSamples(2 * SCAN_US - 30, (100, 2000), samples.sigma, (False, False))
    zones = line.frame()
    assert zones.time_us == 2 * SCAN_US
    assert zones.units is None
    line.sweep(2 * SCAN_US + 10, 140, 1000)
    found = zones.units
    assert found.time_us == zones.time_us
    assert found.readings == (pytest.approx(130), pytest.approx(1750))  # 30 of 40 us after, and 10 of 40
    assert zones.units is found
    assert zones.to_dict()["units"]["readings"] == found.readings


def test_a_run_of_frames_has_them_too():
    line = Line()
    line.sweep(150, 10, 10)
    packets = [line.board.frame() for _ in range(40)]
    events = line.host.receive(b"".join(packets), 0.0)
    line.sweep(9_000, 20, 20)
    frames = frames_in(events)
    assert len(frames) == 40
    assert all(zones.units is not None for zones in frames)


def test_readings_are_interpolated_unit_by_unit_and_never_beyond_the_samples(rng):
    history = UnitHistory(FACTS, 12_000_000)
    times = np.cumsum([rng.choice([40, 40, 40, 120]) for _ in range(50)])
    values = np.array([[rng.randrange(4096) for _ in range(2)] for _ in times])
    for index, (time_us, readings) in enumerate(zip(times, values, strict=True)):
        history.add(Sweep(0, index, tuple(readings), False, False), int(time_us))
    for time_us in range(times[0], times[-1] + 40, 7):
        found = history.at(time_us)
        known = times[0] + SPACING_US <= time_us < times[-1]
        assert (found is not None) == known
        if known:
            wanted = [np.interp(time_us - unit * SPACING_US, times, values[:, unit]) for unit in range(2)]
            assert found.readings == pytest.approx(wanted)


def test_sigma_is_that_of_a_step_at_an_unknown_moment(rng):
    """Simulated: between two samples a reading changes at once, at any moment."""
    history = UnitHistory(UnitFacts(1, 12, 0, 0, 0, 480), 12_000_000)
    history.add(Sweep(0, 0, (1000,), False, False), 1_000)
    history.add(Sweep(0, 1, (1600,), False, False), 1_040)
    for time_us in (1_004, 1_020, 1_036):
        found = history.at(time_us)
        steps = [1000 if time_us < 1_000 + 40 * rng.random() else 1600 for _ in range(20_000)]
        spread = np.sqrt(np.mean((np.array(steps) - found.readings[0]) ** 2))
        assert found.sigma[0] == pytest.approx(spread, rel=0.05)


def test_what_touches_an_end_of_the_scale_is_saturated():
    history = UnitHistory(FACTS, 12_000_000)
    first = history.add(Sweep(0, 0, (0, 2000), False, False), 100)
    second = history.add(Sweep(0, 1, (9, 4095), False, False), 140)
    assert (first.saturated, second.saturated) == ((True, False), (False, True))
    assert history.at(130).saturated == (True, True)


def test_lost_sweeps_are_counted_and_times_wrap_with_those_of_frames():
    line = Line()
    line.board.time_us = 2**24 - 50
    line.give(line.board.hello())
    before = line.frame()
    line.sweep(2**24 - 90, 1, 1)
    line.swept += 3
    line.sweep(2**24 + 10, 1, 1)
    assert before.units.readings == (1, 1)
    stats = line.host.stats
    assert (stats.sweeps, stats.sweeps_lost, stats.sweeps_unexplained) == (2, 3, 0)


def test_a_board_without_units_has_none():
    line = Line(Skin())
    assert line.frame().units is None
    assert "units" not in line.frame().to_dict()
    line.sweep(150, 1, 1)
    assert line.host.stats.unknown_kinds == 1


def test_units_that_never_read_anything_else_are_found():
    assert only([0, 0, 3, 4095], [0, 4, 9, 4095], 0) == [0]
    assert only([0, 0, 3, 4095], [0, 4, 9, 4095], 4095) == [3]
