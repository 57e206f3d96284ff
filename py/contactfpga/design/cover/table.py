"""The table `[cover]` in a Skin's file."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

from contactfpga.design.cover.answer import MAX_LENGTH_M, CoverError
from contactfpga.design.cover.press import Cover
from contactfpga.design.cover.switch import Switch
from contactfpga.inputs import tomlfile

MIN_LENGTH_M = 1e-6
"""Nothing is thinner; integrals over a layer run out of numbers long after."""


def load(path: str | Path) -> Cover | None:
    """The cover in a Skin's file; None where it has no table ``[cover]``. Raises CoverError."""
    return tomlfile.load_table(path, "cover", read, CoverError)


def read(values: Any) -> Cover:
    """The cover that a TOML table describes; its keys are the fields of :class:`Cover`, with a table ``switch``."""
    given = dict(tomlfile.fields_of(Cover, "cover", values, CoverError))
    if "switch" in given:
        given["switch"] = Switch(**tomlfile.fields_of(Switch, "cover.switch", given["switch"], CoverError))
    cover = Cover(**given)
    if not MIN_LENGTH_M <= cover.thickness_m <= MAX_LENGTH_M:
        raise CoverError(
            f"thickness_m in [cover] is {cover.thickness_m:g}; it must be a length in m, at most {MAX_LENGTH_M:g}; "
            f"5 mm is 0.005, and the least is {MIN_LENGTH_M:g}"
        )
    for name, value, unit in (("force_n", cover.switch.force_n, "N"), ("area_m2", cover.switch.area_m2, "m2")):
        if not 1e-9 <= value <= 1e6:
            raise CoverError(f"{name} in [cover.switch] is {value:g}; it must lie between 1e-09 and 1e+06 {unit}")
    return cover


def write(cover: Cover) -> str:
    """The TOML tables that :func:`read` reads back."""
    values = dataclasses.asdict(cover)
    switch = values.pop("switch")
    return "\n[cover]\n" + _lines(values) + "\n[cover.switch]\n" + _lines(switch)


def _lines(values: dict[str, Any]) -> str:
    return "".join(f"{name} = {json.dumps(value)}\n" for name, value in values.items() if value is not None)
