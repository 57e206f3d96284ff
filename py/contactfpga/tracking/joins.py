"""Contacts that come together in one zone, and zones that come apart: told from a lift and a touch by their areas."""

from __future__ import annotations

import math
from collections.abc import Callable

from contactfpga.tracking.assignment import assign
from contactfpga.tracking.spot import PASSING_S, Member, Spot, place, radius_mm
from contactfpga.zones.around import across
from contactfpga.zones.zone import Zone

FASTER = (1.0, 1.5, 2.0)
"""How many times as fast as measured two may pass each other: a smoothed speed comes after the contact's."""

Apart = Callable[[Spot, Zone], float]
"""From where a spot would be to a zone, in mm."""

Pairs = list[tuple[Spot, Zone]]

MOST = 0.75
"""Part of the areas that a zone must have to be made of several spots, or several zones of one spot."""

REACH = 1.5
"""A zone comes out of another, or goes into it, within the gate and so many radii of the larger one: a foot is long.
One of several contacts comes out within so many gates of where it would be."""


def merged(pairs: Pairs, lost: list[Spot], free: list[Zone], apart: Apart, gate_mm: float) -> dict[Spot, list[Spot]]:
    """Which lost spots are now in the zone of another one. They are taken from ``lost``; a new zone that several make
    up is taken from ``free`` and paired with the largest."""
    found: dict[Spot, list[Spot]] = {}
    area = {spot: spot.zone.area_mm2 for spot, _ in pairs}
    for spot in list(lost):
        best, least = None, math.inf
        for other, zone in pairs:
            distance = apart(spot, zone)
            grown = zone.area_mm2 >= area[other] + spot.zone.area_mm2 / 2
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
    expects: Callable[[Spot, Zone], bool],
    gate_mm: float,
) -> dict[Spot, list[Zone]]:
    """Which new zones come out of which spot: where it was, and of what it lost in area; of a spot with several
    contacts, where one of these would be. They are taken from ``free``, a lost spot that lies in several from
    ``lost``."""
    found: dict[Spot, list[Zone]] = {}
    left = {spot: zone.area_mm2 for spot, zone in pairs if spot not in merges}
    for zone in list(free):
        best, least = None, math.inf
        for spot in left:
            count = 1 + len(found.get(spot, ()))
            lost_area = spot.zone.area_mm2 >= left[spot] + zone.area_mm2 / 2
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


def join(spot: Spot, others: list[Spot], zone: Zone, time_us: int, around_mm: float | None) -> None:
    """Put the contacts of all these into this zone, each where it would be."""
    x, y = place(zone)
    for one in (spot, *others):
        ahead_x, ahead_y = one.ahead(time_us)
        for member in one.members:
            member.dx, member.dy = across(ahead_x + member.dx - x, around_mm), ahead_y + member.dy - y
            member.vx, member.vy = member.vx + one.vx, member.vy + one.vy
    spot.members += [member for other in others for member in other.members]
    spot.members.sort(key=_rank)
    total = spot.area_mm2
    spot.vx = math.fsum(member.area_mm2 * member.vx for member in spot.members) / total
    spot.vy = math.fsum(member.area_mm2 * member.vy for member in spot.members) / total
    spot.place(zone, time_us)
    spot.joined_us, spot.small_us = time_us, None
    spot.center()


def _rank(member: Member) -> tuple[float, int]:
    """A zone goes by the largest of its contacts: a finger on a switch that is stuck stays the finger."""
    return -member.area_mm2, member.id


def _ways(spot: Spot, time_us: int) -> tuple[float, ...]:
    """For how many seconds at their measured speeds its contacts may have gone on against each other: for none, when
    they came together and went back, or since they came together, when they pass."""
    passed_s = (time_us - spot.joined_us) / 1e6
    if len(spot.members) == 1 or not 0 < passed_s <= PASSING_S:
        return (0.0,)
    return 0.0, *(passed_s * faster for faster in FASTER)


def _off(spot: Spot, member: Member, zone: Zone, seconds: float, time_us: int, around_mm: float | None) -> float:
    """From where a contact of a spot would be, having gone on for so long, to a zone, in mm."""
    x, y = place(zone)
    ahead_x, ahead_y = spot.ahead(time_us)
    dx, dy = member.dx + member.vx * seconds, member.dy + member.vy * seconds
    return math.hypot(across(x - ahead_x - dx, around_mm), y - ahead_y - dy)


def expected(spot: Spot, zone: Zone, time_us: int, around_mm: float | None, gate_mm: float) -> bool:
    """Whether one of several contacts of a spot would be where a zone is new."""
    return len(spot.members) > 1 and any(
        _off(spot, one, zone, seconds, time_us, around_mm) <= REACH * gate_mm
        for seconds in _ways(spot, time_us)
        for one in spot.members
    )


def shared_out(
    spot: Spot, zones: list[Zone], time_us: int, around_mm: float | None, gate_mm: float
) -> list[tuple[Zone, list[Member]]]:
    """The zones a spot came apart into, each with its contacts: one each where they would be, the largest with most
    right to it, the rest where they are nearest; none for a zone that begins a contact."""
    far = 1 + spot.area_mm2 * REACH * gate_mm  # more than any pairing costs: whoever can have a zone has one
    ways = []
    for seconds in _ways(spot, time_us):
        off = [[_off(spot, one, zone, seconds, time_us, around_mm) for zone in zones] for one in spot.members]
        costs = [
            [one.area_mm2 * distance if distance <= REACH * gate_mm else math.inf for distance in line]
            for one, line in zip(spot.members, off)
        ]
        chosen = assign(costs, far)
        total = math.fsum(far if column is None else line[column] for line, column in zip(costs, chosen))
        ways.append((total, off, chosen))
    _, off, chosen = min(ways, key=lambda way: way[0])
    found: list[list[Member]] = [[] for _ in zones]
    for member, line, column in zip(spot.members, off, chosen):
        found[line.index(min(line)) if column is None else column].append(member)
    for members in found:
        members.sort(key=_rank)
    # The one that it went by comes first, so that what parts from it is told after it.
    first = spot.members[0]
    return sorted(zip(zones, found), key=lambda pair: first not in pair[1])


def piece(spot: Spot, zone: Zone, members: list[Member], time_us: int, around_mm: float | None) -> Spot:
    """What becomes of a spot in one of the zones that it came apart into."""
    x, y = place(zone)
    ahead_x, ahead_y = spot.ahead(time_us)
    made = Spot(zone, time_us, members)
    made.born_us = spot.born_us
    made.vx, made.vy = spot.vx + members[0].vx, spot.vy + members[0].vy
    for one in members:
        one.dx, one.dy = across(ahead_x + one.dx - x, around_mm), ahead_y + one.dy - y
    if len(members) == 1:
        members[0].area_mm2 = zone.area_mm2
    made.center()
    return made
