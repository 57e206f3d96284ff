"""Closed switches under contacts on a cover, by a named model; and the table `[cover]` of a Skin's file."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from contactfpga.design.cover import foams, medium
from contactfpga.design.cover.answer import MAX_LENGTH_M, CoverError, not_negative, positive
from contactfpga.design.cover.cell import ResistiveCell, read_cell
from contactfpga.design.cover.hertz import Ball, HalfSpace
from contactfpga.design.cover.layers import Body, Indentation, Layer, Spring
from contactfpga.design.cover.patch import Part
from contactfpga.design.cover.point import Switch
from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import is_finite, shown

MODELS = ("patch", "foam", "point")
"""``patch``: a switch closes under the contact's shape, whatever the force. ``foam``: body and foam are pressed as
layers (:mod:`contactfpga.design.cover.layers`), and whole foam spreads the pressure
(:func:`contactfpga.design.cover.medium.foam`). ``point``: each part's force acts at its middle on a half-space, paper
(9)."""

GONE = ("hertz", "bonded", "frictionless")
"""Models of earlier versions."""

SHEAR = 6 / 5
"""Shear deflection of a strip over that by its mean shear stress (Timoshenko)."""

GIVES = 0.5
"""Foam thicknesses by which a strip between two caps is longer than the gap: fitted to the tests' finite elements of
foam glued to caps of 0.6 to 0.94 of the pitch, 2 to 5 mm thick."""

GRID = 16
"""Sampling points per side of a switch's face for :attr:`Cover.share`."""


Indenter = Indentation | HalfSpace
"""A body on a cover: force, depth and patch."""


@dataclasses.dataclass(frozen=True)
class Load:
    """One contact: its parts, and the force, shared by area."""

    parts: tuple[Part, ...]
    force_n: float

    def __post_init__(self) -> None:
        not_negative("force_n", self.force_n, "N")

    def shares(self) -> list[tuple[Part, float]]:
        """Each part with its force in N."""
        total = sum(part.area_m2 for part in self.parts)
        return [(part, self.force_n * part.area_m2 / total) for part in self.parts]


@dataclasses.dataclass(frozen=True)
class Cap:
    """A rigid square plate on each switch."""

    side_m: float
    """Side, at most the pitch."""
    proud: bool = True
    """Whether the foam rests on caps alone, above their surroundings; False: flush."""
    mass_kg: float = 0.0
    """Mass of one cap."""

    def __post_init__(self) -> None:
        positive("side_m", self.side_m, "m")
        not_negative("mass_kg", self.mass_kg, "kg")
        if not isinstance(self.proud, bool):
            raise CoverError(f"proud is {shown(self.proud)}; it must be true or false")


SOLID = 0.9
"""Strain from which on a pad's force goes on linearly."""


@dataclasses.dataclass(frozen=True)
class Bed:
    """Pads of the cover's foam, glued between the sheet's board and the link. The board sinks without a tilt."""

    thickness_m: float
    area_m2: float
    """Area of all pads together."""
    mass_kg: float
    """Mass on the pads: board, caps and foam."""

    def __post_init__(self) -> None:
        positive("thickness_m", self.thickness_m, "m")
        positive("area_m2", self.area_m2, "m2")
        positive("mass_kg", self.mass_kg, "kg")

    @property
    def pad_mm(self) -> float:
        """Side of each of four square pads."""
        return 1e3 * math.sqrt(self.area_m2 / 4)

    def force_n(self, sunk_m: float, modulus_pa: float) -> float:
        """Force of pads with p = E e/(1 - e), below 0 if they are pulled."""
        strain = sunk_m / self.thickness_m
        within = min(strain, SOLID)
        return self.area_m2 * modulus_pa * (within / (1 - within) + (strain - within) / (1 - SOLID) ** 2)


