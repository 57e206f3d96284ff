"""The carrier of a drawn sheet: a forearm with foam for a cylinder, otherwise a plate."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from contactfpga.tools.view.tiles import MM, Tiles

if TYPE_CHECKING:
    import viser

FOAM_MM = 5.0
"""Thickness of the drawn foam: the default of a Skin's `[cover]`."""
UNDER_MM = 1.2
LEFT_MM = 1.0
REACH = 1.6
"""Distance from a closed cell to undented foam, in pitches."""
SIDES = 72

CORE, COLLAR, JOINT, FOAM, PLATE = (52, 58, 67), (176, 183, 192), (96, 104, 115), (228, 234, 240), (52, 58, 67)


class Limb:
    """A forearm in foam about the sheet's z axis, with the elbow below."""

    def __init__(self, server: viser.ViserServer, tiles: Tiles, node: str):
        sheet = tiles.sheet
        assert sheet.radius_mm is not None
        self._tiles = tiles
        low, high = -sheet.pitch_y_mm, sheet.rows * sheet.pitch_y_mm
        radius = sheet.radius_mm
        self._profile = foam_profile(radius, low, high)
        parts = forearm(radius, low, high)
        for name, (profile, color) in parts.items():
            _add(server, f"{node}/{name}", *revolved(profile), color)
        vertices, faces = revolved(self._profile)
        self._foam: Any = _add(server, f"{node}/foam", vertices, faces, FOAM, opacity=0.38)
        self.points_mm = np.concatenate([revolved(profile)[0] for profile, _ in parts.values()])
        """(n, 3) points of everything drawn."""

    def press(self, closed: np.ndarray) -> None:
        """Dent the foam over these cells, (n,) bool row by row."""
        vertices, _ = revolved(self._profile)
        self._foam.vertices = (dented(vertices, self._tiles, closed) * MM).astype(np.float32)


def forearm(radius: float, low: float, high: float) -> dict[str, tuple[np.ndarray, tuple[int, int, int]]]:
    """Profiles, (n, 2) radius and z in mm, and colors of the parts around a sheet between these heights."""
    core, rim = radius - UNDER_MM, radius + FOAM_MM
    length = high - low
    return {
        "core": (np.array([(0, low - 4), (core, low - 4), (core, high + 4), (0, high + 4)], float), CORE),
        "elbow collar": (_ring(core, rim, low - 12, low), COLLAR),
        "wrist collar": (_ring(core, rim, high, high + 12), COLLAR),
        "elbow": (_rounded(0.92 * core, low - 12 - 0.28 * length, low - 12, 0.9 * core), JOINT),
        "wrist": (_tapered(0.9 * core, 0.55 * core, high + 12, high + 12 + 0.15 * length), JOINT),
        "flange": (_ring(0.0, 0.68 * core, high + 12 + 0.15 * length, high + 22 + 0.15 * length), COLLAR),
    }


def foam_profile(radius: float, low: float, high: float) -> np.ndarray:
    """(n, 2) radius and z in mm: the outside, with round edges down to the core."""
    turn = np.linspace(0, np.pi / 2, 5)
    edge = FOAM_MM * 0.8
    begin = np.stack([radius + FOAM_MM - edge + edge * np.sin(turn), low + edge - edge * np.cos(turn)], -1)
    end = np.stack([begin[::-1, 0], high + low - begin[::-1, 1]], -1)
    between = np.linspace(low + edge, high - edge, 44)[1:-1]
    return np.concatenate([begin, np.stack([np.full(len(between), radius + FOAM_MM), between], -1), end])


