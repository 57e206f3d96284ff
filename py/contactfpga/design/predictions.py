"""Predictions of a kit that a builder can prove wrong: numbers with intervals, each with its command.

In ``predictions.toml`` a changed prediction is a new entry below the old one.
"""

from __future__ import annotations

import dataclasses
import datetime
import tomllib
from collections.abc import Mapping

from contactfpga.design.kits import Kit, KitError
from contactfpga.inputs import tomlfile

FILE = "predictions.toml"


@dataclasses.dataclass(frozen=True)
class Prediction:
    """A number and its 95 % interval."""

    name: str
    what: str
    unit: str
    value: float
    low: float
    high: float
    model: str
    """Model under test: gateware, bridge, circuit or cover."""
    command: str
    date: datetime.date
    commit: str
    """Abbreviated hash of the commit that computed the value."""


def load(kit: Kit) -> dict[str, Prediction]:
    """The newest prediction of each name, in file order; raises :class:`KitError`, OSError."""
    path = kit.folder / FILE
    found: dict[str, Prediction] = {}
    for entry in tomlfile.load(path, KitError).get("prediction", []):
        one = Prediction(**tomlfile.fields_of(Prediction, "prediction", entry, KitError))
        if not one.low <= one.value <= one.high:
            raise KitError(f"{path}: {one.name} is {one.value:g}, outside its interval {one.low:g} to {one.high:g}")
        found[one.name] = one
    return found


def added(text: str, now: Mapping[str, Prediction]) -> str:
    """The text of the file with an entry for each new or changed prediction."""
    newest = {entry["name"]: entry for entry in tomllib.loads(text).get("prediction", [])}
    for one in now.values():
        before = newest.get(one.name, {})
        if all(before.get(field) == getattr(one, field) for field in ("value", "low", "high", "unit")):
            continue
        text = f"{text.rstrip()}\n\n{_entry(one)}" if text.strip() else _entry(one)
    return text


def _entry(one: Prediction) -> str:
    lines = ["[[prediction]]"]
    for name, value in dataclasses.asdict(one).items():
        written = f'"{value}"' if isinstance(value, str) else value.isoformat() if name == "date" else f"{value!r}"
        lines.append(f"{name} = {written}")
    return "\n".join(lines) + "\n"
