"""An arm that runs into an obstacle, and the energy balance by which the foam slows it.

One joint has constant motor torque u and optional gravity; the foam is a Hertz spring F = K_s delta^1.5. With theta -
theta0 = delta/d, delta(0) = 0 and +v0 at the touch (the paper prints -v0 and drops cos theta0), (3) is

    J/(2 d^2) (v^2 - v0^2) = u delta/d - M g l [cos theta0 - cos(theta0 + delta/d)] - 2/5 K_s delta^(5/2).

The reference for :mod:`contactfpga.design.cover.impact` is (2) as corrected,

    J/d^2 d^2 delta/dt^2 = (u - M g l sin(theta0 + delta/d))/d - K_s delta^(3/2),

by Dormand and Prince's method of order 5. The step in which v becomes negative is repeated with v as the independent
variable (Henon), which ends at v = 0 exactly.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from contactfpga.design.cover.answer import CoverError, finite, not_negative, numbers, positive
from contactfpga.design.cover.numerics import Floats, gauss

GRAVITY = 9.81
"""g of the paper in m/s2."""


@dataclasses.dataclass(frozen=True)
class Arm:
    """A link that turns about one joint, and its drive."""

    inertia_kgm2: float
    """J about the joint."""
    lever_m: float
    """d, from the joint to the contact."""
    torque_nm: float = 0.0
    """u, the motor's constant torque; positive presses into the obstacle."""
    weight_nm: float = 0.0
    """M g l; 0 leaves gravity out."""
    angle_rad: float = 0.0
    """theta0, the joint's angle at the touch, from hanging down toward the obstacle."""

    def __post_init__(self) -> None:
        positive("inertia_kgm2", self.inertia_kgm2, "kg m2")
        positive("lever_m", self.lever_m, "m")
        not_negative("weight_nm", self.weight_nm, "Nm")
        for name in ("torque_nm", "angle_rad"):
            finite(name, getattr(self, name))

    @classmethod
    def link(
        cls,
        mass_kg: float,
        radius_m: float,
        com_m: float,
        lever_m: float,
        *,
        length_m: float | None = None,
        tube: bool = False,
        torque_nm: float = 0.0,
        gravity: bool = False,
        angle_rad: float = 0.0,
    ) -> Arm:
        """A cylinder with its center of mass ``com_m`` from the joint.

        J = m/12 (3 R^2 + L^2) + m l^2, for a thin tube 6 R^2; L defaults to the lever, as printed.
        """
        positive("mass_kg", mass_kg, "kg")
        positive("lever_m", lever_m, "m")
        not_negative("radius_m", radius_m, "m")
        not_negative("com_m", com_m, "m")
        length = positive("length_m", lever_m if length_m is None else length_m, "m")
        inertia = mass_kg / 12 * ((6 if tube else 3) * radius_m**2 + length**2) + mass_kg * com_m**2
        weight = mass_kg * GRAVITY * com_m if gravity else 0.0
        return cls(inertia, lever_m, torque_nm, weight, angle_rad)

    @property
    def mass_kg(self) -> float:
        """J/d^2, the effective mass at the contact."""
        return self.inertia_kgm2 / self.lever_m**2

    @property
    def free(self) -> bool:
        """Whether torque and gravity are 0, which allows a closed form."""
        return self.torque_nm == 0 and self.weight_nm == 0

    def push_n(self, indentation_m: float) -> float:
        """Force of motor and gravity at the contact."""
        finite("indentation_m", indentation_m)
        angle = self.angle_rad + indentation_m / self.lever_m
        return (self.torque_nm - self.weight_nm * math.sin(angle)) / self.lever_m

    def work_j(self, indentation_m: Floats | float) -> Floats:
        """Work of motor and gravity since the touch."""
        half = numbers("indentation_m", indentation_m, "m") / (2 * self.lever_m)
        lifted = 2 * self.weight_nm * np.sin(self.angle_rad + half) * np.sin(half)
        return np.asarray(2 * self.torque_nm * half - lifted)


def speed2(arm: Arm, speed_m_s: float, stiffness: float, indentation_m: Floats | float) -> Floats:
    """v^2 in m2/s2 at an indentation, from (3); negative where the arm does not arrive."""
    gained = arm.work_j(indentation_m) - 0.4 * stiffness * np.asarray(indentation_m, float) ** 2.5
    return np.asarray(speed_m_s**2 + 2 / arm.mass_kg * gained)


