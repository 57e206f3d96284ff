"""Contact surfaces: the convex polygon on the link that holds the contact of a zone, and what presses there.

What is held is the *firm* contact: every square on the sheet, one pitch wide and along the lines, in which the pressure
is everywhere at least :data:`FIRM_PA`, and all such squares that are joined by moving one into the other. A square
covers a quarter of some cell or more. If that quarter closes the cell, then joined squares close the cells of one zone,
with either connectivity. A square lies beyond these cells by at most the depth ``d`` to which it may press half the
side of a cell without closing it; d = 2 f/(p pitch) for tiles that close at the force f. So the polygon is the hull of
the cells, grown by d in x and y. Contact that presses less, contact on masked or broken cells, and cells that closed or
opened while the sheet was scanned are not held.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from contactfpga import surfaces
from contactfpga.design.cover import Cells, Cover, Load, Rectangle
from contactfpga.robot import haptics
from contactfpga.robot.body import polygons
from contactfpga.robot.body.kinematics import Pose
from contactfpga.robot.body.polygons import Point
from contactfpga.robot.body.state import BodyError
from contactfpga.skin.sheet import Sheet
from contactfpga.surfaces import Surface
from contactfpga.surfaces.shapes import Floats, Vector
from contactfpga.zones.zone import Zone, Zones

FIRM_PA = 100e3
"""Pressure from which contact is held: 1 bar, or 10 N on a square centimeter."""

ONE, BOTH = 1.959963984540054, 2.236477
"""Standard deviations that hold 95 % of one normal number, and of two independent ones at once."""


@dataclasses.dataclass(frozen=True, eq=False)
class Support:
    """The contact surface of one zone, and what presses there."""

    zone: Zone
    link: str
    """Name of the link in `robot.toml`."""
    frame: str
    """Frame of all points and directions: ``base``, or the link's."""
    corners_m: Floats
    """(n, 3): the outline of the polygon, with a point per pitch where the surface is curved."""
    area_m2: float
    """Area of the polygon on the sheet laid flat."""
    region_m: Floats
    """(k, 3): the outline of where the center of pressure lies. It is ``corners_m``, or the part of it that the
    pressure units leave (95 %) if the zone is the only one."""
    normals: Floats
    """(k, 3): outward unit normals at ``region_m``."""
    center_m: Floats
    """(3,): the estimated center of pressure: by the pressure units if the zone is the only one, else the barycenter of
    the cells."""
    touched_m: Floats
    """(j, 3): hull of the middles of the pressed cells, all of which are touched; (0, 3) if only the extent was sent,
    or if the cover passes force on to cells that are not touched."""
    cell_m: float
    """Half the diagonal of a cell, from which its middle may be out of touch."""
    doubts: tuple[str, ...]
    """Reasons why the polygon may hold more or less than one contact; () if there is none."""
    felt: haptics.Contact | None = dataclasses.field(default=None, repr=False)
    """The force in the link's frame; None without pressure units, before their readings arrive, or while one of them is
    at its limit."""
    _pose: Pose | None = dataclasses.field(default=None, repr=False)
    _alone: haptics.Wrench | None = dataclasses.field(default=None, repr=False)

    @property
    def force_n(self) -> Floats | None:
        """(3,): force on the link; None as :attr:`felt`."""
        if self.felt is None or self.felt.force_n is None:
            return None
        force = np.array(self.felt.force_n)
        return force if self._pose is None else self._pose.turn(force)

    @property
    def wrench_interval(self) -> Floats | None:
        """(6, 2): least and largest component of the wrench on the link, in N and Nm about the frame's origin; None as
        :attr:`felt`.

        A single zone has the wrench of all that presses on the link, each component of which is within its interval in
        95 of 100 cases, by the noise of the units; :attr:`doubts` say if that may be more than this zone. With several
        zones it is all that the push in its interval, any friction within the cone and a center of pressure in
        :attr:`region_m` exert, which holds more often: the units measure one wrench and not how the zones share it.
        """
        if self.felt is None:
            return None
        if self._alone is not None and self._alone.covariance is not None:
            turn = _adjoint(self._pose)
            middle, spread = turn @ self._alone.array, turn @ self._alone.covariance @ turn.T
            return np.asarray(middle[:, None] + ONE * np.sqrt(np.diag(spread))[:, None] * [-1, 1])
        least, most = self.felt.interval_n or (0.0, None)
        ways = np.eye(3)[:, None]
        parts = np.concatenate([np.broadcast_to(ways, (3, *self.region_m.shape)), np.cross(ways, self.region_m)])
        along = -(parts * self.normals).sum(axis=2)
        aside = self.felt.touch.friction * np.linalg.norm(parts + along[..., None] * self.normals, axis=2)
        found = np.stack([along - aside, along + aside], axis=2)
        pushes = np.array([least, 1e300 if most is None else most])
        ends = (found[..., None] * pushes).reshape(6, -1)
        ends = np.where(np.abs(ends) > 1e200, np.copysign(math.inf, ends), ends)
        return np.stack([ends.min(axis=1), ends.max(axis=1)], axis=1)

    def moved(self, pose: Pose, frame: str) -> Support:
        """The support in an outer frame in which its own, the link's, has this ``pose``."""
        return dataclasses.replace(
            self,
            frame=frame,
            corners_m=pose.apply(self.corners_m),
            region_m=pose.apply(self.region_m),
            normals=pose.turn(self.normals),
            center_m=pose.apply(self.center_m),
            touched_m=pose.apply(self.touched_m),
            _pose=pose,
        )


