"""What `sim://?scene=NAME&skin=FILE&threshold=NUMBER&units=FILE` asks for."""

from __future__ import annotations

import dataclasses
import math
import re
from typing import Any
from urllib.parse import unquote

from contactfpga.errors import PortNotFound
from contactfpga.inputs.values import number_in

OPTIONS = ("scene", "skin", "threshold", "units", "sheets")
_FORM = "it reads sim://, with ?scene=NAME, &skin=FILE, &threshold=NUMBER and &units=FILE where wanted"
_ESCAPES = "a % that is meant is written %25, a & %26"


@dataclasses.dataclass(frozen=True)
class SimAddress:
    """The options, decoded."""

    scene: str | None = None
    skin: str | None = None
    threshold: float | None = None
    """Above which a recording's numbers count as pressed."""
    units: str | None = None
    """File of the pressure units that the scene presses on."""
    sheets: str | None = None
    """File of several sheets at one FPGA, in place of a Skin; the scene touches each of them."""


def parse(name: str) -> SimAddress:
    """Read an address. ``%`` and two hex digits stand for a byte of UTF-8; all else but ``&`` stands for itself, ``+``
    and ``#`` too. Raises :class:`PortNotFound` that says what is wrong."""
    head, _, query = name.partition("?")
    if head not in ("sim://", "sim:"):
        raise PortNotFound(f"{name}: {_FORM}")
    found: dict[str, Any] = {}
    for part in query.split("&") if query else ():
        key, equals, value = part.partition("=")
        if key not in OPTIONS or not equals:
            raise PortNotFound(f"{name}: {part!r} is no option; {_FORM}; {_ESCAPES}")
        if key in found:
            raise PortNotFound(f"{name}: {key} is given twice")
        found[key] = _decoded(name, value)
        if not found[key]:
            raise PortNotFound(f"{name}: {key} is empty; {_FORM}")
    if "threshold" in found:
        found["threshold"] = _number(name, found["threshold"])
    if "sheets" in found and (other := {"skin", "threshold", "units"} & set(found)):
        raise PortNotFound(f"{name}: with sheets there is no {min(other)}; their Skins are in the file of the sheets")
    return SimAddress(**found)


def _decoded(name: str, text: str) -> str:
    if odd := re.search(r"%(?![0-9a-fA-F]{2}).{0,2}", text):
        raise PortNotFound(f"{name}: {odd[0]!r} is no % with two hex digits; {_ESCAPES}")
    try:
        return unquote(text, errors="strict")
    except UnicodeDecodeError:
        raise PortNotFound(f"{name}: {text!r} is no UTF-8 once its % are decoded") from None


def _number(name: str, text: str) -> float:
    value = number_in(text)
    if not math.isfinite(value):
        raise PortNotFound(f"{name}: threshold is {text!r}; it must be a finite number")
    return value
