"""Follows contacts from frame to frame; areas distinguish merging and parting zones from lifts and touches."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import NamedTuple

from contactfpga.inputs.values import is_finite, shown
from contactfpga.skin.derived import SEQUENCE_BITS
from contactfpga.skin.sheet import Sheet
from contactfpga.tracking.assignment import assign
from contactfpga.tracking.growth import Growth, Moments
from contactfpga.tracking.places import Places
from contactfpga.tracking.spot import SAME_S, Member, Spot, error_mm2, place, radius_mm, rank
from contactfpga.tracking.tracks import Event, Kind, Track, Tracks
from contactfpga.zones.around import across
from contactfpga.zones.zone import Zone, Zones

LIMITS = {
    "gate_mm": (0.1, 10_000.0, "mm"),
    "hold_ms": (0.0, 10_000.0, "ms"),
    "shared_ms": (0.0, 60_000.0, "ms"),
    "move_mm": (0.1, 10_000.0, "mm"),
}
"""Least and largest value of each setting, and its unit."""


class Tracker:
    """Gives contacts constant ids; takes every frame in order.

    >>> tracker = contactfpga.Tracker()
    >>> with contactfpga.open("sim://?scene=two_fingers") as board:
    ...     tracks = tracker.update(board.next())
    >>> [track.id for track in tracks.active]
    [1, 2]

    Each contact moves on by its speed, and is paired with a zone within the gate so that the sum of distances is least;
    on a cylinder distances run along its surface. Time is that of the frames, so a recording gives the same ids as its
    board.

    ``gate_mm``: largest distance of a contact from its expected or last place. ``hold_ms``: time for which a contact
    without a zone is held, to survive a bounce. ``shared_ms``: time for which a contact that shares a zone is kept
    while the zone is only as large as the others. ``move_mm``: distance between ``move`` events. ``places``: table by
    which contacts get :attr:`Track.place_mm`. Raises ValueError for a setting outside its limits.
    """

    def __init__(
        self,
        gate_mm: float = 20.0,
        *,
        hold_ms: float = 5.0,
        shared_ms: float = 300.0,
        move_mm: float = 5.0,
        places: Places | None = None,
    ):
        for name, value in {"gate_mm": gate_mm, "hold_ms": hold_ms, "shared_ms": shared_ms, "move_mm": move_mm}.items():
            low, high, unit = LIMITS[name]
            if not is_finite(value) or not low <= value <= high:
                raise ValueError(f"{name} is {shown(value)}; it must be a number from {low:g} to {high:,g} {unit}")
        self._gate_mm, self._move_mm = gate_mm * (1 + 1e-9), float(move_mm)  # a zone at the gate is within it
        self._hold_us, self._shared_us = hold_ms * 1e3, shared_ms * 1e3
        self._next_id = 1
        self._time_us = -1
        self._sheet: Sheet | None = None
        self._around_mm: float | None = None
        self._spots: list[Spot] = []
        self._events: list[Event] = []
        self._places = places
        self._growths: dict[int, Growth] = {}
        self._sequence = 0

    def update(self, zones: Zones) -> Tracks:
        """The contacts and events after a frame.

        A frame flagged ``mismatch`` changes nothing; one flagged ``overflow`` ends no contact, nor do lost frames. A
        frame that is older than the last one, or of another sheet, begins a new history. Raises TypeError for anything
        but a frame, and ValueError for a sheet whose contacts the table of places cannot place.
        """
        if not isinstance(zones, Zones):
            raise TypeError(f"update() takes a frame of zones, such as board.next() returns; it got {shown(zones)}")
        self._events = []
        restarted = self._restart(zones)
        self._time_us = zones.time_us
        for spot in self._spots:
            spot.held = True  # until a zone of this frame is its own
        unsure = [] if "mismatch" in zones.flags else self._step(zones)
        active = sorted((spot.track() for spot in self._spots), key=lambda track: track.id)
        if self._places is not None:
            active = self._placed(self._places, active, zones.sequence)
        return Tracks(self._time_us, tuple(active), tuple(self._events), tuple(unsure), restarted)

    # ---- one frame

    def _restart(self, zones: Zones) -> bool:
        if self._sheet is zones.sheet and zones.time_us >= self._time_us:
            return False
        restarted = zones.time_us < self._time_us or self._sheet not in (None, zones.sheet)
        if restarted:
            for spot in self._spots:
                self._end(spot)
            self._spots = []
            self._growths = {}
        if self._places is not None:
            self._places.check(zones.sheet)
        self._sheet = zones.sheet
        radius_mm = zones.sheet.radius_mm
        self._around_mm = None if radius_mm is None else 2 * math.pi * radius_mm
        return restarted

    def _step(self, zones: Zones) -> list[Zone]:
        pairs, lost, free = self._paired([zone for zone in zones if zone.x_mm is not None])
        winding = [zone for zone in zones if zone.winding]
        unsure = [zone for zone in free if zone.ghost] + winding
        free = [zone for zone in free if not zone.ghost]
        merges: dict[Spot, list[Spot]] = {}
        parts: dict[Spot, list[Zone]] = {}
        if lost:
            merges = merged(pairs, lost, free, self._apart, self._shifts, self._gate_mm)
        if free and self._spots:
            parts = parted(pairs, lost, free, merges, self._apart, self._shifts, self._expects, self._gate_mm)
        hidden = bool(winding) or "overflow" in zones.flags
        self._spots = [spot for spot in lost if self._held(spot, hidden)]
        for spot, zone in pairs:
            self._go_on(spot, zone, merges.get(spot), parts.get(spot))
        for spot, split in parts.items():
            if spot not in dict(pairs):
                self._part(spot, split)
        for zone in free:
            self._spots.append(Spot(zone, self._time_us, [self._begin(zone)]))
        return unsure

    def _placed(self, places: Places, active: list[Track], sequence: int) -> list[Track]:
        """The contacts with their places by the order in which their cells closed."""
        sheet, before, found = self._sheet, self._growths, []
        missed = (sequence - self._sequence - 1) % (1 << SEQUENCE_BITS) if sequence != self._sequence else 0
        self._sequence = sequence
        assert sheet is not None
        # The cells that left a zone as it parted are not known. A zone beside one that kept its cells is new.
        areas = {track.id: track.zone.area_cells for track in active}
        parted = {
            name
            for event in self._events
            if event.kind in ("split", "down")
            and any(areas.get(one, 0) < before[one].now.cells for one in event.parents if one in before)
            for name in (event.id, *event.parents)
        }
        self._growths = {}
        for track in active:
            zone, names = track.zone, (track.id, *track.merged)
            # Contacts of one zone have one record.
            growth, *others = [before[name] for name in names if name in before] or [
                Growth(sheet.columns if sheet.closed else 0)
            ]
            for other in others:
                growth.join(other)
            growth.missed += missed if growth.closings else 0
            if not track.held:
                assert zone.sum_x is not None
                assert zone.sum_y is not None
                growth.take(Moments(zone.area_cells, zone.sum_x, zone.sum_y), self._time_us)
            growth.moved |= not parted.isdisjoint(names)
            self._growths[track.id] = growth
            x_mm, y_mm, variance, growth.moved = places.of(growth, *place(zone), zone.area_cells)
            if self._around_mm is not None:
                x_mm %= self._around_mm
            covariance = ((variance, 0.0), (0.0, variance))
            track = dataclasses.replace(track, moved=growth.moved, missed=growth.missed)
            found.append(dataclasses.replace(track, place_mm=(x_mm, y_mm), place_cov_mm2=covariance))
        return found

    def _paired(self, seen: list[Zone]) -> tuple[list[tuple[Spot, Zone]], list[Spot], list[Zone]]:
        spots = self._spots
        if not spots or not seen:
            return [], list(spots), list(seen)
        costs = [self._costs(spot, seen) for spot in spots]
        chosen = assign(costs, SIGMAS**2 * (1 + 1e-9))  # a pair at the gate is one
        pairs = [(spot, seen[column]) for spot, column in zip(spots, chosen) if column is not None]
        lost = [spot for spot, column in zip(spots, chosen) if column is None]
        if len(pairs) == len(seen):
            return pairs, lost, []
        taken = set(chosen)
        return pairs, lost, [zone for column, zone in enumerate(seen) if column not in taken]

    def _costs(self, spot: Spot, seen: list[Zone]) -> list[float]:
        """Squared Mahalanobis distances from the expected place, with the gate widened for a sudden stop."""
        ahead_x, ahead_y = spot.ahead(self._time_us)
        seconds = (self._time_us - spot.seen_us) / 1e6
        spread = max((self._gate_mm / SIGMAS) ** 2, spot.known.later(seconds).place)
        found = []
        for zone in seen:
            off = self._distance(ahead_x, ahead_y, zone)
            if off <= self._gate_mm:
                found.append(off * off / spread)
            else:
                stopped = self._distance(spot.x, spot.y, zone) <= self._gate_mm
                found.append(SIGMAS**2 if stopped else math.inf)
        return found

    def _distance(self, x: float, y: float, zone: Zone) -> float:
        zone_x, zone_y = place(zone)
        return math.hypot(across(zone_x - x, self._around_mm), zone_y - y)

    def _apart(self, spot: Spot, zone: Zone) -> float:
        return self._distance(*spot.ahead(self._time_us), zone)

    def _shifts(self, spot: Spot, zone: Zone, area_mm2: float, x: float, y: float) -> bool:
        """Whether a change of a spot's zone explains an area that came to it (positive) or left it at a place. A small
        area must have moved the barycenter at least half as far as it would alone."""
        if abs(area_mm2) >= SMALL * spot.zone.area_mm2:
            return True
        ahead_x, ahead_y = spot.ahead(self._time_us)
        zone_x, zone_y = place(zone)
        share = area_mm2 / (spot.zone.area_mm2 + area_mm2)
        dx, dy = share * across(x - ahead_x, self._around_mm), share * (y - ahead_y)
        return 2 * (dx * across(zone_x - ahead_x, self._around_mm) + dy * (zone_y - ahead_y)) >= dx * dx + dy * dy

    def _expects(self, spot: Spot, zone: Zone) -> bool:
        return expected(spot, zone, self._time_us, self._around_mm, self._gate_mm)

    # ---- what becomes of a spot

    def _go_on(self, spot: Spot, zone: Zone, merged: list[Spot] | None, split: list[Zone] | None) -> None:
        if merged:
            join(spot, merged, zone, self._time_us, self._around_mm)
            self._spots.append(spot)
            first, *others = (one.id for one in spot.members)
            self._say("merge", first, zone, tuple(others))
        elif split:
            self._part(spot, [zone, *split])
        else:
            if not self._changed(spot, zone):
                spot.follow(zone, self._time_us, self._around_mm)
            self._spots.append(spot)
            self._forget(spot)
            if self._distance(spot.from_x, spot.from_y, zone) >= self._move_mm:
                spot.from_x, spot.from_y = spot.x, spot.y
                self._say("move", spot.members[0].id, zone)

    def _changed(self, spot: Spot, zone: Zone) -> bool:
        """Take a contact that entered or left the zone of a spot at rest while the others stayed, and return whether
        one did. A switch that bounces after such a change may do so at once."""
        more_mm2 = zone.area_mm2 - spot.zone.area_mm2
        rested = spot.seen_us - spot.rest_us >= REST_US or self._time_us - spot.changed_us <= self._hold_us
        if not more_mm2 or not rested:
            return False
        x, y = place(zone)
        scale = zone.area_mm2 / more_mm2
        dx, dy = scale * across(x - spot.x, self._around_mm), scale * (y - spot.y)
        return (self._entered if more_mm2 > 0 else self._left)(spot, zone, abs(more_mm2), dx, dy)

    def _entered(self, spot: Spot, zone: Zone, more_mm2: float, dx: float, dy: float) -> bool:
        """Take a contact that entered a zone at an offset from the spot's place; return whether the new area is one."""
        gone = spot.nearest(dx, dy, gone=True)
        if gone is not None:
            gone.gone_us = None
            spot.shift(zone, self._time_us, self._around_mm)
            return True
        least_mm2 = min(one.area_mm2 for one in spot.members) / 2
        if more_mm2 < least_mm2 or math.hypot(dx, dy) < radius_mm(spot.zone.area_mm2) + radius_mm(more_mm2):
            return False
        new = self._begin(zone)
        new.area_mm2, new.dx, new.dy = more_mm2, dx, dy
        spot.members.append(new)
        spot.shift(zone, self._time_us, self._around_mm)
        first, *others = (one.id for one in spot.members)
        self._say("merge", first, zone, tuple(others))
        return True

    def _left(self, spot: Spot, zone: Zone, less_mm2: float, dx: float, dy: float) -> bool:
        """Note that a contact left a zone at an offset from the spot's place; return whether the lost area was one."""
        one = spot.nearest(dx, dy, gone=False)
        there = sum(other.gone_us is None for other in spot.members)
        if one is None or there == 1 or less_mm2 < one.area_mm2 / 2:
            return False
        one.gone_us = self._time_us
        spot.shift(zone, self._time_us, self._around_mm)
        return True

    def _part(self, spot: Spot, zones: list[Zone]) -> None:
        first = spot.members[0].id
        for one in spot.members:
            one.gone_us = None  # it may have parted
        for zone, members in shared_out(spot, zones, self._time_us, self._around_mm, self._gate_mm):
            if not members:
                members = [self._begin(zone, (first,))]
            self._spots.append(piece(spot, zone, members, self._time_us, self._around_mm))
            if first not in [one.id for one in members]:
                self._say("split", members[0].id, zone, (first,))

    def _held(self, spot: Spot, overflow: bool) -> bool:
        """Whether a spot missing in this frame may still exist; otherwise ends it."""
        if overflow or self._time_us - spot.seen_us < self._hold_us:
            return True
        self._end(spot)
        return False

    def _forget(self, spot: Spot) -> None:
        gone = [(one.gone_us, one) for one in spot.members if one.gone_us is not None]
        for gone_us, one in gone:
            if self._time_us - gone_us >= self._hold_us:
                spot.remove(one)
                self._say("up", one.id, spot.zone, seen_us=gone_us)
        spare = None if gone else spot.spare()
        if spare is None:
            spot.small_us = None
        elif spot.small_us is None:
            spot.small_us = self._time_us
        elif self._time_us - spot.small_us >= self._shared_us:
            spot.remove(spare)
            spot.small_us = None
            self._say("up", spare.id, spot.zone, seen_us=spot.seen_us)

    def _begin(self, zone: Zone, parents: tuple[int, ...] = ()) -> Member:
        made = Member(self._next_id, self._time_us, zone.area_mm2)
        self._next_id += 1
        self._say("down", made.id, zone, parents)
        return made

    def _end(self, spot: Spot) -> None:
        for one in spot.members:
            self._say("up", one.id, spot.zone, seen_us=spot.seen_us)

    def _say(
        self, kind: Kind, name: int, zone: Zone, parents: tuple[int, ...] = (), seen_us: int | None = None
    ) -> None:
        seen = self._time_us if seen_us is None else seen_us
        self._events.append(Event(kind, name, self._time_us, parents, zone, seen))


