"""Peak force of an arm that runs into a rigid body under a cover whose stop comes late, or never.

With m = J/d^2, the drive's force u and the brake's b, the work W of the cover and the stop at the depth x_r:

    m v^2/2 + u x_r - b (x - x_r) = W(x) where the arm comes to rest, and t(x) = int_0^x dx/v.

Without a stop b = -u. The board on a bed has no mass here.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from contactfpga.design.cover.layers import BODIES
from contactfpga.design.cover.numerics import Floats
from contactfpga.design.cover.press import SOLID, Bed, Cover
from contactfpga.design.cover.task import Task

FORCES_N = np.append(0.0, np.geomspace(1e-3, 1e4, 4000))


class PeakForces(NamedTuple):
    """Peak forces in N; infinite above the last of :data:`FORCES_N`."""

    late: float
    """The drive goes on for the task's latency after the touch, and the brake comes then."""
    no_stop: float
    """The drive never ends."""


def peak_forces(task: Task, cover: Cover, pitch_x_m: float, pitch_y_m: float) -> PeakForces:
    """For the task's arm, speed, radius, latency and brake. Raises CoverError for the cover model ``patch``."""
    rigid, arm = BODIES["rigid"], task.arm
    spring = cover.indentation([rigid.ball(task.radius_m)], rigid, pitch_x_m, pitch_y_m)
    depth: Floats = np.array([spring.depth_m(force) for force in FORCES_N.tolist()])
    if cover.bed:
        depth += _sunk_m(cover.bed, cover.modulus_pa)
    mass, push, brake = arm.inertia_kgm2 / arm.lever_m**2, arm.torque_nm / arm.lever_m, task.brake_nm / arm.lever_m
    means = (FORCES_N[1:] + FORCES_N[:-1]) / 2
    work = np.append(0.0, (np.diff(depth) * means).cumsum())
    left = mass * task.speed_m_s**2 / 2 + push * depth - work
    speed = np.sqrt(2 / mass * np.maximum(left, 0))
    moving = speed[1:] + speed[:-1] > 0
    steps = np.divide(2 * np.diff(depth), speed[1:] + speed[:-1], out=np.full(len(means), math.inf), where=moving)
    reacts = float(np.interp(task.latency_s, np.append(0.0, steps.cumsum()), depth))
    braked = left - (push + brake) * np.maximum(depth - reacts, 0)
    return PeakForces(_at_rest(braked), _at_rest(left))


def _sunk_m(bed: Bed, modulus_pa: float) -> Floats:
    """The inverse of :meth:`Bed.force_n`, at each of :data:`FORCES_N`."""
    over = FORCES_N / (bed.area_m2 * modulus_pa)
    within = np.minimum(over, SOLID / (1 - SOLID))
    return np.asarray(bed.thickness_m * (within / (1 + within) + (over - within) * (1 - SOLID) ** 2))


def _at_rest(left: Floats) -> float:
    """Force at which no energy is left."""
    end = int((left <= 0).argmax())
    if not end:
        return math.inf
    share = left[end - 1] / (left[end - 1] - left[end])
    return float(FORCES_N[end - 1] + share * (FORCES_N[end] - FORCES_N[end - 1]))
