"""The equation of motion of an impact on the cover, and the digits of its solution."""

import math

import mpmath
import numpy as np
import pytest
from impacts import FIRST, ROWS, SPEED, arm
from scipy import integrate

from contactfpga.design.cover import CoverError, NoSolution, impact, numerics
from contactfpga.design.cover import arm as motion
from contactfpga.design.cover.arm import Arm, speed2

# ---- the equation of motion


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


@pytest.mark.slow
def test_quadrature_against_30_digit_arithmetic(record_property):
    cases = 0
    for moved, speed, stiffness in random_blows(8):
        found = impact.strike(moved, speed, stiffness, method="quadrature")
        if isinstance(found, NoSolution):
            continue
        depth, seconds = digits30(moved, speed, stiffness)
        assert found.compression_m == pytest.approx(depth, rel=2e-14), moved
        assert found.time_s == pytest.approx(seconds, rel=1e-12), moved
        cases += 1
    record_property("cases", cases)
    assert cases > 5


def test_an_integral_that_does_not_converge_is_none():
    assert numerics.integral(np.sqrt, 0, 1) == pytest.approx(2 / 3, rel=1e-13)
    assert numerics.integral(lambda x: 1 / x, 0, 1) is None


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
