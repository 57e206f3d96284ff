"""Frames that a real sheet recorded. What touched it is not known: a recording has cells and no truth."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np

from contactfpga.skin import Skin

DEFAULT_HZ = 100.0
"""Rate at which a recording is played that does not come with one."""


@dataclasses.dataclass(frozen=True, eq=False)
class Recording:
    """Frames in the order in which they were recorded."""

    pressed: np.ndarray
    """(frames, rows, columns) bool."""
    rate_hz: float = DEFAULT_HZ
    """Frames a second; :data:`DEFAULT_HZ` where the file says nothing."""
    pitch_mm: float | None = None
    """Distance of rows and columns; None where the file does not say."""
    what: str = "the recording"
    """Its name, for messages."""

    @classmethod
    def of(cls, frames: np.ndarray, what: str, rate_hz: float = DEFAULT_HZ, pitch_mm: float | None = None) -> Recording:
        """From (rows, columns) or (frames, rows, columns), bool or numbers of which all but 0 are pressed."""
        if frames.ndim == 2:
            frames = frames[None]
        if frames.ndim != 3 or not len(frames):
            raise ValueError(f"{what} has shape {frames.shape}; a recording has (frames, rows, columns)")
        return cls(frames != 0, rate_hz, pitch_mm, what)

    @classmethod
    def load(cls, path: str | Path) -> Recording:
        """From a .npy file, or a .npz file with `pressed` and, where known, `rate_hz` and `pitch_mm`."""
        with open(path, "rb") as file:
            loaded = np.load(file, allow_pickle=False)
            if isinstance(loaded, np.ndarray):
                return cls.of(loaded, str(path))
            if "pressed" not in loaded:
                raise ValueError(f"{path} holds {', '.join(loaded.files)}; a recording has an array `pressed`")
            rate = float(loaded["rate_hz"]) if "rate_hz" in loaded else DEFAULT_HZ
            pitch = float(loaded["pitch_mm"]) if "pitch_mm" in loaded else None
            return cls.of(loaded["pressed"], str(path), rate, pitch)

    def on(self, skin: Skin) -> Callable[[float], np.ndarray]:
        """Time in s to the cells pressed then, played in a loop; the sheet must be the recorded one's size."""
        rows, columns = self.pressed.shape[1:]
        if (rows, columns) != (skin.rows, skin.columns):
            raise ValueError(
                f"{self.what} has shape {self.pressed.shape}; the sheet takes (frames, {skin.rows}, {skin.columns})"
            )
        return lambda seconds: self.pressed[int(seconds * self.rate_hz + 1e-9) % len(self.pressed)]
