"""The arm's loop through the compiled gateware and the real driver, against the golden model and simple sums."""

import functools

import numpy as np
import pytest

from contactfpga.skin import Skin
from contactfpga.skin.latency import latency_s
from contactfpga_sim.lab.arm.case import Case
from contactfpga_sim.lab.arm.run import run
from contactfpga_sim.lab.arm.world import Faults
from contactfpga_sim.model.board.receiver import frames_in
from contactfpga_sim.model.golden import Timeline, predict

SKIN = Skin()
PAPER = Case.load("paper")
DIRECT = PAPER.but(usb={"timer_s": 0.0, "frame_s": 10e-6, "host_s": 0.0})
"""Bytes come to the program as they are, to the next step."""
STEP = PAPER.run.step_s
LEAD = PAPER.run.lead_s


@functools.cache
def paper(way):
    return run(PAPER, way)


@functools.cache
def direct():
    return run(DIRECT, "uart").outcome


@pytest.fixture
def by_pin():
    return paper("pin")


@pytest.fixture
def by_uart():
    return paper("uart")


@pytest.fixture(scope="module")
def golden():
    """What the golden model says of a sheet whose switch at (8, 8) closes when ours does."""
    cells = np.zeros((SKIN.rows, SKIN.columns), bool)
    cells[8, 8] = True
    closes = round((paper("pin").outcome.closes_s + LEAD) * SKIN.clock_hz)
    return predict(SKIN, Timeline([(closes, cells, None)]), closes + 8 * SKIN.derived.frame_clocks)


def frame_ends(trace):
    """Times in s from the touch at which the stop bits of frames with a zone end."""
    end = 1 + 10 * SKIN.derived.bit_clocks
    return [(got.last + end) / SKIN.clock_hz - LEAD for got in frames_in(SKIN, trace.bytes) if got.frame.cells]


def test_the_pin_rises_in_the_clock_in_which_the_golden_model_says(by_pin, golden):
    cycle = next(cycle for cycle, level in golden.contact if level)
    assert by_pin.outcome.detected_s == pytest.approx(cycle / SKIN.clock_hz - LEAD, abs=1e-9)


def test_the_driver_hands_over_the_first_frame_that_the_golden_model_sends(golden):
    detected = direct().detected_s
    assert 0 <= detected - frame_ends(golden)[0] <= 2 * STEP


def test_the_usb_chip_and_the_host_add_their_time(by_uart, golden):
    usb = PAPER.usb
    late = by_uart.outcome.detected_s - frame_ends(golden)[0]
    assert usb.host_s <= late <= usb.timer_s + usb.frame_s + usb.host_s + 2 * STEP
    assert by_uart.outcome.detected_s > direct().detected_s


def test_detection_is_no_later_than_the_sum_of_its_bounds(by_pin, by_uart):
    scan = SKIN.derived.frame_clocks / SKIN.clock_hz
    assert by_pin.outcome.detected_s - by_pin.outcome.closes_s <= scan + 3e-6
    usb = PAPER.usb
    bound = latency_s(SKIN) + usb.timer_s + usb.frame_s + usb.host_s
    assert by_uart.outcome.detected_s - by_uart.outcome.closes_s <= bound
    for outcome in (by_pin.outcome, by_uart.outcome):
        assert 0 <= outcome.reacts_s - outcome.detected_s <= PAPER.control.period_s


@pytest.mark.parametrize("way", ["latency", "pin", "uart", "torque"])
def test_the_arm_goes_back_until_nothing_is_closed_then_slows_to_rest(way):
    result = paper(way)
    outcome = result.outcome
    assert [state for _, state, _ in result.events] == ["reversing", "slowing", "resting"]
    slows = result.events[1][0]
    assert outcome.closes_s < outcome.reacts_s < outcome.resolved_s < slows < outcome.rest_s
    end = result.course[-1]
    assert end["force_n"] == 0
    assert abs(end["speed_rad_s"]) * 0.2 < 1e-3


def test_a_byte_damaged_on_the_wire_costs_a_frame(golden):
    """One byte of the first frame that tells of the contact: the next frame does, 96 us later."""
    first, second = frame_ends(golden)[:2]
    byte = 10 * SKIN.derived.bit_clocks / SKIN.clock_hz
    clean = direct()
    noisy = run(DIRECT, "uart", faults=Faults(noise_s=(first - 8.5 * byte, first - 7.5 * byte))).outcome
    assert noisy.detected_s - clean.detected_s == pytest.approx(second - first, abs=2 * STEP)
    assert noisy.reacts_s >= clean.reacts_s
