"""The sheet and its contacts as markers, which RViz and Foxglove draw."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from contactfpga import surfaces
from contactfpga.robot.ros.convert import Message, forces_of, quaternion, vector
from contactfpga.skin.sheet import Sheet
from contactfpga.tracking.tracks import Track

if TYPE_CHECKING:
    from contactfpga.robot.haptics import Contacts

ARROW, SPHERE, LINE_STRIP, TEXT = 0, 2, 4, 9
ADD, DELETE_ALL = 0, 3
LIFETIME_NS = 500_000_000
"""After this time without news they vanish: no data is never no contact."""
NEWTON_M = 0.01
"""Length of an arrow per newton; without forces an arrow has :data:`ARROW_M`."""
ARROW_M = 0.03

_EDGE = 16
"""Pieces of each edge of the outline."""
_GRAY, _BLUE, _ORANGE = (0.5, 0.5, 0.5, 1.0), (0.0, 0.45, 0.7, 0.9), (0.85, 0.37, 0.0, 1.0)


Place = Callable[[float, float], tuple[Sequence[float], Sequence[float]]]
"""From x and y on the sheet in mm to a point in m and the normal there."""


def outline(sheet: Sheet, place: Place | None = None) -> list[Message]:
    """The rim of the sheet's cells in m, as points of a line; ``place`` says where it lies that does not lie as its
    Skin says."""
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
    arrow: the force on the link, or where none is known the inward normal."""
    shown = [_marker(head, "", 0, ADD, action=DELETE_ALL)]
    shown.append(_marker(head, "sheet", 0, LINE_STRIP, scale=(0.001, 0.0, 0.0), color=_GRAY, points=rim))
    known = forces_of(forces)
    for track in found:
        if track.zone.point_mm is not None and track.zone.normal is not None:
            shown += _contact(track, head, known.get(track.id))
    return {"markers": shown}


def _contact(track: Track, head: Message, force_n: Sequence[float] | None) -> list[Message]:
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
