"""Impact of a covered arm: the corrected equations' values, limits, energy, digits, inverse, and what has no answer."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import integrate

from contactfpga.cover import Ball, CoverError, NoSolution, elastic, impact, motion, solve
from contactfpga.cover.arm import Arm, speed2
from contactfpga.cover.impact import Impact

BASE = (0.6, 0.038, 0.15, 0.2)
SPEED = 0.4


def arm(**changes):
    return Arm.link(*BASE, **changes)


def spring(poisson=0.5, radius=0.019, modulus=3.65e5):
    return elastic.stiffness(Ball(radius, elastic.effective_modulus_pa(modulus, poisson)))


FIRST = spring()
ROWS = [
    (arm(), FIRST, 3.78018093, 8, 13.9076409, 7, 20.7882, 4),
    (arm(), spring(radius=0.038), 3.29084, 5, 12.10730, 5, 23.8793, 4),
    (arm(), spring(poisson=0.3), 4.08418, 5, 15.02607, 5, 19.2408, 4),
    (arm(torque_nm=2.0), FIRST, 5.72354651, 8, 16.0351470, 7, None, None),
    (arm(torque_nm=-1.0), FIRST, 2.93820403, 8, 12.1188771, 7, None, None),
    (arm(gravity=True), FIRST, 3.7726138, 7, 13.883912, 6, None, None),
    (arm(torque_nm=0.5, gravity=True, angle_rad=0.3), 1e5, 3.809761834, 9, 13.61037078, 8, 23.515095, 6),
]
"""Arm, stiffness, then compression in mm, time in ms and force in N, each with the digits printed."""


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


def test_constant_of_the_closed_form():
    assert round(impact.COMPRESSION_TIME, 9) == 1.471637592
    assert float(mpmath.mpf(2) / 5 * mpmath.beta(0.4, 0.5)) == pytest.approx(impact.COMPRESSION_TIME, rel=1e-15)


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
    # the printed strength: 20 to 74 radii deep, which no contact reaches
    vacuous = [
        elastic.yield_indentation_m(Ball(1.0, elastic.effective_modulus_pa(modulus, poisson)), 8.41e5, ratio)
        for modulus in (3.45e5, 3.65e5)
        for poisson in (0.5, 0.0)
        for ratio in (1.1, 1.5)
    ]
    assert (round(min(vacuous)), round(max(vacuous))) == (20, 74)
    assert elastic.resilience(57.5e3, 3.45e5) == pytest.approx(4791, abs=1)
    assert elastic.resilience(8.41e5, 3.45e5) == pytest.approx(1.025e6, rel=1e-3)


def test_yield_is_where_the_mean_pressure_is_the_strength_times_its_ratio():
    ball = Ball(0.03, 2e5)
    depth = elastic.yield_indentation_m(ball, 4e4)
    assert elastic.mean_pressure_pa(ball, depth) == pytest.approx(1.1 * 4e4, rel=1e-12)
    force = elastic.stiffness(ball) * depth**1.5
    assert force / (math.pi * ball.patch_m(force) ** 2) == pytest.approx(1.1 * 4e4, rel=1e-12)


# ---- limits


def test_a_vanishing_torque_and_weight_change_nothing():
    free = impact.strike(arm(), SPEED, FIRST)
    for moved in (arm(torque_nm=1e-9), arm(torque_nm=-1e-9), Arm(arm().inertia_kgm2, 0.2, 0.0, 1e-9, 1.0)):
        found = impact.strike(moved, SPEED, FIRST)
        assert found.method == "quadrature"
        assert found.compression_m == pytest.approx(free.compression_m, rel=1e-8)
        assert found.time_s == pytest.approx(free.time_s, rel=1e-8)


def test_without_speed_the_torque_alone_presses():
    # u delta/d = 2/5 K delta^2.5, and with delta = delta_c x^(2/3): t_c is a Beta function again
    pressed = impact.strike(arm(torque_nm=2.0), 0.0, FIRST)
    depth = (2.5 * 10 / FIRST) ** (2 / 3)
    assert pressed.compression_m == pytest.approx(depth, rel=1e-12)
    scale = math.sqrt(depth * arm().mass_kg / (2 * 10))
    expected = float(mpmath.beta(mpmath.mpf(1) / 3, 0.5) * 2 / 3) * scale
    assert pressed.time_s == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("speed", [1e-2, 1e-4, 1e-6, 1e-9])
def test_a_slow_touch_under_a_strong_torque_comes_near_that(speed):
    pressed = impact.strike(arm(torque_nm=20.0), 0.0, FIRST)
    found = impact.strike(arm(torque_nm=20.0), speed, FIRST)
    assert found.time_s == pytest.approx(pressed.time_s, abs=1.1 * speed * arm().mass_kg / 100)
    assert found.time_s < pressed.time_s


def test_modulus_of_an_incompressible_foam_and_of_two_bodies():
    assert elastic.effective_modulus_pa(3e5, 0.5) == pytest.approx(4e5, rel=1e-15)
    assert elastic.effective_modulus_pa(3e5, 0.0) == 3e5
    assert elastic.effective_modulus_pa(3e5, 0.5, 3e5, 0.5) == pytest.approx(2e5, rel=1e-15)
    assert elastic.young_pa(4e5, 0.5) == pytest.approx(3e5)
    assert elastic.effective_radius_m(0.038, 0.038) == pytest.approx(0.019)
    assert elastic.effective_radius_m(0.038) == 0.038
    assert elastic.ball_of(elastic.stiffness(Ball(0.02, 3e5)), 0.02).modulus_pa == pytest.approx(3e5)


# ---- the equation of motion


@pytest.mark.parametrize("row", ROWS)
def test_energy_is_kept_along_the_motion(row):
    moved, stiffness = row[:2]
    walked = motion.steps(moved, SPEED, stiffness, rtol=1e-12)
    start = moved.mass_kg * SPEED**2 / 2
    for step in walked:
        stored = 0.4 * stiffness * step.indentation_m**2.5
        moving = moved.mass_kg * step.speed_m_s**2 / 2
        angle = moved.angle_rad + step.indentation_m / moved.lever_m
        lifted = moved.weight_nm * (math.cos(moved.angle_rad) - math.cos(angle))
        work = moved.torque_nm * step.indentation_m / moved.lever_m
        assert moving + stored + lifted - work == pytest.approx(start, rel=1e-10)
    assert walked[-1].speed_m_s == 0
    assert len(walked) > 100
    found = impact.strike(moved, SPEED, stiffness)
    assert found.energy_j == pytest.approx(stored, rel=1e-9)


@pytest.mark.parametrize("row", ROWS)
def test_motion_against_scipys_dop853(row):
    moved, stiffness = row[:2]

    def slope(_, state):
        angle = moved.angle_rad + state[0] / moved.lever_m
        torque = moved.torque_nm - moved.weight_nm * math.sin(angle)
        pull = torque / moved.lever_m - stiffness * max(state[0], 0) ** 1.5
        return state[1], pull * moved.lever_m**2 / moved.inertia_kgm2

    def stopped(_, state):
        return state[1]

    stopped.terminal, stopped.direction = True, -1
    solved = integrate.solve_ivp(slope, (0, 1), (0, SPEED), "DOP853", events=stopped, rtol=1e-11, atol=1e-14)
    depth, seconds = motion.compress(moved, SPEED, stiffness, 1e-11)
    assert depth == pytest.approx(solved.y_events[0][0][0], rel=1e-9)
    assert seconds == pytest.approx(solved.t_events[0][0], rel=1e-9)
    closer = impact.strike(moved, SPEED, stiffness)
    assert (depth, seconds) == (pytest.approx(closer.compression_m, rel=1e-9), pytest.approx(closer.time_s, rel=1e-9))


def test_motion_under_a_brake_far_stronger_than_the_foam_and_from_rest():
    braked = Arm(0.03, 2.2, -25.0)
    found = impact.strike(braked, 0.09, 4.0)
    walked = impact.strike(braked, 0.09, 4.0, method="ode")
    assert walked.compression_m == pytest.approx(found.compression_m, rel=1e-8)
    assert walked.time_s == pytest.approx(found.time_s, rel=1e-8)
    pressed = impact.strike(arm(torque_nm=2.0), 0.0, FIRST, method="ode")
    assert pressed.time_s == pytest.approx(impact.strike(arm(torque_nm=2.0), 0.0, FIRST).time_s, rel=1e-8)
    with pytest.raises(CoverError, match="speed_m_s is 0; it must be above 0 m/s where neither torque nor gravity"):
        motion.steps(arm(), 0.0, FIRST)


def test_course_lies_on_the_motion():
    moved = arm(torque_nm=0.5, gravity=True, angle_rad=0.3)
    found = impact.strike(moved, SPEED, 1e5)
    course = motion.course(moved, SPEED, 1e5, found.compression_m, 32)
    assert len(course.time_s) == 65
    assert course.time_s[32] == pytest.approx(found.time_s, rel=1e-12)
    assert course.force_n.max() == pytest.approx(found.force_n, rel=1e-12)
    assert course.indentation_m[[0, -1]].tolist() == [0, 0]
    assert course.speed_m_s[[0, 32, -1]].tolist() == [SPEED, 0, -SPEED]
    walked = motion.steps(moved, SPEED, 1e5, 1e-11)
    for step in walked[:: len(walked) // 9]:
        depth = np.interp(step.time_s, course.time_s[:33], course.indentation_m[:33])
        assert depth == pytest.approx(step.indentation_m, abs=3e-3 * found.compression_m)


# ---- digits


def digits30(moved, speed, stiffness):
    """delta_c and t_c by the raw integrals (4) and (5), in 36 digits."""
    with mpmath.workdps(36):
        inertia, lever, torque = map(mpmath.mpf, (moved.inertia_kgm2, moved.lever_m, moved.torque_nm))
        weight, angle, spring = map(mpmath.mpf, (moved.weight_nm, moved.angle_rad, stiffness))

        def square(depth):
            half = depth / (2 * lever)
            lifted = 4 * lever**2 * weight / inertia * mpmath.sin(angle + half) * mpmath.sin(half)
            pressed = 4 * spring * lever**2 / (5 * inertia) * depth ** mpmath.mpf("2.5")
            return mpmath.mpf(speed) ** 2 - lifted + 2 * lever * torque * depth / inertia - pressed

        guess = impact.compression_m(moved, speed, stiffness)
        depth = mpmath.findroot(square, (guess * (1 - 1e-9), guess * (1 + 1e-9)), solver="secant", tol=1e-60)
        # A slow arm under a torque gains speed over a short way at first, which needs an interval of its own.
        layer = mpmath.mpf(speed) ** 2 * inertia / (2 * lever * max(abs(torque), abs(weight), mpmath.mpf("1e-9")))
        time = mpmath.quad(lambda x: 1 / mpmath.sqrt(square(x)), [0, min(layer, depth / 2), depth])
        return float(depth), float(time)


def random_blows(count):
    random = np.random.default_rng(20)
    for _ in range(count):
        inertia, lever = 10 ** random.uniform(-3, 0), 10 ** random.uniform(-1.3, 0)
        speed, stiffness = 10 ** random.uniform(-4, 0.7), 10 ** random.uniform(4, 7)
        torque, weight = random.uniform(-3, 3) * random.integers(0, 2), random.uniform(0, 5) * random.integers(0, 2)
        yield Arm(inertia, lever, torque, weight, random.uniform(-math.pi, math.pi)), speed, stiffness


def test_quadrature_against_30_digit_arithmetic(record_property):
    cases = 0
    for moved, speed, stiffness in random_blows(12):
        found = impact.strike(moved, speed, stiffness, method="quadrature")
        if isinstance(found, NoSolution):
            continue
        depth, seconds = digits30(moved, speed, stiffness)
        assert found.compression_m == pytest.approx(depth, rel=2e-14), moved
        assert found.time_s == pytest.approx(seconds, rel=1e-12), moved
        cases += 1
    record_property("cases", cases)
    assert cases > 7


def test_the_first_of_several_roots_is_found():
    # An arm that stands on its joint: gravity slows it, then pulls it over; at some speed it all but stops on top.
    moved = Arm(1.0, 1.0, 0.0, 5.0, math.pi - 0.01)
    near = np.linspace(0, 0.03, 30001)
    barrier = math.sqrt(-float(speed2(moved, 0.0, 10.0, near).min()))
    before = impact.strike(moved, 0.999 * barrier, 10.0)
    beyond = impact.strike(moved, 1.001 * barrier, 10.0)
    assert before.compression_m < 0.02 < 0.1 < beyond.compression_m
    for speed, found in ((0.999 * barrier, before), (1.001 * barrier, beyond)):
        depths = np.linspace(0, found.compression_m * 0.999999, 20001)
        assert (speed2(moved, speed, 10.0, depths) > 0).all()
        depth, seconds = motion.compress(moved, speed, 10.0, 1e-12)
        assert found.compression_m == pytest.approx(depth, rel=1e-8)
        assert found.time_s == pytest.approx(seconds, rel=1e-8)


def test_roots_and_integrals():
    assert solve.root(lambda x: x**3 - 2, 0, 3) == pytest.approx(2 ** (1 / 3), rel=1e-15)
    assert solve.root(lambda x: math.inf if x > 1 else x - 0.3, 0, 9) == pytest.approx(0.3, rel=1e-15)
    assert solve.root(lambda x: x, 0, 1) == 0
    with pytest.raises(ValueError, match="no change of sign between 1 and 2"):
        solve.root(lambda x: x, 1, 2)
    assert solve.integral(np.sqrt, 0, 1) == pytest.approx(2 / 3, rel=1e-13)
    assert solve.integral(lambda x: 1 / x, 0, 1) is None
    assert solve.integral(lambda x: x * np.inf, 0, 1) is None


# ---- the inverse

between = st.floats


@settings(deadline=None, max_examples=150)
@given(
    between(-4, 0), between(-1.7, 0), between(-3, 1), between(2, 8), between(-10, 10), between(0, 5), between(-1.5, 1.5)
)
def test_stiffness_undoes_time(inertia, lever, speed, stiffness, torque, weight, angle):
    moved = Arm(10**inertia, 10**lever, torque, weight, angle)
    hit = impact.strike(moved, 10**speed, 10**stiffness)
    assume(isinstance(hit, Impact) and hit.compression_m < 0.9 * moved.lever_m)
    back = impact.stiffness_for(moved, 10**speed, hit.time_s)
    assume(isinstance(back, Impact))  # next to the longest time rounding decides
    assert impact.strike(moved, 10**speed, back.stiffness).time_s == pytest.approx(hit.time_s, rel=1e-9)
    if moved.push_n(0) >= 0 and weight == 0:
        assert back.stiffness == pytest.approx(hit.stiffness, rel=1e-8)
        assert back.compression_m == pytest.approx(hit.compression_m, rel=1e-8)


@settings(deadline=None)
@given(between(-3, 1), between(2, 8))
def test_stiffness_undoes_time_in_closed_form(speed, stiffness):
    hit = impact.strike(arm(), 10**speed, 10**stiffness)
    assume(isinstance(hit, Impact))
    assert impact.stiffness_for(arm(), 10**speed, hit.time_s).stiffness == pytest.approx(10**stiffness, rel=1e-12)


@given(between(-10, 10), between(2.5, 8), between(0.01, 1))
def test_a_stiffer_contact_is_shorter(torque, stiffness, more):
    hits = [impact.strike(arm(torque_nm=torque), SPEED, 10**k) for k in (stiffness, stiffness + more)]
    assume(all(isinstance(hit, Impact) for hit in hits))
    assert hits[0].time_s > hits[1].time_s


# ---- no solution, and why


@pytest.mark.parametrize(
    ("ask", "reason"),
    [
        (
            lambda: impact.strike(arm(torque_nm=100.0), SPEED, 1e3),
            "the torque wins: without any speed it presses the foam in by 630 mm, the lever's length is 200 mm",
        ),
        (
            lambda: impact.strike(arm(torque_nm=20.0), SPEED, FIRST, thickness_m=0.005),
            "the torque wins: without any speed it presses the foam in by 10.77 mm, the foam's thickness is 5 mm",
        ),
        (
            lambda: impact.strike(arm(), SPEED, FIRST, thickness_m=0.003),
            "the foam bottoms out: pressed in by 3.78 mm, it is 3 mm thick",
        ),
        (
            lambda: impact.strike(arm(), SPEED, 1.0),
            "the foam is too soft: it would be pressed in by 361.5 mm, the lever's length is 200 mm",
        ),
        (
            lambda: impact.strike(arm(), SPEED, FIRST, yield_m=0.003),
            "outside the elastic range: pressed in by 3.78 mm, the foam yields from 3 mm on",
        ),
        (
            lambda: impact.strike(arm(torque_nm=-1.0), 0.0, FIRST),
            "the arm touches at 0 m/s and neither torque nor gravity presses it on",
        ),
        (
            lambda: impact.stiffness_for(arm(torque_nm=-1.0), SPEED, 0.0315),
            "a compression of 31.5 ms: torque and gravity stop the arm within 31.43 ms whatever the foam",
        ),
        (
            lambda: impact.stiffness_for(arm(torque_nm=1.0), SPEED, 0.6),
            "a compression of 600 ms: the foam would be pressed in by more than the lever's length, 200 mm; "
            "that takes 216.9 ms",
        ),
        (
            lambda: impact.stiffness_for(arm(), SPEED, 0.008, thickness_m=0.002),
            "the foam bottoms out: pressed in by 2.174 mm, it is 2 mm thick",
        ),
        (
            lambda: impact.stiffness_for(arm(torque_nm=0.1), SPEED, 0.008, thickness_m=0.002),
            "a compression of 8 ms: the foam would be pressed in by more than the foam's thickness, 2 mm; "
            "that takes 7.309 ms",
        ),
    ],
)
def test_no_solution_has_its_reason(ask, reason):
    assert ask() == NoSolution(reason)


def test_a_braking_torque_stops_the_arm_by_itself():
    longest = arm().inertia_kgm2 * SPEED / 0.2
    assert isinstance(impact.stiffness_for(arm(torque_nm=-1.0), SPEED, longest * 1.000001), NoSolution)
    assert isinstance(impact.stiffness_for(arm(torque_nm=-1.0), SPEED, longest * 0.999999), Impact)


def test_a_wide_turn_is_noted():
    assert impact.strike(arm(), SPEED, FIRST).notes == ()
    assert impact.strike(arm(), SPEED, 100.0).notes == ("the arm turns by 0.29 rad: theta - theta0 = delta/d is rough",)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Arm(0.0, 0.2), "inertia_kgm2 is 0.0; it must be a finite number above 0 kg m2"),
        (lambda: Arm(0.1, -0.2), "lever_m is -0.2; it must be a finite number above 0 m"),
        (lambda: Arm(0.1, 0.2, math.nan), "torque_nm is nan; it must be a finite number"),
        (lambda: Arm(0.1, 0.2, "2"), "torque_nm is '2'; it must be a finite number"),
        (lambda: Arm(0.1, 0.2, 0.0, -1.0), "weight_nm is -1.0; it must be a finite number, 0 Nm or above"),
        (lambda: Arm.link(0, 0.038, 0.15, 0.2), "mass_kg is 0; it must be a finite number above 0 kg"),
        (lambda: arm(length_m=math.inf), "length_m is inf; it must be a finite number above 0 m"),
        (lambda: impact.strike(arm(), -1.0, FIRST), "speed_m_s is -1.0; it must be a finite number, 0 m/s or above"),
        (lambda: impact.strike(arm(), 1.0, 0.0), "stiffness is 0.0; it must be a finite number above 0 N/m^1.5"),
        (lambda: impact.strike(arm(), 1.0, 1.0, method="euler"), "must be one of auto, closed, quadrature, ode"),
        (
            lambda: impact.strike(arm(torque_nm=1.0), 1.0, 1e5, method="closed"),
            "method is 'closed'; with torque or gravity there is no closed form, take 'quadrature'",
        ),
        (lambda: impact.stiffness_for(arm(), 0.4, 0.0), "seconds is 0.0; it must be a finite number above 0 s"),
        (lambda: impact.strike(arm(), 0.4, FIRST, thickness_m=0), "thickness_m is 0; it must be a finite number"),
        (lambda: motion.steps(arm(), 0.4, FIRST, 1.0), "rtol is 1.0; it must lie between 1e-13 and 0.01"),
        (lambda: elastic.effective_modulus_pa(1e5, 0.6), "poisson is 0.6; it must lie above -1 and not above 0.5"),
        (
            lambda: elastic.thickness_m(Ball(0.02, 1e5), 1, 1, 1, rule="best"),
            "rule is 'best'; it must be one of printed",
        ),
        (lambda: elastic.resilience(-1, 1e5), "yield_pa is -1; it must be a finite number above 0 Pa"),
    ],
)
def test_what_cannot_be_is_refused(make, message):
    with pytest.raises(CoverError) as caught:
        make()
    assert message in str(caught.value)
