"""Finer than the pitch: where a contact lies, from center of pressure, barycenter, cells and closings, and how sure.

All places are on the sheet laid flat, in m: column 0 at x = 0, row 0 at y = 0.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Sequence

import numpy as np

from contactfpga.robot.haptics import posterior, resolution
from contactfpga.robot.haptics.answer import Floats, HapticsError
from contactfpga.robot.haptics.evidence import Closing, Known
from contactfpga.robot.haptics.posterior import Box, Posterior
from contactfpga.robot.haptics.reach import Reach
from contactfpga.robot.haptics.surface import Center
from contactfpga.skin import sheet as sheets
from contactfpga.zones.zone import Zones

HELPS_FROM = 0.8
"""Reach over pitch above which the set of consistent places says more than the barycenter."""

DISAGREES = 25.0
"""Misfit, in squares of noise, of evidence that no place explains; chance exceeds it less than once in ten thousand."""


@dataclasses.dataclass(frozen=True)
class Place:
    """Where a contact lies on the sheet laid flat."""

    x_m: float
    y_m: float
    radius_m: float
    """The contact lies within this distance in 95 of 100 cases, if it is as the model of the contact says."""
    covariance_m2: Floats
    method: str
    """`center of pressure`, `barycenter`, `set` or `closings`; `+ center of pressure` where both count."""
    agrees: bool = True
    """False where no place explains all that is known under the assumed contact; then the coarser method answers."""


class Locator:
    """Finds places on one sheet.

    Args:
        sheet: lines and pitches; ``skin.sheet`` and ``board.hello`` have one.
        reach: the assumed contact.
        spread: standard deviation of the switches' thresholds, as a share of them.
        force_sigma_n: standard deviation of the forces that are given.
    """

    def __init__(self, sheet: sheets.Sheet, reach: Reach, spread: float = 0.0, force_sigma_n: float = 0.0):
        if not (0 <= spread < 1 and 0 <= force_sigma_n < 1e6):
            raise HapticsError(f"spread is {spread} and force_sigma_n {force_sigma_n}; give 0 to 1, and 0 N or above")
        self._sheet = sheet
        self._pitch_x, self._pitch_y = 1e-3 * sheet.pitch_x_mm, 1e-3 * sheet.pitch_y_mm
        self._reach = reach
        self._known = functools.partial(
            Known,
            pitches_m=(self._pitch_x, self._pitch_y),
            lines=(sheet.rows, sheet.columns),
            reach=reach,
            spread=spread,
            force_sigma_n=force_sigma_n,
        )
        self._sigma = force_sigma_n

    def center(self, center: Center, origin_m: tuple[float, float] = (0.0, 0.0)) -> Place:
        """By the center of pressure alone; ``origin_m``: where column 0 and row 0 lie on the surface laid flat. Raises
        :class:`HapticsError` where the wrench has no noise."""
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
        """Arc length on the sheet, which lies under the foam, and the covariance there. Of the turns around the link
        that one is taken that is nearest to the sheet's middle."""
        assert self._sheet.radius_mm is not None
        assert center.covariance_m2 is not None
        share = 1e-3 * self._sheet.radius_mm / math.hypot(center.point_m[0], center.point_m[1])
        around = 2 * math.pi * 1e-3 * self._sheet.radius_mm
        x = share * center.sheet_m[0]
        middle = self._pitch_x * (self._sheet.columns - 1) / 2
        scale = np.diag([share, 1.0])
        return x + around * round((middle - x) / around), scale @ center.covariance_m2 @ scale

    def barycenter(self, x_m: float, y_m: float, force_n: float | None = None) -> Place:
        """By a zone's barycenter. Without force it is as unsure as a barycenter can be."""
        # What 95 % stay below hangs on the reach alone; it need not be exact to more than 2 % of the pitch.
        if force_n is None:
            radius = resolution.worst_95(self._pitch_x, self._pitch_y)
            return Place(x_m, y_m, radius, np.eye(2) * (radius / 2) ** 2, "barycenter")
        unit = min(self._pitch_x, self._pitch_y)
        reach = max(0.05, round(self._reach.reach_m(force_n) / unit * 50) / 50)
        found = resolution.static(reach, self._pitch_x / unit, self._pitch_y / unit, 96)
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
        """The place of one contact from everything that is known of it; takes some 10 ms.

        Args:
            cells: (row, column) of each pressed switch of its zone; the others around it are open.
            force_n: its push now.
            closings: which of them closed at which push.
            center: from :meth:`center`, if this contact is the only one.
        """
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
        found = self._locate(moved, force_n, then, None if center is None else self._turned(center, -cut))
        return self._turned(found, cut)

    def _turned(self, place: Place, columns: int) -> Place:
        """The same place, moved around the sheet by this many columns."""
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
        """A box around all places from which these cells can be pressed, with room for the spread of thresholds and the
        noise of the force."""
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
    """The column in the middle of the widest gap between these."""
    wide, left = max((min((other - one - 1) % columns for other in taken), one) for one in taken)
    if not wide:
        raise HapticsError("the cells lie all the way round the closed sheet, so the contact has no x")
    return left + 1 + wide // 2


def closed(before: Zones, after: Zones) -> tuple[int, int] | None:
    """(row, column) of the one switch that closed between two frames, or None where that is not all that happened.

    Exact sums tell: a cell more changes area, sum of columns and sum of rows by its own. Needs ``report = "moments"``.
    """
    if before.frame.barycenters is not None or after.frame.barycenters is not None:
        raise HapticsError('the board sends barycenters; only `report = "moments"` or "cells" has the exact sums')
    more, x, y = (int(number) for number in after.records.sum(axis=0) - before.records.sum(axis=0))
    if after.sheet.closed:
        x %= after.sheet.columns  # sums count on past the seam
    inside = 0 <= x < after.sheet.columns and 0 <= y < after.sheet.rows
    return (y, x) if more == 1 and inside else None