SIGMAS = 3.0
"""Standard deviations of the gate for the least certain contact."""

GOING_S = 1.0
"""Mean time for which two contacts in a shared zone keep their motion."""

FIRST_S = 0.01

REST_US = 40_000
"""Time at rest after which a sudden change of a zone's area counts as a contact that entered or left. A contact that
moves changes its cells more often."""

LARGER = 1.0
"""Standard deviation of the logarithm of a contact's growth in a shared zone."""


class Way(NamedTuple):
    """A hypothesis of how a contact reached a zone."""

    off_mm: float
    """Distance from the expected place."""
    odd: float
    """-2 times the logarithm of the zone's probability density, in 1/mm^2."""


Apart = Callable[[Spot, Zone], float]
Shifts = Callable[[Spot, Zone, float, float, float], bool]

Pairs = list[tuple[Spot, Zone]]

MOST = 0.75
"""Least ratio of areas of a zone to the spots that merged into it, or of the zones to the spot that parted."""

SMALL = 0.25
"""Least ratio of areas at which a zone's area alone shows that another one merged into it, or parted."""

REACH = 1.5
"""Gates for parting and merging: a zone leaves or enters another within the gate plus this many radii of the larger
zone, as feet are long; one of several contacts leaves within this many gates of its expected place."""


