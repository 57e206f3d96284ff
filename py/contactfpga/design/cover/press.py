"""Which switches close: contacts on a cover, by a model chosen by name; and the table `[cover]` of a Skin's file."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from contactfpga.design.cover import hertz, medium, point
from contactfpga.design.cover.answer import MAX_LENGTH_M, CoverError, not_negative, positive
from contactfpga.design.cover.patch import Ellipse, Part
from contactfpga.design.cover.point import Switch
from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import is_finite, shown

MODELS = ("patch", "point", "hertz", "bonded", "frictionless")
"""``patch``: a switch closes when it lies under the contact's shape, whatever the force.
``point``: each part's force acts in its middle on a half-space, paper (9).
``hertz``: each part's pressure acts on a half-space.
``bonded``, ``frictionless``: each part's pressure acts on a layer on a rigid base, glued or sliding."""

GRID = 16
"""A switch's face is looked at in this many by this many points where a share of it has to be covered."""

BLOCK = 1 << 15
"""Stresses that are added up at once: few enough to stay in the cache."""


@dataclasses.dataclass(frozen=True)
class Load:
    """One contact: its parts, and the force in N that they share in proportion to their areas."""

    parts: tuple[Part, ...]
    force_n: float

    def __post_init__(self) -> None:
        not_negative("force_n", self.force_n, "N")

    def shares(self) -> list[tuple[Part, float]]:
        """Each part with its force in N."""
        total = sum(part.area_m2 for part in self.parts)
        return [(part, self.force_n * part.area_m2 / total) for part in self.parts]


@dataclasses.dataclass(frozen=True)
class Cover:
    """The cover and the switches below it."""

    model: str = "patch"
    """One of :data:`MODELS`."""
    thickness_m: float = 5e-3
    """Thickness of the cover in m; ``patch`` does not look at it."""
    switch: Switch = dataclasses.field(default_factory=Switch)
    """What has to be closed; ``patch`` without ``share`` does not look at it."""
    share: float | None = None
    """With ``patch``: the part of the switch's face, a square, that must lie under the contact; None: its middle."""

    def __post_init__(self) -> None:
        if self.model not in MODELS:
            raise CoverError(f"model is {shown(self.model)}; it must be one of {', '.join(MODELS)}")
        positive("thickness_m", self.thickness_m, "m")
        if self.share is None:
            return
        if self.model != "patch":
            raise CoverError(f"share is {self.share}; the model {self.model!r} goes by stress, leave it out")
        if not is_finite(self.share) or not 0 < self.share <= 1:
            raise CoverError(f"share is {shown(self.share)}; it must lie above 0 and not above 1")

    def closed(self, loads: Sequence[Load], x_m: np.ndarray, y_m: np.ndarray) -> np.ndarray:
        """Bool: which of the switches at these places, in m, are closed; ``x_m`` and ``y_m`` broadcast."""
        if self.model == "patch":
            return self._covered(loads, x_m, y_m)
        closed: np.ndarray = self.stress_pa(loads, x_m, y_m) >= self.switch.closing_pa
        return closed

    def stress_pa(self, loads: Sequence[Load], x_m: np.ndarray, y_m: np.ndarray) -> np.ndarray:
        """Normal stress in Pa at these places below the cover, positive in compression; the contacts' stresses add up.

        Not for the model ``patch``, which knows none.
        """
        if self.model == "patch":
            raise CoverError(f"the model 'patch' knows no stress; take one of {', '.join(MODELS[1:])}")
        x, y = np.broadcast_arrays(np.asarray(x_m, float), np.asarray(y_m, float))
        stress = np.zeros(x.shape)
        for load in loads:
            for part, force in load.shares():
                stress += self._of_part(part, force, x, y)
        return stress

    def _of_part(self, part: Part, force_n: float, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        if self.model == "point":
            return point.stress_pa(force_n, np.hypot(x - part.x_m, y - part.y_m), self.thickness_m)
        if self.model == "hertz" and isinstance(part, Ellipse) and part.half_x_m == part.half_y_m:
            return hertz.stress_pa(force_n, part.half_x_m, np.hypot(x - part.x_m, y - part.y_m), self.thickness_m)
        within = "halfspace" if self.model == "hertz" else self.model
        return _superposed(part, force_n, self.thickness_m, within, x, y)

    def _covered(self, loads: Sequence[Load], x_m: np.ndarray, y_m: np.ndarray) -> np.ndarray:
        parts = [part for load in loads for part in load.parts]
        x, y = np.broadcast_arrays(np.asarray(x_m, float), np.asarray(y_m, float))
        if self.share is None:
            return _under(parts, x, y)
        half = math.sqrt(self.switch.area_m2) / 2
        steps = half * ((2 * np.arange(GRID) + 1) / GRID - 1)
        covered: np.ndarray = _under(parts, x[..., None, None] + steps, y[..., None, None] + steps[:, None])
        return np.asarray(covered.mean(axis=(-2, -1)) >= self.share)


def _under(parts: Sequence[Part], x: np.ndarray, y: np.ndarray) -> np.ndarray:
    found = np.zeros(np.broadcast_shapes(x.shape, y.shape), bool)
    for part in parts:
        found |= part.contains(x, y)
    return found


def _superposed(
    part: Part, force_n: float, thickness_m: float, within: str, x: np.ndarray, y: np.ndarray
) -> np.ndarray:
    """The part's pressure as many point forces, each spread through the medium."""
    at_x, at_y, shares = part.pressure(thickness_m)
    places_x, places_y = x.ravel(), y.ravel()
    stress = np.empty(places_x.shape)
    block = max(1, BLOCK // len(shares))
    for start in range(0, len(stress), block):
        here = slice(start, start + block)
        distance = np.subtract.outer(places_x[here], at_x) ** 2
        distance += np.subtract.outer(places_y[here], at_y) ** 2
        stress[here] = medium.spread(within, np.sqrt(distance) / thickness_m) @ shares
    return (force_n / thickness_m**2 * stress).reshape(x.shape)


MIN_LENGTH_M = 1e-6
"""Nothing is thinner; integrals over a layer run out of numbers long after."""


def load_cover(path: str | Path) -> Cover | None:
    """The cover in a Skin's file; None where it has no table ``[cover]``. Raises CoverError."""
    return tomlfile.load_table(path, "cover", read_cover, CoverError)


def read_cover(values: Any) -> Cover:
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


def write_cover(cover: Cover) -> str:
    """The TOML tables that :func:`read_cover` reads back."""
    values = dataclasses.asdict(cover)
    switch = values.pop("switch")
    return "\n[cover]\n" + _lines(values) + "\n[cover.switch]\n" + _lines(switch)


def _lines(values: dict[str, Any]) -> str:
    return "".join(f"{name} = {json.dumps(value)}\n" for name, value in values.items() if value is not None)
