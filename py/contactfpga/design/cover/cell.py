"""A resistive cell: its resistance under a force, and what makes cells and days differ.

A power law from a least force on, R = R1 (F / 1 N)^-k, with shares as data sheets state them; below it a cell is open.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from contactfpga.design.cover.answer import CoverError
from contactfpga.design.cover.numerics import Floats
from contactfpga.design.cover.point import Switch
from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import is_finite, shown

_LIMITS = {"level_n": (1e-3, 1e3), "ohm_at_1n": (1.0, 1e9), "exponent": (0.1, 5.0), "least_ohm": (0.1, 1e6)}
_LIMITS |= {"spread": (0.0, 1.0), "hysteresis": (0.0, 0.9), "creep": (0.0, 0.2), "preload_n": (0.0, 10.0)}
_LIMITS |= {"per_celsius": (-0.01, 0.01)}


@dataclasses.dataclass(frozen=True)
class ResistiveCell:
    """The table ``[cover.cell]``, whose ``material`` is one of :data:`MATERIALS`; other keys replace its values."""

    material: str
    """Name of the material that gives the values that are not stated."""
    level_n: float
    """Force at which a usual cell shall read pressed."""
    ohm_at_1n: float
    """Resistance under 1 N."""
    exponent: float
    """k of the power law."""
    break_n: float
    """Force below which a cell is open."""
    least_ohm: float = 200.0
    """Resistance at which it stays under large forces."""
    spread: float = 0.06
    """Standard deviation of the logarithm of the resistance, from cell to cell."""
    hysteresis: float = 0.1
    """Share by which the resistance is lower while the force falls."""
    creep: float = 0.05
    """Share by which it falls per decade of time under a force, from 1 s on."""
    per_celsius: float = -0.0025
    """Share by which it changes per degree Celsius from 25 on."""
    preload_n: float = 0.0
    """Mean square root of the forces on cells under a glued cover, without a touch."""

    def __post_init__(self) -> None:
        for name, (low, high) in (_LIMITS | {"break_n": (0.0, self.level_n)}).items():
            value = getattr(self, name)
            if not is_finite(value) or not low <= value <= high:
                raise CoverError(f"{name} in [cover.cell] is {shown(value)}; it must lie between {low:g} and {high:g}")

    def ohm(self, force_n: Floats, celsius: float = 25.0, seconds: Any = 1.0, falling: Any = False) -> Floats:
        """Resistance of usual cells after ``seconds`` under these forces; infinite for an open cell. ``seconds`` and
        ``falling`` may be arrays of the same shape."""
        share = 1 + self.per_celsius * (celsius - 25.0) - self.creep * np.log10(np.maximum(1.0, seconds))
        share = share * (1 - self.hysteresis * np.asarray(falling))
        force = np.asarray(force_n, float)
        closed = force >= self.break_n
        found = np.maximum(share * self.ohm_at_1n * np.where(closed, force, 1.0) ** -self.exponent, self.least_ohm)
        return np.where(closed, found, np.inf)

    @property
    def level_ohm(self) -> float:
        """Resistance at ``level_n``."""
        return float(self.ohm(np.array(self.level_n)))

    @property
    def switch(self) -> Switch:
        """A switch without travel that closes at the level, for models of contacts that know no resistance."""
        spread = min(0.3, self.spread / self.exponent)
        return Switch(self.level_n, spread=spread, hysteresis=1 - (1 - self.hysteresis) ** (1 / self.exponent))

    def drawn(self, shape: tuple[int, ...], seed: int) -> tuple[Floats, Floats]:
        """Factors of the resistances of a sheet's cells, and the forces on them without a touch."""
        rng = np.random.default_rng(seed)
        return np.exp(self.spread * rng.standard_normal(shape)), np.abs(self.preload_n * rng.standard_normal(shape))


MATERIALS: dict[str, dict[str, Any]] = {
    "fsr402": {"level_n": 0.2, "ohm_at_1n": 6_200.0, "exponent": 0.7, "break_n": 0.1},
    "velostat": {"level_n": 0.2, "ohm_at_1n": 10_000.0, "exponent": 1.0, "break_n": 0.02, "spread": 0.3,
                 "hysteresis": 0.2, "creep": 0.1},
}  # fmt: skip
"""Values by material, of a cell as large as the maker's part.

``fsr402``: force-sensing ink. The data sheet of Interlink Electronics' FSR 400 series states 0.1 N for the 402 (later
0.2 N), 6 % from part to part in a batch, 10 % hysteresis, 5 % per decade of time and -15 % at 85 degrees
Celsius; 6.2 kilohms under 1 N and 0.25 under 100 N are read off its curve. ``velostat``: carbon-filled polyethylene
(Velostat, Linqstat). No maker states a curve: all its values are assumptions.
"""


def read_cell(values: Any) -> ResistiveCell:
    """The cell of a TOML table. Raises CoverError."""
    given = tomlfile.fields_of(ResistiveCell, "cover.cell", values, CoverError)
    name = given.get("material")
    if not isinstance(name, str) or name not in MATERIALS:
        raise CoverError(f"material in [cover.cell] is {shown(name)}; it must be one of {', '.join(MATERIALS)}")
    return ResistiveCell(**MATERIALS[name] | given)
