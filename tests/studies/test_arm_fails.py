"""Where the arm fails, and what catches it."""

import pytest
from sample import sample

from contactfpga.skin import Skin
from contactfpga_sim.lab.arm.case import Case, CaseError
from contactfpga_sim.lab.arm.plant import Plant, finite
from contactfpga_sim.lab.arm.run import run
from contactfpga_sim.lab.arm.world import Faults

PAPER = Case.load("paper")


def at_rest(result):
    return abs(result.course["speed_rad_s"][-1]) * 0.2 < 1e-3 and result.outcome.rest_s is not None


def test_a_step_that_is_too_long_is_refused_and_would_blow_up():
    """Runge-Kutta of order 4 is stable to 2.785 time constants; the current's is 0.125 ms."""
    with pytest.raises(CaseError, match=r"step_s is 5e-05; it must be at most 3.125e-05 s"):
        PAPER.but(run={"step_s": 50e-6})
    plant = Plant(PAPER.but(motor={"supply_v": 1e12}))  # no limit that would hide it
    for share, stays in ((2.7, True), (2.9, False)):
        state = (-1.0, 0.0, 1.0)
        for number in range(400):
            state = plant.step(number * 1e-4, state, 0.0, share * PAPER.motor.time_constant_s)
        assert (abs(state[2]) < 1) == stays
        assert finite(state)


@pytest.mark.slow
def test_two_contacts_at_once_are_two_zones_and_both_are_left():
    near = {"x_mm": 20.0, "y_mm": 80.0, "lever_m": 0.16}
    two = PAPER.but(touch=({}, near))
    result = run(two, "uart")
    outcome = result.outcome
    assert outcome.zones == 2
    assert outcome.reversals == 1
    assert at_rest(result)
    assert result.course["force_n"][-1] == 0
    apart = 0.2 * result.course["angle_rad"].max(), 0.16 * result.course["angle_rad"].max()
    peaks = sum(PAPER.foam.half_space.force_n(depth) for depth in apart)  # both are deepest at the same moment
    assert outcome.peak_force_n == pytest.approx(peaks, rel=1e-9)
    assert outcome.resolved_s < result.events[1][0]


def test_a_saturated_sensor_still_trips_the_limit_and_a_limit_it_cannot_read_is_refused():
    with pytest.raises(CaseError, match=r"torque_limit_nm is 3.0; the sensor reads 2.9 Nm at most"):
        PAPER.but(control={"sensor_nm": 2.9})
    fast = run(PAPER.but(link={"speed_m_s": 0.6}), "torque").outcome
    assert fast.torque_before_nm > 3.0  # past the range at the sample
    assert fast.reason == "torque"


@pytest.mark.slow
@pytest.mark.parametrize("dies_s", sample([8e-3, 15e-3], quick=[15e-3]))
@pytest.mark.parametrize(("way", "who"), [("pin", "board"), ("uart", "board"), ("uart", "host")])
def test_a_board_or_host_that_dies_in_a_contact_does_not_drive_the_arm_back_for_ever(way, who, dies_s):
    result = run(PAPER, way, faults=Faults(**{f"{who}_dies_s": dies_s}))
    assert [reason for _, _, reason in result.events] == ["contact", "retreat", "rest"]
    assert at_rest(result)
    assert result.course["force_n"][-1] == 0
    lever = PAPER.link.lever_m
    gone = lever * (result.course["angle_rad"].max() - result.course["angle_rad"].min())
    ramp = PAPER.control.reverse_m_s**2 / (2 * PAPER.control.slowing_m_s2)
    assert gone < PAPER.control.retreat_m + ramp + 3e-3


def test_a_board_that_speaks_more_rarely_than_the_watchdog_waits_is_refused():
    with pytest.raises(
        CaseError, match=r"keep_alive_ms is 100; without a frame the controller stops the arm after 0.02 s"
    ):
        run(PAPER, "uart", skin=Skin(send="on_change"))


@pytest.mark.parametrize("who", ["board", "host"])
def test_an_arm_that_hears_nothing_any_more_stops_before_it_touches(who):
    dies = -5e-3
    far = PAPER.but(touch=({"gap_m": 0.03},))
    result = run(far, "uart", faults=Faults(**{f"{who}_dies_s": dies}))
    stopped, state, reason = result.events[0]
    assert (state, reason) == ("stopped", "silence")
    watchdog = PAPER.control.watchdog_s
    assert dies < stopped <= dies + watchdog + PAPER.usb.timer_s + PAPER.usb.host_s + 2 * PAPER.control.period_s
    assert result.outcome.peak_force_n == 0
    assert at_rest(result)
