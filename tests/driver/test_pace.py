"""How simulated and recorded time follow a clock, which the tests turn."""

import math

import pytest

from contactfpga.driver.pace import MOMENT_S, DeviceClock, Pace

LAG_S = 0.1


@pytest.fixture
def now():
    return [100.0]


@pytest.mark.parametrize("factor", [0.25, 1.0, 16.0])
def test_what_keeps_up_passes_at_the_asked_pace(now, factor):
    pace, at_s = Pace(5.0, factor, LAG_S * factor, lambda: now[0]), 5.0
    for _ in range(200):
        now[0] += 0.02
        assert pace.wait_s(at_s) == pytest.approx(-0.02)
        at_s += pace.due(at_s)
    assert at_s == pytest.approx(5.0 + factor * 4.0)
    assert pace.wait_s(at_s + 3.0) == pytest.approx(3.0 / factor)
    assert pace.slip_s == 0
    assert pace.share == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize("factor", [0.5, 1.0])
def test_what_is_slower_slips_and_says_by_how_much(now, factor):
    pace, at_s = Pace(0.0, factor, LAG_S, lambda: now[0]), 0.0
    for _ in range(500):
        due = pace.due(at_s)
        at_s += max(due, 0.0)
        now[0] += due / factor / 0.4 if due > 0 else 0.02  # a machine that reaches 40 %
    assert pace.share == pytest.approx(0.4, abs=0.02)
    assert pace.slip_s == pytest.approx(factor * (now[0] - 100.0) - at_s, abs=3 * LAG_S)


def test_without_a_pace_all_is_due_and_a_pause_ends_where_it_began(now):
    assert Pace(factor=None, clock=lambda: now[0]).due(1e9) == math.inf
    assert Pace(factor=None, clock=lambda: now[0]).wait_s(1e9) == -math.inf
    pace = Pace(clock=lambda: now[0])
    now[0] += 1.0
    assert pace.due(0.0) == 1.0
    pace.factor = 0.0
    now[0] += 50.0
    assert (pace.due(0.25), pace.wait_s(2.0)) == (0.75, math.inf)
    pace.factor = 2.0
    now[0] += 1.0
    assert pace.due(0.25) == 2.75
    pace.restart(9.0)
    assert pace.due(9.0) == 0


def test_a_slow_machine_simulates_less_at_a_time():
    """And no less than before, however long it takes to draw: else it would come to a stop."""
    pace = Pace()
    assert pace.most_s == pytest.approx(MOMENT_S)
    for _ in range(50):
        pace.ran(pace.most_s, pace.most_s / 0.1)  # a tenth of real time
    assert pace.most_s == pytest.approx(0.1 * MOMENT_S, rel=0.01)


def test_device_time_goes_on_where_a_board_was_started_again():
    clock = DeviceClock()
    assert [clock.take(time_us) for time_us in (5_000_000, 6_000_000, 100, 500_100)] == [0, 1, 1, 1.5]
