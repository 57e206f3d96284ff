"""Pressure units end to end: a simulated converter, the compiled gateware, the driver, commands, doctor."""

import itertools
import math
import random

import pytest

import contactfpga
from contactfpga import Skin, SkinError
from contactfpga.driver import health
from contactfpga_sim.model.board.receiver import frames_in
from contactfpga_sim.model.board.virtual import VirtualBoard
from contactfpga_sim.model.golden import Timeline, predict
from contactfpga_sim.verify.cosim import bench_native
from contactfpga_sim.verify.cosim.compare import compare

SKIN = Skin(rows=4, columns=4, units=3, unit_sums=[[1, 1, 1], [127, -127, 5]])


@pytest.fixture
def wave():
    """A board whose first unit swings at 20 Hz; the second reads 0, the third rests."""

    def units(seconds):
        return [round(2048 + 1500 * math.sin(40 * math.pi * seconds)), 0, 1000]

    with contactfpga.open(VirtualBoard(SKIN, units=units), SKIN) as board:
        yield board, units


@pytest.mark.slow
def test_readings_at_a_frames_moment_are_those_of_the_moment(wave):
    """Off by what the wave moves in the 0.2 ms for which the simulation holds a reading."""
    board, units = wave
    frames = [board.next() for _ in range(400)]
    known = [zones for zones in frames if zones.units is not None]
    assert len(known) > 390
    slope = 1500 * 40 * math.pi * 0.2e-3
    for zones in known:
        reading, *rest = zones.units.readings
        assert abs(reading - units(zones.time_us / 1e6)[0]) <= slope + 1 + 4 * zones.units.sigma[0]
        assert rest == [0, 1000]
        assert zones.units.saturated == (False, True, False)


@pytest.mark.slow
def test_events_tell_each_sweep_with_its_own_time(wave):
    board, _ = wave
    events = board.events()
    sweeps = [event for event, _ in zip(events, range(300), strict=False) if isinstance(event, contactfpga.UnitSamples)]
    steps = {late.time_us - early.time_us for early, late in itertools.pairwise(sweeps)}
    assert len(sweeps) > 50
    assert all(step % 60 == 0 for step in steps)


@pytest.mark.slow
def test_doctor_names_the_unit_that_reads_only_0(wave):
    board, _ = wave
    found = {finding.sentence: finding.verdict for finding in health.count(board, 0.06, 1.0)}
    assert found["unit 1 reads only 0: look at its amplifier and at its wires"] == "fault"
    assert found["no threshold is set: the pressure units cannot raise contact"] == "note"


@pytest.mark.slow
@pytest.mark.parametrize(("code", "what"), [(0, "0"), (4095, "full scale (4095)")])
def test_doctor_names_a_dead_converter(code, what):
    with contactfpga.open(VirtualBoard(SKIN, units=lambda _: [code] * 3), SKIN) as board:
        sentences = [finding.sentence for finding in health.count(board, 0.02, 1.0)]
    assert f"the converter reads only {what}: look at its supply, its reference and its wires" in sentences


@pytest.mark.slow
def test_commands_set_zeros_and_thresholds():
    with contactfpga.open(VirtualBoard(SKIN, units=lambda _: [2000, 2100, 2200]), SKIN) as board:
        for unit, rest in enumerate((2000, 2100, 2200)):
            board.set_zero(unit, rest)
        board.set_threshold(2, 1)
        board.read()
        last = board.unit_history.last
        assert (last.armed, last.over) == (True, False)
        board.set_zero(2, 2201)
        board.read()
        board.read()
        assert board.unit_history.last.over
        with pytest.raises(ValueError, match="unit is 3; this board has 3, counted from 0"):
            board.set_threshold(3, 1)
        with pytest.raises(ValueError, match="sum is 2; this board has 2"):
            board.set_sum_threshold(2, 1)


def test_a_board_without_units_says_so():
    with contactfpga.open(VirtualBoard(), Skin()) as board:
        with pytest.raises(contactfpga.NoSuchCommand, match="build its Skin with units"):
            board.set_zero(0, 0)
        assert board.unit_history is None


def test_readings_are_no_frames_for_what_measures_latencies():
    sent = predict(SKIN, Timeline([]), 60_000).bytes
    frames = list(frames_in(SKIN, sent))
    assert len(frames) > 20
    assert sum(value >> 4 == 8 and after == 0 for (_, value), (_, after) in zip(sent[:-4], sent[4:], strict=True)) > 20


def test_a_converter_without_a_model_is_not_taken_for_another():
    skin = SKIN.replace(converter="toy_converter:MINE")
    with pytest.raises(SkinError, match="converter is 'toy_converter:MINE', which is not simulated"):
        VirtualBoard(skin)


@pytest.mark.slow
def test_the_compiled_board_is_the_golden_models_in_every_clock():
    rng = random.Random(5)
    cycles = 60_000
    timeline = Timeline([], units=[(start, [rng.randrange(4096) for _ in range(3)]) for start in range(0, cycles, 97)])
    assert compare(predict(SKIN, timeline, cycles), bench_native.run(SKIN, timeline, cycles)) > 1_000
