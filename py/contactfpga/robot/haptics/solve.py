"""From a wrench and touched places to contacts, by the simplest model that suffices."""

from __future__ import annotations

import math
from collections.abc import Sequence

from contactfpga.robot.haptics import few, many
from contactfpga.robot.haptics.alone import AloneWatch
from contactfpga.robot.haptics.answer import HapticsError
from contactfpga.robot.haptics.contact import FULL_WRENCH, Contacts, Seen, Solution, Touch
from contactfpga.robot.haptics.surface import Surface
from contactfpga.robot.haptics.system import System, distinct
from contactfpga.robot.haptics.wrench import Wrench
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
    """The force at each zone, or at each place in a list of :class:`Touch`.

    One contact: a closed form. Two: the same, with the exact interval of each push. More: pushes along the normals if
    they suffice, else forces in pyramids within friction's cones, by non-negative least squares (extra `haptics`). With
    ``cones`` friction's cones themselves, by Clarabel. Where units do not see all six components of the wrench, or
    friction is 0, pushes along the normals. Where there is no zone, the center of pressure on ``surface``. No contact
    ever pulls.

    Args:
        surface: the bumper's outside, on which zones are placed.
        friction: of zones; a :class:`Touch` has its own.
        sheet_m: where column 0 and row 0 lie on the surface laid flat.
        link: name of the link; by default that of the wrench's frame.
        tracks: of the same zones, for :attr:`Contact.track`.
        alone: knows places of contacts from the time when they were alone; it has taken this frame.
    """
    if isinstance(zones, Zones):
        touches: Sequence[Touch] = touched(zones, surface, friction, sheet_m)
        touches = touches if alone is None else alone.sharpened(zones, touches)
        seen = Seen(link, zones.time_us, () if tracks is None else _tracked(zones, tracks))
    else:
        touches, seen = zones, Seen(link)
    if not touches:
        return Contacts(wrench, (), _nothing(wrench), None if surface is None else surface.center(wrench), seen)
    if len(touches) > 1:
        distinct(touches)
    return Contacts(wrench, touches, _chosen(wrench, touches, cones), seen=seen)


def _tracked(zones: Zones, tracks: Tracks) -> list[int | None]:
    names = {id(track.zone): track.id for track in tracks.active}
    return [names.get(id(zone)) for zone in zones if zone.point_mm is not None]


def _chosen(wrench: Wrench, touches: Sequence[Touch], cones: bool) -> Solution:
    rough = [touch.friction > 0 for touch in touches]
    sees_all = wrench.noise is None or wrench.noise.rank == 6
    if not sees_all or not any(rough):
        return many.pushes(System(wrench, touches))
    if cones:
        return many.within_cones(System(wrench, touches))
    if len(touches) == 1:
        return few.one(wrench, touches[0])
    if len(touches) == 2 and all(rough):
        return few.two(wrench, touches)
    return many.many(System(wrench, touches))


def _nothing(wrench: Wrench) -> Solution:
    rest, noise = wrench.array, wrench.noise
    chi2 = None if noise is None else float(rest @ noise.information @ rest)
    return Solution(FULL_WRENCH, [], list, 0, [], chi2, 6 if noise is None else noise.rank, (), wrench, lambda: None)


def touched(
    zones: Zones, surface: Surface | None, friction: float = 0.5, sheet_m: tuple[float, float] = (0.0, 0.0)
) -> list[Touch]:
    """The zones as places on the bumper's outside. A barycenter is taken to be off by no more than chance within a
    cell, a pitch over the root of 12; :class:`~contactfpga.robot.haptics.Locator` knows better."""
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
