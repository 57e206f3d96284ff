"""The impact as motion over time: the equation itself integrated step by step, and its time course by quadrature.

The reference for :mod:`contactfpga.design.cover.impact`: (2) as corrected,

    J/d^2 d^2 delta/dt^2 = (u - M g l sin(theta0 + delta/d))/d - K_s delta^(3/2),

by Dormand and Prince's method of order 5 with step control. The step in which v turns negative is made once more with
v as the independent variable (Henon), which ends at v = 0 exactly.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from contactfpga.design.cover.answer import CoverError, not_negative, positive
from contactfpga.design.cover.arm import Arm, slowness, speed2
from contactfpga.design.cover.solve import Floats, gauss

State = tuple[float, float]

RTOL = 1e-10
"""Error a step, relative to each of depth, speed and time."""

_A = (
    (),
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
    (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
)
_C = (0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0)
_ERROR = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)


class Step(NamedTuple):
    """A moment of a compression."""

    time_s: float
    indentation_m: float
    speed_m_s: float


class Course(NamedTuple):
    """Touch to separation; arrays of the same length."""

    time_s: Floats
    indentation_m: Floats
    speed_m_s: Floats
    """Positive into the foam."""
    force_n: Floats


def compress(arm: Arm, speed_m_s: float, stiffness: float, rtol: float = RTOL) -> State:
    """(delta_c in m, t_c in s) by :func:`steps`."""
    last = steps(arm, speed_m_s, stiffness, rtol)[-1]
    return last.indentation_m, last.time_s


def steps(arm: Arm, speed_m_s: float, stiffness: float, rtol: float = RTOL) -> list[Step]:
    """Every accepted step from the touch to the end of the compression, where the speed is 0."""
    positive("stiffness", stiffness, "N/m^1.5")
    if not 1e-13 <= rtol <= 1e-2:
        raise CoverError(f"rtol is {rtol!r}; it must lie between 1e-13 and 0.01")

    def pull(indentation: float) -> float:
        return float((arm.push_n(indentation) - stiffness * max(indentation, 0.0) ** 1.5) / arm.mass_kg)

    def over_time(_: float, state: State) -> State:
        return state[1], pull(state[0])

    def over_speed(speed: float, state: State) -> State:
        slowing = pull(state[0])
        return speed / slowing, 1 / slowing

    speed = not_negative("speed_m_s", speed_m_s, "m/s")
    push = arm.push_n(0.0)
    if speed == 0 and push <= 0:
        raise CoverError("speed_m_s is 0; it must be above 0 m/s where neither torque nor gravity presses")
    # How far and how fast it goes, roughly: what errors are compared with, and the first step taken from.
    length = float((1.25 * arm.mass_kg * speed**2 / stiffness) ** 0.4 + (max(push, 0.0) / stiffness) ** (2 / 3))
    if push < 0:
        length = min(length, -arm.mass_kg * speed**2 / (2 * push))
    pace = max(speed, math.sqrt(max(push, 0.0) * length / arm.mass_kg))
    found = [Step(0.0, 0.0, speed)]
    for time, state in _walk(over_time, 0.0, (0.0, speed), length / pace / 50, rtol, (length, pace)):
        if state[1] <= 0:
            break
        found.append(Step(time, *state))
    last = found[-1]
    # At the start of that step the arm may still be pushed on; only where it is slowed, v can be what time is told by.
    while pull(last.indentation_m) >= -1e-3 * abs(pull(state[0])):
        short = (time - last.time_s) / 8
        state = _one(over_time, last.time_s, (last.indentation_m, last.speed_m_s), short)[0]
        last = Step(last.time_s + short, *state)
        found.append(last)
    at = last.indentation_m, last.time_s
    left = -last.speed_m_s / pull(last.indentation_m)
    scale = last.indentation_m + left * last.speed_m_s, last.time_s + left
    for slower, (depth, seconds) in _walk(over_speed, last.speed_m_s, at, -last.speed_m_s, rtol, scale, 0.0):
        found.append(Step(seconds, depth, slower))
    return found


def course(arm: Arm, speed_m_s: float, stiffness: float, depth_m: float, count: int = 64) -> Course:
    """The whole contact in 2 ``count`` + 1 moments by quadrature; ``depth_m``: where the compression ends.

    Nothing is lost in this model, so that the way out mirrors the way in.
    """
    phi = np.linspace(0, math.pi / 2, count + 1)

    def pace(at: Floats) -> Floats:
        return slowness(arm, speed_m_s, stiffness, depth_m, at)

    parts = [gauss(pace, low, high) for low, high in itertools.pairwise(phi.tolist())]
    time = np.concatenate([[0.0], np.cumsum(parts)])
    depth = depth_m * np.sin(phi) ** 2
    speed = np.sqrt(np.maximum(0, speed2(arm, speed_m_s, stiffness, depth)))
    speed[-1] = 0.0
    both = np.concatenate([depth, depth[-2::-1]])
    return Course(
        np.concatenate([time, 2 * time[-1] - time[-2::-1]]),
        both,
        np.concatenate([speed, -speed[-2::-1]]),
        stiffness * both**1.5,
    )


Slope = Callable[[float, State], State]


def _walk(
    slope: Slope, x: float, y: State, step: float, rtol: float, scale: State, end: float | None = None
) -> Iterator[tuple[float, State]]:
    """(x, y) after each accepted step, to ``end`` or forever. ``step``'s sign is the direction."""
    while end is None or x != end:
        if end is not None and abs(step) >= abs(end - x):
            step = end - x
        after, off = _one(slope, x, y, step)
        error = max(abs(off[i]) / (rtol * (abs(y[i]) + 1e-3 * scale[i])) for i in (0, 1))
        if error <= 1:
            x = end if end is not None and step == end - x else x + step
            y = after
            yield x, y
        step *= min(5.0, max(0.2, 0.9 * error**-0.2)) if error > 0 else 5.0


def _one(slope: Slope, x: float, y: State, step: float) -> tuple[State, State]:
    """One step: where it leads, and by how much that of order 4 differs."""
    slopes: list[State] = []
    at = y
    for row, share in zip(_A, _C):
        at = (
            y[0] + step * sum(a * k[0] for a, k in zip(row, slopes)),
            y[1] + step * sum(a * k[1] for a, k in zip(row, slopes)),
        )
        slopes.append(slope(x + share * step, at))
    off = (
        step * sum(e * k[0] for e, k in zip(_ERROR, slopes)),
        step * sum(e * k[1] for e, k in zip(_ERROR, slopes)),
    )
    return at, off