def merged(
    pairs: Pairs, lost: list[Spot], free: list[Zone], apart: Apart, shifts: Shifts, gate_mm: float
) -> dict[Spot, list[Spot]]:
    """Lost spots by the spot whose zone they entered; removed from ``lost``. A new zone of several is removed from
    ``free`` and paired with the largest."""
    found: dict[Spot, list[Spot]] = {}
    area = {spot: spot.zone.area_mm2 for spot, _ in pairs}
    for spot in list(lost):
        best, least = None, math.inf
        for other, zone in pairs:
            distance = apart(spot, zone)
            grown = zone.area_mm2 >= area[other] + spot.zone.area_mm2 / 2
            grown = grown and shifts(other, zone, spot.zone.area_mm2, spot.x, spot.y)
            grown = grown or distance <= touch_mm(spot.zone, zone)
            if grown and distance < least and distance <= gate_mm + REACH * radius_mm(zone.area_mm2):
                best, least = other, distance
        if best is not None:
            found.setdefault(best, []).append(spot)
            area[best] += spot.zone.area_mm2
            lost.remove(spot)
    for zone in list(free):
        near = [spot for spot in lost if apart(spot, zone) <= gate_mm + REACH * radius_mm(zone.area_mm2)]
        if len(near) > 1 and zone.area_mm2 >= MOST * math.fsum(spot.zone.area_mm2 for spot in near):
            first = max(near, key=lambda spot: spot.zone.area_mm2)
            found[first] = [spot for spot in near if spot is not first]
            pairs.append((first, zone))
            free.remove(zone)
            for spot in near:
                lost.remove(spot)
    return found


