"""Frames that a real sheet recorded. What touched it is not known: a recording has cells and no truth."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from contactfpga.inputs import array_file
from contactfpga.skin import Skin
from contactfpga.skin.limits import MAX_LINES, MAX_PITCH_MM, MIN_PITCH_MM
from contactfpga_sim.model.scenes import cells

DEFAULT_HZ = 100.0
"""Rate at which a recording is played that does not come with one."""


_RANGES = {"rate_hz": (1e-3, 1e6), "pitch_mm": (MIN_PITCH_MM, MAX_PITCH_MM)}
"""What a .npz file may say of its frames, and within which limits."""


@dataclasses.dataclass(frozen=True, eq=False)
class Recording:
    """Frames in the order in which they were recorded."""

    pressed: np.ndarray
    """(frames, rows, columns) bool."""
    rate_hz: float = DEFAULT_HZ
    """Frames per second; :data:`DEFAULT_HZ` where the file says nothing."""
    pitch_mm: float | None = None
    """Distance of rows and columns; None where the file does not say."""
    what: str = "the recording"
    """Its name, for messages."""

    @classmethod
    def of(cls, frames: np.ndarray, what: str, threshold: float | None = None) -> Recording:
        """From (rows, columns) or (frames, rows, columns), bool or numbers with a threshold (:func:`cells.pressed`)."""
        if frames.ndim == 2:
            frames = frames[None]
        if frames.ndim != 3:
            raise ValueError(f"{what} has shape {frames.shape}; a recording has (frames, rows, columns)")
        count, rows, columns = frames.shape
        if not count:
            raise ValueError(f"{what} has shape {frames.shape}; it holds no frame")
        if not (1 <= rows <= MAX_LINES and 1 <= columns <= MAX_LINES):
            raise ValueError(f"{what} has frames of {rows}x{columns}; a sheet has 1 to {MAX_LINES} lines")
        return cls(cells.pressed(frames, what, threshold), what=what)

    @classmethod
    def load(cls, path: str | Path, threshold: float | None = None) -> Recording:
        """From a .npy file, or a .npz file with `pressed` and, where known, `rate_hz` and `pitch_mm`."""
        held = array_file.read(path, ("pressed", *_RANGES))
        facts: dict[str, Any] = {name: _number(path, name, held[name]) for name in _RANGES if name in held}
        return dataclasses.replace(cls.of(held["pressed"], str(path), threshold), **facts)

    def on(self, skin: Skin) -> Callable[[float], np.ndarray]:
        """Time in s to the cells pressed then, played in a loop; the sheet must be the recorded one's size."""
        rows, columns = self.pressed.shape[1:]
        if (rows, columns) != (skin.rows, skin.columns):
            raise ValueError(
                f"{self.what} has shape {self.pressed.shape}; the sheet takes (frames, {skin.rows}, {skin.columns})"
            )
        return lambda seconds: self.pressed[int(seconds * self.rate_hz + 1e-9) % len(self.pressed)]


def _number(path: str | Path, name: str, array: np.ndarray) -> float:
    low, high = _RANGES[name]
    if array.size != 1 or array.dtype == bool:
        raise ValueError(f"`{name}` in {path} has shape {array.shape} of {array.dtype}; it must be one number")
    value = float(array.item())
    if not low <= value <= high:
        raise ValueError(f"`{name}` in {path} is {value:g}; it must lie between {low:g} and {high:g}")
    return value
