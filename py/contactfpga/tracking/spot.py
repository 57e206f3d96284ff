"""State of a tracker: spots on the sheet, their motion, and their contacts."""

from __future__ import annotations

import dataclasses
import math
from typing import NamedTuple

from contactfpga.tracking.tracks import Track
from contactfpga.zones.around import across
from contactfpga.zones.zone import Zone

SUDDEN = 4e6
"""Acceleration noise of a contact: spectral density in mm^2/s^3."""

FAST_MM_S = 1500.0
"""Standard deviation of the speed along each axis of a contact seen once."""

SAME_S = 0.003
"""Time for which a barycenter's error stays the same: it jumps with a cell, so denser frames add nothing."""

COAST_S = 0.05


class Covariance(NamedTuple):
    """Covariance of place and speed along each axis, in mm^2, mm^2/s and mm^2/s^2."""

    place: float
    both: float
    speed: float

    def later(self, seconds: float) -> Covariance:
        spread = SUDDEN * seconds
        place = self.place + seconds * (2 * self.both + seconds * (self.speed + spread / 3))
        return Covariance(place, self.both + seconds * (self.speed + spread / 2), self.speed + spread)


NEW = Covariance(0.0, 0.0, FAST_MM_S**2)
"""Covariance of a contact seen once."""


@dataclasses.dataclass(slots=True)
class Member:
    id: int
    since_us: int
    area_mm2: float
    """Area when last seen alone."""
    dx: float = 0.0
    """Offset from the spot's barycenter on entering, in mm; 0 while alone."""
    dy: float = 0.0
    vx: float = 0.0
    """Speed on entering relative to the spot's, in mm/s."""
    vy: float = 0.0
    known: Covariance = NEW
    """Covariance on entering."""
    gone_us: int | None = None
    """Time at which it left the zone of others; None while it is there."""


class Spot:
    """A zone over time, with one or more contacts."""

    def __init__(self, zone: Zone, time_us: int, members: list[Member]):
        self.members = members
        """Contacts of the spot; the first gives its id."""
        self.vx = self.vy = 0.0
        self.known = NEW
        self.joined_us = time_us
        self.small_us: int | None = None
        """Time since which the zone would be large enough without one of its contacts."""
        self.rest_us = time_us
        """Time of the last change of the zone's place or area."""
        self.changed_us = -math.inf
        """Time of the last :meth:`shift`."""
        self.place(zone, time_us)

    def place(self, zone: Zone, time_us: int) -> None:
        """Move the spot to a zone without speed: a zone that grew or shrank by a whole contact has not moved."""
        self.zone, self.seen_us, self.held = zone, time_us, False
        self.x, self.y = self.fx, self.fy = self.from_x, self.from_y = place(zone)
        self.known = Covariance(error_mm2(zone), 0.0, self.known.speed)
        self.rest_us = time_us

    def ahead(self, time_us: int) -> tuple[float, float]:
        seconds = min((time_us - self.seen_us) / 1e6, COAST_S)
        return self.fx + self.vx * seconds, self.fy + self.vy * seconds

    def follow(self, zone: Zone, time_us: int, around_mm: float | None) -> None:
        """Continue the spot in a zone, by a Kalman filter of constant velocity."""
        x, y = place(zone)
        if (x, y, zone.area_mm2) != (self.x, self.y, self.zone.area_mm2):
            self.rest_us = time_us
        seconds = (time_us - self.seen_us) / 1e6
        if seconds > 0:
            self.fx, self.fy = self.ahead(time_us)
            off_x, off_y = across(x - self.fx, around_mm), y - self.fy
            self.correct(off_x, off_y, self.known.later(seconds), error_mm2(zone) * max(1.0, SAME_S / seconds))
        self.zone, self.seen_us, self.held = zone, time_us, False
        self.x, self.y = x, y
        if len(self.members) == 1:
            self.members[0].area_mm2 = zone.area_mm2

    def shift(self, zone: Zone, time_us: int, around_mm: float | None) -> None:
        """Put the spot at a zone that one contact entered or left, while the others stayed where they were."""
        x, y = place(zone)
        for one in self.members:
            one.dx, one.dy = one.dx - across(x - self.x, around_mm), one.dy - (y - self.y)
        self.place(zone, time_us)
        self.joined_us = self.changed_us = time_us
        self.small_us = None
        self.members.sort(key=lambda one: one.gone_us is not None)

    def nearest(self, dx: float, dy: float, gone: bool) -> Member | None:
        """The contact within its radius of an offset from the spot's place; None without one. ``gone``: of those that
        left, else of those that are there."""
        found = [one for one in self.members if (one.gone_us is not None) is gone]
        best = min(found, key=lambda one: math.hypot(dx - one.dx, dy - one.dy), default=None)
        return best if best and math.hypot(dx - best.dx, dy - best.dy) <= radius_mm(best.area_mm2) else None

    def remove(self, member: Member) -> None:
        self.members.remove(member)
        self.center()

    def correct(self, off_x: float, off_y: float, known: Covariance, error: float) -> None:
        """Correct by a zone's offset from the expected place; ``error``: variance of the zone's place."""
        at, both, speed = known
        gain, turn = at / (at + error), both / (at + error)
        self.fx, self.fy = self.fx + gain * off_x, self.fy + gain * off_y
        self.vx, self.vy = self.vx + turn * off_x, self.vy + turn * off_y
        self.known = Covariance(at - gain * at, both - gain * both, speed - turn * both)

    def center(self) -> None:
        """Shift the contacts so that their barycenter is the zone's."""
        if len(self.members) == 1:
            only = self.members[0]
            only.dx = only.dy = only.vx = only.vy = 0.0
            return
        total = math.fsum(one.area_mm2 for one in self.members)
        for place, speed in (("dx", "vx"), ("dy", "vy")):
            for name in (place, speed):
                mean = math.fsum(one.area_mm2 * getattr(one, name) for one in self.members) / total
                for one in self.members:
                    setattr(one, name, getattr(one, name) - mean)

    @property
    def area_mm2(self) -> float:
        return math.fsum(one.area_mm2 for one in self.members)

    def spare(self) -> Member | None:
        """The contact without which the areas fit the zone best, then farthest from the middle, then newest; None if
        all fit."""
        if len(self.members) == 1:
            return None
        total, area = self.area_mm2, self.zone.area_mm2

        def without(one: Member) -> tuple[float, float, int]:
            return abs(total - one.area_mm2 - area), -math.hypot(one.dx, one.dy), -one.id

        best = min(self.members, key=without)
        return best if abs(total - best.area_mm2 - area) < abs(total - area) else None

    def track(self) -> Track:
        first = self.members[0]
        merged = tuple(one.id for one in self.members[1:]) if len(self.members) > 1 else ()
        return Track(first.id, self.zone, first.since_us, self.seen_us, self.vx, self.vy, self.held, merged)


def rank(member: Member) -> tuple[float, int]:
    """Sorting key of contacts in a zone, of which the first gives its id: the largest, then the oldest."""
    return -member.area_mm2, member.id


def place(zone: Zone) -> tuple[float, float]:
    """Place of a zone in mm; without ``mismatch`` every zone has one."""
    assert zone.x_mm is not None
    assert zone.y_mm is not None
    return zone.x_mm, zone.y_mm


def error_mm2(zone: Zone) -> float:
    """Variance of a zone's barycenter along each axis: that of a cell over the number of cells."""
    return zone.area_mm2 / (12 * zone.area_cells)


def radius_mm(area_mm2: float) -> float:
    return math.sqrt(area_mm2 / math.pi)