def _adjoint(pose: Pose | None) -> Floats:
    """(6, 6): wrenches of the inner frame in the outer one."""
    if pose is None:
        return np.eye(6)
    found = np.kron(np.eye(2), pose.rotation)
    found[3:, :3] = np.cross(pose.point_m, pose.rotation.T).T
    return np.asarray(found)


def margin_m(supports: Sequence[Support], point_m: Vector | Floats, up: Vector = (0.0, 0.0, 1.0)) -> Point:
    """Least and largest distance of a point, such as the center of mass, from the edge of the support polygon: the
    convex hull of these supports' contacts, seen along ``up``. A distance below 0 is outside.

    The largest is that to the hull of the polygons. The least is that to what is left of the hull if each pressed cell
    is touched at its far corner alone; -inf without :attr:`Support.touched_m`. Raises :class:`BodyError` without
    supports: an empty list is no contact, and no data raises before.
    """
    if not supports:
        raise BodyError("there is no support, so there is no margin")
    high = np.array(up) / np.linalg.norm(up)
    aside = np.cross(high, np.eye(3)[np.abs(high).argmin()])
    plane = np.stack([aside, np.cross(high, aside)]) / np.linalg.norm(aside)
    x, y = (plane @ np.array(point_m)).tolist()

    def to_edge(points: list[Floats]) -> float:
        return polygons.depth(polygons.hull((u, v) for u, v in (np.concatenate(points) @ plane.T).tolist()), (x, y))

    known = all(len(one.touched_m) for one in supports)
    least = to_edge([one.touched_m for one in supports]) - max(one.cell_m for one in supports) if known else -math.inf
    return least, to_edge([one.corners_m for one in supports])


def overhang_m(cover: Cover | None, pitch_x_m: float, pitch_y_m: float, firm_pa: float = FIRM_PA) -> Point:
    """The depths in x and y by which firm contact may lie beyond the cells of its zone. Raises :class:`BodyError` if
    contact of this pressure may close no cell.

    On a bare sheet (None, or ``patch``) a cell closes if its middle is covered: half a pitch, at any pressure.
    """
    if cover is None or (cover.model == "patch" and cover.share is None):
        return pitch_x_m / 2, pitch_y_m / 2
    half = pitch_x_m / 2, pitch_y_m / 2
    hardest_n = cover.switch.force_n * (1 + 3 * cover.switch.spread) - cover.switch.preload_n
    if cover.cut:
        found = hardest_n / firm_pa / half[1], hardest_n / firm_pa / half[0]
    else:
        found = _by_model(cover, half, hardest_n, firm_pa)
    if found[0] > half[0] or found[1] > half[1]:
        raise BodyError(
            f"a contact of {firm_pa / 1e3:g} kPa on a quarter of a cell may not close it, so nothing holds it; "
            "take a larger firm_pa, lighter switches or a wider pitch"
        )
    return found