@dataclasses.dataclass(frozen=True)
class Cover:
    """The cover and the switches below it."""

    model: str = "patch"
    """One of :data:`MODELS`."""
    thickness_m: float = 5e-3
    """Thickness of the cover; irrelevant for ``patch``."""
    switch: Switch = dataclasses.field(default_factory=Switch)
    """The switch; irrelevant for ``patch`` without ``share``."""
    share: float | None = None
    """With ``patch``: share of the switch's square face that must be under the contact; None: its middle."""
    cap: Cap | None = None
    """Cap on each switch; None: the foam presses the switch's own face, flush with its surroundings."""
    cut: bool = False
    """Whether the foam is cut between the caps."""
    cell: ResistiveCell | None = None
    """Resistive cells in place of switches; ``switch`` then closes, without travel, at the force of their level."""
    modulus_pa: float = foams.find("Plastazote LD33").layer_pa
    """E of the foam in p = E e / (1 - e). A file may have ``foam`` in its place, a name of
    :data:`contactfpga.design.cover.foams.FOAMS`."""

    bed: Bed | None = None
    """Pads below the board, for the arm's study alone; None: the board is fixed to the link."""

    def __post_init__(self) -> None:
        if self.model in GONE:
            raise CoverError(f"model is {shown(self.model)}, which no longer exists; take 'foam'")
        if self.model not in MODELS:
            raise CoverError(f"model is {shown(self.model)}; it must be one of {', '.join(MODELS)}")
        positive("thickness_m", self.thickness_m, "m")
        positive("modulus_pa", self.modulus_pa, "Pa")
        if not isinstance(self.cut, bool):
            raise CoverError(f"cut is {shown(self.cut)}; it must be true or false")
        self._check_caps()
        if self.cell and self.model == "patch":
            raise CoverError("the model 'patch' knows no force, by which cells change; take 'foam'")
        if self.share is None:
            return
        if self.model != "patch":
            raise CoverError(f"share is {self.share}; the model {self.model!r} goes by stress, leave it out")
        if not is_finite(self.share) or not 0 < self.share <= 1:
            raise CoverError(f"share is {shown(self.share)}; it must lie above 0 and not above 1")

    def _check_caps(self) -> None:
        if self.model in ("patch", "point"):
            for name in ("cap", "cut"):
                if getattr(self, name):
                    raise CoverError(f"the model {self.model!r} knows no {name}; take 'foam'")
        if self.cut and self.cap is None:
            raise CoverError("cut is true; foam is cut between caps, give [cover.cap] as well")
        if self.switch.travel_m and not (self.cap and self.cap.proud):
            raise CoverError(f"travel_m is {self.switch.travel_m:g}; only a switch under a proud cap may give way")

    @property
    def side_m(self) -> float:
        """Side of the square that takes the foam's stress."""
        return self.cap.side_m if self.cap else math.sqrt(self.switch.area_m2)

    @property
    def area_m2(self) -> float:
        """Area of the square that takes the foam's stress."""
        return self.side_m**2

    @property
    def gives_way(self) -> bool:
        """Whether a sinking cap loads its neighbors."""
        return bool(self.switch.travel_m and not self.cut)

    def width_m(self, pitch_m: float) -> float:
        """Width of the foam on one switch."""
        return pitch_m if self.cap and self.cap.proud else self.side_m

    def strip_pa(self, pitch_m: float) -> float:
        """Stiffness of the foam between two proud caps: N/m per m of the strip's width.

        A strip of the length l = gap + :data:`GIVES` h, clamped at both ends: 1/K = 6/5 l/(G h) + l^3 (1 - nu^2)/(E
        h^3).
        """
        long = (pitch_m - self.side_m) / self.thickness_m + GIVES
        shear = self.modulus_pa / (2 * (1 + medium.POISSON))
        plate = self.modulus_pa / (1 - medium.POISSON**2)
        return 1 / (SHEAR * long / shear + long**3 / plate)

    def indentation(self, parts: Sequence[Part], body: Body, pitch_x_m: float, pitch_y_m: float) -> Indenter:
        """A body's parts on this cover, over switches of this pitch; with ``point`` a rigid ball as large as the first
        part on an incompressible half-space. Raises CoverError for the model ``patch``."""
        if self.model == "patch":
            raise CoverError("the model 'patch' knows no force; take 'foam'")
        if self.model == "point":
            ball = Ball(parts[0].half_x_m ** 2 / (2 * body.depth_m), self.modulus_pa / 0.75)
            return HalfSpace(ball, self.thickness_m)
        return Indentation(parts, body.depth_m, self.layers(body, pitch_x_m, pitch_y_m))

    def layers(self, body: Body, pitch_x_m: float, pitch_y_m: float) -> list[Layer | Spring]:
        """Foam, the body's flesh and the switches' travel, of those that there are. Tiles carry for the gaps, too."""
        switch, cell = self.switch, pitch_x_m * pitch_y_m
        carries = self.area_m2 / cell if self.cut else 1.0
        found: list[Layer | Spring] = [Layer(self.thickness_m, self.modulus_pa * carries, coupled=True)]
        if body.flesh is not None:
            found.append(body.flesh)
        if switch.travel_m:
            found.append(Spring(switch.force_n / switch.travel_m / cell, switch.travel_m))
        return found

    def under(self, loads: Sequence[Load], x_m: np.ndarray, y_m: np.ndarray) -> np.ndarray:
        """Bool: which switches at these places are under a contact's shape, as ``patch`` goes; ``x_m`` and ``y_m``
        broadcast."""
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


