"""What touches the sheet: scenes as functions of time, by name, from a recording or from a callback.

The patches are geometric: a cell is pressed when its centre lies under the contact.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from contactfpga.skin import Skin
from contactfpga_sim.shapes import SHAPES

Scene = Callable[[float], np.ndarray]
"""Time in s to the (rows, columns) bool cells that are pressed then."""

FINGER_MM = 12.0
"""Radius of a fingertip's contact."""

RECORDING_HZ = 100.0
"""Rate at which a recording is played that does not come with one."""


def ellipse(skin: Skin, x_mm: float, y_mm: float, width_mm: float, height_mm: float) -> np.ndarray:
    """(rows, columns) bool: cells under an ellipse with these half axes; at least the cell nearest to its centre."""
    x = np.arange(skin.columns) * skin.pitch_x_mm - x_mm
    y = np.arange(skin.rows) * skin.pitch_y_mm - y_mm
    cells = (x / width_mm) ** 2 + (y[:, None] / height_mm) ** 2 <= 1
    cells[np.abs(y).argmin(), np.abs(x).argmin()] = True
    return cells


def fingertip(skin: Skin) -> Scene:
    """One fingertip at rest, a third into the sheet."""
    x_mm, y_mm = (extent / 3 for extent in _extent(skin))
    return _still(ellipse(skin, x_mm, y_mm, FINGER_MM, FINGER_MM))


def two_fingers(skin: Skin) -> Scene:
    """Two fingertips side by side, with at least one free column between them."""
    width, height = _extent(skin)
    apart = 2 * FINGER_MM + 1.01 * skin.pitch_x_mm
    left, right = (width - apart) / 2, (width + apart) / 2
    cells = ellipse(skin, left, height / 2, FINGER_MM, FINGER_MM)
    return _still(cells | ellipse(skin, right, height / 2, FINGER_MM, FINGER_MM))


def palm(skin: Skin) -> Scene:
    """A hand laid flat: two balls of the hand, the pads below the fingers, and the hollow between them."""
    width, height = _extent(skin)
    x, y = width / 2, height / 2
    cells = ellipse(skin, x - 24, y + 22, 18, 28) | ellipse(skin, x + 24, y + 24, 16, 26)
    return _still(cells | ellipse(skin, x, y - 24, 42, 14))


def edge(skin: Skin) -> Scene:
    """A straight edge across the sheet, 20 degrees off the rows."""
    width, height = _extent(skin)
    x = np.arange(skin.columns) * skin.pitch_x_mm - width / 2
    y = np.arange(skin.rows)[:, None] * skin.pitch_y_mm - height / 2
    tilt = math.radians(20)
    distance = x * math.sin(tilt) - y * math.cos(tilt)
    return _still(np.abs(distance) <= 0.55 * skin.pitch_y_mm)


def moving(skin: Skin) -> Scene:
    """A fingertip that circles around the middle of the sheet twice a second."""
    width, height = _extent(skin)

    def scene(seconds: float) -> np.ndarray:
        angle = 4 * math.pi * seconds
        x_mm, y_mm = width * (0.5 + 0.3 * math.cos(angle)), height * (0.5 + 0.3 * math.sin(angle))
        return ellipse(skin, x_mm, y_mm, FINGER_MM, FINGER_MM)

    return scene


def nothing(skin: Skin) -> Scene:
    """An untouched sheet."""
    return _still(np.zeros((skin.rows, skin.columns), bool))


CONTACTS: dict[str, Callable[[Skin], Scene]] = {
    scene.__name__: scene for scene in (fingertip, two_fingers, palm, edge, moving, nothing)
}
"""Every contact scene by its name."""

NAMES = (*CONTACTS, *SHAPES)
"""All that :func:`scene` knows by name: contacts, and the shapes that break labellers."""


def scene(skin: Skin, source: str | Path | np.ndarray | Scene | None = None) -> Scene:
    """A scene for a sheet.

    ``source``: one of :data:`NAMES` (none given: fingertip); a .npy file or an array, (rows, columns) or
    (frames, rows, columns), bool or numbers of which all but 0 are pressed, frames played in a loop at
    :data:`RECORDING_HZ`; or a function of time. Raises ValueError for anything else.
    """
    if source is None:
        source = "fingertip"
    if callable(source):
        return _checked(skin, source)
    if isinstance(source, np.ndarray):
        return _recording(skin, source, "the array")
    name = str(source)
    if name in CONTACTS:
        return CONTACTS[name](skin)
    if name in SHAPES:
        return _still(SHAPES[name](skin.rows, skin.columns))
    if not name.endswith(".npy"):
        raise ValueError(f"scene {name!r} is not known; take a .npy file or one of {', '.join(NAMES)}")
    return _recording(skin, np.load(name, allow_pickle=False), name)


def _recording(skin: Skin, frames: np.ndarray, what: str) -> Scene:
    if frames.ndim == 2:
        frames = frames[None]
    if frames.ndim != 3 or not len(frames) or frames.shape[1:] != (skin.rows, skin.columns):
        raise ValueError(f"{what} has shape {frames.shape}; the sheet takes (frames, {skin.rows}, {skin.columns})")
    pressed = frames != 0
    return lambda seconds: pressed[int(seconds * RECORDING_HZ) % len(pressed)]


def _checked(skin: Skin, callback: Scene) -> Scene:
    def scene(seconds: float) -> np.ndarray:
        cells = np.asarray(callback(seconds), bool)
        if cells.shape != (skin.rows, skin.columns):
            raise ValueError(f"the scene gave cells of shape {cells.shape}; the sheet has {skin.rows}x{skin.columns}")
        return cells

    return scene


def _still(cells: np.ndarray) -> Scene:
    return lambda seconds: cells


def _extent(skin: Skin) -> tuple[float, float]:
    """Width and height between the outermost cell centres, in mm."""
    return (skin.columns - 1) * skin.pitch_x_mm, (skin.rows - 1) * skin.pitch_y_mm