def parted(
    pairs: Pairs,
    lost: list[Spot],
    free: list[Zone],
    merges: dict[Spot, list[Spot]],
    apart: Apart,
    shifts: Shifts,
    expects: Callable[[Spot, Zone], bool],
    gate_mm: float,
) -> dict[Spot, list[Zone]]:
    """New zones by the spot that they leave, by place and lost area or by expected places of contacts; removed from
    ``free``, and lost spots in several zones from ``lost``."""
    found: dict[Spot, list[Zone]] = {}
    own = {spot: zone for spot, zone in pairs if spot not in merges}
    left = {spot: zone.area_mm2 for spot, zone in own.items()}
    for zone in list(free):
        best, least = None, math.inf
        for spot in left:
            count = 1 + len(found.get(spot, ()))
            lost_area = spot.zone.area_mm2 >= left[spot] + zone.area_mm2 / 2
            lost_area = lost_area and shifts(spot, own[spot], -zone.area_mm2, *place(zone))
            reach = min(least, gate_mm + REACH * radius_mm(spot.zone.area_mm2))
            more = lost_area or (count < len(spot.members) and expects(spot, zone))
            if more and (distance := apart(spot, zone)) <= reach:
                best, least = spot, distance
        if best is not None:
            found.setdefault(best, []).append(zone)
            left[best] += zone.area_mm2
            free.remove(zone)
    for spot in list(lost):
        near = [zone for zone in free if apart(spot, zone) <= gate_mm + REACH * radius_mm(spot.zone.area_mm2)]
        if len(near) > 1 and spot.zone.area_mm2 >= MOST * math.fsum(zone.area_mm2 for zone in near):
            found[spot] = near
            lost.remove(spot)
            for zone in near:
                free.remove(zone)
    return found


