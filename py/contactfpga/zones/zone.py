"""Zones of a frame, in cells, in mm, and on the link's surface."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeVar, overload

import numpy as np

from contactfpga import notebook, surfaces
from contactfpga.skin.sheet import Sheet
from contactfpga.surfaces.shapes import Vector
from contactfpga.wire.faults import STUCK
from contactfpga.wire.protocol import Frame
from contactfpga.zones import around, ghosts, labels, levels, motion, tables
from contactfpga.zones.box import Box, BoxMm, box_mm
from contactfpga.zones.units import UnitHistory, UnitSamples

if TYPE_CHECKING:
    import pandas
    import pyarrow

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
        ("winding", np.dtype("U5")),
    ]
)
"""Fields of :attr:`Zones.array`, those of :class:`Zone`."""

_UNSENT = ("sum_x", "sum_y")
DIVIDED_DTYPE = np.dtype([(name, DTYPE[name]) for name in DTYPE.names or () if name not in _UNSENT])
""":data:`DTYPE` without the sums, for ``report = "barycenter"``."""
_BOXES = [("box", np.int64, (4,)), ("box_mm", np.float64, (4,))]


@functools.cache
def dtype_of(divided: bool, extent: bool, levels: bool = False) -> np.dtype[np.void]:
    """:data:`DTYPE` or, with barycenters, :data:`DIVIDED_DTYPE`; of a Skin with ``extent`` also the fields ``box`` and
    ``box_mm`` of :class:`Zone`, four numbers each; of one with levels of force also ``pressure``."""
    dtype = DIVIDED_DTYPE if divided else DTYPE
    if levels:
        return np.dtype([*dtype.descr, ("pressure", np.float64)])
    return np.dtype(dtype.descr + _BOXES) if extent else dtype


@dataclasses.dataclass(frozen=True, slots=True)
class Zone:
    """One contact zone.

    >>> zone = contactfpga.read_zones("sim://?scene=two_fingers")[0]
    >>> zone.area_mm2, zone.x_mm, zone.y_mm
    (400.0, 55.0, 75.0)
    """

    area_cells: int
    """Number of pressed cells."""
    sum_x: int | None
    """Sum of the cells' columns, exact; None with ``report = "barycenter"``. On a sheet whose ends meet, columns are
    counted on past the seam, so that x is this sum / area, unless the zone is :attr:`winding`."""
    sum_y: int | None
    """Sum of the cells' rows, exact; None with ``report = "barycenter"``."""
    area_mm2: float
    """Area of the cells in mm2, measured on the sheet."""
    x_mm: float | None
    """Barycenter along the columns in mm, on the sheet laid flat, within :attr:`Zones.rounding_mm`; column 0 lies at 0.
    With levels of force a cell counts once for each that it reached.
    On a sheet whose ends meet, x is from 0 to the circumference. None for a zone that is :attr:`winding`, and for one
    without cells, which only a frame flagged ``mismatch`` can have."""
    y_mm: float | None
    """Barycenter along the rows in mm, within :attr:`Zones.rounding_mm`; row 0 lies at 0. None for a zone without
    cells."""
    point_mm: Vector | None
    """Barycenter on the surface in the link's frame, in mm. None without an x."""
    normal: Vector | None
    """Outward unit normal at the point. None without an x."""
    ghost: bool = False
    """On a sheet without diodes: other pressed switches may have made the whole zone."""
    winding: str = ""
    """On a sheet whose ends meet: ``ring`` if a path of the zone's cells closes around the cylinder; ``wound`` if none
    does, but the cells lie on more than two turns. Otherwise ""."""
    pressure: float | None = None
    """Mean level of the cells, without a unit: from 1 to the number of the Skin's levels of force, the more the harder
    it is pressed. None for a Skin of one level."""
    box: Box | None = None
    """First and last column and row of the cells; None unless the Skin has ``extent``."""
    box_mm: BoxMm | None = None
    """Outer edges of these cells in mm; None unless the Skin has ``extent``."""

    @property
    def centroid_mm(self) -> tuple[float, float] | None:
        """(:attr:`x_mm`, :attr:`y_mm`), the barycenter; None without an x."""
        return None if self.x_mm is None or self.y_mm is None else (self.x_mm, self.y_mm)


def order(zone: Zone) -> tuple[bool, float, bool, float, int]:
    """Sort key of zones: y, x, area; zones without a place come last."""
    return zone.y_mm is None, zone.y_mm or 0.0, zone.x_mm is None, zone.x_mm or 0.0, zone.area_cells


