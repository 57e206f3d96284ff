"""Scenes in a TOML file: contacts with fixed or random shape, place, force and motion, so that one file is a family.

Places count in mm from the corner of the sheet, which lies half a pitch before the first switch, so that the same
contacts press sheets of any pitch. docs/scenes.md tells the keys.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import is_finite, shown
from contactfpga_sim.model.scenes import contacts
from contactfpga_sim.model.scenes.contacts import Shape, Track

MAX_MM = 100_000.0
MAX_NUMBER = 64
"""Contacts of one kind."""


class SceneFileError(ValueError):
    """What a file says that cannot be; the message names the key, its value and the limit."""


@dataclasses.dataclass(frozen=True)
class Range:
    """A number that is drawn for each contact; a fixed one where both ends are the same."""

    low: float
    high: float

    def draw(self, rng: np.random.Generator) -> float:
        """One of them."""
        return self.low if self.low == self.high else float(rng.uniform(self.low, self.high))


def _ellipse(length_mm: float, width_mm: float) -> Shape:
    return contacts.ellipse(length_mm / 2, width_mm / 2)


SHAPES: dict[str, tuple[Callable[..., Shape], dict[str, float | None]]] = {
    "disc": (contacts.disc, {"radius_mm": None}),
    "ellipse": (_ellipse, {"length_mm": None, "width_mm": None}),
    "edge": (contacts.edge, {"length_mm": None, "width_mm": None}),
    "palm": (contacts.palm, {"scale": 1.0}),
    "sole": (contacts.sole, {"length_mm": 260.0}),
}
"""By name: what makes the shape, and its sizes with what they are when the file does not say; None: it must."""


@dataclasses.dataclass(frozen=True)
class Kind:
    """Contacts that are alike: a `[[contact]]` of a file."""

    shape: str
    sizes: tuple[tuple[str, Range], ...]
    number: tuple[int, int] = (1, 1)
    """The least and the most of them in a scene."""
    x_mm: Range | Track | None = None
    """From the sheet's left edge; None: anywhere on the sheet."""
    y_mm: Range | Track | None = None
    """From its upper edge."""
    angle_deg: Range | Track = Range(0.0, 0.0)
    force_n: Range | Track = Range(10.0, 10.0)
    approach_mm_s: Range | None = None
    """Speed with which it comes in from the touch at 0 s until it has its force; None: it has it at once."""
    speed_mm_s: Range = Range(0.0, 0.0)
    heading_deg: Range = Range(0.0, 360.0)

    def outline(self, rng: np.random.Generator) -> Shape:
        """One of the shapes, around the origin."""
        return SHAPES[self.shape][0](**{name: size.draw(rng) for name, size in self.sizes})


@dataclasses.dataclass(frozen=True)
class SceneFile:
    """What a file says."""

    kinds: tuple[Kind, ...]
    width_mm: float | None = None
    """Of the sheet; None: any."""
    height_mm: float | None = None
    seconds: float = 0.0
    """How long a scene lasts; it is looked at in one instant of it."""
    gap_mm: float | None = None
    """The least distance between two contacts when the scene begins; None: they may overlap."""
    count: int = 500
    """Scenes to choose a Skin with; as many others are reported."""
    seed: int = 0

    @classmethod
    def load(cls, path: str | Path) -> SceneFile:
        """Read a file. Raises :class:`SceneFileError` for what cannot be."""
        values = tomlfile.load(path, SceneFileError)
        try:
            return _scene_file(values)
        except SceneFileError as error:
            raise SceneFileError(f"{path}: {error}") from None


def _scene_file(values: dict[str, Any]) -> SceneFile:
    known = ("contact", *(field.name for field in dataclasses.fields(SceneFile) if field.name != "kinds"))
    _keys("a scene file", values, known)
    kinds = values.pop("contact", None)
    if not isinstance(kinds, list) or not kinds:
        raise SceneFileError(f"contact is {shown(kinds)}; a scene file has one part [[contact]] at least")
    for name in ("width_mm", "height_mm"):
        if name in values:
            values[name] = _number(name, values[name], 0.1, MAX_MM)
    for name, most in (("gap_mm", MAX_MM), ("seconds", 3600.0)):
        if name in values:
            values[name] = _number(name, values[name], 0.0, most)
    for name, least, most in (("count", 2, 1_000_000), ("seed", 0, 2**63 - 1)):
        if name in values:
            values[name] = _whole(name, values[name], least, most)
    return SceneFile(tuple(_kind(f"contact {i}", one) for i, one in enumerate(kinds, 1)), **values)


