"""What a board says as messages of ROS 2."""

from __future__ import annotations

import functools
import math
import struct
from typing import Any

import numpy as np

from contactfpga.recordings.cdr import BEGIN, aligned, encode
from contactfpga.ros.types import PACKAGE, message_type
from contactfpga.tracking.tracks import Event, Track, Tracks
from contactfpga.zones.units import UnitSamples
from contactfpga.zones.zone import Zone, Zones

BYTES, FAULTS, UNITS, ZONES, TRACKS = (f"{PACKAGE}/{name}" for name in ("Bytes", "Faults", "Units", "Zones", "Tracks"))
TRANSFORMS, MARKERS, WRENCH = "tf2_msgs/TFMessage", "visualization_msgs/MarkerArray", "geometry_msgs/WrenchStamped"

NAN3 = (math.nan,) * 3
BARE = ("overflow", "mismatch", "fault", "motion", "ghost")
"""Names of flags, as bits of ``Zones.flags`` from the lowest on."""
_BITS = {name: message_type(ZONES).constant(f"FLAG_{name.upper()}") for name in BARE}
_EVENTS = {kind: message_type(f"{PACKAGE}/TrackEvent").constant(kind.upper()) for kind in
           ("down", "move", "merge", "split", "up")}  # fmt: skip
_GHOST = message_type(f"{PACKAGE}/Zone").constant("FLAG_GHOST")


def header(time_ns: int, frame: str) -> tuple[tuple[int, int], str]:
    """A ``std_msgs/Header``; ``time_ns`` since 1970."""
    return divmod(time_ns, 1_000_000_000), frame


def of_bytes(data: bytes, time_ns: int, frame: str) -> bytes:
    """Bytes that came until then."""
    return encode(BYTES, (header(time_ns, frame), data))


def of_faults(names: tuple[str, ...], time_ns: int, frame: str) -> bytes:
    """Faults by name."""
    return encode(FAULTS, (header(time_ns, frame), names))


def of_units(samples: UnitSamples, time_ns: int, frame: str) -> bytes:
    """A sweep of the pressure units."""
    values = samples.time_us, samples.readings, samples.sigma, samples.saturated
    return encode(UNITS, (header(time_ns, frame), *values))


def of_zones(zones: Zones, time_ns: int, frame: str, sigma_s: float = math.nan) -> bytes:
    """A frame; ``time_ns``: of its sample, with its standard deviation in s."""
    found = [_zone(zone) for zone in zones]
    flags = sum(_BITS[name] for name in zones.flags)
    facts = sigma_s, zones.time_us, zones.sequence, flags, zones.overwritten, zones.pressed, zones.total_zones
    cells = b"" if zones.cells is None else np.packbits(zones.cells).tobytes()
    if zones.faults:
        return encode(ZONES, (header(time_ns, frame), *facts, zones.faults, found, cells))
    # Most frames have no fault; then all places are known from how many zones there are.
    named = frame.encode() + b"\0"
    flat = [value for position, normal, *rest in found for value in (*position, *normal, *rest)]
    packed = _layout(len(named), len(found))
    return (
        BEGIN
        + packed.pack(*divmod(time_ns, 1_000_000_000), len(named), named, *facts, 0, len(found), *flat, len(cells))
        + cells
    )


@functools.lru_cache(maxsize=256)
def _layout(name_bytes: int, zones: int) -> struct.Struct:
    """Of a frame without faults, up to the number of bytes of its cells."""
    letters = ["i", "I", "I", f"{name_bytes}s", *"dQBBIII", "I", "I", *("d" * 9 + "IIIB") * zones, "I"]
    form, offset = "<", 0
    for letter in letters:
        size = name_bytes if letter.endswith("s") else struct.calcsize(letter)
        begin = offset if letter.endswith("s") else aligned(offset, size)
        form += "x" * (begin - offset) + letter
        offset = begin + size
    return struct.Struct(form)


def of_tracks(tracks: Tracks, time_ns: int, frame: str) -> bytes:
    """Contacts over time."""
    active, events = [_track(one) for one in tracks.active], [_event(one) for one in tracks.events]
    values = tracks.time_us, active, events, len(tracks.unsure), tracks.restarted
    return encode(TRACKS, (header(time_ns, frame), *values))


def _zone(zone: Zone) -> tuple[Any, ...]:
    area = zone.area_mm2 * 1e-6, zone.area_cells, zone.sum_x or 0, zone.sum_y or 0, _GHOST if zone.ghost else 0
    if zone.point_mm is None or zone.normal is None or zone.x_mm is None or zone.y_mm is None:
        return NAN3, NAN3, math.nan, math.nan, *area
    x, y, z = zone.point_mm
    return (x * 1e-3, y * 1e-3, z * 1e-3), zone.normal, zone.x_mm * 1e-3, zone.y_mm * 1e-3, *area


def _track(one: Track) -> tuple[Any, ...]:
    speed = one.vx_mm_s * 1e-3, one.vy_mm_s * 1e-3
    return one.id, _zone(one.zone), one.since_us, one.seen_us, *speed, one.held, one.merged


def _event(one: Event) -> tuple[Any, ...]:
    return _EVENTS[one.kind], one.id, one.time_us, one.seen_us, one.parents, _zone(one.zone)


def of_transforms(links: list[tuple[str, str, tuple[float, ...], tuple[float, ...]]], time_ns: int) -> bytes:
    """Where links are: parent, child, place in m and turn as a quaternion (x, y, z, w)."""
    return encode(
        TRANSFORMS, [[(header(time_ns, parent), child, (place, turn)) for parent, child, place, turn in links]]
    )


_CYLINDER, _ADD, _DELETE_ALL = 3, 0, 3
_NO_POSE = (0.0,) * 3, (0.0, 0.0, 0.0, 1.0)
_THICK_M = 0.002
_COLOR = 0.90, 0.45, 0.10, 0.9


def of_markers(zones: Zones, time_ns: int, frame: str) -> bytes:
    """Zones as disks of their areas, which 3-D programs draw: barycenters and areas are known, shapes are not."""
    drawn = [_marker(time_ns, frame, 0, _DELETE_ALL, _NO_POSE, 0.0)]
    for number, zone in enumerate(zones):
        if zone.point_mm is not None and zone.normal is not None:
            x, y, z = zone.point_mm
            pose = (x * 1e-3, y * 1e-3, z * 1e-3), _upright(zone.normal)
            across_m = 2e-3 * math.sqrt(zone.area_mm2 / math.pi)
            drawn.append(_marker(time_ns, frame, number, _ADD, pose, across_m))
    return encode(MARKERS, [drawn])


def _marker(
    time_ns: int, frame: str, number: int, action: int, pose: tuple[Any, Any], across_m: float
) -> tuple[Any, ...]:
    stamped = header(time_ns, frame)
    scale = across_m, across_m, _THICK_M
    image = (header(0, ""), "", b"")
    return (
        *(stamped, "zones", number, _CYLINDER, action, pose, scale, _COLOR, (0, 0), False, (), ()),
        *("", image, (), "", "", ("", b""), False),
    )


def _upright(normal: tuple[float, float, float]) -> tuple[float, float, float, float]:
    """The shortest turn of the z axis into this direction, as a quaternion."""
    x, y, z = normal
    if z < -1 + 1e-9:
        return 1.0, 0.0, 0.0, 0.0
    length = math.sqrt(2 * (1 + z))
    return -y / length, x / length, 0.0, length / 2
