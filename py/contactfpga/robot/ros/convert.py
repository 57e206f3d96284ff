"""A board's data as messages, for publishing and recording: lengths in m, flags as bits."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from contactfpga import surfaces
from contactfpga.robot.ros.types import PACKAGE, message_type
from contactfpga.skin.sheet import Sheet
from contactfpga.tracking.tracks import Event, Track, Tracks
from contactfpga.wire.hello import Hello
from contactfpga.zones.zone import Zone, Zones

if TYPE_CHECKING:
    from contactfpga.robot.haptics import Contacts, Wrench
if TYPE_CHECKING:
    from contactfpga.robot.haptics import Contacts

Message = dict[str, Any]

_NAN = math.nan
_NOWHERE = (_NAN, _NAN, _NAN)
_SECOND = 1_000_000_000
_NO_TORQUE = (0.0, 0.0, 0.0)
_UNKNOWN_WRENCH = {"force": dict.fromkeys("xyz", _NAN), "torque": dict.fromkeys("xyz", _NAN)}


def _bits(name: str, prefix: str) -> dict[str, int]:
    constants = message_type(f"{PACKAGE}/{name}").constants
    return {constant.removeprefix(prefix).lower(): bit for constant, bit in constants if constant.startswith(prefix)}


FLAGS = _bits("Zones", "FLAG_")
REPORTS = _bits("Skin", "REPORT_")
EVENTS = _bits("TrackEvent", "")
ZONE_FLAGS = _bits("Zone", "FLAG_")


def header(time_ns: int, frame: str) -> Message:
    """A ``std_msgs/Header``: a moment in ns since 1970, and the frame of places."""
    sec, nanosec = divmod(time_ns, _SECOND)
    return {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": frame}


def skin(hello: Hello, head: Message) -> Message:
    """A ``Skin``."""
    sheet = hello.sheet
    return {
        "header": head,
        "name": hello.name,
        "fingerprint": hello.fingerprint,
        "rows": sheet.rows,
        "columns": sheet.columns,
        "pitch_x": sheet.pitch_x_mm / 1000,
        "pitch_y": sheet.pitch_y_mm / 1000,
        "radius": (sheet.radius_mm or 0.0) / 1000,
        "closed": sheet.closed,
        "ghosts": sheet.ghosts,
        "connectivity": sheet.connectivity,
        "report": REPORTS[sheet.report],
        "barycenter_bits": sheet.barycenter_bits,
        "zone_capacity": sheet.zone_capacity,
        "on_change": hello.send == "on_change",
        "guard": hello.guard,
        "clock_hz": hello.clock_hz,
        "baud": hello.baud,
    }


def zone(found: Zone) -> Message:
    return {
        "position": vector(_NOWHERE) if found.point_mm is None else _point(found.point_mm),
        "normal": vector(found.normal or _NOWHERE),
        "x": _meters(found.x_mm),
        "y": _meters(found.y_mm),
        "area": found.area_mm2 / 1e6,
        "area_cells": found.area_cells,
        "sum_x": found.sum_x or 0,
        "sum_y": found.sum_y or 0,
        "flags": ZONE_FLAGS["ghost"] * found.ghost | ZONE_FLAGS.get(found.winding, 0),
    }


def zones(frame: Zones, head: Message, sigma_s: float | None = None) -> Message:
    """A ``Zones``; ``sigma_s`` is the standard deviation of the header's time."""
    return {
        "header": head,
        "stamp_sigma": _NAN if sigma_s is None else sigma_s,
        "device_time_us": frame.time_us,
        "sequence": frame.sequence,
        "flags": flag_bits(frame.flags),
        "overwritten": frame.overwritten,
        "pressed": frame.pressed,
        "total_zones": frame.total_zones,
        "faults": frame.faults,
        "zones": [zone(one) for one in frame],
        "cells": b"" if frame.cells is None else np.packbits(frame.cells).tobytes(),
    }


@functools.cache
def flag_bits(flags: frozenset[str]) -> int:
    """Flags of a frame as bits of a ``Zones``."""
    return sum(FLAGS[name] for name in flags)


