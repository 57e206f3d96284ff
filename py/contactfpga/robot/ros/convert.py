"""What a board says, as messages: lengths in m, flags as bits. Whoever publishes or records takes them from here."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from contactfpga.robot.ros.types import PACKAGE, message_type
from contactfpga.tracking.tracks import Event, Track, Tracks
from contactfpga.wire.hello import Hello
from contactfpga.zones.zone import Zone, Zones

if TYPE_CHECKING:
    from contactfpga.robot.haptics import Contacts, Wrench

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
    """A ``std_msgs/Header``: a moment in ns since 1970, and the frame in which places are given."""
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
    """A ``Zone``."""
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
    """A ``Zones``; ``sigma_s`` is the standard deviation of the header's time in s."""
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
    """The flags of a frame as a ``Zones`` has them."""
    return sum(FLAGS[name] for name in flags)


def tracks(found: Tracks, events: Iterable[Event], restarted: bool, head: Message) -> Message:
    """A ``Tracks`` with all events since the message before, and whether contacts were begun again since."""
    return {
        "header": head,
        "device_time_us": found.time_us,
        "active": [_track(one) for one in found.active],
        "events": [_event(one) for one in events],
        "unsure": len(found.unsure),
        "restarted": restarted,
    }


def contacts(found: Iterable[Track], head: Message, forces: Contacts | None = None) -> Message:
    """A ``Contacts``: the tracks that the frame shows, each with its force where that is known."""
    shown = [one for one in found if not one.held and one.zone.point_mm is not None]
    known = forces_of(forces)
    return {"header": head, "contacts": [_contact(one, head["frame_id"], known.get(one.id)) for one in shown]}


def forces_of(forces: Contacts | None) -> dict[int | None, Sequence[float]]:
    """The known forces in N by the ids of their tracks."""
    return {one.track: one.force_n for one in forces or () if one.force_n is not None}


def wrench(found: Wrench, head: Message) -> Message:
    """A ``geometry_msgs/WrenchStamped``: what all contacts together exert on the link, about its origin."""
    return {"header": head, "wrench": {"force": vector(found.force_n), "torque": vector(found.moment_nm)}}


def transform(head: Message, child: str, place_m: Sequence[float], turn_rad: Sequence[float]) -> Message:
    """A ``tf2_msgs/TFMessage``: where a frame lies in that of the header; turned about the fixed x, y and z axes in
    turn, as in a URDF."""
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
    """A ``geometry_msgs/Vector3`` or ``Point``."""
    x, y, z = values
    return {"x": x, "y": y, "z": z}


def quaternion(roll: float, pitch: float, yaw: float) -> Message:
    """A ``geometry_msgs/Quaternion``: turned about the fixed x, y and z axes in turn, in rad."""
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(one / 2), math.cos(one / 2)) for one in (roll, pitch, yaw))
    return {
        "x": sr * cp * cy - cr * sp * sy,
        "y": cr * sp * cy + sr * cp * sy,
        "z": cr * cp * sy - sr * sp * cy,
        "w": cr * cp * cy + sr * sp * sy,
    }
