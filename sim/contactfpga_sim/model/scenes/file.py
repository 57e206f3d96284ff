"""Scenes in a TOML file: contacts with fixed or random shape, place, force and motion. docs/scenes.md lists the keys.

Places are in mm from the sheet's corner, half a pitch before the first switch.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from contactfpga.design.cover import BODIES, Cover
from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import is_finite, shown, suggestion
from contactfpga.skin import Skin
from contactfpga_sim.model.scenes import contacts
from contactfpga_sim.model.scenes.contacts import Contact, M, Shape, Track, Value
from contactfpga_sim.model.scenes.families import TRIES, Random, place
from contactfpga_sim.model.scenes.scene import Scene, around_m, sheet
from contactfpga_sim.model.scenes.truth import Box, on_all_turns, widths

MAX_MM = 100_000.0
MAX_NUMBER = 64
"""Most contacts of one kind."""


class SceneFileError(ValueError):
    """An invalid scene file; the message names the key, its value and the limit."""


@dataclasses.dataclass(frozen=True)
class Range:
    """Range of a number drawn for each contact."""

    low: float
    high: float

    def draw(self, rng: np.random.Generator) -> float:
        """A random number."""
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
"""By name the maker of the shape, and its sizes with defaults; None: required."""


@dataclasses.dataclass(frozen=True)
class Kind:
    """Similar contacts: a ``[[contact]]`` of a file."""

    shape: str
    sizes: tuple[tuple[str, Range], ...]
    body: str = "finger"
    """Name of what presses, of :data:`contactfpga.design.cover.BODIES`, which has the shape at its depth."""
    number: tuple[int, int] = (1, 1)
    """Range of their number in a scene."""
    x_mm: Range | Track | None = None
    """Distance from the sheet's left edge; None: anywhere."""
    y_mm: Range | Track | None = None
    """Distance from the sheet's upper edge; None: anywhere."""
    angle_deg: Range | Track = Range(0.0, 0.0)
    force_n: Range | Track = Range(10.0, 10.0)
    approach_mm_s: Range | None = None
    """Speed of approach from 0 s on; None: full force at once."""
    speed_mm_s: Range = Range(0.0, 0.0)
    heading_deg: Range = Range(0.0, 360.0)

    def outline(self, rng: np.random.Generator) -> Shape:
        """A shape around the origin."""
        return SHAPES[self.shape][0](**{name: size.draw(rng) for name, size in self.sizes})


@dataclasses.dataclass(frozen=True)
class SceneFile:
    """Content of a file."""

    kinds: tuple[Kind, ...]
    width_mm: float | None = None
    """Width of the sheet; None: any."""
    height_mm: float | None = None
    seconds: float = 0.0
    """Duration of a scene, which is sampled at one instant."""
    gap_mm: float | None = None
    """Least distance of two contacts at the beginning; None: any."""
    count: int = 500
    """Scenes to choose a Skin with, and number of others for the report."""
    seed: int = 0

    @classmethod
    def load(cls, path: str | Path) -> SceneFile:
        """Read a file. Raises :class:`SceneFileError` for invalid content."""
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
    if (body := values.get("body", "finger")) not in BODIES:
        raise SceneFileError(f"{where}: body is {shown(body)}; it must be one of {', '.join(BODIES)}")
    if "speed_mm_s" in values and any(isinstance(values.get(name), Track) for name in ("x_mm", "y_mm")):
        raise SceneFileError(f"{where} has speed_mm_s and a track; leave one of them out")
    if "approach_mm_s" in values and isinstance(values.get("force_n"), Track):
        raise SceneFileError(f"{where} has approach_mm_s and a force over time; leave one of them out")
    return Kind(shape, sizes, **values)


def _keys(what: str, values: dict[str, Any], known: Any) -> None:
    for key in values:
        if key not in known:
            raise SceneFileError(f"{what} has the key {shown(key)}; {suggestion(key, known)}")


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


DIRECTIONS = 128
"""Directions for the distance of two shapes, at most 0.03 % of their size too short."""

PLACES = 10
"""Places tried for a contact before the whole scene is drawn again."""