def tracks(found: Tracks, events: Iterable[Event], restarted: bool, head: Message) -> Message:
    """A ``Tracks`` with all events since the previous message, and whether tracking restarted since."""
    return {
        "header": head,
        "device_time_us": found.time_us,
        "active": [_track(one) for one in found.active],
        "events": [_event(one) for one in events],
        "unsure": len(found.unsure),
        "restarted": restarted,
    }


def contacts(found: Iterable[Track], head: Message, forces: Contacts | None = None) -> Message:
    """A ``Contacts``: the tracks in the frame, each with its force if known."""
    shown = [one for one in found if not one.held and one.zone.point_mm is not None]
    known = forces_of(forces)
    return {"header": head, "contacts": [_contact(one, head["frame_id"], known.get(one.id)) for one in shown]}


def forces_of(forces: Contacts | None) -> dict[int | None, Sequence[float]]:
    """Known forces in N by track id."""
    return {one.track: one.force_n for one in forces or () if one.force_n is not None}


def wrench(found: Wrench, head: Message) -> Message:
    """A ``geometry_msgs/WrenchStamped``: the contacts' wrench on the link, about its origin."""
    return {"header": head, "wrench": {"force": vector(found.force_n), "torque": vector(found.moment_nm)}}


def transform(head: Message, child: str, place_m: Sequence[float], turn_rad: Sequence[float]) -> Message:
    """A ``tf2_msgs/TFMessage``: pose of a frame in the header's, with ``turn_rad`` as in :func:`quaternion`."""
    made = {"translation": vector(place_m), "rotation": quaternion(*turn_rad)}
    return {"transforms": [{"header": head, "child_frame_id": child, "transform": made}]}


def _contact(track: Track, frame: str, force_n: Sequence[float] | None) -> Message:
    placed = zone(track.zone)
    known = _UNKNOWN_WRENCH if force_n is None else {"force": vector(force_n), "torque": vector(_NO_TORQUE)}
    return {
        "name": f"{frame}/{track.id}",
        "position": placed["position"],
        "normal": placed["normal"],
        "wrench": known,
    }


def _track(track: Track) -> Message:
    return {
        "id": track.id,
        "zone": zone(track.zone),
        "since_us": track.since_us,
        "seen_us": track.seen_us,
        "velocity_x": track.vx_mm_s / 1000,
        "velocity_y": track.vy_mm_s / 1000,
        "held": track.held,
        "merged": track.merged,
    }


def _event(event: Event) -> Message:
    return {
        "kind": EVENTS[event.kind],
        "id": event.id,
        "device_time_us": event.time_us,
        "seen_us": event.seen_us,
        "parents": event.parents,
        "zone": zone(event.zone),
    }


def _meters(length_mm: float | None) -> float:
    return _NAN if length_mm is None else length_mm / 1000


def _point(point_mm: tuple[float, float, float]) -> Message:
    x, y, z = point_mm
    return {"x": x / 1000, "y": y / 1000, "z": z / 1000}


def vector(values: Sequence[float]) -> Message:
    x, y, z = values
    return {"x": x, "y": y, "z": z}


def quaternion(roll: float, pitch: float, yaw: float) -> Message:
    """A ``geometry_msgs/Quaternion`` of rotations about the fixed x, y and z axes in turn, in rad."""
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(one / 2), math.cos(one / 2)) for one in (roll, pitch, yaw))
    return {
        "x": sr * cp * cy - cr * sp * sy,
        "y": cr * sp * cy + sr * cp * sy,
        "z": cr * cp * sy - sr * sp * cy,
        "w": cr * cp * cy + sr * sp * sy,
    }


ARROW, SPHERE, LINE_STRIP, TEXT = 0, 2, 4, 9
ADD, DELETE_ALL = 0, 3
LIFETIME_NS = 500_000_000
"""Lifetime of markers without updates: no data is never no contact."""
NEWTON_M = 0.01
"""Length of an arrow per newton; :data:`ARROW_M` without forces."""
ARROW_M = 0.03

