"""Frames recorded from a real sheet."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from contactfpga.inputs import array_file
from contactfpga.skin import Skin
from contactfpga.skin.sheet import MAX_LINES
from contactfpga_sim.model.scenes import cells

DEFAULT_HZ = 100.0
"""Default playback rate."""


_RANGES = {"rate_hz": (1e-3, 1e6), "pitch_mm": Skin.limits("pitch_x_mm")[:2]}


@dataclasses.dataclass(frozen=True, eq=False)
class Recording:
    """Frames in recorded order."""

    pressed: np.ndarray
    """(frames, rows, columns) bool."""
    rate_hz: float = DEFAULT_HZ
    """Frames per second."""
    pitch_mm: float | None = None
    """Distance of rows and columns; None if unknown."""
    what: str = "the recording"
    """Name for messages."""

    @classmethod
    def of(cls, frames: np.ndarray, what: str, threshold: float | None = None) -> Recording:
        """A recording of (rows, columns) or (frames, rows, columns), bool or numbers with a threshold."""
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
        """Load a .npy file, or a .npz file with `pressed` and optionally `rate_hz` and `pitch_mm`."""
        held = array_file.read(path, ("pressed", *_RANGES))
        facts: dict[str, Any] = {name: _number(path, name, held[name]) for name in _RANGES if name in held}
        return dataclasses.replace(cls.of(held["pressed"], str(path), threshold), **facts)

    def on(self, skin: Skin) -> Callable[[float], np.ndarray]:
        """A function from time in s to pressed cells, played in a loop. The sheet must have the recorded size."""
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
