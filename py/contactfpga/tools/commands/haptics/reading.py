"""JSON files of `contactfpga haptics`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from contactfpga.inputs.files import read_small, reason_of
from contactfpga.inputs.values import shown, suggestion
from contactfpga.robot.haptics.contact import Touch
from contactfpga.robot.haptics.units import LoadCells, Unit
from contactfpga.robot.haptics.values import HapticsError, direction, matrix, number, positive, vector
from contactfpga.robot.haptics.wrench import Noise, Surface, Wrench, read_surface

MAX_BYTES = 1_000_000
MAX_CONTACTS = 64
MAX_UNITS = 64


def load(path: str | Path, keys: tuple[str, ...]) -> dict[str, Any]:
    """The object in a file, with only these keys. Raises :class:`HapticsError`."""
    try:
        values = json.loads(read_small(path, MAX_BYTES, "a JSON file", HapticsError))
    except OSError as error:
        raise HapticsError(reason_of(error)) from None
    except HapticsError:
        raise
    except RecursionError:
        raise HapticsError(f"{path}: not a JSON file that can be read: lists lie too deep in each other") from None
    except ValueError as error:  # of JSON, of UTF-8, of numbers of thousands of digits
        raise HapticsError(f"{path}: not a JSON file: {error}") from None
    return _table(str(path), values, keys)


def contacts(path: str | Path) -> tuple[Wrench, list[Touch], Surface | None]:
    """Wrench, places and surface in a file of `haptics contacts`. Raises :class:`HapticsError`."""
    values = load(path, ("surface", "wrench", "contacts"))
    wrench = _wrench(_needed(values, "wrench", "with force_n and moment_nm"))
    listed = values.get("contacts", [])
    if not isinstance(listed, list) or len(listed) > MAX_CONTACTS:
        raise HapticsError(f"contacts is {shown(listed)}; it must be a list of at most {MAX_CONTACTS}")
    touches = [_touch(one, f"contacts[{index}]") for index, one in enumerate(listed)]
    surface = read_surface(values["surface"]) if "surface" in values else None
    if touches and surface is not None:
        raise HapticsError("surface is given beside contacts; it counts only where no contact is given")
    if not touches and surface is None:
        raise HapticsError("no contact is given; add contacts, or surface to find the center of pressure")
    return wrench, touches, surface


def units(path: str | Path) -> tuple[LoadCells, list[float]]:
    """Units and readings in a file of `haptics wrench`. Raises :class:`HapticsError`."""
    values = load(path, ("units", "readings_n", "sigma_n"))
    listed = _needed(values, "units", "a list of point_m and axis")
    if not isinstance(listed, list) or not 0 < len(listed) <= MAX_UNITS:
        raise HapticsError(f"units is {shown(listed)}; it must be a list of 1 to {MAX_UNITS}")
    sigma = positive("sigma_n", _needed(values, "sigma_n", "the noise of a unit in N"), "N")
    made = []
    for index, one in enumerate(listed):
        name = f"units[{index}]"
        _table(name, one, ("point_m", "axis"))
        point = vector(f"{name}.point_m", _needed(one, "point_m", "in m", name), "in m")
        made.append(Unit(point, direction(f"{name}.axis", _needed(one, "axis", "", name)), sigma_n=sigma))
    readings = _needed(values, "readings_n", "one per unit, in N")
    if not isinstance(readings, list) or len(readings) != len(made):
        raise HapticsError(f"readings_n is {shown(readings)}; it must be a list of {len(made)}, one per unit")
    return LoadCells(made), [number(f"readings_n[{index}]", one, unit="N") for index, one in enumerate(readings)]


def _wrench(values: Any) -> Wrench:
    _table("wrench", values, ("force_n", "moment_nm", "covariance"))
    force = vector("wrench.force_n", _needed(values, "force_n", "", "wrench"), "in N")
    moment = vector("wrench.moment_nm", _needed(values, "moment_nm", "", "wrench"), "in Nm")
    given = values.get("covariance")
    return Wrench(force, moment, None if given is None else Noise.checked(matrix("wrench.covariance", given, 6, 6)))


def _touch(values: Any, name: str) -> Touch:
    _table(name, values, ("point_m", "normal", "friction", "point_sigma_m"))
    return Touch(
        vector(f"{name}.point_m", _needed(values, "point_m", "in m", name), "in m"),
        direction(f"{name}.normal", _needed(values, "normal", "", name)),
        number(f"{name}.friction", values.get("friction", 0.5), 0, 100),
        number(f"{name}.point_sigma_m", values.get("point_sigma_m", 0.0), 0, 1, "m"),
    )


def _needed(values: dict[str, Any], key: str, what: str, name: str = "the file") -> Any:
    if key not in values:
        raise HapticsError(f"{key} is missing in {name}" + (f"; give it, {what}" if what else ""))
    return values[key]


def _table(name: str, values: Any, keys: tuple[str, ...]) -> dict[str, Any]:
    if not isinstance(values, dict):
        raise HapticsError(f"{name} is {shown(values)}; it must be an object with {', '.join(keys)}")
    for key in values:
        if key not in keys:
            raise HapticsError(f"unknown key {shown(key)} in {name}; {suggestion(key, keys)}")
    return values
