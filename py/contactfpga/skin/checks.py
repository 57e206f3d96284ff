"""Checks of a :class:`~contactfpga.Skin`; each error names the field, its value and the limit."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Callable, Iterable
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin

from contactfpga.choices import converters, debounces, labellers, scans
from contactfpga.choices.choice import Choice
from contactfpga.errors import SkinError
from contactfpga.inputs.values import is_finite, shown, whole
from contactfpga.skin.derived import Derived
from contactfpga.skin.sheet import MAX_LEVELS, MIN_AROUND
from contactfpga.skin.units import MAX_SUMS, MAX_WEIGHT

if TYPE_CHECKING:
    from contactfpga.skin import Skin


Mask = tuple[tuple[int, int], ...]

_REGISTERED: dict[str, Callable[[object], Choice]] = {
    "labeller": labellers.find,
    "scan": scans.find,
    "debounce": debounces.find,
    "converter": converters.find,
}


def check_types(skin: Skin) -> dict[str, Any]:
    """Check every field's type; returns the values in their final types: Python's integers, not numpy's, and 8.0 is no
    8."""
    _check_name(skin.name)
    return {name: check(name, getattr(skin, name)) for name, check in _type_checks(dataclasses.fields(skin))}


@functools.cache
def _type_checks(fields: tuple[dataclasses.Field[Any], ...]) -> list[tuple[str, Callable[[str, Any], Any]]]:
    types = {field.name: field.type for field in fields}
    types["connectivity"] = Literal[4, 8]  # int in the class, as callers compute it
    return [
        *((name, partial(_choice, get_args(of))) for name, of in types.items() if get_origin(of) is Literal),
        *((name, _registered) for name in _REGISTERED),
        *((name, checks[of]) for checks in _BY_TYPE for name, of in types.items() if of in checks),
    ]


def _choice(choices: tuple[Any, ...], name: str, value: Any) -> Any:
    of_type = isinstance(value, str) if isinstance(choices[0], str) else whole(value) is not None
    if not of_type or value not in choices:
        raise SkinError(f"{name} is {shown(value)}; it must be one of {', '.join(map(repr, choices))}")
    return choices[choices.index(value)]


def _registered(name: str, value: Any) -> str:
    return _REGISTERED[name](value).name


def _switch(name: str, value: Any) -> bool:
    if not isinstance(value, bool):
        raise SkinError(f"{name} is {shown(value)}; it must be true or false")
    return value


def _whole(name: str, value: Any) -> int:
    if (number := whole(value)) is None:
        raise SkinError(f"{name} is {shown(value)}; it must be a whole number")
    return number


def _finite(name: str, value: Any) -> float:
    if not is_finite(value):
        raise SkinError(f"{name} is {shown(value)}; it must be a finite number")
    return float(value)


def _optional(check: Callable[[str, Any], Any]) -> Callable[[str, Any], Any]:
    return lambda name, value: None if value is None else check(name, value)


_BY_TYPE: tuple[dict[Any, Callable[[str, Any], Any]], ...] = (
    {bool: _switch},
    {int: _whole},
    {int | None: _optional(_whole)},
    {float: _finite, float | None: _optional(_finite)},
)


def _check_name(name: object) -> None:
    if not isinstance(name, str):
        raise SkinError(f"name is {shown(name)}; it must be a string")
    if not name.isprintable() or name != name.strip():
        raise SkinError(f"name is {shown(name)}; it must be printable, with no spaces around it")
    if (count := len(name.encode())) > 32:
        raise SkinError(f"name is {shown(name)}, {count} bytes of UTF-8; at most 32 are possible")


def check_sheet(skin: Skin) -> dict[str, Any]:
    """Check sheet, wiring and scan; returns the sorted mask, and the line orders as tuples."""
    _within(skin, "rows", "columns", "pitch_x_mm", "pitch_y_mm")
    mask = _check_mask(skin)
    _check_registers(skin)
    _check_precharge(skin)
    scans.find(skin.scan).check(skin)
    _check_ghosts(skin, mask)
    surface = check_surface(skin)
    _check_guard(skin)
    orders = {f"{kind}_order": _check_order(skin, kind) for kind in ("row", "column")}
    return {"mask": mask, "harder": _check_harder(skin), **surface, **orders, **check_units(skin)}


def _check_order(skin: Skin, kind: str) -> tuple[int, ...]:
    name, lines = f"{kind}_order", getattr(skin, f"{kind}s")
    value = getattr(skin, name)
    numbers = [whole(line) for line in value] if isinstance(value, list | tuple) else None
    if numbers is None or None in numbers:
        raise SkinError(f"{name} is {shown(value)}; it must be a list of whole numbers")
    order = tuple(line for line in numbers if line is not None)
    if order and sorted(order) != list(range(lines)):
        wrong = next((line for line in range(lines) if order.count(line) != 1), None)
        found = f"line {wrong} stands in it {order.count(wrong)} times" if wrong is not None else f"it has {len(order)}"
        raise SkinError(f"{name} must hold each line from 0 to {lines - 1} once; {found}")
    return () if order == tuple(range(lines)) else order


def _check_guard(skin: Skin) -> None:
    if skin.guard and skin.ghosts:
        raise SkinError("diodes is 'none'; guard = true closes switches for good and needs 'col2row' or 'row2col'")
    _within(skin, "ruler")
    if skin.ruler and not (skin.guard and skin.precharge_us and skin.scan == "raster"):
        raise SkinError(f"ruler is {skin.ruler}; columns that fall need guard = true, precharge_us and scan = 'raster'")
    if skin.self_test and not skin.reads_rows:
        raise SkinError(f"scan is {skin.scan!r}; self_test = true drives and reads all lines and needs 'reversal'")


def _check_harder(skin: Skin) -> tuple[int, ...]:
    values = [whole(one) for one in skin.harder] if isinstance(skin.harder, list | tuple) else [None]
    harder = tuple(one for one in values if one is not None)
    if len(harder) < len(values):
        raise SkinError(f"harder is {shown(skin.harder)}; it must be a list of whole numbers")
    if len(harder) >= MAX_LEVELS:
        raise SkinError(f"harder has {len(harder)} levels; {MAX_LEVELS - 1} are possible, as a cell has two bits")
    for lighter, one in itertools.pairwise((skin.ruler, *harder)):
        if not 0 < one < lighter:
            raise SkinError(f"harder has {one} after {lighter}; each level is from 1 to below the lighter one's ruler")
    wanted: dict[str, Any] = {"report": "cells", "debounce": "none", "closed": False} if harder else {}
    for name, value in wanted.items():
        if getattr(skin, name) != value:
            found, needed = (repr(one).lower() for one in (getattr(skin, name), value))
            raise SkinError(f"{name} is {found}; harder levels need {name} = {needed}")
    return harder


def _check_mask(skin: Skin) -> Mask:
    if isinstance(skin.mask, str) or not isinstance(skin.mask, Iterable):
        raise SkinError(f"mask is {shown(skin.mask)}; it must be a list of [row, column]")
    cells = []
    for cell in skin.mask:
        pair = [whole(index) for index in cell] if isinstance(cell, list | tuple) else []
        if len(pair) != 2 or pair[0] is None or pair[1] is None:
            raise SkinError(f"mask holds {shown(cell)}; it must hold [row, column] pairs")
        row, column = pair[0], pair[1]
        if not (0 <= row < skin.rows and 0 <= column < skin.columns):
            raise SkinError(f"mask holds {shown(pair)}; the sheet has {skin.rows} rows and {skin.columns} columns")
        cells.append((row, column))
    if len(set(cells)) == skin.rows * skin.columns:
        raise SkinError(f"mask lists all {len(set(cells))} switches; at least one must be left")
    return tuple(sorted(set(cells)))


def _check_registers(skin: Skin) -> None:
    for kind, wiring, registers in (("row", "row_drive", "74hc595"), ("column", "column_read", "74hc165")):
        lines, chains = getattr(skin, f"{kind}_lines"), getattr(skin, f"{kind}_chains")
        if getattr(skin, wiring) == "direct":
            _left_out(skin, f"{kind}_chains", f"set {wiring} = '{registers}'")
            continue
        _within(skin, f"{kind}_chains", ends=(1, lines, ""))
        length = math.ceil(lines / chains)
        filled = math.ceil(lines / length)
        if filled < chains:
            guarded = " with the guard line" if skin.guard else ""
            raise SkinError(
                f"{kind}_chains is {shown(chains)}; {lines} {kind}s{guarded} in chains of {length} fill {filled}, set "
                f"{kind}_chains = {filled}"
            )
    _within(skin, "shift_hz")
    if skin.row_drive == skin.column_read == "direct":
        _left_out(skin, "shift_hz", "set row_drive = '74hc595' or column_read = '74hc165'")


def _check_precharge(skin: Skin) -> None:
    if skin.precharge_us and skin.column_read != "direct":
        raise SkinError(f"column_read is {skin.column_read!r}; precharge_us drives the columns and needs 'direct'")
    if skin.precharge_us and skin.ghosts:
        raise SkinError("diodes is 'none'; precharge_us drives the columns and needs 'col2row' or 'row2col'")
    if not skin.reads_rows:
        _left_out(skin, "project_us", "set scan = 'reversal'")


def _check_ghosts(skin: Skin, mask: Mask) -> None:
    if not skin.ghosts:
        return
    wanted: dict[str, Any] = {"scan": "raster", "row_drive": "direct"}
    if skin.report == "barycenter":
        raise SkinError("report is 'barycenter'; diodes = 'none' needs report = 'moments' or 'cells'")
    if skin.report == "moments":
        exact = labellers.find(skin.labeller).exact
        wanted |= {"connectivity": 4, "labeller": skin.labeller if exact else "run"}
    for name, value in wanted.items():
        if getattr(skin, name) != value:
            why = " with report = 'moments'" if name in ("connectivity", "labeller") else ""
            raise SkinError(f"{name} is {getattr(skin, name)!r}; diodes = 'none' needs {name} = {value!r}{why}")
    if mask:
        raise SkinError(
            f"mask lists {len(mask)} switches; diodes = 'none' takes none, as what a masked switch feeds "
            "could not be known"
        )


def check_link(skin: Skin) -> None:
    _within(skin, "barycenter_bits")
    if skin.report != "barycenter":
        _left_out(skin, "barycenter_bits", "set report = 'barycenter'")
    if skin.extent:
        _check_extent(skin)
    low, high, _ = skin.limits("clock_hz")
    if skin.clock_hz % 1_000_000 or not low <= skin.clock_hz <= high:
        ends = f"{low // 1_000_000} to {high // 1_000_000} MHz"
        raise SkinError(f"clock_hz is {shown(skin.clock_hz)}; it must be a whole number of MHz from {ends}")
    _within(skin, "baud", ends=(skin.limits("baud")[0], skin.clock_hz // 2, "for this clock"))
    divisor = round(skin.clock_hz / skin.baud)
    error = skin.clock_hz / divisor / skin.baud - 1
    if abs(error) > _MAX_BAUD_ERROR:
        nearest = sorted({skin.clock_hz // d for d in (divisor - 1, divisor, divisor + 1) if d >= 2})
        raise SkinError(
            f"baud is {skin.baud}: a clock of {skin.clock_hz} Hz misses it by {100 * error:+.2f} %, the limit is "
            f"{100 * _MAX_BAUD_ERROR} %; nearest good rates: {', '.join(map(str, nearest))}"
        )
    if skin.send == "on_change":
        _within(skin, "keep_alive_ms")


def _check_extent(skin: Skin) -> None:
    if skin.report == "cells":
        raise SkinError("report is 'cells'; extent = true needs report = 'moments' or 'barycenter'")
    if not labellers.find(skin.labeller).extent:
        raise SkinError(f"labeller is {str(skin.labeller)!r}; extent = true needs labeller = {_labellers('extent')}")


def _labellers(able: str) -> str:
    return " or ".join(repr(name) for name, labeller in labellers.LABELLERS.items() if getattr(labeller, able))


def check_timing(skin: Skin) -> None:
    """Check times, zone capacity, and that each row is processed before the next."""
    assert skin.zone_capacity is not None
    _within(skin, "zone_capacity", ends=(1, skin.max_zones(), "for this sheet"))
    _within(skin, "settle_us", "release_us", "precharge_us", "project_us")
    derived = skin.derived
    megahertz = skin.clock_hz // 1_000_000
    for name in ("settle_us", "release_us", "project_us", *(["precharge_us"] if skin.precharge_us else [])):
        if derived.clocks(getattr(skin, name)) < 1:
            raise SkinError(f"{name} is {getattr(skin, name)}; it must be at least one clock, {1 / megahertz:g} us")
    if derived.row_clocks < derived.min_row_clocks:
        divided = f" and report = {skin.report!r}" if derived.report.divided else ""
        raise SkinError(
            f"settle_us + release_us is {derived.row_clocks} clocks; {skin.columns} columns and "
            f"{skin.zone_capacity} zones per frame need {derived.min_row_clocks} clocks "
            f"({derived.min_row_clocks / megahertz:g} us) with labeller = '{skin.labeller}'{divided}"
        )
    _check_keep_alive(skin, derived)
    if derived.debounced:
        longest_us = _MAX_DEBOUNCE_SCANS * derived.frame_clocks / megahertz
        _within(skin, "debounce_press_us", "debounce_release_us", ends=(0.0, longest_us, "us"))


def _check_keep_alive(skin: Skin, derived: Derived) -> None:
    if skin.send != "on_change":
        return
    if derived.scan.waits and derived.keep_alive_toggles < 1:
        raise SkinError(
            f"keep_alive_ms is {skin.keep_alive_ms}; scan = {skin.scan!r} needs at least "
            f"{derived.min_keep_alive_ms:g} ms for this sheet"
        )
    if not derived.scan.waits and derived.keep_alive_frames < 1:
        raise SkinError(
            f"keep_alive_ms is {skin.keep_alive_ms}; one scan takes {derived.frame_clocks / skin.clock_hz * 1e3:g} ms"
        )


def _left_out(skin: Skin, name: str, instead: str) -> None:
    if (value := getattr(skin, name)) != getattr(type(skin), name):
        raise SkinError(f"{name} is {shown(value)}; leave it out, or {instead}")


def _within(skin: Skin, *names: str, ends: tuple[float, float, str] | None = None) -> None:
    for name in names:
        low, high, unit = ends or skin.limits(name)
        if not low <= (value := getattr(skin, name)) <= high:
            raise SkinError(f"{name} is {shown(value)}; it must lie between {low} and {high} {unit}".rstrip())


_PITCH_TOLERANCE, _MAX_BAUD_ERROR, _MAX_DEBOUNCE_SCANS = 1e-3, 0.015, 4095


def check_surface(skin: Skin) -> dict[str, float]:
    """Check surface, radius and pitch; returns the pitch of a closed sheet."""
    if skin.surface == "plane":
        if skin.closed:
            raise SkinError("surface is 'plane'; closed = true needs surface = 'cylinder' and radius_mm")
        if skin.radius_mm is not None:
            raise SkinError(f"radius_mm is {skin.radius_mm}; a plane has none, leave it out")
        return {}
    if skin.radius_mm is None:
        raise SkinError("radius_mm is missing; surface = 'cylinder' needs it")
    _within(skin, "radius_mm")
    around_mm = 2 * math.pi * skin.radius_mm
    return _check_closed(skin, around_mm) if skin.closed else _check_gap(skin, around_mm)


def _check_gap(skin: Skin, around_mm: float) -> dict[str, float]:
    if skin.columns * skin.pitch_x_mm >= around_mm:
        most = math.ceil(around_mm / skin.pitch_x_mm) - 1
        advice = f"use at most {most} columns" if most else "use a larger radius_mm or a smaller pitch_x_mm"
        raise SkinError(
            f"{skin.columns} columns of {skin.pitch_x_mm} mm take {skin.columns * skin.pitch_x_mm:g} mm of a "
            f"circumference of {around_mm:g} mm: the sheet's ends meet; set closed = true, or {advice}"
        )
    return {}


def _check_closed(skin: Skin, around_mm: float) -> dict[str, float]:
    if skin.columns < MIN_AROUND:
        raise SkinError(f"columns is {skin.columns}; closed = true needs at least {MIN_AROUND}")
    if skin.ghosts:
        raise SkinError("diodes is 'none'; closed = true needs 'col2row' or 'row2col'")
    if skin.report == "barycenter":
        raise SkinError("report is 'barycenter'; closed = true needs report = 'moments' or 'cells'")
    if skin.report == "moments" and not labellers.find(skin.labeller).closed:
        raise SkinError(f"labeller is {str(skin.labeller)!r}; closed = true needs labeller = {_labellers('closed')}")
    pitch_mm = around_mm / skin.columns
    given = skin.pitch_x_mm != type(skin).pitch_x_mm
    if given and abs(skin.pitch_x_mm / pitch_mm - 1) > _PITCH_TOLERANCE:
        raise SkinError(
            f"pitch_x_mm is {skin.pitch_x_mm}; {skin.columns} columns around a radius of {skin.radius_mm:g} mm have "
            f"{pitch_mm:g} mm, leave it out"
        )
    low, high, unit = skin.limits("pitch_x_mm")
    if not low <= pitch_mm <= high:
        raise SkinError(
            f"{skin.columns} columns around a radius of {skin.radius_mm:g} mm have a pitch of {pitch_mm:g} mm; it must "
            f"lie between {low} and {high} {unit}"
        )
    return {"pitch_x_mm": pitch_mm}


def check_units(skin: Skin) -> dict[str, Any]:
    """Check units, converter and sums; returns the sums as tuples."""
    converter = converters.find(skin.converter)
    if not 0 <= skin.units <= converter.channels:
        raise SkinError(f"units is {skin.units}; {converter.title} has {converter.channels} channels")
    sums = _sums(skin.unit_sums, skin.units)
    if not skin.units:
        _left_out(skin, "converter_v", "set units")
        return {"unit_sums": sums}
    least_v = converter.limits[0][0]
    if not least_v <= skin.converter_v <= converter.most_v:
        raise SkinError(f"converter_v is {skin.converter_v}; {converter.title} needs {least_v} to {converter.most_v} V")
    return {"unit_sums": sums}


def _sums(value: Any, units: int) -> tuple[tuple[int, ...], ...]:
    if not isinstance(value, list | tuple) or len(value) > MAX_SUMS:
        raise SkinError(f"unit_sums is {shown(value)}; it must be a list of at most {MAX_SUMS} lists of weights")
    return tuple(_weights(row, units) for row in value)


def _weights(row: Any, units: int) -> tuple[int, ...]:
    weights = [whole(weight) for weight in row] if isinstance(row, list | tuple) else []
    if len(weights) != units or not any(weights):
        raise SkinError(f"unit_sums holds {shown(row)}; it must hold a weight for each of {units} units, not all 0")
    found = tuple(weight for weight in weights if weight is not None and abs(weight) <= MAX_WEIGHT)
    if len(found) != units:
        raise SkinError(f"unit_sums holds {shown(row)}; weights are whole numbers from -{MAX_WEIGHT} to {MAX_WEIGHT}")
    return found
