"""What a frame says of the sheet: contact zones in cells, in mm, and on the link's surface."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Iterator, Sequence
from typing import overload

import numpy as np

from contactfpga import ghosts
from contactfpga.protocol import Frame
from contactfpga.skin import Skin

Vector = tuple[float, float, float]

DTYPE = np.dtype(
    [
        ("area_cells", np.int64),
        ("sum_x", np.int64),
        ("sum_y", np.int64),
        ("area_mm2", np.float64),
        ("x_mm", np.float64),
        ("y_mm", np.float64),
        ("point_mm", np.float64, 3),
        ("normal", np.float64, 3),
        ("ghost", np.bool_),
    ]
)
"""Fields of :attr:`Zones.array`, the same as those of :class:`Zone`."""

_UNSENT = ("sum_x", "sum_y")
DIVIDED_DTYPE = np.dtype([(name, DTYPE[name]) for name in DTYPE.names or () if name not in _UNSENT])
"""The same with ``report = "barycenter"``, whose boards send no sums."""


@dataclasses.dataclass(frozen=True, slots=True)
class Zone:
    """One contact zone."""

    area_cells: int
    """Pressed cells."""
    sum_x: int | None
    """Sum of the cells' columns, exact; None with ``report = "barycenter"``, which does not send it."""
    sum_y: int | None
    """Sum of the cells' rows, exact; None likewise."""
    area_mm2: float
    """Area of the cells in mm2, measured on the sheet."""
    x_mm: float
    """Barycenter along the columns in mm, on the sheet laid flat; column 0 lies at 0. It is off by at most
    :attr:`Zones.rounding_mm`."""
    y_mm: float
    """Barycenter along the rows in mm; row 0 lies at 0. It is off by at most :attr:`Zones.rounding_mm`."""
    point_mm: Vector
    """Barycenter in the link's frame in mm; it lies on the surface."""
    normal: Vector
    """Outward unit normal at that point."""
    ghost: bool = False
    """On a sheet without diodes: other pressed switches may have made all of it, with nothing pressed here."""


