"""From a wrench and touched places to contacts, by the simplest sufficient model."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from contactfpga.robot.haptics.cones import KNOWN, Cones
from contactfpga.robot.haptics.contact import (
    FULL_WRENCH,
    PURE_FORCE,
    PURE_FORCE_WITH_KNOWN_DIRECTION,
    AloneWatch,
    Contacts,
    Context,
    Interval,
    Solution,
    Touch,
)
from contactfpga.robot.haptics.values import HapticsError, cross, dot, minus, skew
from contactfpga.robot.haptics.wrench import ALARM, Noise, Surface, Wrench
from contactfpga.surfaces.shapes import Floats, Vector, vector
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

    Forces lie within friction's cones and have the smallest parts along the surface that exert the wrench; where
    friction does not allow for it (:attr:`Contacts.beyond_friction`), they are of any size. Three contacts or more have
    pushes along the normals if these suffice, and all contacts if units do not see all six components of the wrench, or
    friction is 0. Without a zone there is the center of pressure on ``surface``.

    Args:
        cones: forces within friction's cones also where pushes along the normals suffice.
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
    sees_all = wrench.noise is None or wrench.noise.rank == 6
    if not sees_all or not any(touch.friction for touch in touches):
        return _Frame(wrench, touches, known=True).solution()
    closed = _one(wrench, touches[0]) if len(touches) == 1 else _two(wrench, touches) if len(touches) == 2 else None
    if closed is not None:
        forces, null, chi2, beyond = closed
        rank = 3 if len(touches) == 1 else 5
        late = (lambda: _Frame(wrench, touches).intervals()), (lambda: _Frame(wrench, touches).covariance())
        return Solution(PURE_FORCE, forces, late[0], rank, null, chi2, 6 - rank, touches, wrench, late[1], beyond)
    if len(touches) > 2 and not cones:
        pushes = _Frame(wrench, touches, known=True)
        if pushes.suffice:
            return pushes.solution()
    return _Frame(wrench, touches).solution()


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


SAME_M = 1e-9
"""Distance below which points are identical."""

SMALL = 1e-6
"""Share of the wrench that pushes alone may leave unexplained without noise."""

EXACT = 1e-9
"""Share of the wrench that counts as its noise where none is given, and its least size in N."""


def distinct(touches: Sequence[Touch]) -> None:
    """Raise :class:`HapticsError` for two touches at one place, whose forces are indistinguishable."""
    for last, one in enumerate(touches):
        for first in range(last):
            if math.dist(one.point_m, touches[first].point_m) < SAME_M:
                raise HapticsError(f"contacts {first} and {last} both lie at {one.point_m}; give one of them")


Closed = tuple[list[Vector], list[list[float]], float | None, bool]
"""Forces, null space, chi-square, and whether they are beyond friction."""


def _one(wrench: Wrench, touch: Touch) -> Closed | None:
    """The closed form of one contact, of any friction; None if it pulls."""
    force, chi2 = _at_point(wrench, touch)
    push = -dot(touch.normal, force)
    beyond = not _within(touch, force, push)
    return None if push < 0 else ([force], [], chi2, beyond)


def _two(wrench: Wrench, touches: Sequence[Touch]) -> Closed | None:
    """The closed form of two contacts, at the squeeze with the smallest parts along the surface; None if that lies
    beyond friction."""
    (ax, ay, az), (bx, by, bz) = (touch.point_m for touch in touches)
    length = math.dist(touches[0].point_m, touches[1].point_m)
    along = (ax - bx) / length, (ay - by) / length, (az - bz) / length
    middle = (ax + bx) / 2, (ay + by) / 2, (az + bz) / 2
    split = _split(wrench.force_n, wrench.moment_nm, middle, along, length)
    force, moment, chi2 = _about_line(wrench, along, middle, touches, split)
    forces, curve, slope = _split(force, moment, middle, along, length), 0.0, 0.0
    for touch, one, sign in zip(touches, forces, (1, -1)):
        more = sign * dot(touch.normal, along)
        curve += 1 - more * more
        slope += sign * dot(one, along) - dot(touch.normal, one) * more
    if curve < KNOWN:
        return None
    forces = [_plus(one, sign * slope / curve, along) for one, sign in zip(forces, (-1, 1))]
    if not all(_within(touch, one, -dot(touch.normal, one)) for touch, one in zip(touches, forces)):
        return None
    half = math.sqrt(0.5)
    null = [[*(half * one for one in along), *(-half * one for one in along)]]
    return forces, null, chi2, False


def _at_point(wrench: Wrench, touch: Touch) -> tuple[Vector, float | None]:
    """The force nearest to the wrench's that has no moment about the touch's point, and its distance in squares of
    noise, to which the uncertain point adds about as with the wrench's force.

    Numbers so few are faster in plain Python than in numpy.
    """
    force, (x, y, z) = wrench.force_n, touch.point_m
    if wrench.noise is None:
        return force, None
    sides = np.array((0.0, z, -y, 1.0, 0.0, 0.0, -z, 0.0, x, 0.0, 1.0, 0.0, y, -x, 0.0, 0.0, 0.0, 1.0)).reshape(3, 6)
    both = sides @ wrench.noise.covariance
    (a, b, c), (_, d, e), (_, _, f) = (both @ sides.T).tolist()
    u, v, w = (touch.point_sigma_m * part for part in force)
    a, b, c, d, e, f = a + v * v + w * w, b - u * v, c - u * w, d + u * u + w * w, e - v * w, f + u * u + v * v
    first, second, third = d * f - e * e, c * e - b * f, b * e - c * d  # of the adjugate
    mixed = b * c - a * e
    adjugate = (first, second, third), (second, a * f - c * c, mixed), (third, mixed, a * d - b * b)
    rest = _plus(wrench.moment_nm, -1.0, cross(touch.point_m, force))
    over = 1 / (a * first + b * second + c * third)
    shares = [over * dot(row, rest) for row in adjugate]
    for share, row in zip(shares, both.tolist()):
        force = _plus(force, -share, row)
    return force, dot(rest, shares)


def _about_line(
    wrench: Wrench, axis: Vector, point: Vector, touches: Sequence[Touch], forces: Sequence[Vector]
) -> tuple[Vector, Vector, float | None]:
    """Force and moment nearest to the wrench's that have no moment about the axis through a point, and their distance
    in squares of noise, to which the touches' uncertain points add about as with these forces."""
    force, moment = wrench.force_n, wrench.moment_nm
    if wrench.noise is None:
        return force, moment, None
    lever = cross(point, axis)
    side, rest = np.array((*lever, *axis)), dot(lever, force) + dot(axis, moment)
    both = wrench.noise.covariance @ side
    spread = float(both @ side)
    for touch, one in zip(touches, forces):
        moved = cross(axis, one)
        spread += touch.point_sigma_m**2 * dot(moved, moved)
    share, row = rest / spread, both.tolist()
    return _plus(force, -share, row), _plus(moment, -share, row[3:]), rest * share