def touch_mm(one: Zone, other: Zone) -> float:
    return radius_mm(one.area_mm2) + radius_mm(other.area_mm2)


def join(spot: Spot, others: list[Spot], zone: Zone, time_us: int, around_mm: float | None) -> None:
    """Put the contacts of all spots into a zone, at their expected places."""
    x, y = place(zone)
    for one in (spot, *others):
        ahead_x, ahead_y = one.ahead(time_us)
        for member in one.members:
            member.dx, member.dy = across(ahead_x + member.dx - x, around_mm), ahead_y + member.dy - y
            member.vx, member.vy = member.vx + one.vx, member.vy + one.vy
            member.known = one.known
    largest = min((spot, *others), key=lambda one: (-one.zone.area_mm2, one.members[0].id))
    rest = [member for one in (spot, *others) if one is not largest for member in one.members]
    spot.members = largest.members + sorted(rest, key=rank)
    total = spot.area_mm2
    spot.vx = math.fsum(member.area_mm2 * member.vx for member in spot.members) / total
    spot.vy = math.fsum(member.area_mm2 * member.vy for member in spot.members) / total
    spot.place(zone, time_us)
    spot.joined_us, spot.small_us = time_us, None
    spot.center()


def _ways(spot: Spot, member: Member, zone: Zone, time_us: int, around_mm: float | None) -> tuple[Way, Way]:
    """Two hypotheses of a contact's way: it kept its motion, less surely with time; or it stopped or returned."""
    x, y = place(zone)
    ahead_x, ahead_y = spot.ahead(time_us)
    off_x, off_y = across(x - ahead_x - member.dx, around_mm), y - ahead_y - member.dy
    seconds, error = (time_us - spot.joined_us) / 1e6, error_mm2(zone)
    went = math.hypot(off_x - member.vx * seconds, off_y - member.vy * seconds)
    far = error + member.known.place + seconds * (2 * member.known.both + seconds * member.known.speed)
    back = math.hypot(off_x, off_y)
    near = error + (REACH * radius_mm(member.area_mm2)) ** 2
    stopped = -math.expm1(-(seconds + FIRST_S) / GOING_S)
    return (
        Way(went, went * went / far + 2 * math.log(far) + 2 * seconds / GOING_S),
        Way(back, back * back / near + 2 * math.log(near) - 2 * math.log(stopped)),
    )


