"""Where a contact was while it was alone: its center of pressure, which the units know better than the sheet."""

from __future__ import annotations

import dataclasses
import math
from collections import deque
from collections.abc import Sequence
from typing import TYPE_CHECKING

from contactfpga.robot.haptics.answer import HapticsError
from contactfpga.robot.haptics.contact import Touch
from contactfpga.robot.haptics.wrench import Motion
from contactfpga.zones.zone import Zone, Zones

if TYPE_CHECKING:
    from contactfpga.robot.haptics.units import LoadCells

EARLIER_US = 20_000
"""Device time by which a place is older than the zone of the next contact, which presses the units before it closes a
switch."""

Key = tuple[int, tuple[float, float, float] | None]


@dataclasses.dataclass(frozen=True, slots=True)
class _Alone:
    """Of one frame with a single zone."""

    time_us: int
    center_m: tuple[float, float, float]
    sigma_m: float


class AloneWatch:
    """Takes every frame with its readings, and remembers the place of a contact that was alone, for
    :func:`~contactfpga.robot.haptics.felt`.

    With two contacts the units say nothing about where each is along the line through both, and the barycenter of one
    to three cells is off by a quarter of the pitch: that is the largest error of the forces. A single contact's center
    of pressure is known to less than a millimeter. It stays its place while more contacts come and its zone keeps the
    same cells.
    """

    def __init__(self, cells: LoadCells):
        """Raises :class:`HapticsError` where the cells have no surface."""
        if cells.surface is None:
            raise HapticsError("surface is missing; give units.toml a table [surface] with the bumper's outside")
        self._cells, self._surface = cells, cells.surface
        self._key: Key | None = None
        """Of the zone that is alone."""
        self._recent: deque[_Alone] = deque()
        self._kept: dict[Key, _Alone] = {}

    def take(self, zones: Zones, motion: Motion | None = None) -> None:
        """The next frame, with its readings (:class:`~contactfpga.robot.haptics.WithReadings`); ``motion`` as for
        :meth:`LoadCells.wrench <contactfpga.robot.haptics.LoadCells.wrench>`."""
        if len(zones) == 1:
            self._kept = {}
            self._alone(zones, motion)
            return
        if self._key is not None and self._recent and zones.time_us - self._recent[0].time_us >= EARLIER_US:
            self._kept[self._key] = self._recent[0]
        keys = {_key(zone) for zone in zones}
        self._key = None
        self._recent.clear()
        self._kept = {key: place for key, place in self._kept.items() if key in keys}

    def _alone(self, zones: Zones, motion: Motion | None) -> None:
        key = _key(zones[0])
        if key != self._key:
            self._key = key
            self._recent.clear()
        if zones.units is None:
            return
        center = self._surface.center(self._cells.wrench(zones.units.readings, motion))
        if center is not None and center.covariance_m2 is not None:
            sigma = math.sqrt(float(center.covariance_m2.trace()) / 2)
            self._recent.append(_Alone(zones.time_us, center.point_m, sigma))
        while len(self._recent) > 1 and zones.time_us - self._recent[1].time_us >= EARLIER_US:
            self._recent.popleft()

    def sharpened(self, zones: Zones, touches: Sequence[Touch]) -> list[Touch]:
        """The touches of a frame's zones, in the order of those that have a place, each where it was alone if that is
        known better and lies on its zone."""
        placed = [zone for zone in zones if zone.point_mm is not None]
        return [self._sharper(zone, touch, zones.sheet.pitch_x_mm) for zone, touch in zip(placed, touches, strict=True)]

    def _sharper(self, zone: Zone, touch: Touch, pitch_mm: float) -> Touch:
        place = self._kept.get(_key(zone))
        if place is None or place.sigma_m >= touch.point_sigma_m:
            return touch
        if math.dist(place.center_m, touch.point_m) > 1e-3 * pitch_mm * math.sqrt(zone.area_cells):
            return touch  # something that the sheet does not show pressed as well
        return dataclasses.replace(touch, point_m=place.center_m, point_sigma_m=place.sigma_m)


def _key(zone: Zone) -> Key:
    """Changes with the zone's cells."""
    return zone.area_cells, zone.point_mm
