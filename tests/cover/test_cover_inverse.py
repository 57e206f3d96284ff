"""What arm and cover give a certain force, and where there is none."""

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from impacts import FIRST, SPEED, arm

from contactfpga.design.cover import Ball, CoverError, NoSolution, elastic, impact
from contactfpga.design.cover import arm as motion
from contactfpga.design.cover.arm import Arm
from contactfpga.design.cover.impact import Impact

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


# ---- no solution, and why


@pytest.mark.parametrize(
    ("ask", "reason"),
    [
        (
            lambda: impact.strike(arm(torque_nm=20.0), SPEED, FIRST, thickness_m=0.005),
            "the torque wins: without any speed it presses the foam in by 10.77 mm, the foam's thickness is 5 mm",
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
        (lambda: Arm(0.1, -0.2), "lever_m is -0.2; it must be a finite number above 0 m"),
        (lambda: Arm(0.1, 0.2, "2"), "torque_nm is '2'; it must be a finite number"),
        (lambda: Arm(0.1, 0.2, 0.0, -1.0), "weight_nm is -1.0; it must be a finite number, 0 Nm or above"),
        (lambda: impact.strike(arm(), 1.0, 1.0, method="euler"), "must be one of auto, closed, quadrature, ode"),
        (
            lambda: impact.strike(arm(torque_nm=1.0), 1.0, 1e5, method="closed"),
            "method is 'closed'; with torque or gravity there is no closed form, take 'quadrature'",
        ),
        (lambda: impact.strike(arm(), 0.4, FIRST, thickness_m=0), "thickness_m is 0; it must be a finite number"),
        (lambda: motion.steps(arm(), 0.4, FIRST, 1.0), "rtol is 1.0; it must lie between 1e-13 and 0.01"),
        (
            lambda: elastic.thickness_m(Ball(0.02, 1e5), 1, 1, 1, rule="best"),
            "rule is 'best'; it must be one of printed",
        ),
    ],
)
def test_what_cannot_be_is_refused(make, message):
    with pytest.raises(CoverError) as caught:
        make()
    assert message in str(caught.value)