def _larger(member: Member, zone: Zone) -> float:
    return (math.log(zone.area_mm2 / member.area_mm2) / LARGER) ** 2


def expected(spot: Spot, zone: Zone, time_us: int, around_mm: float | None, gate_mm: float) -> bool:
    """Whether one of a spot's several contacts may be at a new zone."""
    return len(spot.members) > 1 and any(
        way.off_mm <= REACH * gate_mm for one in spot.members for way in _ways(spot, one, zone, time_us, around_mm)
    )


def shared_out(
    spot: Spot, zones: list[Zone], time_us: int, around_mm: float | None, gate_mm: float
) -> list[tuple[Zone, list[Member]]]:
    """The zones of a parted spot with their contacts: one each by place and area, the rest where most likely."""
    ways = [[_ways(spot, one, zone, time_us, around_mm) for zone in zones] for one in spot.members]
    off = [[min(way.off_mm for way in both) for both in line] for line in ways]
    odd = [[min(way.odd for way in both) for both in line] for line in ways]
    # Each zone has one of them. What that costs a contact is how much less likely it is there than where it would go.
    costs = [
        [
            odd[n][m] - min(odd[n]) + _larger(one, zone) if off[n][m] <= REACH * gate_mm else math.inf
            for m, zone in enumerate(zones)
        ]
        for n, one in enumerate(spot.members)
    ]
    chosen = assign(costs, 1e6)
    found: list[list[Member]] = [[] for _ in zones]
    for member, line, column in zip(spot.members, odd, chosen):
        found[line.index(min(line)) if column is None else column].append(member)
    for members in found:
        members.sort(key=rank)
    # The one that it went by comes first, so that what parts from it is reported after it.
    first = spot.members[0]
    return sorted(zip(zones, found), key=lambda pair: first not in pair[1])


def piece(spot: Spot, zone: Zone, members: list[Member], time_us: int, around_mm: float | None) -> Spot:
    """The part of a spot in one of its zones."""
    x, y = place(zone)
    ahead_x, ahead_y = spot.ahead(time_us)
    made = Spot(zone, time_us, members)
    made.vx, made.vy = spot.vx, spot.vy
    first, seconds = members[0], (time_us - spot.joined_us) / 1e6
    went, stays = _ways(spot, first, zone, time_us, around_mm)
    if len(spot.members) > 1 and went.odd <= stays.odd:
        made.vx, made.vy = spot.vx + first.vx, spot.vy + first.vy
        off_x = across(x - ahead_x - first.dx - first.vx * seconds, around_mm)
        off_y = y - ahead_y - first.dy - first.vy * seconds
        made.fx, made.fy = x - off_x, y - off_y
        made.correct(off_x, off_y, first.known.later(seconds), error_mm2(zone) * max(1.0, SAME_S / max(seconds, 1e-6)))
    for one in members:
        one.dx, one.dy = across(ahead_x + one.dx - x, around_mm), ahead_y + one.dy - y
    if len(members) == 1:
        members[0].area_mm2 = zone.area_mm2
    made.center()
    return made