def _by_model(cover: Cover, half: Point, hardest_n: float, firm_pa: float) -> Point:
    """How far firm contact lies beyond its cells along x and y: by the model of the cover, and one step of its grid.

    More than half a pitch means that firm contact may leave all cells open.
    """
    cells = Cells(cover, 5, 5, 2 * half[0], 2 * half[1])

    def most(axis: int) -> float:
        low, high = 0.0, half[axis]
        for _ in range(12):
            middle = (low + high) / 2
            x, y = (
                5 * each - (middle if number == axis else each) + each for number, each in enumerate(half)
            )  # the far edges of cell (2, 2) are five half pitches from (0, 0)
            square = Rectangle(*half, x, y)
            opens = cells.forces_n([Load((square,), firm_pa * square.area_m2)])[2, 2] < hardest_n
            low, high = (middle, high) if opens else (low, middle)
        return high + 2 * half[axis] / cells.parts

    return most(0), most(1)


class ContactSurfaces:
    """Finds the contact surface of each zone on one sheet.

    >>> from contactfpga.body import ContactSurfaces
    >>> from contactfpga_sim import VirtualBoard
    >>> skin = contactfpga.Skin(extent=True)
    >>> with contactfpga.open(VirtualBoard(skin, scene="two_fingers")) as board:
    ...     support = ContactSurfaces(skin.sheet).supports(board.read())[0]
    >>> round(1e6 * support.area_m2), "mm2"
    (900, 'mm2')
    """

    def __init__(
        self,
        sheet: Sheet,
        cover: Cover | None = None,
        firm_pa: float = FIRM_PA,
        *,
        surface: Surface | None = None,
        pose: Pose | None = None,
        link: str = "",
        frame: str = "",
    ):
        """``surface``: None for that of the sheet. ``pose``: of the surface in the frame named ``frame`` of the link.
        Raises :class:`BodyError` as :func:`overhang_m`."""
        self.sheet, self._names = sheet, (link, frame)
        self._spreads = cover is not None and cover.model != "patch" and not cover.cut
        self._pitch = sheet.pitch_x_mm, sheet.pitch_y_mm
        self.overhang_m = overhang_m(cover, 1e-3 * sheet.pitch_x_mm, 1e-3 * sheet.pitch_y_mm, firm_pa)
        """:func:`overhang_m` of this sheet."""
        self._surface, self._pose = surface or surfaces.of(sheet), pose or Pose.of()
        self._grown = [pitch / 2 + 1e3 * over for pitch, over in zip(self._pitch, self.overhang_m)]
        left, top = (-pitch / 2 for pitch in self._pitch)
        right, bottom = sheet.columns * self._pitch[0] + left, sheet.rows * self._pitch[1] + top
        if sheet.closed:
            left, right = left - 2 * (right - left), right + 2 * (right - left)  # which cuts nothing off
        self._edges = [(left, top), (right, top), (right, bottom), (left, bottom)]

    def supports(
        self,
        zones: Zones,
        forces: haptics.Contacts | None = None,
        outside: haptics.Plane | haptics.Cylinder | None = None,
        pressures: Floats | None = None,
    ) -> list[Support]:
        """The support of each zone of a frame, in the frame of the link.

        ``forces``: those of the frame's zones in the same order. ``outside``: the surface of the pressure units, which
        places the center of pressure. ``pressures``: (rows, columns) pressure or level of the cells in any unit, which
        weighs them in :attr:`Support.center_m`. Raises :class:`BodyError` if the board sends neither cells nor extents,
        and for a zone without cells.
        """
        cells, of_units = [self._cells(zones, zone) for zone in zones], _of_units(forces)
        if forces is not None and (forces.wrench.saturated or forces.wrench.lifted):
            forces = None
        flat = [polygons.within(polygons.grown(middles, *self._grown), self._edges) for middles, _ in cells]
        boxes = np.array([(*np.min(one, axis=0), *np.max(one, axis=0)) for one in flat])
        alone = forces.wrench if forces is not None and len(zones) == 1 else None
        center = None if alone is None or outside is None else outside.center(alone)
        found = []
        for number, (zone, corners, (middles, why)) in enumerate(zip(zones, flat, cells)):
            region, doubts = corners, [*why, *self._neighbors(number, boxes), *of_units]
            if center is not None and outside is not None:
                middle = self._flat(center.point_m)
                if center.covariance_m2 is not None:
                    region = polygons.within(corners, self._around(corners, self._ellipse(center, outside)))
                if not region:
                    doubts.append("by the pressure units the center of pressure lies elsewhere")
                    region, middle = corners, self._barycenter(zones, zone, corners, pressures)
            else:
                middle = self._barycenter(zones, zone, corners, pressures)
            outlines = [polygons.edges_split(one, self._longest) for one in (corners, region)]
            points, normals = self._placed([*outlines, [] if zone.box or self._spreads else middles, [middle]])
            found.append(
                Support(
                    *(zone, *self._names, points[0], 1e-6 * polygons.area(corners), points[1], normals[1]),
                    *(points[3][0], points[2], 5e-4 * math.hypot(*self._pitch), tuple(doubts)),
                    None if forces is None else forces[number],
                    _alone=alone,
                )
            )
        return found

    @property
    def _longest(self) -> float:
        return math.inf if isinstance(self._surface, surfaces.PlaneSurface) else min(self._pitch)

    def _placed(self, places_mm: Sequence[Sequence[Point]]) -> tuple[list[Floats], list[Floats]]:
        """Points in m and normals in the link's frame, (n, 3) for each n places on the sheet."""
        flat = np.array([place for some in places_mm for place in some])
        points, normals = self._surface.place(flat[:, 0], flat[:, 1])
        ends = np.cumsum([len(some) for some in places_mm])[:-1]
        return np.split(self._pose.apply(1e-3 * points), ends), np.split(self._pose.turn(normals), ends)

    def _around(self, corners: list[Point], other: list[Point]) -> list[Point]:
        """Another polygon, on a cylinder on the turn that is nearest to these corners."""
        if self.sheet.radius_mm is None:
            return other
        turn = 2 * math.pi * self.sheet.radius_mm
        by = turn * round((np.mean(corners, axis=0)[0] - np.mean(other, axis=0)[0]) / turn)
        return [(x + by, y) for x, y in other]

    def _flat(self, point_m: Vector) -> Point:
        """The place on the sheet in mm that is nearest to a point in the link's frame."""
        x, y, z = (1e3 * (np.array(point_m) - self._pose.point_m) @ self._pose.rotation).tolist()
        return self._surface.flat((x, y, z))

    def _cells(self, zones: Zones, zone: Zone) -> tuple[list[Point], list[str]]:
        """The hull of the middles of a zone's cells in mm, and what is doubtful about it."""
        cells, sheet = zones.cells_of(zone), self.sheet
        if not zone.area_cells:
            raise BodyError("a zone has no cells, so it has no surface; the frame's flags say why")
        if cells is not None:
            rows, columns = np.nonzero(cells)
            if sheet.closed:
                columns = _unrolled(columns, sheet.columns)
            first = np.flatnonzero(np.diff(rows, prepend=-1))
            ends = (np.minimum.reduceat(columns, first), np.maximum.reduceat(columns, first))
            corners = polygons.hull((x, y) for one in ends for x, y in zip(one.tolist(), rows[first].tolist()))
            around = [(u - x, v - y) for (x, y), (u, v) in zip(corners, corners[1:] + corners[:1])]
            inside = round(polygons.area(corners) + sum(math.gcd(*map(int, way)) for way in around) / 2 + 1)  # Pick
            several = inside > zone.area_cells
        elif zone.box is not None:
            left, right, top, bottom = zone.box
            right = left + (right - left) % sheet.columns
            corners = [(left, top), (right, top), (right, bottom), (left, bottom)]
            inside = (right - left + 1) * (bottom - top + 1)
            several = inside > 2 * zone.area_cells  # a slanted contact, too, leaves many cells of its rectangle free
        else:
            raise BodyError(
                f"the board reports {sheet.report!r} without extents, which have no outline; build its Skin with "
                'extent = true or report = "cells"'
            )
        doubts = []
        if several:
            doubts.append(f"{inside - zone.area_cells} of {inside} cells in it are not pressed: it may be two contacts")
        (low_x, high_x), (low_y, high_y) = ((min(one), max(one)) for one in zip(*corners))
        at_side = not sheet.closed and (low_x == 0 or high_x == sheet.columns - 1)
        if at_side or low_y == 0 or high_y == sheet.rows - 1:
            doubts.append("it ends at the edge of the sheet: the contact may go on beyond")
        if zone.ghost:
            doubts.append("it may be a ghost: the sheet has no diodes")
        return [(x * self._pitch[0], y * self._pitch[1]) for x, y in corners], doubts

    def _neighbors(self, number: int, boxes: Floats) -> list[str]:
        """Which other polygons are less than a pitch away along x and y, by the (n, 4) boxes of all."""
        if len(boxes) == 1:
            return []
        gap = np.maximum(boxes[:, :2] - boxes[number, 2:], boxes[number, :2] - boxes[:, 2:])
        if (around := self.sheet.around_mm) is not None:
            wide = boxes[:, 2] - boxes[:, 0]
            away = np.abs((boxes[:, ::2].mean(axis=1) - boxes[number, ::2].mean() + around / 2) % around - around / 2)
            gap[:, 0] = away - (wide + wide[number]) / 2
        near = np.flatnonzero((gap < self._pitch).all(axis=1))
        return [f"zone {other} is less than a pitch away: both may be one contact" for other in near if other != number]

    def _barycenter(self, zones: Zones, zone: Zone, corners: list[Point], pressures: Floats | None) -> Point:
        cells = None if pressures is None else zones.cells_of(zone)
        if pressures is not None and cells is not None and (weights := pressures * cells).any():
            rows, columns = np.nonzero(cells)
            columns = _unrolled(columns, self.sheet.columns) if self.sheet.closed else columns
            x, y = np.average([columns, rows], axis=1, weights=weights[cells]).tolist()
            return x * self._pitch[0], y * self._pitch[1]
        if zone.x_mm is not None and zone.y_mm is not None:
            return zone.x_mm, zone.y_mm
        x, y = np.mean(corners, axis=0).tolist()
        return x, y

    def _ellipse(self, center: haptics.Center, outside: haptics.Plane | haptics.Cylinder) -> list[Point]:
        """The rectangle on the sheet, in mm, that holds the center of pressure in 95 of 100 cases."""
        assert center.covariance_m2 is not None
        sizes, ways = np.linalg.eigh(center.covariance_m2)
        ways = BOTH * np.sqrt(np.maximum(sizes, 1e-18)) * ways
        found = []
        for one, other in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
            x, y = np.array(center.sheet_m) + one * ways[:, 0] + other * ways[:, 1]
            found.append(self._flat(outside.place(x, y)[0]))
        return polygons.hull(found)


def _of_units(forces: haptics.Contacts | None) -> list[str]:
    if forces is None:
        return []
    limits = forces.wrench.saturated or forces.wrench.lifted
    found = ["a pressure unit is at its limit: the force is not known"] if limits else []
    return found + (["the pressure units feel something that the sheet does not show"] if forces.alarm else [])


def _unrolled(columns: NDArray[np.intp], around: int) -> NDArray[np.intp]:
    """Columns of a zone of a closed sheet, counted on over the seam from behind the widest free gap."""
    used = np.unique(columns)
    gaps = np.diff(used, append=used[0] + around)
    start = used[(int(gaps.argmax()) + 1) % len(used)]
    found: NDArray[np.intp] = start + (columns - start) % around
    return found