class Zones(Sequence[Zone]):
    """The zones of one frame, sorted by y, x and area; not to be changed."""

    def __init__(self, frame: Frame, skin: Skin, time_us: int | None = None, before: Frame | None = None):
        self.frame = frame
        """The frame as it came over the wire."""
        self.skin = skin
        """The board's Skin, as far as its hello tells it."""
        self.time_us = frame.time_us if time_us is None else time_us
        """Device time of the sample of the frame's first row in us, without the wire's wrap at 2^24 us."""
        self.flags: frozenset[str] = frame.flags
        """Names from :data:`contactfpga.protocol.FLAGS`; and `ghost` where a sheet without diodes may show pressed
        cells that are none, in a zone that is one (:attr:`Zone.ghost`) or in one that they are added to."""
        self._before = before
        if skin.ghosts and (self._ghost_cells.any() if frame.bitmap is not None else ghosts.spread(frame, before)):
            self.flags |= {"ghost"}

    @property
    def sequence(self) -> int:
        """Frames the board sent before this one, modulo 256."""
        return self.frame.sequence

    @property
    def overwritten(self) -> int:
        """Frames that the board replaced by newer ones before they were sent, modulo what the trailer has room for."""
        return self.frame.overwritten

    @property
    def stuck(self) -> int:
        """Columns that read pressed while no row was driven; 7 stands for 7 or more."""
        return self.frame.stuck

    @property
    def total_zones(self) -> int:
        """Zones on the sheet, also those the frame had no room for; 0 with ``report = "cells"``."""
        return self.frame.zones

    @property
    def pressed(self) -> int:
        """Pressed cells on the whole sheet."""
        return self.frame.cells

    @property
    def cells(self) -> np.ndarray | None:
        """(rows, columns) bool with ``report = "cells"``, else None: then the board sends zones only."""
        return self.frame.bitmap

    @property
    def ghost_cells(self) -> np.ndarray | None:
        """(rows, columns) bool with ``report = "cells"``, else None: cells that other pressed ones may have made, which
        takes a sheet without diodes (:mod:`contactfpga.ghosts`)."""
        return None if self.frame.bitmap is None else self._ghost_cells

    @functools.cached_property
    def _ghost_cells(self) -> np.ndarray:
        if not self.skin.ghosts:
            return np.zeros_like(self.frame.bitmap)
        return ghosts.cells(self.frame, self._before)

    @functools.cached_property
    def _suspects(self) -> list[bool]:
        if not self.skin.ghosts:
            return [False] * len(self)
        return ghosts.zones(self.frame, self._before)

    @property
    def rounding_mm(self) -> tuple[float, float]:
        """How far the board's rounding may have moved x_mm and y_mm: half a step with ``report = "barycenter"``, else
        0."""
        if self.skin.report != "barycenter":
            return 0.0, 0.0
        steps = 2 << self.skin.barycenter_bits
        return self.skin.pitch_x_mm / steps, self.skin.pitch_y_mm / steps

    @functools.cached_property
    def array(self) -> np.ndarray:
        """(n,) structured array of :data:`DTYPE`, read-only, in the order of the zones. It has no ``sum_x`` and
        ``sum_y`` with ``report = "barycenter"``."""
        dtype = DTYPE if self.frame.barycenters is None else DIVIDED_DTYPE
        assert dtype.names is not None
        array = np.array([tuple(getattr(zone, name) for name in dtype.names) for zone in self._zones], dtype)
        array.flags.writeable = False
        return array

    @functools.cached_property
    def _zones(self) -> tuple[Zone, ...]:
        # In plain Python, because most frames hold a zone or two, for which numpy takes forty times as long.
        make = self._exact if self.frame.barycenters is None else self._divided
        both = zip(self._records.tolist(), self._suspects)
        zones = [make(area, x, y, ghost) for (area, x, y), ghost in both]
        zones.sort(key=lambda zone: (zone.y_mm, zone.x_mm, zone.area_cells))
        return tuple(zones)

    def _exact(self, area: int, sum_x: int, sum_y: int, ghost: bool) -> Zone:
        # Only a frame that is flagged `mismatch` may hold an area of 0.
        x_mm = sum_x / area * self.skin.pitch_x_mm if area else math.nan
        y_mm = sum_y / area * self.skin.pitch_y_mm if area else math.nan
        return self._placed(area, sum_x, sum_y, x_mm, y_mm, ghost)

    def _divided(self, area: int, x: int, y: int, ghost: bool) -> Zone:
        steps = 1 << self.skin.barycenter_bits
        x_mm = x / steps * self.skin.pitch_x_mm if area else math.nan
        y_mm = y / steps * self.skin.pitch_y_mm if area else math.nan
        return self._placed(area, None, None, x_mm, y_mm, ghost)

    def _placed(self, area: int, sum_x: int | None, sum_y: int | None, x_mm: float, y_mm: float, ghost: bool) -> Zone:
        area_mm2 = area * (self.skin.pitch_x_mm * self.skin.pitch_y_mm)
        point_mm, normal = on_surface(x_mm, y_mm, self.skin.radius_mm)
        return Zone(area, sum_x, sum_y, area_mm2, x_mm, y_mm, point_mm, normal, ghost)

    @overload
    def __getitem__(self, index: int) -> Zone: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Zone, ...]: ...

    def __getitem__(self, index: int | slice) -> Zone | tuple[Zone, ...]:
        return self._zones[index]

    def __len__(self) -> int:
        return len(self._records)

    @property
    def _records(self) -> np.ndarray:
        return self.frame.moments if self.frame.barycenters is None else self.frame.barycenters

    def __iter__(self) -> Iterator[Zone]:
        return iter(self._zones)

    def __repr__(self) -> str:
        count = f"{len(self)} zone" + ("" if len(self) == 1 else "s")
        what = count if self.cells is None else "bitmap"
        flags = "".join(f", {flag}" for flag in sorted(self.flags))
        when = f"frame {self.sequence} at {self.time_us / 1e6:.6f} s"
        head = f"<Zones: {what}, {self.pressed} cells pressed, {when}{flags}"
        lines = [
            f"  {zone.area_cells} cells, {zone.area_mm2:g} mm2 at x {zone.x_mm:.2f} mm, y {zone.y_mm:.2f} mm"
            for zone in self
        ]
        return "\n".join([head, *lines]) + ">"

    def to_dict(self) -> dict[str, object]:
        """Everything in plain Python values, ready for JSON."""
        values: dict[str, object] = {
            name: getattr(self, name)
            for name in ("sequence", "time_us", "overwritten", "stuck", "total_zones", "pressed")
        }
        values["flags"] = sorted(self.flags)
        values["rounding_mm"] = list(self.rounding_mm)
        values["zones"] = [dataclasses.asdict(zone) for zone in self]
        if self.cells is not None:
            values["cells"] = [[int(cell) for cell in row] for row in self.cells]
            if self.skin.ghosts:
                values["ghost_cells"] = [[int(cell) for cell in row] for row in self._ghost_cells]
        return values


def on_surface(x_mm: float, y_mm: float, radius_mm: float | None) -> tuple[Vector, Vector]:
    """Point in mm and outward unit normal, in the link's frame, of a place on the sheet.

    A plane lies at z = 0. On a cylinder x runs around the link's z axis, from the x axis towards the y axis, and y
    along it; ``x_mm`` is the arc length.
    """
    if radius_mm is None:
        return (x_mm, y_mm, 0.0), (0.0, 0.0, 1.0)
    angle = x_mm / radius_mm
    cosine, sine = math.cos(angle), math.sin(angle)
    return (radius_mm * cosine, radius_mm * sine, y_mm), (cosine, sine, 0.0)