def line_of(zone: Zone) -> str:
    where = "nowhere" if zone.x_mm is None else f"at x {zone.x_mm:.2f} mm, y {zone.y_mm:.2f} mm"
    if zone.winding:
        where = f"{zone.winding} at y {zone.y_mm:.2f} mm"
    return f"  {zone.area_cells} cells, {zone.area_mm2:g} mm2 {where}"


def records_of(frame: Frame, sheet: Sheet) -> np.ndarray:
    """(n, 3) int64 area and sums, or area and barycenter, of a frame's zones, unsorted."""
    if sheet.closed:
        return around.flat(closed_records(frame, sheet), sheet.columns)
    if frame.bitmap is not None:
        return labels.moments(cell_labels(frame, sheet))
    return frame.moments if frame.barycenters is None else frame.barycenters


def cell_labels(frame: Frame, sheet: Sheet) -> np.ndarray:
    """(rows, columns) int64: zone of each cell, from 1; 0: none. Of a map of levels the contacts are the zones."""
    assert frame.bitmap is not None
    if sheet.closed:
        return around.label(frame.bitmap, sheet.connectivity)[0]
    if frame.levels is not None:
        return levels.label(frame.levels, sheet.connectivity, levels.LASTS)
    return labels.label(frame.bitmap, sheet.connectivity)


def closed_records(frame: Frame, sheet: Sheet) -> np.ndarray:
    """(n, 4) int64 records, as received, of a sheet whose ends meet."""
    return frame.moments if frame.bitmap is None else around.label(frame.bitmap, sheet.connectivity)[1]


