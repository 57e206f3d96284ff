"""Which switches close: contacts on a cover, through a model chosen by name."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from contactfpga.design.cover import hertz, medium, point
from contactfpga.design.cover.answer import CoverError, not_negative, positive
from contactfpga.design.cover.patch import Ellipse, Part
from contactfpga.design.cover.switch import Switch
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
