"""The file units.toml: places, axes, gains and zeros of the units, and the bumper they carry."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import shown
from contactfpga.robot.haptics import surface
from contactfpga.robot.haptics.answer import HapticsError, direction, matrix, number, positive, vector
from contactfpga.robot.haptics.unit import Unit
from contactfpga.robot.haptics.wrench import Bumper

if TYPE_CHECKING:
    from contactfpga.robot.haptics.units import LoadCells

MAX_UNITS = 64
KEYS = ("frame", "zero_gravity_m_s2", "matrix", "surface", "bumper", "unit")
UNIT_KEYS = ("point_m", "axis", "gain_n", "zero", "sigma_n", "range", "preload_n")
BUMPER_KEYS = ("mass_kg", "center_m", "inertia_kg_m2")


def load(path: str | Path) -> dict[str, Any]:
    """The arguments of :class:`LoadCells`, from a units.toml. Raises :class:`HapticsError`, OSError."""
    values = tomlfile.load(path, HapticsError)
    try:
        return read(values)
    except HapticsError as error:
        raise HapticsError(f"{path}: {error}") from None


def read(values: dict[str, Any]) -> dict[str, Any]:
    """The same, from the tables of such a file."""
    _known(values, KEYS, "the file")
    given = values.get("unit")
    if not isinstance(given, list) or not given:
        raise HapticsError("there is no unit; give a table [[unit]] with point_m and axis for each")
    if len(given) > MAX_UNITS:
        raise HapticsError(f"there are {len(given)} units; at most {MAX_UNITS} are read")
    units = [_unit(one, f"unit[{index}]") for index, one in enumerate(given)]
    frame = values.get("frame", "")
    if not isinstance(frame, str):
        raise HapticsError(f"frame is {shown(frame)}; it must be the name of the link's frame")
    gravity = vector("zero_gravity_m_s2", values.get("zero_gravity_m_s2", (0, 0, 0)), "m/s2")
    found = matrix("matrix", values["matrix"], 6, len(units)) if "matrix" in values else None
    bumper = _bumper(values["bumper"]) if "bumper" in values else None
    made = {"units": units, "frame": frame, "bumper": bumper, "zero_gravity_m_s2": gravity, "matrix": found}
    return made | (_surface(values["surface"]) if "surface" in values else {})


def _surface(values: Any) -> dict[str, Any]:
    """The bumper's outside, and where the sheet begins on it."""
    kind = dict(values) if isinstance(values, dict) else values
    place = kind.pop("sheet_m", (0.0, 0.0)) if isinstance(kind, dict) else None
    found = surface.read(kind)
    if not isinstance(place, (list, tuple)) or len(place) != 2:
        raise HapticsError(f"surface.sheet_m is {shown(place)}; it must be two numbers, x and y in m")
    x, y = (number(f"surface.sheet_m[{index}]", one, unit="m") for index, one in enumerate(place))
    return {"surface": found, "sheet_m": (x, y)}


def _unit(values: Any, name: str) -> Unit:
    _known(values, UNIT_KEYS, name)
    for key in ("point_m", "axis"):
        if key not in values:
            raise HapticsError(f"{key} is missing in {name}")
    gain = number(f"{name}.gain_n", values.get("gain_n", 1.0), unit="N")
    if gain == 0:
        raise HapticsError(f"{name}.gain_n is 0; it must be the newtons of a step of the reading")
    preload = values.get("preload_n")
    return Unit(
        vector(f"{name}.point_m", values["point_m"], "in m"),
        direction(f"{name}.axis", values["axis"]),
        gain,
        number(f"{name}.zero", values.get("zero", 0.0)),
        positive(f"{name}.sigma_n", values.get("sigma_n", 0.05), "N"),
        _range(f"{name}.range", values.get("range")),
        None if preload is None else number(f"{name}.preload_n", preload, 0, unit="N"),
    )


def _range(name: str, value: Any) -> tuple[float, float] | None:
    if value is None:
        return None
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise HapticsError(f"{name} is {shown(value)}; it must be the two readings at the ends")
    low, high = (number(f"{name}[{index}]", one) for index, one in enumerate(value))
    if not low < high:
        raise HapticsError(f"{name} is {shown(value)}; the first reading must be below the second")
    return low, high


def _bumper(values: Any) -> Bumper:
    _known(values, BUMPER_KEYS, "bumper")
    if "mass_kg" not in values:
        raise HapticsError("mass_kg is missing in bumper")
    x, y, z = matrix("bumper.inertia_kg_m2", values.get("inertia_kg_m2", [[0] * 3] * 3), 3, 3).tolist()
    center = vector("bumper.center_m", values.get("center_m", (0, 0, 0)), "in m")
    return Bumper(positive("bumper.mass_kg", values["mass_kg"], "kg"), center, (tuple(x), tuple(y), tuple(z)))


def _known(values: Any, keys: tuple[str, ...], name: str) -> None:
    if not isinstance(values, dict):
        raise HapticsError(f"{name} is {shown(values)}; it must be a table with {', '.join(keys)}")
    for key in values:
        if key not in keys:
            raise HapticsError(f"unknown key {shown(key)} in {name}; known are {', '.join(keys)}")


def write(cells: LoadCells) -> str:
    """The text that :func:`read` reads back."""
    lines = [f"frame = {json.dumps(cells.frame)}"] if cells.frame else []
    if any(cells.zero_gravity_m_s2):
        lines.append(f"zero_gravity_m_s2 = {json.dumps(list(cells.zero_gravity_m_s2))}")
    if cells.calibrated:
        lines.append(f"matrix = {json.dumps(np.asarray(cells.matrix).tolist())}")
    if cells.surface:
        lines += ["", "[surface]", *_written(cells.surface), f"sheet_m = {json.dumps(list(cells.sheet_m))}"]
    if cells.bumper:
        lines += ["", "[bumper]", f"mass_kg = {cells.bumper.mass_kg!r}"]
        lines.append(f"center_m = {json.dumps(list(cells.bumper.center_m))}")
        lines.append(f"inertia_kg_m2 = {json.dumps([list(row) for row in cells.bumper.inertia_kg_m2])}")
    for unit in cells.units:
        lines += ["", "[[unit]]"]
        for key in UNIT_KEYS:
            value = getattr(unit, key)
            if value is not None:
                lines.append(f"{key} = {json.dumps(list(value) if isinstance(value, tuple) else value)}")
    return "\n".join(lines) + "\n"


def _written(outside: surface.Surface) -> list[str]:
    kind = next(name for name, (made, _) in surface.KINDS.items() if isinstance(outside, made))
    length = surface.KINDS[kind][1]
    return [f'kind = "{kind}"', f"{length} = {getattr(outside, length)!r}"]
