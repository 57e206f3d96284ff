"""Contact places finer than the pitch, from center of pressure, barycenter, cells and closings, with their uncertainty.

Places are in m on the sheet laid flat: column 0 at x = 0, row 0 at y = 0.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Sequence

import numpy as np

from contactfpga.design.cover import medium, sense
from contactfpga.design.cover.answer import NoSolution, numbers
from contactfpga.inputs.values import shown
from contactfpga.robot.haptics import posterior
from contactfpga.robot.haptics.posterior import Box, Posterior
from contactfpga.robot.haptics.values import HapticsError, number
from contactfpga.robot.haptics.wrench import Center
from contactfpga.skin import sheet as sheets
from contactfpga.surfaces.shapes import Floats
from contactfpga.zones.zone import Zones

STEPS, PATCH_STEPS = 512, 240
"""Table entries for a point and for a patch, which takes longer."""

LARGEST_N = 1e4


class Reach:
    """Tables of the force that closes a switch at a distance (:mod:`contactfpga.design.cover`), and of the inverse,
    within 0.01 % of the force.

    Args:
        cover: foam, switch and, for a patch, the touching body.
        model: the assumed contact, for instance ``Model("bonded", "point")``.
        farthest_m: largest distance; None: four times the foam's thickness.
    """

    def __init__(self, cover: sense.PaddedSheet, model: sense.Model, farthest_m: float | None = None):
        self.model = model
        farthest = 4 * cover.thickness_m if farthest_m is None else farthest_m
        steps = STEPS if model.contact == "point" else PATCH_STEPS
        self._distances = np.linspace(0, farthest, steps)
        if model.contact == "point":
            spread = medium.spread(model.within, self._distances / cover.thickness_m)
            found = cover.switch.closing_pa * cover.thickness_m**2 / np.maximum(spread, 1e-30)
        else:
            found = np.array([_force(cover.force_n(model, float(distance))) for distance in self._distances])
        # In a layer a force far away presses no more, and just before that takes more than any arm has.
        grows = np.concatenate([[True], found[1:] > found[:-1]]) & (found < LARGEST_N)
        count = steps if grows.all() else int(grows.argmin())
        if count < 2:
            raise HapticsError(f"model is '{model}'; no force closes a switch under this cover")
        self._distances = self._distances[:count]
        forces = found[:count]
        # Over a half-space this root is straight in the distance's square, and nearly so in a layer.
        self._squares = self._distances**2
        self._roots = forces**0.4

    def closing_n(self, distance_m: Floats) -> Floats:
        """Force that closes a switch at each distance; 1e9 if none does."""
        distance_m = numbers("distance_m", distance_m, "m")
        roots = np.interp(distance_m * distance_m, self._squares, self._roots)
        return np.where(distance_m > self._distances[-1], 1e9, roots * roots * np.sqrt(roots))

    def reach_m(self, force_n: float) -> float:
        """Distance up to which the force closes switches; 0 if it closes none."""
        number("force_n", force_n, unit="N")
        return math.sqrt(np.interp(max(0.0, force_n) ** 0.4, self._roots, self._squares, left=0.0))


def _force(found: float | NoSolution) -> float:
    return math.inf if isinstance(found, NoSolution) else found


ROUNDING = 1e-4


CERTAIN = 10.0
"""Standard deviations beyond a threshold that count as certain."""


@dataclasses.dataclass(frozen=True)
class Closing:
    """A switch that closed, and the push at that instant, whose reach is the contact's distance."""

    row: int
    column: int
    force_n: float

    def __post_init__(self) -> None:
        number("force_n", self.force_n, unit="N")


