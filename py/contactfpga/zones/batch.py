"""Many frames as numpy arrays."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from contactfpga import surfaces
from contactfpga.wire.protocol import FAULT, MISMATCH, MOTION, OVERFLOW, sums_of
from contactfpga.zones import around, tables
from contactfpga.zones.box import box_mm
from contactfpga.zones.run import Run
from contactfpga.zones.zone import DIVIDED_DTYPE, DTYPE, Zones, dtype_of

if TYPE_CHECKING:
    import pandas
    import pyarrow

FRAME_DTYPE = np.dtype(
    [
        ("time_us", np.int64),
        ("host_time_s", np.float64),
        ("host_sigma_s", np.float64),
        ("arrived_s", np.float64),
        ("sequence", np.int64),
        ("overwritten", np.int64),
        ("pressed", np.int64),
        ("total_zones", np.int64),
        ("overflow", np.bool_),
        ("mismatch", np.bool_),
        ("fault", np.bool_),
        ("motion", np.bool_),
    ]
)
"""Fields of :attr:`Batch.frames`: those of :class:`Zones` and its flags; times on the host's clock are NaN in a
recording."""

_WHICH = [("frame", np.int64), ("time_us", np.int64), ("sequence", np.int64)]
ZONE_DTYPE = np.dtype(_WHICH + [(name, DTYPE[name]) for name in DTYPE.names or ()])
"""Fields of :attr:`Batch.zones`: ``frame``, the index in :attr:`Batch.frames`, its time and sequence, and the fields of
:class:`Zone`, with NaN for None.
"""
DIVIDED_ZONE_DTYPE = np.dtype(_WHICH + [(name, DIVIDED_DTYPE[name]) for name in DIVIDED_DTYPE.names or ()])
""":data:`ZONE_DTYPE` without the sums, for ``report = "barycenter"``."""


@functools.cache
def zone_dtype_of(divided: bool, extent: bool, levels: bool = False) -> np.dtype[np.void]:
    """:data:`ZONE_DTYPE` or, with barycenters, :data:`DIVIDED_ZONE_DTYPE`; with the fields that
    :func:`contactfpga.zones.zone.dtype_of` adds."""
    return np.dtype(_WHICH + dtype_of(divided, extent, levels).descr)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Batch:
    """Consecutive frames as arrays: ``zones["x_mm"]`` over all zones, in mm; ``frames["time_us"]`` over all frames, in
    us.

    >>> with contactfpga.open("sim://?scene=two_fingers") as board:
    ...     batch = board.batch()
    >>> float(batch.zones["x_mm"].mean())
    75.0
    """

    frames: np.ndarray
    """(n,) of :data:`FRAME_DTYPE`, in order."""
    zones: np.ndarray
    """(m,) of :func:`zone_dtype_of`, in the order of the frames and of their zones."""
    faults: tuple[tuple[str, ...], ...] = ()
    """:attr:`Zones.faults` of each frame."""
    first: int = 0
    """Frames in the earlier batches of the same reader. Tables begin their ``frame`` with it."""

    def __len__(self) -> int:
        return len(self.frames)

    def __repr__(self) -> str:
        first, last = self.frames["sequence"][[0, -1]]
        return f"<Batch: frames {first} to {last} ({len(self.frames)}), {len(self.zones)} zones>"

    @property
    def starts(self) -> np.ndarray:
        """(n + 1,) int64: the zones of frame i are ``zones[starts[i] : starts[i + 1]]``."""
        starts: np.ndarray = np.searchsorted(self.zones["frame"], np.arange(len(self.frames) + 1))
        return starts

    def to_pandas(self) -> pandas.DataFrame:
        """A row per zone, with the fields of :attr:`zones` as columns; ``frame`` goes on from batch to batch, and
        ``point_mm`` and ``normal`` are three columns each (``point_x_mm``). ``pandas.DataFrame(batch.frames)`` has a
        row per frame. Raises :class:`MissingExtra` without pandas."""
        return tables.to_pandas(self._numbered())

    def to_arrow(self) -> pyarrow.Table:
        """The zones as a pyarrow table, with null for NaN; ``frame`` goes on from batch to batch. Raises
        :class:`MissingExtra` without pyarrow."""
        return tables.to_arrow(self._numbered())

    def _numbered(self) -> np.ndarray:
        zones = self.zones.copy()
        zones["frame"] += self.first
        return zones

    @classmethod
    def of(cls, frames: Sequence[Zones | Run]) -> Batch:
        """A batch of one sheet's frames."""
        if (sheet := frames[0].sheet).report == "cells" or sheet.ghosts:  # of which a run does not hold the zones
            frames = [zones for one in frames for zones in (one if isinstance(one, Run) else [one])]
        described = np.zeros(sum(len(one) if isinstance(one, Run) else 1 for one in frames), FRAME_DTYPE)
        counts = np.zeros(len(described), np.int64)
        faults: list[tuple[str, ...]] = []
        start = 0
        for one in frames:
            if isinstance(one, Run):
                stop = start + len(one)
                _describe(one, described[start:stop])
                counts[start:stop] = one.packets["items"]
                faults += [one.faults if flagged else () for flagged in described["fault"][start:stop].tolist()]
                start = stop
            else:
                described[start], counts[start] = _row(one), len(one)
                faults.append(one.faults)
                start += 1
        return cls(described, _zones(frames, described, counts), tuple(faults))