def dented(vertices: np.ndarray, tiles: Tiles, closed: np.ndarray) -> np.ndarray:
    """(n, 3) vertices in mm, moved toward the axis over closed cells and slightly around."""
    sheet = tiles.sheet
    assert sheet.radius_mm is not None
    turns = np.arctan2(vertices[:, 1], vertices[:, 0])
    radii = np.hypot(vertices[:, 0], vertices[:, 1])
    whole = np.ones(len(vertices))
    for x_mm, y_mm in zip(tiles.x_mm[closed], tiles.y_mm[closed]):
        rows = (vertices[:, 2] - y_mm) / sheet.pitch_y_mm
        near = np.flatnonzero(np.abs(rows) < REACH)
        turned = np.remainder(turns[near] - x_mm / sheet.radius_mm + np.pi, 2 * np.pi) - np.pi
        columns = turned * sheet.radius_mm / sheet.pitch_x_mm
        whole[near] *= 1 - np.exp(-((columns**2 + rows[near] ** 2) ** 2))
    depths = (FOAM_MM - LEFT_MM) * (1 - whole)
    inner = np.maximum(radii - depths, np.minimum(radii, sheet.radius_mm))
    return np.concatenate([vertices[:, :2] * (inner / radii)[:, None], vertices[:, 2:]], -1)


def plate(tiles: Tiles) -> tuple[np.ndarray, np.ndarray]:
    sheet = tiles.sheet
    beyond = 0.35
    x_mm = np.linspace(-0.5 - beyond, sheet.columns - 0.5 + beyond, 2 * sheet.columns + 1) * sheet.pitch_x_mm
    y_mm = np.linspace(-0.5 - beyond, sheet.rows - 0.5 + beyond, 2 * sheet.rows + 1) * sheet.pitch_y_mm
    x, y = np.meshgrid(x_mm, y_mm)
    points, normals = tiles.surface.place(x.ravel(), y.ravel())
    return points - UNDER_MM * normals, _grid(len(y_mm), len(x_mm))


def add_plate(server: viser.ViserServer, tiles: Tiles, node: str) -> None:
    _add(server, f"{node}/plate", *plate(tiles), PLATE)


def revolved(profile: np.ndarray, sides: int = SIDES, first: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) and outward faces of a profile (k, 2), radius and z in one unit, revolved about z in ``sides``
    steps from the angle ``first`` in rad.
    """
    angles = first + np.linspace(0, 2 * np.pi, sides + 1)
    radius, height = profile[:, :1], profile[:, 1:]
    rings = np.stack([radius * np.cos(angles), radius * np.sin(angles), height + 0 * angles], -1)
    return rings.reshape(-1, 3), _grid(len(profile), sides + 1)


def _grid(rows: int, columns: int) -> np.ndarray:
    first = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    lower = np.stack([first, first + 1, first + columns + 1], -1)
    upper = np.stack([first, first + columns + 1, first + columns], -1)
    return np.concatenate([lower, upper])


def _ring(inner: float, outer: float, low: float, high: float, edge: float = 1.5) -> np.ndarray:
    rim = [(outer - edge, low), (outer, low + edge), (outer, high - edge), (outer - edge, high)]
    return np.array([(inner, low), *rim, (inner, high)], float)


def _rounded(radius: float, low: float, high: float, ball: float) -> np.ndarray:
    turn = np.linspace(-np.pi / 2, 0.35 * np.pi, 20)
    points = np.stack([ball * np.cos(turn), low + ball + ball * np.sin(turn)], -1)
    return np.concatenate([points, [(0.72 * radius, high - 14), (radius, high - 4), (radius, high)]])


def _tapered(begin: float, end: float, low: float, high: float) -> np.ndarray:
    share = np.linspace(0, 1, 12)
    smooth = share**2 * (3 - 2 * share)
    return np.stack([begin + (end - begin) * smooth, low + (high - low) * share], -1)


def _add(
    server: viser.ViserServer,
    name: str,
    vertices: np.ndarray,
    faces: np.ndarray,
    color: Any,
    opacity: float | None = None,
) -> Any:
    return server.scene.add_mesh_simple(
        name,
        vertices * MM,
        faces,
        color=color,
        opacity=opacity,
        side="double" if opacity is None else "front",
        cast_shadow=False,
        receive_shadow=False,
    )