@dataclasses.dataclass(frozen=True)
class Observations:
    """The observations of one contact, and their evidence on its place."""

    cells: Sequence[tuple[int, int]]
    """(row, column) of each pressed cell."""
    force_n: float
    closings: Sequence[Closing]
    center: Place | None
    pitches_m: tuple[float, float]
    """Along x and y."""
    lines: tuple[int, int]
    """Rows and columns of the sheet."""
    reach: Reach
    spread: float
    """Relative standard deviation of the thresholds."""
    force_sigma_n: float

    def evidence(self, x: Floats, y: Floats, step_m: float) -> tuple[Floats, Floats]:
        """Logarithm of probability and misfit at the places x, y of a grid with this step."""
        chance, misfit = np.zeros(len(x)), np.zeros(len(x))
        when = {(one.row, one.column): one.force_n for one in self.closings}
        for cell in self.cells:
            needed, sigma = self._needed(cell, x, y, step_m)
            if cell in when:
                off = ((when[cell] - needed) / sigma) ** 2
                chance -= 0.5 * off + np.log(sigma)
                misfit += off
            else:
                _one_side((self.force_n - needed) / sigma, chance, misfit)
        for cell in self._open():
            needed, sigma = self._needed(cell, x, y, step_m)
            if float(needed.min()) - self.force_n < CERTAIN * float(sigma.max()):
                _one_side((needed - self.force_n) / sigma, chance, misfit)
        if self.center is not None:
            off = self._from_center(x, y)
            chance -= 0.5 * off
            misfit += off
        return chance, misfit

    def _needed(self, cell: tuple[int, int], x: Floats, y: Floats, step_m: float) -> tuple[Floats, Floats]:
        """Force that closes the switch from each place, and its standard deviation."""
        row, column = cell
        distance = np.hypot(x - column * self.pitches_m[0], y - row * self.pitches_m[1])
        needed = self.reach.closing_n(distance)
        farther = self.reach.closing_n(distance + step_m / 2)
        within = np.minimum(farther - needed, needed)
        sigma = np.sqrt(self.force_sigma_n**2 + (self.spread * needed) ** 2 + (within / 1.7) ** 2)
        return needed, np.maximum(sigma, ROUNDING * needed)

    def _open(self) -> list[tuple[int, int]]:
        far = self.reach.reach_m(self.force_n * (1 + 3 * self.spread) + 3 * self.force_sigma_n)
        wide, high = (math.ceil(far / pitch) for pitch in self.pitches_m)
        rows, columns = zip(*self.cells)
        return [
            (row, column)
            for row in range(min(rows) - high, max(rows) + high + 1)
            for column in range(min(columns) - wide, max(columns) + wide + 1)
            if (row, column) not in self.cells and 0 <= row < self.lines[0] and 0 <= column < self.lines[1]
        ]

    def _from_center(self, x: Floats, y: Floats) -> Floats:
        assert self.center is not None
        inverse = np.linalg.inv(self.center.covariance_m2)
        dx, dy = x - self.center.x_m, y - self.center.y_m
        return np.asarray(inverse[0, 0] * dx * dx + 2 * inverse[0, 1] * dx * dy + inverse[1, 1] * dy * dy)


def _one_side(standing: Floats, chance: Floats, misfit: Floats) -> None:
    """Add the evidence of a switch ``standing`` standard deviations on the right side of its threshold."""
    # The logistic curve is the normal one to 1 %, and needs no scipy.
    chance -= np.logaddexp(0.0, -1.702 * standing)
    misfit += np.minimum(standing, 0.0) ** 2


HELPS_FROM = 0.8
"""Reach over pitch from which the set of consistent places is better than the barycenter."""

DISAGREES = 25.0
"""Misfit of contradictory evidence, in squares of noise; chance exceeds it less than once in ten thousand."""


@dataclasses.dataclass(frozen=True)
class Place:
    """Place of a contact on the sheet laid flat."""

    x_m: float
    y_m: float
    radius_m: float
    """The contact is within this distance in 95 of 100 cases, if it follows the contact model."""
    covariance_m2: Floats
    """(2, 2), of x and y."""
    method: str
    """`center of pressure`, `barycenter`, `set` or `closings`; `+ center of pressure` if combined."""
    agrees: bool = True
    """False if no place explains all observations; then the coarser method answers."""


