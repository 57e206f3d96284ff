"""What a tracker remembers: a spot on the sheet, how it moves, and the contacts that have it."""

from __future__ import annotations

import dataclasses
import math

from contactfpga.tracking.tracks import Track
from contactfpga.zones.around import across
from contactfpga.zones.zone import Zone

SETTLING_S, SMOOTH_S = 0.004, 0.015
"""Over how long a speed is smoothed: half the spot's age, within these. A barycenter jumps when a cell opens or closes,
and frames follow one another so fast that the jump alone would be meters per second."""

COAST_S = 0.05
"""How far ahead a speed is believed."""

PASSING_S = 0.5
"""How long two contacts in one zone may take to pass each other."""


@dataclasses.dataclass(slots=True)
class Member:
    """A contact of a spot."""

    id: int
    since_us: int
    area_mm2: float
    """When it was last seen alone."""
    dx: float = 0.0
    """Where it came into the spot, from its barycenter, in mm; 0 while it is alone."""
    dy: float = 0.0
    vx: float = 0.0
    """How fast it came, in mm/s, beside the spot's own speed."""
    vy: float = 0.0


class Spot:
    """A zone over time."""

    def __init__(self, zone: Zone, time_us: int, members: list[Member]):
        self.members = members
        """The one that it goes by comes first."""
        self.vx = self.vy = 0.0
        self.born_us = self.joined_us = time_us
        self.small_us: int | None = None
        """Since when it is no larger than it would be without one of its contacts."""
        self.place(zone, time_us)

    def place(self, zone: Zone, time_us: int) -> None:
        """Put it there, as a zone that grew or shrank by a whole contact is not the place it moved to."""
        self.zone, self.seen_us, self.held = zone, time_us, False
        self.x, self.y = self.fx, self.fy = self.from_x, self.from_y = place(zone)

    def ahead(self, time_us: int) -> tuple[float, float]:
        """Where it would be then."""
        seconds = min((time_us - self.seen_us) / 1e6, COAST_S)
        return self.fx + self.vx * seconds, self.fy + self.vy * seconds

    def follow(self, zone: Zone, time_us: int, around_mm: float | None) -> None:
        """Go on in this zone: a filter of second order that fades with time, however often frames come."""
        x, y = place(zone)
        seconds = (time_us - self.seen_us) / 1e6
        ahead_x, ahead_y = self.ahead(time_us)
        off_x, off_y = across(x - ahead_x, around_mm), y - ahead_y
        smooth_s = min(max((time_us - self.born_us) / 2e6, SETTLING_S), SMOOTH_S)
        fade = math.exp(-seconds / smooth_s)
        self.fx, self.fy = ahead_x + (1 - fade * fade) * off_x, ahead_y + (1 - fade * fade) * off_y
        if seconds > 0:
            gain = (1 - fade) * (1 - fade) / seconds
            self.vx += gain * off_x
            self.vy += gain * off_y
        self.zone, self.seen_us, self.held = zone, time_us, False
        self.x, self.y = x, y
        if len(self.members) == 1:
            self.members[0].area_mm2 = zone.area_mm2

    def center(self) -> None:
        """Shift its contacts so that their barycenter is the zone's."""
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
        """Of all its contacts, as each was last seen alone."""
        return math.fsum(one.area_mm2 for one in self.members)

    def spare(self) -> Member | None:
        """The contact without which it would be as large as it is; None where it takes them all. Of several, the one
        farthest from its middle, or the newest."""
        if len(self.members) == 1:
            return None
        total, area = self.area_mm2, self.zone.area_mm2

        def without(one: Member) -> tuple[float, float, int]:
            return abs(total - one.area_mm2 - area), -math.hypot(one.dx, one.dy), -one.id

        best = min(self.members, key=without)
        return best if abs(total - best.area_mm2 - area) < abs(total - area) else None

    def track(self) -> Track:
        """As users see it."""
        first = self.members[0]
        merged = tuple(one.id for one in self.members[1:]) if len(self.members) > 1 else ()
        return Track(first.id, self.zone, first.since_us, self.seen_us, self.vx, self.vy, self.held, merged)


def place(zone: Zone) -> tuple[float, float]:
    """Where a zone is; in a frame without ``mismatch`` each one is somewhere."""
    assert zone.x_mm is not None
    assert zone.y_mm is not None
    return zone.x_mm, zone.y_mm


def radius_mm(area_mm2: float) -> float:
    """Of a disc of this area."""
    return math.sqrt(area_mm2 / math.pi)
