"""The circuit model against closed forms and published figures. test_spice.py compares it with ngspice."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from contactfpga.design.circuit import SILICON, Circuit, Diode, needed, patterns, phases, static
from contactfpga.design.circuit.network import Network
from contactfpga.design.circuit.phases import Levels
from contactfpga.design.circuit.values import THERMAL_V

LEVELS = Levels.of(Circuit())
CELL = np.ones((1, 1), bool)
PF = 1e-12


def settle_ns(circuit, pressed):
    return 1e9 * phases.passed(phases.settle(Network(circuit, pressed), LEVELS)).seconds


def test_a_row_that_is_let_go_decays_as_a_resistor_and_a_capacitance_do():
    circuit = Circuit(row_pull_ohm=20_000.0)
    phase = phases.project_rows(Network(circuit, ~CELL), LEVELS)
    start = 3.3 * 20_000 / 20_040
    expected = 20_000 * 32 * PF * math.log(start / 0.8)
    assert phases.passed(phase).seconds == pytest.approx(expected, rel=1e-3)


def test_a_pressed_column_rests_where_the_diodes_current_meets_the_pulls():
    circuit = Circuit(column_pull_ohm=10_000.0, switch_ohm=300.0, series_ohm=60.0)
    diode = circuit.diode

    def surplus(amperes):
        junction = diode.emission * THERMAL_V * math.log1p(amperes / diode.saturation_a)
        return 3.3 - amperes * (10_000 + 300 + diode.series_ohm + 100) - junction

    amperes = brentq(surplus, 0, 1e-3, xtol=1e-15)
    worst = static.scan(circuit.replace(row_pull_ohm=1e8), 1, 1)
    assert worst.level_v == pytest.approx(3.3 - amperes * 10_000, abs=1e-4)
    assert worst.pin_ma == pytest.approx(1e3 * amperes, rel=1e-4)


@pytest.mark.slow
def test_the_other_direction_is_the_mirror_image():
    circuit = Circuit(low_v=1.0, high_v=2.3)
    one, other = needed(circuit, 2, 3, "col2row"), needed(circuit, 2, 3, "row2col")
    assert one.settle == other.settle
    assert other.pressed.level_v == pytest.approx(3.3 - one.pressed.level_v)
    assert other.unpressed_v == pytest.approx(3.3 - one.unpressed_v)
    assert Levels.of(Circuit(), "row2col").low == pytest.approx(1.3)


# ---- figures of the design of the fast scan, made in ngspice with diodes of other makes


@pytest.mark.parametrize(
    ("changes", "nanoseconds"),
    [
        ({}, 182),
        ({"diode": SILICON}, 154),
        ({"switch_ohm": 500.0, "line_pf": 100.0}, 420),
        ({"switch_ohm": 1000.0, "line_pf": 50.0}, 468),
        ({"neighbor_pf": 10.0}, 184),
        ({"crossing_pf": 5.0}, 238),
        ({"column_pull_ohm": 4700.0}, 252),
    ],
)
def test_published_settle_times(changes, nanoseconds):
    assert settle_ns(Circuit(**changes), np.ones((16, 16), bool)) == pytest.approx(nanoseconds, rel=0.1)


# ---- the named patterns are the worst ones


@pytest.mark.parametrize("changes", [{"neighbor_pf": 15.0}, {"switch_ohm": 2000.0, "pin_ohm": 20.0, "line_ohm": 300.0}])
def test_no_random_pattern_is_worse(changes):
    rng = np.random.default_rng(6)
    circuit, size = Circuit(**changes), 6

    def settled(pressed):
        done = phases.passed(phases.settle(Network(circuit, pressed), LEVELS))
        unpressed = done.trace.volts[:, :size][:, ~pressed[size // 2]]
        return done.seconds, unpressed.min(initial=3.3)

    named = patterns.named(size, size)
    worst = [settled(named[name]) for name in patterns.SETTLE]
    for density in np.linspace(0.3, 0.9, 4):
        seconds, level = settled(rng.random((size, size)) < density)
        assert seconds <= max(one[0] for one in worst) * 1.001
        assert level >= min(one[1] for one in worst) - 1e-3


@pytest.mark.parametrize(
    "changes",
    [
        {"column_pull_ohm": 100.0, "row_pull_ohm": 100.0},
        {"line_pf": 0.1, "crossing_pf": 0.0, "pin_ohm": 1.0, "diode": Diode(1e-18, 5.0, 0.0, 0.0, 2.0, 0.0)},
        {"diode": Diode(1e-3, 0.5, 0.0, 1000.0, 0.1, 0.9)},
    ],
)
def test_extreme_values_have_an_answer(changes):
    """A row that never gets released once made the steps grow without an end."""
    needs = needed(Circuit(**changes), 2, 2)
    assert needs.settle.seconds > 0