def _kind(where: str, given: Any) -> Kind:
    if not isinstance(given, dict):
        raise SceneFileError(f"{where} is {shown(given)}; it must be a part, [[contact]]")
    values = dict(given)
    shape = values.pop("shape", None)
    if not isinstance(shape, str) or shape not in SHAPES:
        raise SceneFileError(f"{where}: shape is {shown(shape)}; it must be one of {', '.join(SHAPES)}")
    usual = SHAPES[shape][1]
    common = [field.name for field in dataclasses.fields(Kind) if field.name != "sizes"]
    _keys(f"{where}, a {shape},", values, (*usual, *common))
    sizes = tuple((name, _size(where, name, values.pop(name, default))) for name, default in usual.items())
    if "number" in values:
        values["number"] = _count(where, values["number"])
    moving = {
        "x_mm": (-MAX_MM, MAX_MM),
        "y_mm": (-MAX_MM, MAX_MM),
        "angle_deg": (-3600.0, 3600.0),
        "force_n": (0.0, 1e6),
    }
    fixed = {"approach_mm_s": (1.0, MAX_MM), "speed_mm_s": (0.0, MAX_MM), "heading_deg": (-3600.0, 3600.0)}
    for name, ends in moving.items():
        if name in values:
            values[name] = _value(f"{where}: {name}", values[name], *ends)
    for name, ends in fixed.items():
        if name in values:
            values[name] = _range(f"{where}: {name}", values[name], *ends)
    if "speed_mm_s" in values and any(isinstance(values.get(name), Track) for name in ("x_mm", "y_mm")):
        raise SceneFileError(f"{where} has speed_mm_s and a track; leave one of them out")
    if "approach_mm_s" in values and isinstance(values.get("force_n"), Track):
        raise SceneFileError(f"{where} has approach_mm_s and a force over time; leave one of them out")
    return Kind(shape, sizes, **values)


def _keys(what: str, values: dict[str, Any], known: Any) -> None:
    for key in values:
        if key not in known:
            raise SceneFileError(f"{what} has the key {shown(key)}; known are {', '.join(known)}")


def _size(where: str, name: str, value: Any) -> Range:
    if value is None:
        raise SceneFileError(f"{where}: {name} is missing")
    return _range(f"{where}: {name}", value, 0.01, MAX_MM)


def _count(where: str, value: Any) -> tuple[int, int]:
    pair = value if isinstance(value, list) and len(value) == 2 else [value, value]
    low, high = (_whole(f"{where}: number", one, 0, MAX_NUMBER) for one in pair)
    if low > high or not high:
        raise SceneFileError(f"{where}: number is {value}; it must be 1 or more, or [least, most]")
    return low, high


def _value(name: str, value: Any, low: float, high: float) -> Range | Track:
    """A number, a range, or what it is over time."""
    if not isinstance(value, dict):
        return _range(name, value, low, high)
    _keys(name, value, ("seconds", "values"))
    seconds, values = value.get("seconds"), value.get("values")
    if not isinstance(seconds, list) or not isinstance(values, list):
        raise SceneFileError(f"{name} is {shown(value)}; it must be {{seconds = [...], values = [...]}}")
    times = tuple(_number(f"{name}: seconds", one, 0.0, 3600.0) for one in seconds)
    try:
        return Track(times, tuple(_number(f"{name}: values", one, low, high) for one in values))
    except SceneFileError:
        raise
    except ValueError as error:
        raise SceneFileError(f"{name}: {error}") from None


def _range(name: str, value: Any, low: float, high: float) -> Range:
    pair = value if isinstance(value, list) else [value, value]
    if len(pair) != 2:
        raise SceneFileError(f"{name} is {shown(value)}; it must be a number or [least, most]")
    first, last = (_number(name, one, low, high) for one in pair)
    if first > last:
        raise SceneFileError(f"{name} is {value}; the least comes first")
    return Range(first, last)


def _number(name: str, value: Any, low: float, high: float) -> float:
    if not is_finite(value):
        raise SceneFileError(f"{name} is {shown(value)}; it must be a finite number")
    if not low <= value <= high:
        raise SceneFileError(f"{name} is {value}; it must lie between {low:g} and {high:g}")
    return float(value)


def _whole(name: str, value: Any, low: int, high: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise SceneFileError(f"{name} is {shown(value)}; it must be a whole number")
    if not low <= value <= high:
        raise SceneFileError(f"{name} is {value}; it must lie between {low} and {high}")
    return value
