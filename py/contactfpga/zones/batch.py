"""Many frames as numpy arrays."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from contactfpga.zones.zone import DIVIDED_DTYPE, DTYPE, Zones, on_surface

FRAME_DTYPE = np.dtype(
    [
        ("time_us", np.int64),
        ("host_time_s", np.float64),
        ("sequence", np.int64),
        ("overwritten", np.int64),
        ("pressed", np.int64),
        ("total_zones", np.int64),
        ("overflow", np.bool_),
        ("mismatch", np.bool_),
        ("fault", np.bool_),
    ]
)
"""Fields of :attr:`Batch.frames`: those of :class:`Zones` and its flags; ``host_time_s`` is NaN in a recording."""

_WHICH = [("frame", np.int64), ("time_us", np.int64), ("sequence", np.int64)]
ZONE_DTYPE = np.dtype(_WHICH + [(name, DTYPE[name]) for name in DTYPE.names or ()])
"""Fields of :attr:`Batch.zones`: ``frame`` is the index in :attr:`Batch.frames`, whose time and sequence are repeated;
the others are those of :class:`Zone`, with NaN in the place of None."""
DIVIDED_ZONE_DTYPE = np.dtype(_WHICH + [(name, DIVIDED_DTYPE[name]) for name in DIVIDED_DTYPE.names or ()])
"""The same with ``report = "barycenter"``, whose boards send no sums."""


@dataclasses.dataclass(frozen=True)
class Batch:
    """Consecutive frames and all of their zones."""

    frames: np.ndarray
    """(n,) of :data:`FRAME_DTYPE`, in order."""
    zones: np.ndarray
    """(m,) of :data:`ZONE_DTYPE`, in the order of the frames and within these of the zones."""

    @classmethod
    def of(cls, frames: Sequence[Zones]) -> Batch:
        """Of frames of one sheet."""
        rows = [
            (
                one.time_us,
                math.nan if one.host_time_s is None else one.host_time_s,
                one.sequence,
                one.overwritten,
                one.pressed,
                one.total_zones,
                *(flag in one.flags for flag in ("overflow", "mismatch", "fault")),
            )
            for one in frames
        ]
        return cls(np.array(rows, FRAME_DTYPE), _zones(frames))


def _zones(frames: Sequence[Zones]) -> np.ndarray:
    sheet = frames[0].sheet
    divided = sheet.report == "barycenter"
    records = np.concatenate([one.records for one in frames])
    area, x, y = records.T
    out = np.zeros(len(records), DIVIDED_ZONE_DTYPE if divided else ZONE_DTYPE)
    out["frame"] = np.repeat(np.arange(len(frames)), [len(one) for one in frames])
    out["time_us"] = np.array([one.time_us for one in frames])[out["frame"]]
    out["sequence"] = np.array([one.sequence for one in frames])[out["frame"]]
    out["area_cells"] = area
    out["area_mm2"] = area * (sheet.pitch_x_mm * sheet.pitch_y_mm)
    if not divided:
        out["sum_x"], out["sum_y"] = x, y
    scale = np.full(len(area), 1 << sheet.barycenter_bits) if divided else area
    nowhere = area == 0
    scale = np.where(nowhere, 1, scale)
    for name, sums, pitch in (("x_mm", x, sheet.pitch_x_mm), ("y_mm", y, sheet.pitch_y_mm)):
        out[name] = np.where(nowhere, math.nan, sums / scale * pitch)
    _place(out, sheet.radius_mm)
    if sheet.ghosts:
        out["ghost"] = [suspect for one in frames for suspect in one.suspects]
    return out[np.lexsort((out["area_cells"], out["x_mm"], out["y_mm"], out["frame"]))]


def _place(out: np.ndarray, radius_mm: float | None) -> None:
    """Points and normals, as :func:`contactfpga.zones.zone.on_surface` has them."""
    nowhere = np.isnan(out["x_mm"])
    if radius_mm is None:
        out["point_mm"][:, 0], out["point_mm"][:, 1] = out["x_mm"], out["y_mm"]
        out["normal"][:, 2] = 1.0
    else:
        for row in np.flatnonzero(~nowhere):
            out["point_mm"][row], out["normal"][row] = on_surface(out["x_mm"][row], out["y_mm"][row], radius_mm)
    out["point_mm"][nowhere] = out["normal"][nowhere] = math.nan