def _row(one: Zones) -> tuple[float, ...]:
    return (
        one.time_us,
        *(math.nan if value is None else value for value in (one.host_time_s, one.host_sigma_s, one.arrived_s)),
        one.sequence,
        one.overwritten,
        one.pressed,
        one.total_zones,
        *(flag in one.frame.flags for flag in _FLAGS),
    )


_SENT = {"sequence": "sequence", "overwritten": "overwritten", "pressed": "cells", "total_zones": "zones"}
_FLAGS = {"overflow": OVERFLOW, "mismatch": MISMATCH, "fault": FAULT, "motion": MOTION}


def _describe(run: Run, out: np.ndarray) -> None:
    out["time_us"] = run.times_us
    line = run.line
    out["host_time_s"] = math.nan if line is None else line.at(run.times_us)
    out["host_sigma_s"] = math.nan if line is None else line.sigma_s
    out["arrived_s"] = math.nan if line is None else line.arrived_s
    for name, sent in _SENT.items():
        out[name] = run.packets[sent]
    for name, bit in _FLAGS.items():
        out[name] = run.packets["flags"] & bit > 0


def _zones(items: Sequence[Zones | Run], frames: np.ndarray, counts: np.ndarray) -> np.ndarray:
    sheet = items[0].sheet
    divided = sheet.report == "barycenter"
    records, windings, extents = _records(items)
    area, x, y = records.T
    out = np.zeros(len(records), zone_dtype_of(divided, sheet.extent, sheet.levels > 1))
    which = np.repeat(np.arange(len(frames)), counts)
    out["frame"] = which
    out["time_us"] = frames["time_us"][which]
    out["sequence"] = frames["sequence"][which]
    out["area_cells"] = area
    out["area_mm2"] = area * (sheet.pitch_x_mm * sheet.pitch_y_mm)
    if not divided:
        out["sum_x"], out["sum_y"] = x, y
    scale = np.full(len(area), 1 << sheet.barycenter_bits) if divided else area
    if sheet.levels > 1:
        scale, x, y = np.concatenate([one.weighted for one in items if isinstance(one, Zones)]).T
        out["pressure"] = scale / area
    if sheet.closed:
        out["winding"] = np.array(around.WINDINGS)[windings]
    nowhere = area == 0
    scale = np.where(nowhere, 1, scale)
    for name, sums, pitch in (("x_mm", x, sheet.pitch_x_mm), ("y_mm", y, sheet.pitch_y_mm)):
        out[name] = np.where(nowhere, math.nan, sums / scale * pitch)
    out["x_mm"][out["winding"] != ""] = math.nan
    if sheet.extent:
        out["box"], out["box_mm"] = extents, box_mm(extents, sheet)
    out["point_mm"], out["normal"] = surfaces.of(sheet).place(out["x_mm"], out["y_mm"])
    if sheet.ghosts:
        out["ghost"] = [suspect for one in items if isinstance(one, Zones) for suspect in one.suspects]
    return out[np.lexsort((out["area_cells"], out["x_mm"], out["y_mm"], out["frame"]))]


def _records(items: Sequence[Zones | Run]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(m, 3) :attr:`Zones.records`; for a sheet whose ends meet (m,) indexes in :data:`around.WINDINGS`; with extents
    (m, 4) of :class:`Box`."""
    sheet = items[0].sheet
    records = np.concatenate([one.carried if isinstance(one, Run) else _carried(one) for one in items])
    records, extents = records[:, : sums_of(sheet)], records[:, sums_of(sheet) :]
    if not sheet.closed:
        return records, np.zeros(0, np.int64), extents
    return around.flat(records, sheet.columns), around.windings(records), extents


def _carried(one: Zones) -> np.ndarray:
    records = one.closed_records if one.sheet.closed else one.records
    return records if one.frame.extents is None else np.concatenate([records, one.frame.extents], axis=1)