def scene_of(file: SceneFile, number: int, skin: Skin, cover: Cover | None = None) -> tuple[Scene, float]:
    """Scene ``number`` of a file on a sheet under a cover, and its sampling instant in s, after all approaches.

    The file's content, the number, and the sheet's pitch and size decide. Raises SceneFileError if contacts do not fit
    as far apart as requested.
    """
    rng = np.random.default_rng([file.seed, number])
    for _ in range(TRIES):
        if (contacts := _apart(rng, file, skin)) is not None:
            scene = Scene(contacts, int(rng.integers(2**63))).on_cover(skin, cover)
            return scene, max(scene.settled_s, float(rng.uniform(0, file.seconds)))
    left, right, top, bottom = (end / M for end in sheet(skin))
    assert file.gap_mm is not None
    raise SceneFileError(
        f"gap_mm is {file.gap_mm:g}; contacts found no places so far apart in {TRIES} tries on a sheet of "
        f"{right - left:g} x {bottom - top:g} mm"
    )


def _apart(rng: Random, file: SceneFile, skin: Skin) -> tuple[Contact, ...] | None:
    placed: list[tuple[Shape, Contact]] = []
    for kind in file.kinds:
        for _ in range(int(rng.integers(kind.number[0], kind.number[1] + 1))):
            for _ in range(PLACES):
                contact = _drawn(rng, file, kind, skin)
                begin = _start(contact)
                if file.gap_mm is None or all(_gap_mm(begin, other, skin) >= file.gap_mm for other, _ in placed):
                    placed.append((begin, contact))
                    break
            else:
                return None
    return tuple(contact for _, contact in placed)


def _start(contact: Contact) -> Shape:
    x, y, angle = (
        value(0.0) if callable(value) else value for value in (contact.x_mm, contact.y_mm, contact.angle_deg)
    )
    assert not callable(contact.shape)
    return tuple(part.placed(x * M, y * M, math.radians(angle)) for part in contact.shape)


def _drawn(rng: Random, file: SceneFile, kind: Kind, skin: Skin) -> Contact:
    shape = kind.outline(rng)
    angle, force = (_value_of(rng, value) for value in (kind.angle_deg, kind.force_n))
    turned = tuple(part.placed(0.0, 0.0, math.radians(angle(0.0) if callable(angle) else angle)) for part in shape)
    x, y = place(rng, skin, turned)
    speed, heading = kind.speed_mm_s.draw(rng), math.radians(kind.heading_deg.draw(rng))
    left, _, top, _ = (end / M for end in sheet(skin))
    return Contact(
        shape=shape,
        body=kind.body,
        x_mm=_along(rng, kind.x_mm, left, x, speed * math.cos(heading), file.seconds),
        y_mm=_along(rng, kind.y_mm, top, y, speed * math.sin(heading), file.seconds),
        angle_deg=angle,
        force_n=force,
        speed_mm_s=None if kind.approach_mm_s is None else kind.approach_mm_s.draw(rng),
    )


def _value_of(rng: Random, value: Range | Track) -> Value:
    return value if isinstance(value, Track) else value.draw(rng)


def _along(
    rng: Random, given: Range | Track | None, edge: float, anywhere: float, speed: float, seconds: float
) -> Value:
    if isinstance(given, Track):
        return Track(given.seconds, tuple(edge + value for value in given.values))
    start = anywhere if given is None else edge + given.draw(rng)
    return Track((0.0, seconds), (start, start + speed * seconds)) if speed and seconds else start


def _gap_mm(one: Shape, other: Shape, skin: Skin) -> float:
    if skin.closed:
        around = around_m(skin)
        ends = [end for part in one for end in widths(part, Box())]
        other = tuple(on_all_turns(other, Box(min(ends) - around, max(ends) + around), around))
    return distance_mm(one, other)


def distance_mm(one: Shape, other: Shape) -> float:
    """Distance of two shapes; at most 0 if they meet.

    For convex sets this is the maximum of -h_A(u) - h_B(-u) over directions u, with support functions h (Boyd and
    Vandenberghe, Convex Optimization, 8.2).
    """
    ahead, back = _reach(one), np.roll(_reach(other), DIRECTIONS // 2, axis=1)
    return float((-ahead[:, None] - back[None]).max(axis=2).min()) / M


def _reach(shape: Shape) -> np.ndarray:
    """(parts, directions): support function of each part, in m."""
    angles = np.arange(DIRECTIONS) * (2 * math.pi / DIRECTIONS)
    along = np.cos(angles), np.sin(angles)
    return np.array([part.x_m * along[0] + part.y_m * along[1] + part.reach_m(angles) for part in shape])