MIN_LENGTH_M = 1e-6
"""Least length."""


def load_cover(path: str | Path) -> Cover | None:
    """The cover in a Skin's file; None without a table ``[cover]``. Raises CoverError."""
    return tomlfile.load_table(path, "cover", read_cover, CoverError)


def read_cover(values: Any) -> Cover:
    """The cover of a TOML table with the fields of :class:`Cover`, and tables ``switch`` and ``cap``."""
    if isinstance(values, dict) and "poisson" in values:
        raise CoverError(f"poisson in [cover] no longer exists; leave it out, the foam's is {medium.POISSON:g}")
    if isinstance(values, dict) and "foam" in values:
        if "modulus_pa" in values:
            raise CoverError("[cover] has foam and modulus_pa; leave one of them out")
        values = {name: value for name, value in values.items() if name != "foam"} | {
            "modulus_pa": foams.find(values["foam"]).layer_pa
        }
    given = dict(tomlfile.fields_of(Cover, "cover", values, CoverError))
    for name, kind in (("switch", Switch), ("cap", Cap), ("bed", Bed)):
        if name in given:
            given[name] = _part(kind, name, given[name])
    if "cell" in given:
        if "switch" in given:
            raise CoverError("[cover] has cell and switch; leave one of them out")
        given["cell"] = cell = read_cell(given["cell"])
        given["switch"] = cell.switch
    cover = Cover(**given)
    lengths = [("thickness_m", cover.thickness_m)]
    lengths += [("side_m", cover.cap.side_m)] if cover.cap else []
    lengths += [("thickness_m", cover.bed.thickness_m)] if cover.bed else []
    for name, length in lengths:
        if not MIN_LENGTH_M <= length <= MAX_LENGTH_M:
            raise CoverError(
                f"{name} in [cover] is {length:g}; it must be a length in m, at most {MAX_LENGTH_M:g}; "
                f"5 mm is 0.005, and the least is {MIN_LENGTH_M:g}"
            )
    for name, value, unit in (("force_n", cover.switch.force_n, "N"), ("area_m2", cover.switch.area_m2, "m2")):
        if not 1e-9 <= value <= 1e6:
            raise CoverError(f"{name} in [cover.switch] is {value:g}; it must lie between 1e-09 and 1e+06 {unit}")
    return cover


def _part(kind: type, name: str, values: Any) -> Any:
    """The part ``[cover.NAME]``, all of whose fields without a default are there."""
    given = tomlfile.fields_of(kind, f"cover.{name}", values, CoverError)
    for field in dataclasses.fields(kind):
        if field.default is dataclasses.MISSING and field.name not in given:
            raise CoverError(f"{field.name} is missing in [cover.{name}]")
    return kind(**given)


def write_cover(cover: Cover) -> str:
    """The TOML tables that :func:`read_cover` reads back."""
    values = dataclasses.asdict(cover)
    values.pop("switch" if cover.cell else "cell")
    names = ("cap", "cell" if cover.cell else "switch", "bed")
    parts = {name: part for name in names if (part := values.pop(name)) is not None}
    tables = "".join(f"\n[cover.{name}]\n" + _lines(part) for name, part in parts.items())
    return "\n[cover]\n" + _lines(values) + tables


def _lines(values: dict[str, Any]) -> str:
    return "".join(f"{name} = {json.dumps(value)}\n" for name, value in values.items() if value is not None)
