"""The one description of a sheet from which gateware, golden model, virtual board and host are built."""

# No `from __future__ import annotations`: the checks look at the fields' types, which must not be texts.

import dataclasses
import functools
import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import field
from pathlib import Path
from typing import Any, Literal
from urllib.parse import quote

from contactfpga.choices import scans
from contactfpga.choices.choice import look_in, modules, refuse_modules, trusted
from contactfpga.choices.converters import Converter, ConverterName
from contactfpga.choices.debounces import Debounce, DebounceName
from contactfpga.choices.labellers import Labeller, LabellerName
from contactfpga.choices.reports import REPORTS, ReportName
from contactfpga.choices.scans import Scan, ScanName
from contactfpga.errors import SkinError
from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import shell_words, shown, suggestion
from contactfpga.skin import checks
from contactfpga.skin.derived import MAX_RULER, Derived
from contactfpga.skin.sheet import MAX_BARYCENTER_BITS, MAX_LINES, Sheet, max_zones


@dataclasses.dataclass(frozen=True, kw_only=True)
class Skin:
    """A sheet of switches, how it is scanned, and how its contact zones are reported.

    >>> skin = contactfpga.Skin(rows=8, columns=8, pitch_x_mm=12.5, pitch_y_mm=12.5)
    >>> skin.replace(report="cells").max_zones()
    16

    Every field has a default; together the defaults are the reference Skin. x runs along the columns, y along
    the rows, and cell (row 0, column 0) lies at 0 mm. A Skin that cannot work raises :class:`SkinError`.
    """

    name: str = ""
    """What the board calls itself, at most 32 bytes of UTF-8; not in the fingerprint."""

    rows: int = field(default=16, metadata={"limits": (1, MAX_LINES, "")})
    """Driven lines."""
    columns: int = field(default=16, metadata={"limits": (1, MAX_LINES, "")})
    """Read lines."""
    pitch_x_mm: float = field(default=10.0, metadata={"limits": (0.01, 1000.0, "mm")})
    """Distance between columns in mm."""
    pitch_y_mm: float = field(default=10.0, metadata={"limits": (0.01, 1000.0, "mm")})
    """Distance between rows in mm."""
    surface: Literal["plane", "cylinder"] = "plane"
    """``plane``, or ``cylinder``: columns run around the link's z axis, rows along it."""
    radius_mm: float | None = field(default=None, metadata={"limits": (0.1, 100_000.0, "mm")})
    """Radius of the sheet on a cylinder in mm; None on a plane."""
    closed: bool = False
    """Whether the sheet's ends meet: the last column is a neighbor of the first, and ``pitch_x_mm`` follows from the
    radius.
    """
    mask: tuple[tuple[int, int], ...] = ()
    """(row, column) of absent or broken switches, which are never pressed and never stuck."""
    guard: bool = False
    """Whether one more row and column have crossings that are always closed, to name broken lines (docs/faults.md)."""
    ruler: int = field(default=0, metadata={"limits": (0, MAX_RULER, "")})
    """Instant at which rows are sampled, in sixteenths of the time in which the columns fall through known resistors at
    the guard crossings (docs/cell.md); 0: there are switches, and rows are sampled at the end of ``settle_us``."""
    harder: tuple[int, ...] = ()
    """Instants at which rows are sampled for up to two harder levels of force, falling, in sixteenths as ``ruler``
    (docs/levels.md). Then a map has the level of each cell: in how many samples it read pressed."""
    row_order: tuple[int, ...] = ()
    """The line that each row is soldered to, counted from 0 (docs/faults.md). (): row i is on line i."""
    column_order: tuple[int, ...] = ()
    """The line that each column is soldered to, as in ``row_order``."""
    connectivity: int = 8
    """8: cells that share a corner belong to one zone; 4: only cells that share an edge."""

    diodes: Literal["col2row", "row2col", "none"] = "col2row"
    """``col2row``: the selected row is low, columns are pulled up. ``row2col``: the opposite. ``none``: as ``col2row``
    without diodes; zones that may be ghosts are flagged.
    """
    scan: ScanName | Scan = "raster"
    """``raster`` drives one row after the other; ``reversal`` drives all columns and reads the rows, and then drives
    only touched rows."""
    settle_us: float = field(default=5.0, metadata={"limits": (0.0, 10_000.0, "us")})
    """Time a row is driven before its columns are sampled, in us."""
    release_us: float = field(default=1.0, metadata={"limits": (0.0, 10_000.0, "us")})
    """Time without a driven row before the next one, in us; with precharge at least ``precharge_us`` and two clocks."""
    precharge_us: float = field(default=0.0, metadata={"limits": (0.0, 10_000.0, "us")})
    """Time for which the board drives the columns to the released level before it drives a row, in us; 0: never."""
    project_us: float = field(default=1.0, metadata={"limits": (0.0, 10_000.0, "us")})
    """Time for which ``scan = "reversal"`` drives all columns before it reads the rows, in us."""
    row_drive: Literal["direct", "74hc595"] = "direct"
    """``direct``: a pin per row; ``74hc595``: rows on shift registers."""
    row_chains: int = 1
    """Chains of 74HC595 that are shifted at once; chain j drives lines j n to j n + n - 1, n = ceil(lines / chains)."""
    column_read: Literal["direct", "74hc165"] = "direct"
    """``direct``: a pin per column; ``74hc165``: columns on shift registers."""
    column_chains: int = 1
    """Chains of 74HC165 that are shifted at once; columns are spread over them as in ``row_chains``."""
    shift_hz: int = field(default=8_000_000, metadata={"limits": (10_000, 50_000_000, "Hz")})
    """Highest shift clock in Hz; the actual one is clock_hz divided by a whole number, at least 2."""
    debounce: DebounceName | Debounce = "none"
    """``none``, ``sym_defer_pk`` or ``asym_eager_defer_pk``, as in the keyboard firmware QMK."""
    debounce_press_us: float = 5000.0
    """In us. With ``sym_defer_pk``, the least duration of a press that counts; with ``asym_eager_defer_pk``, the time
    for which a press that has counted holds.
    """
    debounce_release_us: float = 5000.0
    """Least duration of a release that counts, in us."""

    labeller: LabellerName | Labeller = "run"
    """Method that finds zones: ``run``, the fastest, and ``serial``, smaller, are exact; ``projection`` uses the
    shadows on the two axes and is wrong where these cross; ``single`` joins all pressed cells.
    """
    report: ReportName = "moments"
    """``moments``: area, sum x and sum y of each zone; ``barycenter``: area and rounded barycenter; ``cells``: a bitmap
    of the pressed cells, or a map of their levels.
    """
    barycenter_bits: int = field(default=4, metadata={"limits": (0, MAX_BARYCENTER_BITS, "")})
    """Fraction bits of x and y with ``report = "barycenter"``, in cells; halves are rounded upward."""
    extent: bool = False
    """Whether each zone comes with its smallest and largest row and column, :attr:`Zone.box`; with the labellers
    ``run`` and ``serial``, and not with ``report = "cells"``."""
    send: Literal["always", "on_change"] = "always"
    """``always``: every frame is sent. ``on_change``: only keep-alives, and frames whose cells or flag
    ``fault`` differ from the last one.
    """
    keep_alive_ms: float = field(default=100.0, metadata={"limits": (0.0, 100.0, "ms")})
    """Longest pause between frames with ``send = "on_change"``, in ms."""
    zone_capacity: int | None = None
    """Most zones that a frame carries. Default: the most that can occur up to 32x32, at most 256 above that, and at
    most 64 with ``report = "barycenter"``.
    """

    fail_safe: bool = False
    """Whether ``contact`` is high while the board knows of a fault."""
    alive: bool = False
    """Whether a pin changes its level every ms as long as whole frames without a fault come."""
    self_test: bool = False
    """Whether the board tests its lines against each other, at start and on request; needs a scan that reads rows."""
    dual: bool = False
    """Whether two copies of the gateware are compared in each clock; if they differ, both restart."""

    units: int = 0
    """Number of pressure units on an SPI converter, 0 to 8 with the MCP3208 (docs/units.md)."""
    converter: ConverterName | Converter = "mcp3208"
    """Converter that reads the pressure units."""
    converter_v: float = 3.3
    """Supply of the converter in V, which limits its SPI clock."""
    unit_sums: tuple[tuple[int, ...], ...] = ()
    """Up to four weighted sums of the units' deviations from their zeros; each has a weight from -127 to 127 per unit.
    """

    clock_hz: int = field(default=12_000_000, metadata={"limits": (1_000_000, 400_000_000, "Hz")})
    """Clock of the gateware in Hz, a whole number of MHz."""
    baud: int = field(default=3_000_000, metadata={"limits": (1200, 200_000_000, "bits per second")})
    """Bits per second on the wire."""

    def __post_init__(self) -> None:
        self._keep(**checks.check_types(self))
        self._keep(**checks.check_sheet(self))
        checks.check_link(self)
        if self.zone_capacity is None:
            self._keep(zone_capacity=self._default_capacity())
        checks.check_timing(self)

    @classmethod
    def load(cls, path: str | Path, trust: bool = False, usual: Mapping[str, Any] | None = None) -> "Skin":
        """Read a Skin from a TOML file whose keys are the fields of this class, besides the tables ``[cover]`` and
        ``[circuit]`` (:func:`contactfpga.design.cover.load_cover`, :func:`contactfpga.design.circuit.load_circuit`).

        ``trust`` allows a file to name a module, such as ``labeller = "module:attribute"``; importing it runs its code.
        ``usual``: defaults for fields that the file leaves out. Raises :class:`SkinError`, OSError.
        """
        values = tomlfile.load(path, SkinError)
        with trusted(trust):
            refuse_modules(values, str(path))
        for place in modules(values).values():
            look_in(Path(path).parent, place)
        for table in ("cover", "circuit"):
            values.pop(table, None)
        known = [field.name for field in dataclasses.fields(cls)]
        unknown = sorted(set(values) - set(known))
        if unknown:
            if unknown == ["sheets"]:
                steps = (
                    f"name one of them, or give all as --sheets {shell_words(path)} or sim://?sheets={quote(str(path))}"
                )
                raise SkinError(f"{path} names the Skins of several sheets; {steps}")
            known += ["[cover]", "[circuit]"]
            raise SkinError(f"{path}: unknown key {shown(unknown[0])}; {suggestion(unknown[0], known)}")
        try:
            return cls(**{**(usual or {}), **values})
        except SkinError as error:
            raise SkinError(f"{path}: {error}") from None

    @classmethod
    def limits(cls, name: str) -> tuple[Any, Any, str]:
        """Least and greatest value of a field, and their unit; KeyError for a field whose values have none."""
        low, high, unit = cls.__dataclass_fields__[name].metadata["limits"]
        return low, high, unit

    def replace(self, **changes: Any) -> "Skin":
        """A copy with some fields changed, checked again. ``zone_capacity`` returns to its default if the sheet
        changes, or if ``report = "barycenter"`` is set or left.
        """
        divides = self.report == "barycenter"
        if {"rows", "columns", "connectivity", "closed"} & set(changes) or divides != (
            changes.get("report", self.report) == "barycenter"
        ):
            changes.setdefault("zone_capacity", None)
        if self.closed and {"columns", "radius_mm", "closed"} & set(changes):
            changes.setdefault("pitch_x_mm", type(self).pitch_x_mm)
        return dataclasses.replace(self, **changes)

    def to_toml(self) -> str:
        """TOML text that :meth:`load` reads."""
        lines = []
        for name, value in dataclasses.asdict(self).items():
            if value is not None:
                lines.append(f"{name} = {json.dumps(value)}")
        return "\n".join(lines) + "\n"

    @property
    def fingerprint(self) -> bytes:
        """Eight bytes that differ between Skins that differ in more than their names.

        They hash :attr:`changed`, so that a new field with a default changes no fingerprint (docs/protocol.md).
        """
        return hashlib.sha256(json.dumps(self.changed, sort_keys=True).encode()).digest()[:8]

    @property
    def changed(self) -> dict[str, Any]:
        """The fields that differ from their defaults, except the name."""
        defaults = {field.name: field.default for field in dataclasses.fields(self)}
        defaults["zone_capacity"] = self._default_capacity()
        fields = dataclasses.asdict(self)
        del fields["name"]
        return {name: value for name, value in fields.items() if value != defaults[name]}

    @property
    def selects_low(self) -> bool:
        """Whether selected rows and pressed columns are low; otherwise they are high."""
        return self.diodes != "row2col"

    @property
    def levels(self) -> int:
        """Levels of force that a cell can reach."""
        return 1 + len(self.harder)

    @property
    def reads_rows(self) -> bool:
        """Whether the scan reads the rows while it drives the columns."""
        return scans.find(self.scan).reads_rows

    @property
    def row_lines(self) -> int:
        """Rows, including the guard row."""
        return self.rows + self.guard

    @property
    def column_lines(self) -> int:
        """Columns, including the guard column."""
        return self.columns + self.guard

    @property
    def line_of_row(self) -> tuple[int, ...]:
        """The line of each row; the guard row's comes last."""
        return (*(self.row_order or range(self.rows)), *range(self.rows, self.row_lines))

    @property
    def line_of_column(self) -> tuple[int, ...]:
        """The line of each column; the guard column's comes last."""
        return (*(self.column_order or range(self.columns)), *range(self.columns, self.column_lines))

    @property
    def ghosts(self) -> bool:
        """Whether pressed switches can make others read pressed."""
        return self.diodes == "none"

    @property
    def sheet(self) -> Sheet:
        """The part of the Skin that is needed to read its frames."""
        shared = {field.name: getattr(self, field.name) for field in dataclasses.fields(Sheet)}
        return Sheet(**shared | ({} if self.report == "barycenter" else {"barycenter_bits": 0}))

    @functools.cached_property
    def derived(self) -> Derived:
        """Clocks, widths and depths of this Skin's board."""
        return Derived(self)

    def __getstate__(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}

    def max_zones(self) -> int:
        """The most zones in a frame of this sheet."""
        return max_zones(self.rows, self.columns, self.connectivity, self.closed)

    def _keep(self, **values: Any) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def _default_capacity(self) -> int:
        small = self.rows <= 32 and self.columns <= 32
        most = self.max_zones() if small else min(self.max_zones(), 256)
        return min(most, 64) if REPORTS[self.report].divided else most


def _suggesting(init: Callable[..., None]) -> Callable[..., None]:
    known = [field.name for field in dataclasses.fields(Skin)]

    @functools.wraps(init)
    def checked(self: Skin, *args: Any, **values: Any) -> None:
        for name in values:
            if name not in known:
                raise TypeError(f"a Skin has no field {name!r}; {suggestion(name, known)}")
        init(self, *args, **values)

    return checked


Skin.__init__ = _suggesting(Skin.__init__)  # type: ignore[method-assign]
