"""Places of contacts of one known kind, such as a finger of known size, from a table by zone.

The table has the mean place of such contacts for each area and each barycenter's offset within its cell.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Self

import numpy as np

from contactfpga.inputs import array_file
from contactfpga.inputs.array_file import ArrayFileError
from contactfpga.inputs.files import replaced
from contactfpga.zones.zone import Zone

NAMES = ("keys", "offsets_mm", "pitch_mm")
"""Arrays of a table's file."""

MAX_KEYS = 1 << 20
"""Most entries of a table."""


class PlaceTable:
    """Mean places of contacts, relative to their zones' barycenters.

    ``pitch_mm``: (2,) along columns and rows. ``keys``: (n, 3) int, a zone's area in cells and the remainders of its
    sums of columns and rows after division by the area. ``offsets_mm``: (n, 2) from barycenter to place. Raises
    ValueError for other shapes or values.
    """

    def __init__(self, pitch_mm: np.ndarray, keys: np.ndarray, offsets_mm: np.ndarray):
        self.pitch_mm, self.keys, self.offsets_mm = map(np.asarray, (pitch_mm, keys, offsets_mm))
        self._check()
        self._offsets: dict[tuple[int, ...], tuple[float, float]] = {
            tuple(key): (x, y) for key, (x, y) in zip(self.keys.tolist(), self.offsets_mm.tolist())
        }

    def place_mm(self, zone: Zone) -> tuple[float, float] | None:
        """Place in mm of a zone's contact; None for a zone without an x.

        Without an entry, or without sums (``report = "barycenter"``), this is the barycenter. The table does not hold
        at an edge of the sheet. Raises ValueError for a sheet of another pitch.
        """
        if zone.x_mm is None or zone.y_mm is None:
            return None
        area = zone.area_cells
        if not math.isclose(zone.area_mm2, area * math.prod(self.pitch_mm.tolist()), rel_tol=1e-6):
            x, y = self.pitch_mm
            raise ValueError(f"the table is for a pitch of {x:g} by {y:g} mm; the zone comes from another sheet")
        if zone.sum_x is None or zone.sum_y is None:
            return zone.x_mm, zone.y_mm
        x_mm, y_mm = self._offsets.get((area, zone.sum_x % area, zone.sum_y % area), (0.0, 0.0))
        return zone.x_mm + x_mm, zone.y_mm + y_mm

    def save(self, path: str | Path) -> None:
        """Write the table as a .npz file."""
        with replaced(Path(path)) as new, open(new, "wb") as file:
            np.savez_compressed(file, keys=self.keys, offsets_mm=self.offsets_mm, pitch_mm=self.pitch_mm)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a table of :meth:`save`. Raises ValueError for another file, OSError."""
        held = array_file.read(path, NAMES, 24 * MAX_KEYS)
        missing = [name for name in NAMES if name not in held]
        if missing:
            raise ArrayFileError(f"{path} has no array `{missing[0]}`; a table of places has {', '.join(NAMES)}")
        try:
            return cls(held["pitch_mm"], held["keys"], held["offsets_mm"])
        except ValueError as error:
            raise ArrayFileError(f"{path} is no table of places: {error}") from None

    def _check(self) -> None:
        keys, offsets, pitch = self.keys, self.offsets_mm, self.pitch_mm
        if pitch.shape != (2,) or pitch.dtype.kind not in "iuf" or not (np.isfinite(pitch) & (pitch > 0)).all():
            raise ValueError("pitch_mm must be two lengths above 0")
        if keys.ndim != 2 or keys.shape[1] != 3 or keys.dtype.kind not in "iu" or len(keys) > MAX_KEYS:
            raise ValueError(f"keys have shape {keys.shape} of {keys.dtype}; (n, 3) whole numbers are needed")
        if offsets.shape != (len(keys), 2) or offsets.dtype.kind != "f" or not np.isfinite(offsets).all():
            raise ValueError(f"offsets_mm have shape {offsets.shape}; ({len(keys)}, 2) finite numbers are needed")
        area = keys[:, :1]
        if not ((area > 0).all() and (keys[:, 1:] >= 0).all() and (keys[:, 1:] < area).all()):
            raise ValueError("keys must be an area above 0 and two numbers from 0 to below it")