class Zones(Sequence[Zone]):
    """The zones of one frame, sorted by y, x and area; not to be changed.

    >>> zones = contactfpga.read_zones("sim://?scene=two_fingers")
    >>> len(zones), zones.pressed
    (2, 8)
    >>> [zone.area_mm2 for zone in zones]
    [400.0, 400.0]
    """

    def __init__(
        self,
        frame: Frame,
        sheet: Sheet,
        time_us: int | None = None,
        before: Frame | None = None,
        line: HostLine | None = None,
        faults: tuple[str, ...] = (STUCK,),
        history: UnitHistory | None = None,
    ):
        self.frame = frame
        """The frame as received."""
        self.sheet = sheet
        """The sheet, from the board's hello."""
        self.time_us = frame.time_us if time_us is None else time_us
        """Device time of the sample of the frame's first row in us, since power-up."""
        self.faults: tuple[str, ...] = faults if "fault" in frame.flags else ()
        """Faults that the board noticed, sorted. With guard lines or a self-test these are names: ``row 3 open``,
        ``column 7 open``, ``column 2 stuck`` (it read pressed while no row was driven), ``guard row open`` (all columns
        are), ``guard column open`` (all rows are), ``all lines open`` (the sheet is unplugged), ``guard column stuck``,
        ``joined lines``, or ``unnamed fault`` until the names come. Otherwise ``stuck``."""
        self._before = before
        self._line = line
        self._history = history
        self._units: UnitSamples | None = None

    @property
    def time_s(self) -> float:
        """:attr:`time_us` in s."""
        return self.time_us / 1e6

    @property
    def arrived_s(self) -> float | None:
        """Arrival of the frame's last byte on :meth:`Board.clock` in s, which is ``time.monotonic`` except for
        ``sim://``; None in a recording."""
        return None if self._line is None else self._line.arrived_s

    @property
    def host_time_s(self) -> float | None:
        """:attr:`time_us` on :meth:`Board.clock` in s, as estimated when the frame arrived (docs/clock.md); None in a
        recording."""
        return None if self._line is None else self._line.at(self.time_us)

    @property
    def host_sigma_s(self) -> float | None:
        """Standard deviation of :attr:`host_time_s` in s; None in a recording."""
        return None if self._line is None else self._line.sigma_s

    @property
    def units(self) -> UnitSamples | None:
        """Readings of the pressure units at :attr:`time_us`, interpolated between two samples. None for a board without
        units, and until both samples have come, usually after the frame: ask again a few sweeps later, but within a
        second, or take the newest readings from :meth:`Board.events`."""
        if self._units is None and self._history is not None:
            self._units = self._history.at(self.time_us)
        return self._units

    @functools.cached_property
    def flags(self) -> frozenset[str]:
        """Names from :data:`contactfpga.wire.protocol.FLAGS`; also ``ghost`` if, without diodes, pressed cells may be
        ghosts, and ``motion`` if a zone moved by more than a pitch since the scan before, so that its place may be off
        by as much."""
        found = set()
        if self.sheet.ghosts and self._has_ghosts():
            found.add("ghost")
        before = self._before
        if before is not None and motion.adjacent(self.frame, before):
            if self.sheet.closed:
                moved = motion.moved(self.closed_records, closed_records(before, self.sheet), self.sheet)
            else:
                moved = motion.moved(self.records, records_of(before, self.sheet), self.sheet)
            if moved:
                found.add("motion")
        return self.frame.flags | found

    def _has_ghosts(self) -> bool:
        if self.frame.bitmap is None:
            return ghosts.spread(self.frame, self._before)
        return bool(self._ghost_cells.any())

    @property
    def sequence(self) -> int:
        """Number of frames sent before this one, modulo 256."""
        return self.frame.sequence

    @property
    def overwritten(self) -> int:
        """Number of frames that newer ones replaced before they were sent, modulo a power of two."""
        return self.frame.overwritten

    @property
    def total_zones(self) -> int:
        """Number of zones on the sheet, including those beyond the frame's capacity."""
        return self.frame.zones if self.frame.bitmap is None else len(self)

    @property
    def pressed(self) -> int:
        """Number of pressed cells on the sheet."""
        return self.frame.cells

    @property
    def cells(self) -> np.ndarray | None:
        """(rows, columns) bool with ``report = "cells"``; otherwise None."""
        return self.frame.bitmap

    @property
    def levels(self) -> np.ndarray | None:
        """(rows, columns) int64 with levels of force (docs/levels.md): how many of them each cell reached, 0 at rest;
        otherwise None."""
        return self.frame.levels

    @property
    def ghost_cells(self) -> np.ndarray | None:
        """(rows, columns) bool with ``report = "cells"``: cells that may be ghosts (:mod:`contactfpga.zones.ghosts`);
        otherwise None."""
        return None if self.frame.bitmap is None else self._ghost_cells

    def cells_of(self, zone: Zone) -> np.ndarray | None:
        """(rows, columns) bool of one zone's cells with ``report = "cells"``; otherwise None. Zones that
        have the same area and sums, as rings in one another, are not told apart."""
        if self.frame.bitmap is None:
            return None
        key = [zone.area_cells, zone.sum_x, zone.sum_y]
        found = np.zeros(self.frame.bitmap.shape, bool)
        for number, record in enumerate(self.records.tolist(), 1):
            if record == key:
                found |= self._labels == number
        return found

    @functools.cached_property
    def _ghost_cells(self) -> np.ndarray:
        if not self.sheet.ghosts:
            return np.zeros_like(self.frame.bitmap)
        return ghosts.cells(self.frame, self._before)

    @functools.cached_property
    def suspects(self) -> list[bool]:
        """:attr:`Zone.ghost` of each of :attr:`records`."""
        if not self.sheet.ghosts:
            return [False] * len(self)
        if self.frame.bitmap is None:
            return ghosts.zones(self.frame, self._before)
        return ghosts.labelled(self.frame, self._before, self._labels)

    @functools.cached_property
    def _labels(self) -> np.ndarray:
        return cell_labels(self.frame, self.sheet)

    @functools.cached_property
    def weighted(self) -> np.ndarray:
        """(n, 3) int64 of each of :attr:`records`, with levels of force: sum of the levels, and of columns and rows
        times the level."""
        assert self.frame.levels is not None
        return levels.moments(self.frame.levels, self._labels)[:, 1:]

    @property
    def rounding_mm(self) -> tuple[float, float]:
        """Largest error of x_mm and y_mm from the board's rounding: half a step with ``report = "barycenter"``,
        otherwise 0."""
        if self.sheet.report != "barycenter":
            return 0.0, 0.0
        steps = 2 << self.sheet.barycenter_bits
        return self.sheet.pitch_x_mm / steps, self.sheet.pitch_y_mm / steps

    @functools.cached_property
    def array(self) -> np.ndarray:
        """(n,) read-only structured array of :func:`dtype_of`, with NaN for None; without sums for ``report =
        "barycenter"``."""
        dtype = dtype_of(self.frame.barycenters is not None, self.sheet.extent, self.sheet.levels > 1)
        array = np.zeros(len(self), dtype)
        for row, zone in zip(array, self._zones):
            for name in dtype.names or ():
                value = getattr(zone, name)
                row[name] = math.nan if value is None else value
        array.flags.writeable = False
        return array

    def to_pandas(self) -> pandas.DataFrame:
        """A row per zone: :attr:`time_us`, :attr:`sequence`, and the fields of :attr:`array`, with ``point_mm`` and
        ``normal`` in three columns each. Raises :class:`MissingExtra` without pandas."""
        return tables.to_pandas(self.array, time_us=self.time_us, sequence=self.sequence)

    def to_arrow(self) -> pyarrow.Table:
        """The zones as a pyarrow table, with null for None. Raises :class:`MissingExtra` without pyarrow."""
        return tables.to_arrow(self.array, time_us=self.time_us, sequence=self.sequence)

    @functools.cached_property
    def _zones(self) -> tuple[Zone, ...]:
        # In plain Python, because most frames hold a zone or two, for which numpy takes forty times as long.
        make = self._exact if self.frame.barycenters is None else self._divided
        suspects = self.suspects if self.sheet.ghosts else itertools.repeat(False)
        if self.frame.levels is None:
            zones = [make(area, x, y, ghost) for (area, x, y), ghost in zip(self.records.tolist(), suspects)]
        else:
            zones = [self._weighed(*sums) for sums in np.hstack([self.records, self.weighted]).tolist()]
        for index, winding in enumerate(self.windings if self.sheet.closed else ()):
            if winding:
                zones[index] = dataclasses.replace(zones[index], x_mm=None, point_mm=None, normal=None, winding=winding)
        if (extents := self.frame.extents) is not None:
            for index, (box, edges) in enumerate(zip(extents.tolist(), box_mm(extents, self.sheet).tolist())):
                zones[index] = dataclasses.replace(zones[index], box=Box(*box), box_mm=BoxMm(*edges))
        zones.sort(key=order)
        return tuple(zones)

    def _exact(self, area: int, sum_x: int, sum_y: int, ghost: bool) -> Zone:
        return self._placed(area, sum_x, sum_y, (sum_x / area, sum_y / area) if area else None, ghost)

    def _weighed(self, area: int, sum_x: int, sum_y: int, weight: int, x: int, y: int) -> Zone:
        zone = self._placed(area, sum_x, sum_y, (x / weight, y / weight), False)
        return dataclasses.replace(zone, pressure=weight / area)

    def _divided(self, area: int, x: int, y: int, ghost: bool) -> Zone:
        steps = 1 << self.sheet.barycenter_bits
        return self._placed(area, None, None, (x / steps, y / steps) if area else None, ghost)

    def _placed(
        self, area: int, sum_x: int | None, sum_y: int | None, place: tuple[float, float] | None, ghost: bool
    ) -> Zone:
        area_mm2 = area * (self.sheet.pitch_x_mm * self.sheet.pitch_y_mm)
        if place is None:
            return Zone(area, sum_x, sum_y, area_mm2, None, None, None, None, ghost)
        x_mm, y_mm = place[0] * self.sheet.pitch_x_mm, place[1] * self.sheet.pitch_y_mm
        point_mm, normal = surfaces.of(self.sheet).place(x_mm, y_mm)
        return Zone(area, sum_x, sum_y, area_mm2, x_mm, y_mm, point_mm, normal, ghost)

    @overload
    def __getitem__(self, index: int) -> Zone: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Zone, ...]: ...

    def __getitem__(self, index: int | slice) -> Zone | tuple[Zone, ...]:
        return self._zones[index]

    def __len__(self) -> int:
        return len(self.records)

    @functools.cached_property
    def records(self) -> np.ndarray:
        """(n, 3) int64 area and sums, or area and barycenter, of each zone as received, unsorted."""
        if self.frame.bitmap is None or self.sheet.closed:
            return records_of(self.frame, self.sheet)
        return labels.moments(self._labels)

    @functools.cached_property
    def windings(self) -> list[str]:
        """:attr:`Zone.winding` of each of :attr:`records`; empty for an open sheet."""
        if not self.sheet.closed:
            return []
        return [around.WINDINGS[index] for index in around.windings(self.closed_records).tolist()]

    @property
    def closed_records(self) -> np.ndarray:
        """(n, 4) int64 records of a sheet whose ends meet, with the cells past the seam
        (:mod:`contactfpga.zones.around`)."""
        return closed_records(self.frame, self.sheet)

    def __iter__(self) -> Iterator[Zone]:
        return iter(self._zones)

    @property
    def _head(self) -> tuple[str, str]:
        what = f"{len(self)} zone" + ("" if len(self) == 1 else "s")
        flags = "".join(f", {flag}" for flag in sorted(self.flags))
        return f"{what}, {self.pressed} cells pressed", f"frame {self.sequence} at {self.time_us / 1e6:.6f} s{flags}"

    def __repr__(self) -> str:
        return "\n".join([f"<Zones: {', '.join(self._head)}", *map(line_of, self)]) + ">"

    def _repr_svg_(self) -> str:
        return self.svg()

    def svg(self, width_px: int = notebook.WIDTH_PX) -> str:
        """SVG of the sheet: known pressed cells, and a circle of each zone's area."""
        sheet = self.sheet
        circles = [
            (zone.x_mm, zone.y_mm, notebook.radius_mm(zone.area_mm2))
            for zone in self
            if zone.x_mm is not None and zone.y_mm is not None
        ]
        if sheet.around_mm is not None:
            circles = notebook.over_the_seam(circles, sheet.around_mm, sheet.pitch_x_mm)
        pitch_mm = (sheet.pitch_x_mm, sheet.pitch_y_mm)
        return notebook.sheet(
            (sheet.rows, sheet.columns), pitch_mm, "\n".join(self._head), circles, self.cells, width_px
        )

    def to_dict(self) -> dict[str, object]:
        """All values as plain Python objects for JSON."""
        values: dict[str, object] = {
            name: getattr(self, name)
            for name in (
                "sequence",
                "time_us",
                "host_time_s",
                "host_sigma_s",
                "arrived_s",
                "overwritten",
                "total_zones",
                "pressed",
            )
        }
        values["faults"] = list(self.faults)
        values["flags"] = sorted(self.flags)
        values["rounding_mm"] = list(self.rounding_mm)
        if self._history is not None:
            values["units"] = None if self.units is None else dataclasses.asdict(self.units)
        values["zones"] = [self._as_dict(zone) for zone in self]
        if self.cells is not None:
            values["cells"] = [[int(cell) for cell in row] for row in self.cells]
            if self.levels is not None:
                values["levels"] = self.levels.tolist()
            if self.sheet.ghosts:
                values["ghost_cells"] = [[int(cell) for cell in row] for row in self._ghost_cells]
        return values

    def _as_dict(self, zone: Zone) -> dict[str, object]:
        values = dataclasses.asdict(zone)
        if not self.sheet.closed:
            del values["winding"]
        if self.sheet.levels == 1:
            del values["pressure"]
        if not self.sheet.extent:
            del values["box"], values["box_mm"]
        return values