_EDGE = 16
_GRAY, _BLUE, _ORANGE = (0.5, 0.5, 0.5, 1.0), (0.0, 0.45, 0.7, 0.9), (0.85, 0.37, 0.0, 1.0)


Place = Callable[[float, float], tuple[Sequence[float], Sequence[float]]]
"""From x and y on the sheet in mm to a point in m and the normal there."""


def outline(sheet: Sheet, place: Place | None = None) -> list[Message]:
    """Rim of the sheet's cells in m, as points of a line; ``place`` overrides the Skin's surface."""
    x0, x1 = -sheet.pitch_x_mm / 2, (sheet.columns - 0.5) * sheet.pitch_x_mm
    y0, y1 = -sheet.pitch_y_mm / 2, (sheet.rows - 0.5) * sheet.pitch_y_mm
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]
    places = [corners[0]]
    for (ax, ay), (bx, by) in pairwise(corners):
        places += [(ax + (bx - ax) * part / _EDGE, ay + (by - ay) * part / _EDGE) for part in range(1, _EDGE + 1)]
    if place is not None:
        return [vector(place(x, y)[0]) for x, y in places]
    lies = surfaces.of(sheet)
    return [vector([one / 1000 for one in lies.place(x, y)[0]]) for x, y in places]


def markers(rim: Sequence[Message], found: Sequence[Track], head: Message, forces: Contacts | None = None) -> Message:
    """A ``visualization_msgs/MarkerArray``: the rim, and for each contact a ball as large as its zone, its id, and an
    arrow of the force on the link, or of the inward normal."""
    shown = [_marker(head, "", 0, ADD, action=DELETE_ALL)]
    shown.append(_marker(head, "sheet", 0, LINE_STRIP, scale=(0.001, 0.0, 0.0), color=_GRAY, points=rim))
    known = forces_of(forces)
    for track in found:
        if track.zone.point_mm is not None and track.zone.normal is not None:
            shown += _marks(track, head, known.get(track.id))
    return {"markers": shown}


def _marks(track: Track, head: Message, force_n: Sequence[float] | None) -> list[Message]:
    point = [one / 1000 for one in track.zone.point_mm or ()]
    normal = track.zone.normal or ()
    size = 2 * math.sqrt(track.zone.area_mm2 / math.pi) / 1000
    number = track.id % (1 << 31)
    along = [-ARROW_M * one for one in normal] if force_n is None else [NEWTON_M * float(one) for one in force_n]
    tail = [one - part for one, part in zip(point, along)]
    above = [one + 0.02 * part for one, part in zip(point, normal)]
    arrow = (0.003, 0.006, 0.008)
    return [
        _marker(head, "contacts", number, SPHERE, scale=(size, size, size), color=_BLUE, place=point),
        _marker(head, "forces", number, ARROW, scale=arrow, color=_ORANGE, points=[vector(tail), vector(point)]),
        _marker(head, "ids", number, TEXT, scale=(0.0, 0.0, 0.01), color=_GRAY, place=above, text=str(track.id)),
    ]


def _marker(head: Message, namespace: str, number: int, kind: int, **given: Any) -> Message:
    red, green, blue, alpha = given.get("color", _GRAY)
    return {
        "header": head,
        "ns": namespace,
        "id": number,
        "type": kind,
        "action": given.get("action", ADD),
        "pose": {"position": vector(given.get("place", (0.0, 0.0, 0.0))), "orientation": quaternion(0.0, 0.0, 0.0)},
        "scale": vector(given.get("scale", (0.0, 0.0, 0.0))),
        "color": {"r": red, "g": green, "b": blue, "a": alpha},
        "lifetime": {"sec": 0, "nanosec": LIFETIME_NS},
        "frame_locked": True,
        "points": given.get("points", ()),
        "colors": (),
        "texture_resource": "",
        "texture": {"header": head, "format": "", "data": b""},
        "uv_coordinates": (),
        "text": given.get("text", ""),
        "mesh_resource": "",
        "mesh_file": {"filename": "", "data": b""},
        "mesh_use_embedded_materials": False,
    }