def slowness(arm: Arm, speed_m_s: float, stiffness: float, depth_m: float, phi: Floats) -> Floats:
    """dt/dphi in s at delta = ``depth_m`` sin^2(phi); ``phi`` in rad, below pi/2."""
    s = np.sin(phi)
    share = s * s
    rest = np.cos(phi) ** 2
    spring = 0.4 * stiffness * depth_m**2.5
    half = depth_m / (2 * arm.lever_m)
    ending = spring * (1 + s + share + share * s + share * share) / (1 + s) - 2 * arm.torque_nm * half
    if arm.weight_nm:
        ending = ending + 2 * arm.weight_nm * np.sin(arm.angle_rad + half * (1 + share)) * half * np.sinc(
            half * rest / math.pi
        )
    starting = speed2(arm, speed_m_s, stiffness, depth_m * share) / rest
    square = np.where(share < 0.5, starting, 2 / arm.mass_kg * ending)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(square > 0, 2 * depth_m * s / np.sqrt(np.where(square > 0, square, 1.0)), np.inf)


State = tuple[float, float]

RTOL = 1e-10
"""Allowed error per step, relative to depth, speed and time."""

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


class CompressionStep(NamedTuple):
    """A moment of a compression."""

    time_s: float
    indentation_m: float
    speed_m_s: float


class Course(NamedTuple):
    """The motion from touch to separation, as arrays of one length."""

    time_s: Floats
    indentation_m: Floats
    speed_m_s: Floats
    """Speed, positive into the foam."""
    force_n: Floats


def compress(arm: Arm, speed_m_s: float, stiffness: float, rtol: float = RTOL) -> State:
    """(delta_c in m, t_c in s) by :func:`steps`."""
    last = steps(arm, speed_m_s, stiffness, rtol)[-1]
    return last.indentation_m, last.time_s


def steps(arm: Arm, speed_m_s: float, stiffness: float, rtol: float = RTOL) -> list[CompressionStep]:
    """Every accepted step from the touch to the end of the compression."""
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
    found = [CompressionStep(0.0, 0.0, speed)]
    for time, state in _walk(over_time, 0.0, (0.0, speed), length / pace / 50, rtol, (length, pace)):
        if state[1] <= 0:
            break
        found.append(CompressionStep(time, *state))
    last = found[-1]
    # At the start of that step the arm may still be pushed on; only where it is slowed, v can be what time is told by.
    while pull(last.indentation_m) >= -1e-3 * abs(pull(state[0])):
        short = (time - last.time_s) / 8
        state = _one(over_time, last.time_s, (last.indentation_m, last.speed_m_s), short)[0]
        last = CompressionStep(last.time_s + short, *state)
        found.append(last)
    at = last.indentation_m, last.time_s
    left = -last.speed_m_s / pull(last.indentation_m)
    scale = last.indentation_m + left * last.speed_m_s, last.time_s + left
    for slower, (depth, seconds) in _walk(over_speed, last.speed_m_s, at, -last.speed_m_s, rtol, scale, 0.0):
        found.append(CompressionStep(seconds, depth, slower))
    return found


def course(arm: Arm, speed_m_s: float, stiffness: float, depth_m: float, count: int = 64) -> Course:
    """The whole contact in 2 ``count`` + 1 moments by quadrature; compression ends at ``depth_m``.

    The model is lossless, so the way out mirrors the way in.
    """
    not_negative("speed_m_s", speed_m_s, "m/s")
    positive("stiffness", stiffness, "N/m^1.5")
    positive("depth_m", depth_m, "m")
    phi = np.linspace(0, math.pi / 2, count + 1)

    def pace(at: Floats) -> Floats:
        return slowness(arm, speed_m_s, stiffness, depth_m, at)

    parts = [gauss(pace, low, high) for low, high in itertools.pairwise(phi.tolist())]
    if not all(map(math.isfinite, parts)):
        raise CoverError(f"depth_m is {depth_m:g}; the arm does not come so far")
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
    """(x, y) after each accepted step, to ``end`` or forever; the sign of ``step`` is the direction."""
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