Times = TypeVar("Times", int, np.ndarray)


class HostLine(NamedTuple):
    """Arrival of frames, and the linear map from device time to the host's clock as known then."""

    arrived_s: float
    base_us: int
    """Reference device time."""
    base_s: float
    """The host's clock at ``base_us``."""
    rate: float
    """Seconds of the host's clock per second of device time."""
    sigma_s: float

    def at(self, time_us: Times) -> float | Times:
        """The host's clock in s at a device time in us, at most :attr:`arrived_s`."""
        at_s = self.base_s + (time_us - self.base_us) * (self.rate * 1e-6)
        return np.minimum(at_s, self.arrived_s) if isinstance(at_s, np.ndarray) else min(at_s, self.arrived_s)


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class HostLines:
    """A :class:`HostLine` for each of n frames, as (n,) arrays."""

    arrived_s: np.ndarray
    base_us: np.ndarray
    base_s: np.ndarray
    rate: np.ndarray
    sigma_s: np.ndarray

    def at(self, times_us: np.ndarray) -> np.ndarray:
        at_s: np.ndarray = np.minimum(self.base_s + (times_us - self.base_us) * (self.rate * 1e-6), self.arrived_s)
        return at_s

    def of(self, index: int) -> HostLine:
        return HostLine(*(values[index].item() for values in self._fields()))

    def after(self, index: int) -> HostLines:
        return HostLines(*(values[index:] for values in self._fields()))

    def _fields(self) -> tuple[np.ndarray, ...]:
        return self.arrived_s, self.base_us, self.base_s, self.rate, self.sigma_s
