"""Impact of a covered arm: the corrected equations' values, limits, energy, digits, inverse, and what has no answer."""

import math

import mpmath
import pytest
from impacts import FIRST, ROWS, SPEED, arm, spring

from contactfpga.design.cover import Ball, elastic, impact

# ---- reference values, to their printed digits


def test_inertia_and_stiffness():
    assert round(arm().inertia_kgm2, 7) == 0.0157166
    assert [round(spring(), 1), round(spring(radius=0.038)), round(spring(poisson=0.3), 1)] == [
        89443.2,
        126492,
        73716.9,
    ]
    tube = arm(tube=True).inertia_kgm2 - arm().inertia_kgm2
    assert tube == pytest.approx(0.6 / 12 * 3 * 0.038**2, rel=1e-12)
    assert arm(length_m=0.3).inertia_kgm2 - arm().inertia_kgm2 == pytest.approx(0.05 * (0.09 - 0.04), rel=1e-12)


@pytest.mark.parametrize("row", ROWS)
@pytest.mark.parametrize("method", ["auto", "quadrature", "ode"])
def test_compression_time_and_force(row, method):
    moved, stiffness, millimeters, mm_digits, milliseconds, ms_digits, newtons, n_digits = row
    found = impact.strike(moved, SPEED, stiffness, method=method)
    assert abs(1e3 * found.compression_m - millimeters) <= 0.51 * 10**-mm_digits
    assert abs(1e3 * found.time_s - milliseconds) <= 0.51 * 10**-ms_digits
    if newtons:
        assert abs(found.force_n - newtons) <= 0.51 * 10**-n_digits
    assert found.method == (
        "closed" if method == "auto" and moved.free else "quadrature" if method == "auto" else method
    )


@pytest.mark.parametrize(("seconds", "millimeters", "stiffness"), [(0.006, 1.63084, 731649), (0.008, 2.17445, 356415)])
def test_stiffness_for_a_time(seconds, millimeters, stiffness):
    found = impact.stiffness_for(arm(), SPEED, seconds)
    assert (round(1e3 * found.compression_m, 5), round(found.stiffness)) == (millimeters, stiffness)
    # with a torque that is next to none the search has to find the same
    searched = impact.stiffness_for(arm(torque_nm=1e-13), SPEED, seconds)
    assert searched.method == "quadrature"
    assert searched.stiffness == pytest.approx(found.stiffness, rel=1e-10)


@pytest.mark.parametrize(("radius", "millimeters"), [(0.019, 26.873381), (0.038, 15.434704)])
def test_thickness_as_printed(radius, millimeters):
    found = elastic.thickness_m(Ball(radius, 4.6e5), 2.0, 1.5, 4791.0)
    assert round(1e3 * found, 6) == millimeters


def test_constants_of_the_thickness():
    exact = [round(elastic.THICKNESS_RULES[name], 4) for name in ("printed", "printed_exact")]
    assert exact == [84, 83.7589]
    assert round(elastic.THICKNESS_RULES["peak_force"], 3) == 154.285
    assert round(elastic.THICKNESS_RULES["hertz"], 3) == 97.969


def test_thickness_with_the_hertz_rule_is_the_energy_over_sixteen_true_areas():
    ball, mass, speed, resilience = Ball(0.02, 3e5), 1.3, 0.7, 5000.0
    energy = mass * speed**2 / 2
    depth = (energy / (0.4 * elastic.stiffness(ball))) ** 0.4
    area = math.pi * ball.patch_m(elastic.stiffness(ball) * depth**1.5) ** 2
    expected = energy / (resilience * 16 * area)
    assert elastic.thickness_m(ball, mass, speed, resilience, rule="hertz") == pytest.approx(expected, rel=1e-12)
    halved = elastic.thickness_m(ball, mass, speed, resilience, 0.5, "hertz")
    assert halved == pytest.approx(expected / 2, rel=1e-12)


def test_yield():
    ball = Ball(1.0, 4.6e5)
    assert round(elastic.yield_indentation_m(ball, 57.5e3), 5) == 0.10496
    assert round(elastic.yield_indentation_m(ball, 57.5e3, elastic.CYLINDER_ON_PLANE), 5) == 0.19518
    assert elastic.resilience(57.5e3, 3.45e5) == pytest.approx(4791, abs=1)


def test_yield_is_where_the_mean_pressure_is_the_strength_times_its_ratio():
    ball = Ball(0.03, 2e5)
    depth = elastic.yield_indentation_m(ball, 4e4)
    force = elastic.stiffness(ball) * depth**1.5
    assert force / (math.pi * ball.patch_m(force) ** 2) == pytest.approx(1.1 * 4e4, rel=1e-12)


# ---- limits


def test_without_speed_the_torque_alone_presses():
    # u delta/d = 2/5 K delta^2.5, and with delta = delta_c x^(2/3): t_c is a Beta function again
    pressed = impact.strike(arm(torque_nm=2.0), 0.0, FIRST)
    depth = (2.5 * 10 / FIRST) ** (2 / 3)
    assert pressed.compression_m == pytest.approx(depth, rel=1e-12)
    scale = math.sqrt(depth * arm().mass_kg / (2 * 10))
    expected = float(mpmath.beta(mpmath.mpf(1) / 3, 0.5) * 2 / 3) * scale
    assert pressed.time_s == pytest.approx(expected, rel=1e-12)


def test_modulus_of_an_incompressible_foam_and_of_two_bodies():
    assert elastic.effective_modulus_pa(3e5, 0.5) == pytest.approx(4e5, rel=1e-15)
    assert elastic.effective_modulus_pa(3e5, 0.0) == 3e5
    assert elastic.effective_modulus_pa(3e5, 0.5, 3e5, 0.5) == pytest.approx(2e5, rel=1e-15)
    assert elastic.young_pa(4e5, 0.5) == pytest.approx(3e5)
    assert elastic.ball_of(elastic.stiffness(Ball(0.02, 3e5)), 0.02).modulus_pa == pytest.approx(3e5)
