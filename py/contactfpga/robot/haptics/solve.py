"""From a wrench and touched places to contacts, by the simplest sufficient model.

One and two contacts are solved in plain Python, faster than numpy for a few numbers. The wrench is corrected to the
nearest that they can exert: a force has no moment about its point, two have none about their line.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence

import numpy as np

from contactfpga.robot.haptics.contact import (
    FULL_WRENCH,
    PURE_FORCE,
    AloneWatch,
    Contacts,
    Context,
    Interval,
    Solution,
    Touch,
)
from contactfpga.robot.haptics.system import (
    System,
    along_normals,
    by_least_squares,
    distinct,
    intervals_of,
    within_cones,
)
from contactfpga.robot.haptics.values import HapticsError, cross, dot, minus, solve_symmetric
from contactfpga.robot.haptics.wrench import Surface, Wrench
from contactfpga.surfaces.shapes import Floats, Vector
from contactfpga.tracking.tracks import Tracks
from contactfpga.zones.zone import Zones


def contacts(
    wrench: Wrench,
    zones: Zones | Sequence[Touch],
    surface: Surface | None = None,
    friction: float = 0.5,
    *,
    cones: bool = False,
    sheet_m: tuple[float, float] = (0.0, 0.0),
    link: str = "",
    tracks: Tracks | None = None,
    alone: AloneWatch | None = None,
) -> Contacts:
    """The force at each zone, or at each place in a list of :class:`Touch`; no contact ever pulls.

    One contact has a closed form, two also the exact interval of each push. More have pushes along the normals if these
    suffice, else forces in pyramids within friction's cones, by non-negative least squares (extra `haptics`); with
    ``cones``, in the cones themselves, by Clarabel. If units do not see all six components of the wrench, or friction
    is 0, there are only pushes along the normals. Without a zone there is the center of pressure on ``surface``.

    Args:
        surface: the bumper's outside, for the zones' places.
        friction: of zones; a :class:`Touch` has its own.
        sheet_m: position of column 0 and row 0 on the surface laid flat.
        link: name of the link; default: the wrench's frame.
        tracks: of the same zones, for :attr:`Contact.track`.
        alone: places of contacts from when they were alone; it has already read this frame.
    """
    if isinstance(zones, Zones):
        touches: Sequence[Touch] = touched(zones, surface, friction, sheet_m)
        touches = touches if alone is None else alone.sharpened(zones, touches)
        context = Context(link, zones.time_us, () if tracks is None else _tracked(zones, tracks))
    else:
        touches, context = zones, Context(link)
    if not touches:
        return Contacts(wrench, (), _nothing(wrench), None if surface is None else surface.center(wrench), context)
    if len(touches) > 1:
        distinct(touches)
    return Contacts(wrench, touches, _chosen(wrench, touches, cones), context=context)


def _tracked(zones: Zones, tracks: Tracks) -> list[int | None]:
    names = {id(track.zone): track.id for track in tracks.active}
    return [names.get(id(zone)) for zone in zones if zone.point_mm is not None]


def _chosen(wrench: Wrench, touches: Sequence[Touch], cones: bool) -> Solution:
    rough = [touch.friction > 0 for touch in touches]
    sees_all = wrench.noise is None or wrench.noise.rank == 6
    if not sees_all or not any(rough):
        return along_normals(System(wrench, touches))
    if cones:
        return within_cones(System(wrench, touches))
    if len(touches) == 1:
        return _one(wrench, touches[0])
    if len(touches) == 2 and all(rough):
        return _two(wrench, touches)
    return by_least_squares(System(wrench, touches))


def _nothing(wrench: Wrench) -> Solution:
    rest, noise = wrench.array, wrench.noise
    chi2 = None if noise is None else float(rest @ noise.information @ rest)
    return Solution(FULL_WRENCH, [], list, 0, [], chi2, 6 if noise is None else noise.rank, (), wrench, lambda: None)


def touched(
    zones: Zones, surface: Surface | None, friction: float = 0.5, sheet_m: tuple[float, float] = (0.0, 0.0)
) -> list[Touch]:
    """The zones as places on the bumper's outside, with a barycenter's error of a pitch over the root of 12;
    :class:`~contactfpga.robot.haptics.Locator` is more precise."""
    if surface is None:
        raise HapticsError("surface is missing; contacts() needs the bumper's outside to place zones on it")
    pitch_mm = math.hypot(zones.sheet.pitch_x_mm, zones.sheet.pitch_y_mm) / math.sqrt(2)
    sigma = 1e-3 * pitch_mm / math.sqrt(12)
    found = []
    for zone in zones:
        if zone.winding:
            name = "a ring" if zone.winding == "ring" else zone.winding
            raise HapticsError(
                f"a zone at y {zone.y_mm:.1f} mm is {name}: it pushes as well, at no known place around the sheet, so "
                "that the forces at the others are not known either"
            )
        if zone.point_mm is not None:
            x, y, z = zone.point_mm
            along, across = surface.flat((1e-3 * x, 1e-3 * y, 1e-3 * z))
            point, normal = surface.place(along + sheet_m[0], across + sheet_m[1])
            found.append(Touch(point, normal, friction, sigma))
    return found


ROUNDING = 1e-9

NONE: Vector = (0.0, 0.0, 0.0)


def _one(wrench: Wrench, touch: Touch) -> Solution:
    force, chi2 = _at_point(wrench, touch)
    push = -dot(touch.normal, force)
    sideways = math.sqrt(max(0.0, dot(force, force) - push * push))
    inside = push >= 0 and sideways <= touch.friction * push + ROUNDING * (push + 1)
    if push < 0:
        force, push = NONE, 0.0
    return _solution(wrench, [touch], [force], [(push, push)], None, None if push == 0 else chi2, not inside)


def _two(wrench: Wrench, touches: Sequence[Touch]) -> Solution:
    """Forces at two contacts, determined up to a squeeze along their line, which friction bounds; the smallest forces
    along the surface count, else the smallest squeeze."""
    first, second = touches
    (ax, ay, az), (bx, by, bz) = first.point_m, second.point_m
    away = (ax - bx, ay - by, az - bz)
    length = math.sqrt(dot(away, away))
    along = (away[0] / length, away[1] / length, away[2] / length)
    (fx, fy, fz), (gx, gy, gz), chi2 = _about_line(wrench, touches, along, length)
    lines = (_Line((fx, fy, fz), along, first.normal), _Line((gx, gy, gz), minus(along), second.normal))
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
    """Force, and chi-square of the moment about the point, ideally 0."""
    force, point = wrench.force_n, touch.point_m
    if wrench.noise is None:
        return force, None
    exerted = cross(point, force)
    moment = wrench.moment_nm
    rest = (moment[0] - exerted[0], moment[1] - exerted[1], moment[2] - exerted[2])
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
    """Both forces without squeeze, and chi-square of the moment about their line, ideally 0."""
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
    """Two forces without squeeze: half of the sum each, plus a couple about the middle."""
    exerted = cross(middle, force)
    couple = cross((moment[0] - exerted[0], moment[1] - exerted[1], moment[2] - exerted[2]), along)
    x, y, z = couple[0] / length, couple[1] / length, couple[2] / length
    fx, fy, fz = force[0] / 2, force[1] / 2, force[2] / 2
    return (fx + x, fy + y, fz + z), (fx - x, fy - y, fz - z)


def _widen(spread: list[list[float]], sigma: float, force: Vector) -> None:
    """Add the effect of an uncertain point on the moment about it: sigma^2 (|f|^2 - f f^T)."""
    square = dot(force, force)
    for row in range(3):
        spread[row][row] += sigma * sigma * square
        for column in range(3):
            spread[row][column] -= sigma * sigma * force[row] * force[column]


def _best_alone(wrench: Wrench, touches: Sequence[Touch], along: Vector) -> Solution:
    """The contact that alone fits the wrench better, if two would have to pull."""
    alone = [_one(wrench, touch) for touch in touches]
    scores = [_misfit(each, touch) for each, touch in zip(alone, touches)]
    best = 0 if scores[0] <= scores[1] else 1
    forces = [NONE, NONE]
    forces[best] = alone[best].forces_n[0]
    intervals: list[Interval] = [(0.0, 0.0), (0.0, 0.0)]
    intervals[best] = alone[best].intervals()[0]
    return _solution(wrench, touches, forces, intervals, along, None, True)


def _misfit(found: Solution, touch: Touch) -> tuple[bool, float]:
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
    half = math.sqrt(0.5)
    null = [] if along is None else [[half * one for one in along] + [-half * one for one in along]]
    rank = 3 if along is None else 5
    noise = wrench.noise
    if noise is not None and chi2 is None:
        chi2 = _chi2(wrench, touches, forces)
    freedom = (6 if noise is None else noise.rank) - rank
    covariance = _covariance(wrench, touches, forces)

    def with_noise() -> list[Interval]:
        return intervals if noise is None else intervals_of(_widened(wrench, touches, forces), forces, False, beyond)

    return Solution(PURE_FORCE, forces, with_noise, rank, null, chi2, freedom, touches, wrench, covariance, beyond)


def _widened(wrench: Wrench, touches: Sequence[Touch], forces: list[Vector]) -> System:
    system = System(wrench, touches)
    system.places_widen(np.ravel(forces))
    return system


def _chi2(wrench: Wrench, touches: Sequence[Touch], forces: list[Vector]) -> float | None:
    system = _widened(wrench, touches, forces)
    rest = system.wrench - system.matrix() @ np.ravel(forces)
    return system.chi2(rest)


def _covariance(wrench: Wrench, touches: Sequence[Touch], forces: list[Vector]) -> Callable[[], Floats | None]:
    def found() -> Floats | None:
        if wrench.noise is None:
            return None
        system = _widened(wrench, touches, forces)
        matrix = system.matrix()
        return np.asarray(np.linalg.pinv(matrix.T @ system.weight @ matrix, rcond=1e-12, hermitian=True))

    return found


def _less(first: Vector, second: Vector) -> Vector:
    return first[0] - second[0], first[1] - second[1], first[2] - second[2]


Range = tuple[float, float]
"""Range of the squeeze in N, possibly infinite."""


@dataclasses.dataclass(slots=True)
class _Line:
    """The forces at one of two contacts: ``start`` plus any squeeze times ``along``."""

    start: Vector
    along: Vector
    normal: Vector
    push: float = 0.0
    more: float = 0.0

    def __post_init__(self) -> None:
        self.push, self.more = -dot(self.normal, self.start), -dot(self.normal, self.along)

    def force(self, squeeze: float) -> Vector:
        (x, y, z), (ax, ay, az) = self.start, self.along
        return x + squeeze * ax, y + squeeze * ay, z + squeeze * az

    def pushes(self, allowed: Range) -> Interval:
        push, more = self.push, self.more
        if abs(more) <= ROUNDING:
            push = max(0.0, push)
            return push, push
        first, second = push + more * allowed[0], push + more * allowed[1]
        least, largest = (first, second) if first < second else (second, first)
        return max(0.0, least), None if largest == math.inf else max(0.0, largest)

    def pushing(self) -> Range | None:
        if abs(self.more) <= ROUNDING:
            return (-math.inf, math.inf) if self.push >= 0 else None
        start = -self.push / self.more
        return (start, math.inf) if self.more > 0 else (-math.inf, start)

    def within(self, friction: float) -> Range | None:
        """Squeezes with the force in friction's cone: |f|^2 <= (1 + mu^2) push^2, a quadratic."""
        wide = 1 + friction * friction
        square = 1 - wide * self.more * self.more
        slope = dot(self.start, self.along) - wide * self.push * self.more
        level = dot(self.start, self.start) - wide * self.push * self.push
        if abs(square) <= ROUNDING:  # the line runs along the cone
            return both(self.pushing(), _below(2 * slope, level))
        under = slope * slope - square * level
        if under < 0:
            if under < -ROUNDING * (slope * slope + abs(square * level)):
                return None
            under = 0.0
        root = math.sqrt(under)
        low, high = sorted(((-slope - root) / square, (-slope + root) / square))
        if square < 0:
            return (high, math.inf) if self.more > 0 else (-math.inf, low)
        middle = self.push - self.more * slope / square
        return (low, high) if middle >= -ROUNDING * abs(self.push) else None


def _below(slope: float, level: float) -> Range | None:
    if abs(slope) <= ROUNDING:
        return (-math.inf, math.inf) if level <= ROUNDING else None
    end = -level / slope
    return (-math.inf, end) if slope > 0 else (end, math.inf)


def both(first: Range | None, second: Range | None) -> Range | None:
    """Common part of two ranges; a gap of rounding counts as a common point."""
    if first is None or second is None:
        return None
    low, high = max(first[0], second[0]), min(first[1], second[1])
    if low <= high:
        return low, high
    if low - high <= ROUNDING * (abs(low) + abs(high)):
        return (low + high) / 2, (low + high) / 2
    return None


def least_sideways(lines: Sequence[_Line], allowed: Range) -> float:
    """The squeeze with the smallest squared parts along the surface; if these are constant, the smallest squeeze."""
    curve = slope = 0.0
    for line in lines:
        curve += 1 - line.more * line.more
        slope += dot(line.start, line.along) - line.push * line.more
    if curve > ROUNDING:
        return min(max(-slope / curve, allowed[0]), allowed[1])
    low, high = allowed
    return low if lines[0].more + lines[1].more > 0 else high