def _split(force: Vector, moment: Vector, middle: Vector, along: Vector, length: float) -> list[Vector]:
    """Two forces without squeeze: half of the sum each, plus a couple about the middle."""
    couple = cross(_plus(moment, -1.0, cross(middle, force)), along)
    half = force[0] / 2, force[1] / 2, force[2] / 2
    return [_plus(half, 1 / length, couple), _plus(half, -1 / length, couple)]


def _plus(first: Sequence[float], share: float, second: Sequence[float]) -> Vector:
    return first[0] + share * second[0], first[1] + share * second[1], first[2] + share * second[2]


def _within(touch: Touch, force: Vector, push: float) -> bool:
    sideways = math.sqrt(max(0.0, dot(force, force) - push * push))
    return push >= 0 and sideways <= touch.friction * push + KNOWN * (push + 1)


class _Frame:
    """Forces at the contacts of one frame that explain its wrench.

    ``known``: all are along the normals.
    """

    def __init__(self, wrench: Wrench, touches: Sequence[Touch], known: bool = False):
        self._wrench, self._touches, self._known = wrench, touches, known
        self._axes = [_axes(touch.normal) for touch in touches]
        columns = [(*axis, *cross(touch.point_m, axis)) for touch, axes in zip(touches, self._axes) for axis in axes]
        self._matrix = np.array(columns).T  # (6, 3k)
        self._frictions = [0.0 if known else touch.friction for touch in touches]
        root = _exact(wrench, touches) if wrench.noise is None else self._widened(wrench.noise).root
        self._cones = Cones(root @ self._matrix, root @ wrench.array, self._frictions)
        self._sizes, self._beyond = self._cones.nearest()
        self._forces = self._turned(self._sizes)

    def _widened(self, noise: Noise) -> Noise:
        """The noise with that of uncertain places, at the smallest forces that fit."""
        if not any(touch.point_sigma_m for touch in self._touches):
            return noise
        matrix = np.where(np.arange(self._matrix.shape[1]) % 3 * self._known, 0.0, noise.root @ self._matrix)
        sizes = np.asarray(np.linalg.lstsq(matrix, noise.root @ self._wrench.array, rcond=KNOWN)[0], float)
        turns = [touch.point_sigma_m * skew(force) for touch, force in zip(self._touches, self._turned(sizes))]
        return noise.widened(np.asarray(sum(turn @ turn.T for turn in turns)))

    def _turned(self, sizes: Floats) -> list[Vector]:
        """Forces in the link's frame."""
        return [vector(force) for force in np.einsum("ki,kij->kj", sizes.reshape(-1, 3), np.array(self._axes))]

    @property
    def _freedom(self) -> int:
        return max(0, (6 if self._wrench.noise is None else self._wrench.noise.rank) - self._cones.rank)

    @property
    def suffice(self) -> bool:
        """Whether the forces exert the wrench to within its noise."""
        off = self._cones.misfit(self._sizes)
        if self._wrench.noise is None:
            return off <= (SMALL / EXACT) ** 2
        return self._freedom == 0 or off <= ALARM[self._freedom - 1]

    def intervals(self) -> list[Interval]:
        noise = self._wrench.noise
        sees_all = noise is None or noise.rank == 6
        frictions = [touch.friction if sees_all else 0.0 for touch in self._touches]
        ranges = self._cones.ranges(self._sizes, frictions, self._beyond, noise is None)
        pushes = [-dot(touch.normal, force) for touch, force in zip(self._touches, self._forces)]
        return [
            (max(0.0, min(push, low)), None if high is None else max(0.0, push, high))
            for push, (low, high) in zip(pushes, ranges)
        ]

    def _in_link(self, forces: Floats) -> Floats:
        """(n, 3k) forces from the contacts' axes to the link's frame."""
        return (np.array(self._axes).transpose(0, 2, 1) @ forces.reshape(-1, len(self._axes), 3, 1)).reshape(
            forces.shape
        )

    def covariance(self) -> Floats | None:
        root = self._in_link(self._cones.root.T)
        return None if self._wrench.noise is None else root.T @ root

    def solution(self) -> Solution:
        cones = self._cones
        null = cones.null[:, ::3] if self._known else self._in_link(cones.null)
        model = PURE_FORCE_WITH_KNOWN_DIRECTION if self._known else PURE_FORCE
        chi2 = None if self._wrench.noise is None else cones.misfit(self._sizes)
        given = (self._touches, self._wrench, self.covariance, self._beyond)
        return Solution(model, self._forces, self.intervals, cones.rank, null.tolist(), chi2, self._freedom, *given)


def _exact(wrench: Wrench, touches: Sequence[Touch]) -> Floats:
    """(6, 6) from a wrench without noise to standard deviations: a newton counts as much as a newton times the
    contacts' mean distance from their barycenter, so that forces depend on neither frame nor unit."""
    points = np.array([touch.point_m for touch in touches])
    middle = points.mean(axis=0)
    length = math.sqrt(float(np.square(points - middle).sum()) / len(points))
    root = np.eye(6)
    root[3:, :3] = -skew(middle.tolist())
    root[3:] /= length if length > SAME_M else 1.0
    return np.asarray(root / (EXACT * max(EXACT, float(np.linalg.norm(root @ wrench.array)))))


def _axes(normal: Vector) -> tuple[Vector, Vector, Vector]:
    """Unit vectors inward and, two, along the surface."""
    x, y, z = (abs(part) for part in normal)
    least = (1.0, 0.0, 0.0) if x <= min(y, z) else (0.0, 1.0, 0.0) if y <= z else (0.0, 0.0, 1.0)
    first = cross(minus(normal), least)
    length = math.hypot(*first)
    first = first[0] / length, first[1] / length, first[2] / length
    return minus(normal), first, cross(minus(normal), first)
