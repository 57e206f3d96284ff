"""The drawing of a frame as plain arrays."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from contactfpga import picture_style
from contactfpga.robot.body import Support
from contactfpga.robot.haptics import Contacts, LoadCells
from contactfpga.surfaces import Surface
from contactfpga.tools.view.tiles import MM
from contactfpga.tracking.tracks import Tracks
from contactfpga.zones.zone import Zone, Zones

SIDES = 48


def rgb(color: str) -> tuple[int, int, int]:
    value = int(color[1:], 16)
    return value >> 16, value >> 8 & 0xFF, value & 0xFF


OPEN, TRUE, REPORTED, GHOST, UNKNOWN = (
    rgb(color)
    for color in (
        "#76818e",
        picture_style.SKY,
        picture_style.BLUE,
        picture_style.ORANGE,
        picture_style.INK,
    )
)
"""Colors of cells: open; closed by a virtual board's truth, beyond its zones; closed by the board's report; possibly
ghosts; of a link without data.
"""

CIRCLE, TRAIL, PUSH, AXIS = (
    rgb(color) for color in (picture_style.VERMILLION, picture_style.GREEN, picture_style.PURPLE, picture_style.GRAY)
)


def tile_colors(zones: Zones, truth: np.ndarray | None = None) -> np.ndarray:
    """(n, 3) uint8, row by row; with levels of force in shades. ``truth``: closed cells of a virtual board."""
    shape = (zones.sheet.rows, zones.sheet.columns)
    colors = np.empty((*shape, 3), np.uint8)
    colors[:] = OPEN
    if truth is not None:
        colors[truth] = TRUE
    if zones.cells is not None:
        share = zones.cells if zones.levels is None else zones.levels / zones.sheet.levels
        shades = np.array(OPEN) + np.multiply.outer(share, np.subtract(REPORTED, OPEN))
        colors[zones.cells] = shades[zones.cells].round()
        ghosts = zones.ghost_cells
        if ghosts is not None:
            colors[ghosts & zones.cells] = GHOST
    return colors.reshape(-1, 3)


def lit(colors: np.ndarray) -> np.ndarray:
    """(n,) bool: the closed, or possibly closed, cells by color."""
    found: np.ndarray = (colors != np.array(OPEN, np.uint8)).any(-1) & (colors != np.array(UNKNOWN, np.uint8)).any(-1)
    return found


@dataclasses.dataclass(frozen=True)
class Spots:
    """Barycenters and circles of a frame's zones, in m, above the sheet."""

    points: np.ndarray
    """(n, 3)"""
    circles: np.ndarray
    """(m, 2, 3) lines of circles with the zones' areas."""


def spots(zones: Zones, surface: Surface, lift_mm: float) -> Spots:
    """Spots of all zones with a place."""
    placed = [zone for zone in zones if zone.x_mm is not None]
    if not placed:
        return Spots(np.zeros((0, 3)), np.zeros((0, 2, 3)))
    x_mm, y_mm = np.array([(zone.x_mm, zone.y_mm) for zone in placed], float).T
    points = _lifted(surface, x_mm, y_mm, lift_mm)
    return Spots(points, np.concatenate([_circle(zone, surface, lift_mm) for zone in placed]))


def outlines(supports: Iterable[Support], lift_mm: float) -> np.ndarray:
    """(n, 2, 3) lines in m around the polygons of contacts, whose points follow the surface."""
    found = [np.zeros((0, 2, 3))]
    for one in supports:
        rim = one.region_m + lift_mm * MM * one.normals
        found.append(np.stack([rim, np.roll(rim, -1, axis=0)], axis=1))
    return np.concatenate(found)


def radius_mm(zone: Zone) -> float:
    return math.sqrt(zone.area_mm2 / math.pi)


def _circle(zone: Zone, surface: Surface, lift_mm: float) -> np.ndarray:
    angles = np.linspace(0, 2 * math.pi, SIDES + 1)
    radius = radius_mm(zone)
    assert zone.x_mm is not None
    assert zone.y_mm is not None
    rim = _lifted(surface, zone.x_mm + radius * np.cos(angles), zone.y_mm + radius * np.sin(angles), lift_mm)
    return np.stack([rim[:-1], rim[1:]], axis=1)


def _lifted(surface: Surface, x_mm: np.ndarray, y_mm: np.ndarray, lift_mm: float) -> np.ndarray:
    points, normals = surface.place(x_mm, y_mm)
    return (points + lift_mm * normals) * MM


MM_PER_N = 4.0
LEAST_N = 0.02


def pushes(contacts: Contacts, zones: Zones, cells: LoadCells, surface: Surface) -> np.ndarray:
    """(n, 2, 3) arrows in m, one for each contact with a force, from outside to its zone's barycenter.

    Forces are resolved along the normal, rows and columns of the units' surface, which may be the outside of a foam,
    and drawn along those of the sheet.
    """
    placed = [zone for zone in zones if zone.x_mm is not None]
    arrows = []
    for contact, zone in zip(contacts, placed):
        if contact.force_n is None or math.hypot(*contact.force_n) < LEAST_N:
            continue
        assert zone.x_mm is not None
        assert zone.y_mm is not None
        shift_x, shift_y = cells.sheet_m
        assert cells.surface is not None
        theirs = _directions(cells.surface, zone.x_mm * MM + shift_x, zone.y_mm * MM + shift_y, 1.0)
        ours = _directions(surface, zone.x_mm, zone.y_mm, 1 / MM)
        force = (theirs @ np.array(contact.force_n)) @ ours
        tip = np.array(surface.place(zone.x_mm, zone.y_mm)[0])
        arrows.append(np.array([tip - MM_PER_N * force, tip]) * MM)
    return np.array(arrows) if arrows else np.zeros((0, 2, 3))


def _directions(surface: Any, x: float, y: float, unit: float) -> np.ndarray:
    """(3, 3) unit vectors at a place: the normal, and the directions of growing x and y."""
    point, normal = (np.array(each) for each in surface.place(x, y))
    step = 1e-4 * unit
    across = np.array(surface.place(x, y + step)[0]) - point
    across = across - (across @ normal) * normal
    across = across / np.linalg.norm(across)
    return np.stack([normal, np.cross(across, normal), across])


class Trails:
    """Recent paths of the contacts, in m."""

    def __init__(self, surface: Surface, lift_mm: float, seconds: float = 1.0):
        self._surface, self._lift_mm, self._us = surface, lift_mm, seconds * 1e6
        self._ways: dict[int, list[tuple[int, np.ndarray]]] = {}

    def add(self, tracks: Tracks) -> None:
        if tracks.restarted:
            self._ways.clear()
        for track in tracks.active:
            zone = track.zone
            if zone.x_mm is None or zone.y_mm is None or track.held:
                continue
            place = _lifted(self._surface, np.array([zone.x_mm]), np.array([zone.y_mm]), self._lift_mm)[0]
            self._ways.setdefault(track.id, []).append((tracks.time_us, place))
        for number, way in list(self._ways.items()):
            self._ways[number] = kept = [step for step in way if tracks.time_us - step[0] <= self._us]
            if not kept:
                del self._ways[number]

    @property
    def lines(self) -> np.ndarray:
        """(n, 2, 3) line segments."""
        found = [[one[1], other[1]] for way in self._ways.values() for one, other in itertools.pairwise(way)]
        return np.array(found) if found else np.zeros((0, 2, 3))
