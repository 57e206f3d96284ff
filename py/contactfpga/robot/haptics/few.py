"""One contact in closed form, two with the exact interval of each push.

In plain Python, for numpy takes several times as long for a few numbers. Both correct the wrench to the nearest one
that contacts at these places can exert: a force has no moment about its point, two have none about the line through
both. What is corrected away, over its variance, is chi-square.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from contactfpga.robot.haptics.answer import Floats, Vector
from contactfpga.robot.haptics.contact import PURE_FORCE, Interval, Solution, Touch
from contactfpga.robot.haptics.squeeze import Line, both, least_sideways
from contactfpga.robot.haptics.system import System
from contactfpga.robot.haptics.vectors import cross, dot, minus, solve_symmetric
from contactfpga.robot.haptics.wrench import Wrench

ROUNDING = 1e-9
"""Share of a force that is rounding."""

NONE: Vector = (0.0, 0.0, 0.0)


def one(wrench: Wrench, touch: Touch) -> Solution:
    """The force at one contact: generalized least squares. Friction is not needed to find it."""
    force, chi2 = _at_point(wrench, touch)
    push = -dot(touch.normal, force)
    sideways = math.sqrt(max(0.0, dot(force, force) - push * push))
    inside = push >= 0 and sideways <= touch.friction * push + ROUNDING * (push + 1)
    if push < 0:
        force, push = NONE, 0.0
    return _solution(wrench, [touch], [force], [(push, push)], None, None if push == 0 else chi2, not inside)


def two(wrench: Wrench, touches: Sequence[Touch]) -> Solution:
    """The forces at two contacts: all but a squeeze along the line that joins them is known, and friction bounds that.

    Of what friction allows it takes the forces with the smallest parts along the surface, and where these hang on no
    squeeze the smallest one.
    """
    first, second = touches
    (ax, ay, az), (bx, by, bz) = first.point_m, second.point_m
    away = (ax - bx, ay - by, az - bz)
    length = math.sqrt(dot(away, away))
    along = (away[0] / length, away[1] / length, away[2] / length)
    (fx, fy, fz), (gx, gy, gz), chi2 = _about_line(wrench, touches, along, length)
    lines = (Line((fx, fy, fz), along, first.normal), Line((gx, gy, gz), minus(along), second.normal))
    allowed = both(lines[0].within(first.friction), lines[1].within(second.friction))
    beyond = allowed is None
    if allowed is None:
        allowed = both(lines[0].pushing(), lines[1].pushing())
    if allowed is None:
        return _best_alone(wrench, touches, along)
    squeeze = least_sideways(lines, allowed)
    forces = [lines[0].force(squeeze), lines[1].force(squeeze)]
    return _solution(wrench, touches, forces, [line.pushes(allowed) for line in lines], along, chi2, beyond)


def _at_point(wrench: Wrench, touch: Touch) -> tuple[Vector, float | None]:
    """The force, and chi-square of the moment about the point, which should be 0."""
    force, point = wrench.force_n, touch.point_m
    if wrench.noise is None:
        return force, None
    turned = cross(point, force)
    moment = wrench.moment_nm
    rest = (moment[0] - turned[0], moment[1] - turned[1], moment[2] - turned[2])
    ff, fm, mm = wrench.noise.blocks
    # Rows: covariances of the force's x, y, z, and then of the moment's, with the moment about the point.
    with_rest = [_less(fm[axis], cross(point, ff[axis])) for axis in range(3)]
    half = [_less(mm[axis], cross(point, (fm[0][axis], fm[1][axis], fm[2][axis]))) for axis in range(3)]
    columns = [cross(point, (with_rest[0][axis], with_rest[1][axis], with_rest[2][axis])) for axis in range(3)]
    spread = [[half[row][column] - columns[column][row] for column in range(3)] for row in range(3)]
    if touch.point_sigma_m:
        _widen(spread, touch.point_sigma_m, force)
    share = solve_symmetric(spread, rest)
    corrected = (
        force[0] - dot(with_rest[0], share),
        force[1] - dot(with_rest[1], share),
        force[2] - dot(with_rest[2], share),
    )
    return corrected, dot(rest, share)


def _about_line(
    wrench: Wrench, touches: Sequence[Touch], along: Vector, length: float
) -> tuple[Vector, Vector, float | None]:
    """Both forces without any squeeze, and chi-square of the moment about their line, which should be 0."""
    force, moment = wrench.force_n, wrench.moment_nm
    (ax, ay, az), (bx, by, bz) = touches[0].point_m, touches[1].point_m
    middle = ((ax + bx) / 2, (ay + by) / 2, (az + bz) / 2)
    # u (m - c x f) = u m - (u x c) f
    lever = cross(along, middle)
    rest = dot(along, moment) - dot(lever, force)
    chi2 = None
    if wrench.noise is not None:
        (lx, ly, lz), (ux, uy, uz) = lever, along
        sides = np.array((-lx, -ly, -lz, ux, uy, uz))
        gx, gy, gz, nx, ny, nz = (wrench.noise.covariance @ sides).tolist()
        variance = ux * nx + uy * ny + uz * nz - lx * gx - ly * gy - lz * gz
        if touches[0].point_sigma_m or touches[1].point_sigma_m:
            pair = _split(force, moment, middle, along, length)
            for touch, each in zip(touches, pair):
                side = cross(along, each)
                variance += touch.point_sigma_m**2 * dot(side, side)
        share = rest / variance
        force = (force[0] - share * gx, force[1] - share * gy, force[2] - share * gz)
        moment = (moment[0] - share * nx, moment[1] - share * ny, moment[2] - share * nz)
        chi2 = rest * share
    first, second = _split(force, moment, middle, along, length)
    return first, second, chi2


def _split(force: Vector, moment: Vector, middle: Vector, along: Vector, length: float) -> tuple[Vector, Vector]:
    """Two forces without squeeze: half of the sum each, and what turns about the middle."""
    turned = cross(middle, force)
    turns = cross((moment[0] - turned[0], moment[1] - turned[1], moment[2] - turned[2]), along)
    x, y, z = turns[0] / length, turns[1] / length, turns[2] / length
    fx, fy, fz = force[0] / 2, force[1] / 2, force[2] / 2
    return (fx + x, fy + y, fz + z), (fx - x, fy - y, fz - z)


def _widen(spread: list[list[float]], sigma: float, force: Vector) -> None:
    """What an uncertain point does to the moment about it: sigma^2 (|f|^2 - f f^T)."""
    square = dot(force, force)
    for row in range(3):
        spread[row][row] += sigma * sigma * square
        for column in range(3):
            spread[row][column] -= sigma * sigma * force[row] * force[column]


def _best_alone(wrench: Wrench, touches: Sequence[Touch], along: Vector) -> Solution:
    """Where two contacts would have to pull: the one of them that alone comes nearer to the wrench."""
    alone = [one(wrench, touch) for touch in touches]
    scores = [_misfit(each, touch) for each, touch in zip(alone, touches)]
    best = 0 if scores[0] <= scores[1] else 1
    forces = [NONE, NONE]
    forces[best] = alone[best].forces_n[0]
    intervals: list[Interval] = [(0.0, 0.0), (0.0, 0.0)]
    intervals[best] = alone[best].intervals()[0]
    return _solution(wrench, touches, forces, intervals, along, None, True)


def _misfit(found: Solution, touch: Touch) -> tuple[bool, float]:
    """Order of preference among contacts that are alone: those that push, those that explain most."""
    rest = found.residual
    about = np.array(rest[3:]) - np.cross(touch.point_m, rest[:3])
    return found.forces_n[0] == NONE, found.chi2 if found.chi2 is not None else float(about @ about)


def _solution(
    wrench: Wrench,
    touches: Sequence[Touch],
    forces: list[Vector],
    intervals: list[Interval],
    along: Vector | None,
    chi2: float | None,
    beyond: bool,
) -> Solution:
    """``chi2``: None where the forces are not the best ones without friction; then it is computed from the residual."""
    half = math.sqrt(0.5)
    null = [] if along is None else [[half * one for one in along] + [-half * one for one in along]]
    rank = 3 if along is None else 5
    noise = wrench.noise
    if noise is not None and chi2 is None:
        chi2 = _chi2(wrench, touches, forces)
    freedom = (6 if noise is None else noise.rank) - rank
    covariance = _covariance(wrench, touches, forces)
    return Solution(
        PURE_FORCE, forces, lambda: intervals, rank, null, chi2, freedom, touches, wrench, covariance, beyond
    )


def _chi2(wrench: Wrench, touches: Sequence[Touch], forces: list[Vector]) -> float | None:
    system = System(wrench, touches)
    system.places_widen(np.ravel(forces))
    rest = system.wrench - system.matrix() @ np.ravel(forces)
    return system.chi2(rest)


def _covariance(wrench: Wrench, touches: Sequence[Touch], forces: list[Vector]) -> Callable[[], Floats | None]:
    def found() -> Floats | None:
        if wrench.noise is None:
            return None
        system = System(wrench, touches)
        system.places_widen(np.ravel(forces))
        matrix = system.matrix()
        return np.asarray(np.linalg.pinv(matrix.T @ system.weight @ matrix, rcond=1e-12, hermitian=True))

    return found


def _less(first: Vector, second: Vector) -> Vector:
    return first[0] - second[0], first[1] - second[1], first[2] - second[2]
