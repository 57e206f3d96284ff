"""Cameras that hold the whole scene in any window."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from contactfpga.tools.view.tiles import Tiles

if TYPE_CHECKING:
    import viser

FOV_RAD = math.radians(32)
"""Vertical field of view."""
ROOM = 1.04
FIRST = 1.6
NEAR = 0.02
"""Nearest drawn depth over the distance."""


@dataclasses.dataclass(frozen=True)
class Side:
    toward: np.ndarray
    """(3,) from the scene toward the camera."""
    up: np.ndarray
    """(3,) up in its picture, not parallel to ``toward``."""


@dataclasses.dataclass(frozen=True)
class CameraPose:
    """A camera, in m."""

    position: np.ndarray
    look_at: np.ndarray
    """Middle of its picture, at the depth of the scene's middle."""


def fitted(points: np.ndarray, side: Side, aspect: float, fov_rad: float = FOV_RAD) -> CameraPose:
    """The nearest camera on this side whose picture holds all (n, 3) points, centered; ``aspect``: width over height.

    A camera at c sees a point p where ``|(p - c) . right| <= t (p - c) . ahead``, and the same upward. In each
    direction, the two outermost points bound how far ahead c may be, and c is midway between them.
    """
    ahead = -side.toward / np.linalg.norm(side.toward)
    right = np.cross(ahead, side.up)
    if np.linalg.norm(right) < 1e-6:  # straight from above: any way is up
        right = np.cross(ahead, np.eye(3)[np.abs(ahead).argmin()])
    right /= np.linalg.norm(right)
    upward = np.cross(right, ahead)
    depths = points @ ahead
    rise = math.tan(fov_rad / 2) / ROOM
    spans = []
    for axis, slope in ((right, rise * aspect), (upward, rise)):
        low, high = (float((sign * (points @ axis) - slope * depths).max()) for sign in (-1, 1))
        spans.append(((high - low) / 2, -(low + high) / (2 * slope)))
    (across, far_x), (up, far_y) = spans
    depth = min(far_x, far_y)
    position = across * right + up * upward + depth * ahead
    middle = (float(depths.min()) + float(depths.max())) / 2
    return CameraPose(position, position + (middle - depth) * ahead)


def sides_of(tiles: Tiles) -> dict[str, Side]:
    """Views of a sheet: oblique, frontal, along it, and from the back. A sheet around a limb lies, with row 0 on the
    left.
    """
    if tiles.sheet.radius_mm is None:
        normal, away, aside = (each.mean(0) for each in (tiles.normals, tiles.along_y, tiles.along_x))
        return {
            "overview": Side(0.8 * normal - 0.55 * away - 0.12 * aside, normal),
            "front": Side(normal, away),
            "side": Side(aside + 0.35 * normal, normal),
            "back": Side(0.6 * away + 0.8 * normal, normal),
        }
    column = tiles.sheet.columns // (8 if tiles.sheet.closed else 2)
    front, along = tiles.normals[column], tiles.along_y[column]
    up = np.cross(front, along)
    return {
        "overview": Side(front + 0.45 * up + 0.5 * along, up),
        "front": Side(front, up),
        "side": Side(along + 0.8 * front + 0.3 * up, up),
        "back": Side(-front, up),
    }


class Cameras:
    """Sets the camera of each browser: at first, on a change of its window, and on request."""

    def __init__(self, server: viser.ViserServer, sides: dict[str, Side], points: Callable[[], np.ndarray]):
        self.sides, self._points = sides, points
        self._sizes: dict[int, tuple[int, int]] = {}
        self._first = next(iter(sides))
        begins = server.initial_camera
        placed = fitted(points(), sides[self._first], FIRST)
        begins.fov = FOV_RAD
        begins.position, begins.look_at = tuple(placed.position), tuple(placed.look_at)
        begins.near = NEAR * float(np.linalg.norm(placed.position - placed.look_at))
        server.scene.set_up_direction(tuple(sides[self._first].up))
        server.on_client_connect(self._follow)
        server.on_client_disconnect(lambda client: self._sizes.pop(client.client_id, None))

    def show(self, client: Any, name: str) -> None:
        self.look(client.camera, self.sides[name])

    def look(self, camera: Any, side: Side) -> None:
        placed = fitted(self._points(), side, camera.aspect, camera.fov)
        with camera.client.atomic():
            camera.up_direction = side.up
            camera.position = placed.position
            camera.look_at = placed.look_at

    def fit(self, camera: Any) -> None:
        """Fit the scene in this camera, from its direction."""
        self.look(camera, Side(camera.position - camera.look_at, camera.up_direction))

    def _follow(self, client: Any) -> None:
        self._sizes[client.client_id] = _size(client.camera)
        self.show(client, self._first)
        client.camera.on_update(self._resized)

    def _resized(self, camera: Any) -> None:
        size = _size(camera)
        if self._sizes.get(camera.client.client_id) != size:
            self._sizes[camera.client.client_id] = size
            self.fit(camera)


def _size(camera: Any) -> tuple[int, int]:
    return camera.image_width, camera.image_height