class Locator:
    """Finds contact places on one sheet.

    Args:
     sheet: lines and pitches; ``skin.sheet`` and ``board.hello`` have one.
     reach: the assumed contact.
     spread: relative standard deviation of the switches' thresholds.
     force_sigma_n: standard deviation of the given forces.
    """

    def __init__(self, sheet: sheets.Sheet, reach: Reach, spread: float = 0.0, force_sigma_n: float = 0.0):
        if not (0 <= spread < 1 and 0 <= force_sigma_n < 1e6):
            raise HapticsError(
                f"spread is {shown(spread)} and force_sigma_n {shown(force_sigma_n)}; give 0 to 1, and 0 N or above"
            )
        self._sheet = sheet
        self._pitch_x, self._pitch_y = 1e-3 * sheet.pitch_x_mm, 1e-3 * sheet.pitch_y_mm
        self._reach = reach
        self._known = functools.partial(
            Observations,
            pitches_m=(self._pitch_x, self._pitch_y),
            lines=(sheet.rows, sheet.columns),
            reach=reach,
            spread=spread,
            force_sigma_n=force_sigma_n,
        )
        self._sigma = force_sigma_n

    def center(self, center: Center, origin_m: tuple[float, float] = (0.0, 0.0)) -> Place:
        """The place by the center of pressure alone; ``origin_m`` is column 0 and row 0 on the surface laid flat.
        Raises :class:`HapticsError` for a wrench without noise."""
        if center.covariance_m2 is None:
            raise HapticsError("the wrench has no covariance; a place needs one to say how sure it is")
        x, spread = center.sheet_m[0], center.covariance_m2
        if self._sheet.radius_mm is not None:
            x, spread = self._inside(center)
        x -= origin_m[0]
        if self._sheet.closed:
            x %= self._sheet.columns * self._pitch_x
        return Place(x, center.sheet_m[1] - origin_m[1], posterior.radius_95(spread), spread, "center of pressure")

    def _inside(self, center: Center) -> tuple[float, Floats]:
        assert self._sheet.radius_mm is not None
        assert center.covariance_m2 is not None
        share = 1e-3 * self._sheet.radius_mm / math.hypot(center.point_m[0], center.point_m[1])
        around = 2 * math.pi * 1e-3 * self._sheet.radius_mm
        x = share * center.sheet_m[0]
        middle = self._pitch_x * (self._sheet.columns - 1) / 2
        scale = np.diag([share, 1.0])
        return x + around * round((middle - x) / around), scale @ center.covariance_m2 @ scale

    def barycenter(self, x_m: float, y_m: float, force_n: float | None = None) -> Place:
        """The place by a zone's barycenter; it is least certain without force."""
        # What 95 % stay below hangs on the reach alone; it need not be exact to more than 2 % of the pitch.
        if force_n is None:
            radius = posterior.worst_95(self._pitch_x, self._pitch_y)
            return Place(x_m, y_m, radius, np.eye(2) * (radius / 2) ** 2, "barycenter")
        unit = min(self._pitch_x, self._pitch_y)
        reach = max(0.05, round(self._reach.reach_m(force_n) / unit * 50) / 50)
        found = posterior.static(reach, self._pitch_x / unit, self._pitch_y / unit, 96)
        return Place(
            x_m, y_m, found.barycenter_95 * unit, np.eye(2) * (found.barycenter_rms * unit) ** 2 / 2, "barycenter"
        )

    def locate(
        self,
        cells: Sequence[tuple[int, int]],
        force_n: float,
        closings: Sequence[Closing] = (),
        center: Place | None = None,
    ) -> Place:
        """The place of one contact from all observations, in some 10 ms.

        Args:
            cells: (row, column) of each pressed switch of its zone; the others around it are open.
            force_n: its current push.
            closings: their closings with pushes.
            center: from :meth:`center`, if this contact is the only one.
        """
        number("force_n", force_n, unit="N")
        if not cells:
            raise HapticsError(
                "there is no pressed cell; a contact that closes no switch has its center of pressure alone"
            )
        if not self._sheet.closed:
            return self._locate(cells, force_n, closings, center)
        # As if the sheet were cut open far from the contact.
        columns = self._sheet.columns
        cut = _cut({column for _, column in cells}, columns)
        moved = [(row, (column - cut) % columns) for row, column in cells]
        then = [dataclasses.replace(one, column=(one.column - cut) % columns) for one in closings]
        found = self._locate(moved, force_n, then, None if center is None else self._around_sheet(center, -cut))
        return self._around_sheet(found, cut)

    def _around_sheet(self, place: Place, columns: int) -> Place:
        return dataclasses.replace(
            place, x_m=(place.x_m + columns * self._pitch_x) % (self._sheet.columns * self._pitch_x)
        )

    def _locate(
        self, cells: Sequence[tuple[int, int]], force_n: float, closings: Sequence[Closing], center: Place | None
    ) -> Place:
        x = self._pitch_x * sum(column for _, column in cells) / len(cells)
        y = self._pitch_y * sum(row for row, _ in cells) / len(cells)
        coarse = self.barycenter(x, y, force_n)
        relative = self._reach.reach_m(force_n) / max(self._pitch_x, self._pitch_y)
        if not closings and center is None and relative <= HELPS_FROM:
            return coarse
        known = self._known(cells=cells, force_n=force_n, closings=closings, center=center)
        found = posterior.of(known.evidence, self._box(cells, force_n, center))
        if found.misfit > DISAGREES + 2 * len(cells):
            better = coarse if center is None or center.radius_m > coarse.radius_m else center
            return dataclasses.replace(better, agrees=False)
        return _place(found, bool(closings), center is not None)

    def _box(self, cells: Sequence[tuple[int, int]], force_n: float, center: Place | None) -> Box:
        far = 1.2 * self._reach.reach_m(1.5 * force_n + 5 * self._sigma) + max(self._pitch_x, self._pitch_y)
        rows, columns = zip(*cells)
        left, right = self._pitch_x * max(columns) - far, self._pitch_x * min(columns) + far
        low, high = self._pitch_y * max(rows) - far, self._pitch_y * min(rows) + far
        left, right, low, high = min(left, right), max(left, right), min(low, high), max(low, high)
        if center is None:
            return left, right, low, high
        wide = 3 * center.radius_m
        around = (center.x_m - wide, center.x_m + wide, center.y_m - wide, center.y_m + wide)
        both = (max(left, around[0]), min(right, around[1]), max(low, around[2]), min(high, around[3]))
        return both if both[0] < both[1] and both[2] < both[3] else (left, right, low, high)


def _place(found: Posterior, closings: bool, center: bool) -> Place:
    method = ("closings" if closings else "set") + (" + center of pressure" if center else "")
    return Place(found.x_m, found.y_m, found.radius_m, found.covariance_m2, method)


def _cut(taken: set[int], columns: int) -> int:
    wide, left = max((min((other - one - 1) % columns for other in taken), one) for one in taken)
    if not wide:
        raise HapticsError("the cells lie all the way round the closed sheet, so the contact has no x")
    return left + 1 + wide // 2


def closed(before: Zones, after: Zones) -> tuple[int, int] | None:
    """(row, column) of the one switch that closed between two frames, by exact sums; None after other changes. Needs
    ``report = "moments"``."""
    if before.frame.barycenters is not None or after.frame.barycenters is not None:
        raise HapticsError('the board sends barycenters; only `report = "moments"` or "cells" has the exact sums')
    more, x, y = (int(number) for number in after.records.sum(axis=0) - before.records.sum(axis=0))
    if after.sheet.closed:
        x %= after.sheet.columns  # sums count on past the seam
    inside = 0 <= x < after.sheet.columns and 0 <= y < after.sheet.rows
    return (y, x) if more == 1 and inside else None
