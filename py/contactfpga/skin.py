"""The one description of a sheet from which gateware, golden model, virtual board and host are built."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from contactfpga.cover import Cover, CoverError, table
from contactfpga.errors import ContactFPGAError

MAX_LINES = 64
MAX_BAUD_ERROR = 0.015
MAX_KEEP_ALIVE_MS = 100.0
MAX_DEBOUNCE_SCANS = 4095
SHIFT_HZ = 8_000_000
BARYCENTER_BITS = 4
MAX_BARYCENTER_BITS = 8
MAX_DIVIDED_ZONES = 64
MIN_SHIFT_HZ, MAX_SHIFT_HZ = 10_000, 50_000_000

_CHOICES: dict[str, tuple[Any, ...]] = {
    "surface": ("plane", "cylinder"),
    "connectivity": (4, 8),
    "diodes": ("col2row", "row2col", "none"),
    "scan": ("raster", "adaptive"),
    "row_drive": ("direct", "74hc595"),
    "column_read": ("direct", "74hc165"),
    "debounce": ("none", "sym_defer_pk", "asym_eager_defer_pk"),
    "labeller": ("run", "serial", "projection", "single"),
    "report": ("moments", "barycenter", "cells"),
    "send": ("always", "on_change"),
}

_WHOLE = ("rows", "columns", "row_chains", "column_chains", "shift_hz", "barycenter_bits", "clock_hz", "baud")


class SkinError(ContactFPGAError, ValueError):
    """A Skin that cannot work; the message names the field, its value and the limit."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Skin:
    """A sheet of switches, how it is scanned, and how its contact zones are reported.

    Every field has a default; together the defaults are the reference Skin. x runs along the columns, y along
    the rows, and cell (row 0, column 0) lies at 0 mm. A Skin that cannot work raises :class:`SkinError`.
    """

    rows: int = 16
    """Driven lines, 1 to 64."""
    columns: int = 16
    """Read lines, 1 to 64."""
    pitch_x_mm: float = 10.0
    """Distance between columns in mm."""
    pitch_y_mm: float = 10.0
    """Distance between rows in mm."""
    surface: str = "plane"
    """``plane``, or ``cylinder``: columns run around the link's z axis, rows along it."""
    radius_mm: float | None = None
    """Radius of the sheet on a cylinder in mm; None on a plane."""
    mask: tuple[tuple[int, int], ...] = ()
    """(row, column) of switches that are absent or broken: never pressed, never stuck."""
    connectivity: int = 8
    """8: cells that share a corner belong to one zone; 4: only cells that share an edge."""

    diodes: str = "col2row"
    """``col2row``: selected row low, columns pulled up; ``row2col``: selected row high, columns pulled down; ``none``:
    as ``col2row``, but with no diodes rows float while they are not selected, and three pressed corners of a rectangle
    make the fourth read pressed: what that may have made is flagged ``ghost``."""
    scan: str = "raster"
    """``raster`` drives one row after the other; ``adaptive`` drives rows together where nothing is touched."""
    settle_us: float = 5.0
    """Time a row is driven before its columns are sampled, in us."""
    release_us: float = 1.0
    """Time without a driven row before the next one, in us."""
    row_drive: str = "direct"
    """``direct``: a pin a row; ``74hc595``: rows on shift registers, which a row slot may have to wait for."""
    row_chains: int = 1
    """Chains of 74HC595 that are shifted at once; chain j drives rows j n to j n + n - 1, n = ceil(rows / chains)."""
    column_read: str = "direct"
    """``direct``: a pin a column; ``74hc165``: columns on shift registers, which settle and release may have to wait
    for."""
    column_chains: int = 1
    """Chains of 74HC165 that are shifted at once, with the columns spread over them as rows are."""
    shift_hz: int = SHIFT_HZ
    """The shift clock in Hz at most; it is clock_hz divided by a whole number, at least 2."""
    debounce: str = "none"
    """``none``, ``sym_defer_pk`` or ``asym_eager_defer_pk``, as QMK names them."""
    debounce_press_us: float = 5000.0
    """sym_defer_pk: how long a press must last to count; asym_eager_defer_pk: how long it then holds; us."""
    debounce_release_us: float = 5000.0
    """How long a release must last to count, in us."""

    labeller: str = "run"
    """How zones are found. Exactly: ``run``, fastest, its work follows the runs of pressed cells; ``serial``, smaller,
    a cell a clock. ``projection``: from the shadows on the two axes, wrong where these cross. ``single``: all pressed
    cells are one zone."""
    report: str = "moments"
    """``moments``: area, sum x and sum y of each zone; ``barycenter``: area and barycenter, divided on the board and
    rounded; ``cells``: the pressed cells as a bitmap."""
    barycenter_bits: int = BARYCENTER_BITS
    """``report = "barycenter"``: x and y come in steps of a cell / 2^this, the nearest one, half a step upwards."""
    send: str = "always"
    """``always``: every frame; ``on_change``: a frame whose cells differ from the last one, or a keep-alive."""
    keep_alive_ms: float = 100.0
    """Longest pause between frames with ``send = "on_change"``, in ms; at most 100."""
    zone_capacity: int | None = None
    """Zones a frame can carry. None: the most that can occur up to 32x32, at most 256 above, and with
    ``report = "barycenter"`` at most 64; then filled in."""

    clock_hz: int = 12_000_000
    """Clock of the gateware in Hz, a whole number of MHz."""
    baud: int = 3_000_000
    """Bits a second on the wire."""

    if TYPE_CHECKING:
        cover: Cover | None = None
    else:
        # No field: fields are what gateware and golden model are built from and the fingerprint tells apart.
        cover: dataclasses.InitVar[Cover | None] = None
    """The soft cover, through which scenes press the switches; None: a switch closes when it is touched. The gateware
    does not know it: Skins that differ in nothing else are equal and have one fingerprint."""

    def __post_init__(self, cover: Cover | None = None) -> None:  # noqa: RUF033  # to type checkers it is a field
        if cover is not None and not isinstance(cover, Cover):
            raise SkinError(f"cover is {cover!r}; it must be a contactfpga.cover.Cover")
        object.__setattr__(self, "cover", cover)
        self._check_types()
        self._check_sheet()
        self._check_link()
        if self.zone_capacity is None:
            object.__setattr__(self, "zone_capacity", self._default_capacity())
        self._check_timing()

    @classmethod
    def load(cls, path: str | Path) -> Skin:
        """Read a Skin from a TOML file whose keys are the fields of this class."""
        with open(path, "rb") as file:
            try:
                values = tomllib.load(file)
            except tomllib.TOMLDecodeError as error:
                raise SkinError(f"{path}: not a TOML file: {error}") from None
        known = [*(field.name for field in dataclasses.fields(cls)), "cover"]
        unknown = sorted(set(values) - set(known))
        if unknown:
            raise SkinError(f"{path}: unknown key {unknown[0]!r}; known are {', '.join(known)}")
        if "cover" in values:
            try:
                values["cover"] = table.read(values["cover"])
            except CoverError as error:
                raise SkinError(f"{path}: {error}") from None
        return cls(**values)

    def replace(self, **changes: Any) -> Skin:
        """A copy with some fields changed, checked again. A changed sheet gets its default capacity again, and so does
        one that begins or ends to divide."""
        divides = self.report == "barycenter"
        if {"rows", "columns", "connectivity"} & set(changes) or divides != (
            changes.get("report", self.report) == "barycenter"
        ):
            changes.setdefault("zone_capacity", None)
        return dataclasses.replace(self, **changes)

    def to_toml(self) -> str:
        """The Skin as a TOML file that :meth:`load` reads back."""
        lines = []
        for name, value in dataclasses.asdict(self).items():
            if value is not None:
                lines.append(f"{name} = {json.dumps(value)}")
        return "\n".join(lines) + "\n" + (table.write(self.cover) if self.cover else "")

    @property
    def fingerprint(self) -> bytes:
        """Eight bytes that differ between any two Skins that are not the same."""
        fields = dataclasses.asdict(self)
        if self.report != "barycenter":
            del fields["barycenter_bits"]  # says nothing there, and boards built before it was a field have none
        canonical = json.dumps(fields, sort_keys=True)
        return hashlib.sha256(canonical.encode()).digest()[:8]

    @property
    def selects_low(self) -> bool:
        """A selected row is low, as is a column that reads pressed; else both are high."""
        return self.diodes != "row2col"

    @property
    def ghosts(self) -> bool:
        """Pressed switches can make others read pressed."""
        return self.diodes == "none"

    def max_zones(self) -> int:
        """The most zones a frame of this sheet can hold.

        With 8-connectivity every 2x2 block holds cells of one zone at most; with 4-connectivity the
        checkerboard is the worst.
        """
        if self.connectivity == 8:
            return math.ceil(self.rows / 2) * math.ceil(self.columns / 2)
        return math.ceil(self.rows * self.columns / 2)

    def _default_capacity(self) -> int:
        small = self.rows <= 32 and self.columns <= 32
        most = self.max_zones() if small else min(self.max_zones(), 256)
        return min(most, MAX_DIVIDED_ZONES) if self.report == "barycenter" else most

    def _check_types(self) -> None:
        for name, choices in _CHOICES.items():
            value = getattr(self, name)
            if value not in choices or isinstance(value, bool):
                raise SkinError(f"{name} is {value!r}; it must be one of {', '.join(map(repr, choices))}")
        for name in (*_WHOLE, "zone_capacity"):
            value = getattr(self, name)
            if value is None and name == "zone_capacity":
                continue
            if not isinstance(value, int) or isinstance(value, bool):
                raise SkinError(f"{name} is {value!r}; it must be a whole number")
        for field in dataclasses.fields(self):
            if field.type not in ("float", "float | None"):
                continue
            value = getattr(self, field.name)
            if value is None and field.name == "radius_mm":
                continue
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
                raise SkinError(f"{field.name} is {value!r}; it must be a finite number")
            object.__setattr__(self, field.name, float(value))

    def _check_sheet(self) -> None:
        for name in ("rows", "columns"):
            _within(name, getattr(self, name), 1, MAX_LINES)
        for name in ("pitch_x_mm", "pitch_y_mm"):
            _within(name, getattr(self, name), 0.01, 1000.0, "mm")
        self._check_mask()
        self._check_registers()
        self._check_scan()
        self._check_ghosts()
        if self.surface == "plane":
            if self.radius_mm is not None:
                raise SkinError(f"radius_mm is {self.radius_mm}; a plane has none, leave it out")
            return
        if self.radius_mm is None:
            raise SkinError("radius_mm is missing; surface = 'cylinder' needs it")
        _within("radius_mm", self.radius_mm, 0.1, 100_000.0, "mm")
        around = 2 * math.pi * self.radius_mm
        if self.columns * self.pitch_x_mm >= around:
            raise SkinError(
                f"{self.columns} columns of {self.pitch_x_mm} mm take {self.columns * self.pitch_x_mm:g} mm of a "
                f"circumference of {around:g} mm: the sheet's ends meet, which is not supported; "
                f"use at most {math.ceil(around / self.pitch_x_mm) - 1} columns"
            )

    def _check_mask(self) -> None:
        if isinstance(self.mask, str) or not isinstance(self.mask, Iterable):
            raise SkinError(f"mask is {self.mask!r}; it must be a list of [row, column]")
        cells = []
        for cell in self.mask:
            if (
                not isinstance(cell, list | tuple)
                or len(cell) != 2
                or not all(isinstance(index, int) and not isinstance(index, bool) for index in cell)
            ):
                raise SkinError(f"mask holds {cell!r}; it must hold [row, column] pairs")
            if not (0 <= cell[0] < self.rows and 0 <= cell[1] < self.columns):
                raise SkinError(f"mask holds {list(cell)}; the sheet has {self.rows} rows and {self.columns} columns")
            cells.append((cell[0], cell[1]))
        if len(set(cells)) == self.rows * self.columns:
            raise SkinError(f"mask lists all {len(set(cells))} switches; at least one must be left")
        object.__setattr__(self, "mask", tuple(sorted(set(cells))))

    def _check_registers(self) -> None:
        for kind, wiring, registers in (("row", "row_drive", "74hc595"), ("column", "column_read", "74hc165")):
            lines, chains = getattr(self, f"{kind}s"), getattr(self, f"{kind}_chains")
            if getattr(self, wiring) == "direct":
                if chains != 1:
                    raise SkinError(f"{kind}_chains is {chains}; leave it out, or set {wiring} = '{registers}'")
                continue
            _within(f"{kind}_chains", chains, 1, lines)
            length = math.ceil(lines / chains)
            filled = math.ceil(lines / length)
            if filled < chains:
                raise SkinError(
                    f"{kind}_chains is {chains}; {lines} {kind}s in chains of {length} fill {filled}, set "
                    f"{kind}_chains = {filled}"
                )
        _within("shift_hz", self.shift_hz, MIN_SHIFT_HZ, MAX_SHIFT_HZ, "Hz")
        if self.row_drive == self.column_read == "direct" and self.shift_hz != SHIFT_HZ:
            raise SkinError(
                f"shift_hz is {self.shift_hz}; leave it out, or set row_drive = '74hc595' or column_read = '74hc165'"
            )

    def _check_scan(self) -> None:
        if self.scan == "raster":
            return
        _within("rows", self.rows, 2, MAX_LINES, "with scan = 'adaptive'")
        if self.column_read != "direct":
            raise SkinError(
                f"column_read is {self.column_read!r}; scan = 'adaptive' needs column_read = 'direct', as it looks at "
                "the columns of an untouched sheet in each clock"
            )

    def _check_ghosts(self) -> None:
        """Without diodes only what can still be told apart from ghosts is taken."""
        if not self.ghosts:
            return
        wanted: dict[str, Any] = {"scan": "raster", "row_drive": "direct"}
        if self.report == "barycenter":
            raise SkinError("report is 'barycenter'; diodes = 'none' needs report = 'moments' or 'cells'")
        if self.report == "moments":
            wanted |= {"connectivity": 4, "labeller": "run" if self.labeller != "serial" else "serial"}
        for name, value in wanted.items():
            if getattr(self, name) != value:
                why = " with report = 'moments'" if name in ("connectivity", "labeller") else ""
                raise SkinError(f"{name} is {getattr(self, name)!r}; diodes = 'none' needs {name} = {value!r}{why}")
        if self.mask:
            raise SkinError(
                f"mask lists {len(self.mask)} switches; diodes = 'none' takes none, as what a masked switch feeds "
                "could not be told"
            )

    def _check_link(self) -> None:
        _within("barycenter_bits", self.barycenter_bits, 0, MAX_BARYCENTER_BITS)
        if self.report != "barycenter" and self.barycenter_bits != BARYCENTER_BITS:
            raise SkinError(f"barycenter_bits is {self.barycenter_bits}; leave it out, or set report = 'barycenter'")
        if self.clock_hz % 1_000_000 or not 1_000_000 <= self.clock_hz <= 400_000_000:
            raise SkinError(f"clock_hz is {self.clock_hz}; it must be a whole number of MHz from 1 to 400 MHz")
        _within("baud", self.baud, 1200, self.clock_hz // 2, "for this clock")
        divisor = round(self.clock_hz / self.baud)
        error = self.clock_hz / divisor / self.baud - 1
        if abs(error) > MAX_BAUD_ERROR:
            nearest = sorted({self.clock_hz // d for d in (divisor - 1, divisor, divisor + 1) if d >= 2})
            raise SkinError(
                f"baud is {self.baud}: a clock of {self.clock_hz} Hz misses it by {100 * error:+.2f} %, the limit is "
                f"{100 * MAX_BAUD_ERROR} %; nearest good rates: {', '.join(map(str, nearest))}"
            )
        if self.send == "on_change":
            _within("keep_alive_ms", self.keep_alive_ms, 0.0, MAX_KEEP_ALIVE_MS, "ms")

    def _check_timing(self) -> None:
        from contactfpga.derived import Derived  # it needs Skin for its annotations only

        assert self.zone_capacity is not None
        _within("zone_capacity", self.zone_capacity, 1, self.max_zones(), "for this sheet")
        for name in ("settle_us", "release_us"):
            _within(name, getattr(self, name), 0.0, 10_000.0, "us")
        derived = Derived(self)
        megahertz = self.clock_hz // 1_000_000
        for name in ("settle_us", "release_us"):
            if derived.clocks(getattr(self, name)) < 1:
                raise SkinError(f"{name} is {getattr(self, name)}; it must be at least one clock, {1 / megahertz:g} us")
        if derived.row_clocks < derived.min_row_clocks:
            rows = f"{self.rows} rows, " if self.scan == "adaptive" else ""
            divided = " and report = 'barycenter'" if self.report == "barycenter" else ""
            raise SkinError(
                f"settle_us + release_us is {derived.row_clocks} clocks; {rows}{self.columns} columns and "
                f"{self.zone_capacity} zones a frame need {derived.min_row_clocks} clocks "
                f"({derived.min_row_clocks / megahertz:g} us) with labeller = '{self.labeller}'{divided}"
            )
        if self.send == "on_change" and derived.keep_alive_frames < 1:
            raise SkinError(
                f"keep_alive_ms is {self.keep_alive_ms}; one scan takes "
                f"{derived.max_frame_slots * derived.row_clocks / self.clock_hz * 1e3:g} ms"
            )
        if self.debounce == "none":
            return
        for name in ("debounce_press_us", "debounce_release_us"):
            _within(name, getattr(self, name), 0.0, MAX_DEBOUNCE_SCANS * derived.frame_clocks / megahertz, "us")


def _within(name: str, value: float, low: float, high: float, unit: str = "") -> None:
    if not low <= value <= high:
        raise SkinError(f"{name} is {value}; it must lie between {low} and {high} {unit}".rstrip())
