"""The part of a Skin that is needed to read a board's frames; hellos carry it."""

from __future__ import annotations

import dataclasses
import math

MAX_LINES, MIN_AROUND, MAX_BARYCENTER_BITS, MAX_LEVELS = 64, 3, 8, 3
"""Limits of a sheet; ``MIN_AROUND``: least columns if its ends meet."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Sheet:
    """Lines, lengths and report of a sheet. The fields mean what those of :class:`~contactfpga.Skin` mean.

    >>> zones = contactfpga.read_zones("sim://")
    >>> zones.sheet.rows, zones.sheet.pitch_y_mm
    (16, 10.0)
    """

    rows: int
    columns: int
    connectivity: int
    report: str
    barycenter_bits: int
    """Fraction bits of a barycenter; 0 with other reports."""
    zone_capacity: int
    pitch_x_mm: float
    pitch_y_mm: float
    radius_mm: float | None
    """Radius of a sheet on a cylinder; None on a plane."""
    closed: bool = False
    """Whether the last column is a neighbor of the first."""
    ghosts: bool
    """Whether the sheet lacks diodes, so that pressed switches can make others read pressed."""
    extent: bool = False
    """Whether zones come with their smallest and largest row and column."""
    levels: int = 1
    """Levels of force of each cell; 1: a cell is pressed or not."""

    @property
    def around_mm(self) -> float | None:
        """Circumference in mm of a sheet whose ends meet; otherwise None."""
        return self.columns * self.pitch_x_mm if self.closed else None

    def max_zones(self) -> int:
        """The most zones in a frame."""
        return max_zones(self.rows, self.columns, self.connectivity, self.closed)

    def check(self) -> None:
        """Raises ValueError for a sheet whose frames would be unreadable."""
        lengths = {"pitch_x_mm": self.pitch_x_mm, "pitch_y_mm": self.pitch_y_mm}
        if self.radius_mm is not None:
            lengths["radius_mm"] = self.radius_mm
        for name, value in lengths.items():
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name} is {value}")
        ranges = {
            "rows": (1, MAX_LINES),
            "columns": (1, MAX_LINES),
            "levels": (1, MAX_LEVELS if self.report == "cells" and not self.closed else 1),
            "barycenter_bits": (0, MAX_BARYCENTER_BITS if self.report == "barycenter" else 0),
        }
        for name, (low, high) in ranges.items():
            if not low <= getattr(self, name) <= high:
                raise ValueError(f"{name} is {getattr(self, name)}")
        if self.closed and (self.columns < MIN_AROUND or self.radius_mm is None or self.report == "barycenter"):
            raise ValueError(f"{self.columns} columns around, radius {self.radius_mm}, report {self.report!r}")
        if self.extent and self.report == "cells":
            raise ValueError("report 'cells' has no extents")
        if self.connectivity not in (4, 8):
            raise ValueError(f"connectivity is {self.connectivity}")
        if not 1 <= self.zone_capacity <= self.max_zones():
            raise ValueError(f"zone_capacity is {self.zone_capacity}; the sheet holds at most {self.max_zones()} zones")


def max_zones(rows: int, columns: int, connectivity: int, closed: bool = False) -> int:
    """The most zones of a sheet.

    With 8-connectivity every 2x2 block holds cells of at most one zone; with 4-connectivity the checkerboard has most.
    Around a cylinder a row has at most half as many runs as columns.
    """
    if closed:
        return (math.ceil(rows / 2) if connectivity == 8 else rows) * (columns // 2)
    if connectivity == 8:
        return math.ceil(rows / 2) * math.ceil(columns / 2)
    return math.ceil(rows * columns / 2)
