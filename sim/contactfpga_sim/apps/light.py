"""Light cells: resistive cells that tell one force or three, as they are read, and the board that reads them.

Spread, preload and creep are assumed, and nothing was measured.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import NamedTuple

import numpy as np

from contactfpga.design.circuit import Circuit, falling, load_circuit
from contactfpga.design.cover import Cover, load_cover
from contactfpga.design.cover.cell import ResistiveCell
from contactfpga.shipped import examples
from contactfpga.skin import Skin
from contactfpga.zones import levels
from contactfpga_sim.apps.errors import Blob

SPREAD = 0.2
"""Standard deviation of the logarithm of a cell's gain."""
PRELOAD_N = 0.02
"""Root mean square of the preload that a glued cover leaves on a cell."""
CREEP = 0.05
"""Part of the gain at 1 s that a decade of time adds."""
TOUCHED, OLDER = (-1.0, 3.0), 3.0
"""Decades of a touch's time in s; most decades by which a preload is older than the reading at rest."""
GUARD = 0.8
"""Part of the lightest level's force from which a cell at rest is masked: its preload may creep."""
LASTS = 2
"""Levels by which a part must last, of three levels."""


class Reading(NamedTuple):
    """Forces of the levels, and by how many levels a part must last (:func:`contactfpga.zones.levels.label`)."""

    forces_n: tuple[float, ...]
    lasts: int = 1

    @property
    def bits(self) -> int:
        """Bits of a cell in a map of the levels."""
        return len(self.forces_n).bit_length()


class Sensed:
    """Forces on the cells of a scene's sheet as they are read, at rest and touched."""

    def __init__(self, forces_n: np.ndarray, *seeds: int):
        rng = np.random.default_rng(seeds)
        gain = np.exp(SPREAD * rng.standard_normal(forces_n.shape))
        preload = PRELOAD_N * np.abs(rng.standard_normal(forces_n.shape))
        self._rest_n = gain * preload
        touch, older = 1 + CREEP * rng.uniform(*TOUCHED), 1 + CREEP * rng.uniform(0, OLDER)
        self._touched_n = gain * (np.maximum(forces_n, 0) * touch + preload * older)

    def levels(self, reading: Reading) -> np.ndarray:
        """(rows, columns) level of each cell; 0 where its preload masks it, as a Skin's `mask` does."""
        masked = self._rest_n >= GUARD * reading.forces_n[0]
        return np.where(masked, 0, np.searchsorted(reading.forces_n, self._touched_n, "right"))


def reading_of(skin: Skin, cell: ResistiveCell) -> Reading:
    """The forces that a Skin's instants tell apart: the time of a fall goes as the resistance."""
    ratios = [(skin.ruler / each) ** (1 / cell.exponent) for each in skin.derived.rulers]
    return Reading(tuple(cell.level_n * ratio for ratio in ratios), LASTS if skin.levels > 1 else 1)


def zones(read: np.ndarray, skin: Skin) -> list[Blob]:
    """Contacts in a (rows, columns) map of levels."""
    sums = levels.moments(read, levels.label(read, skin.connectivity, LASTS)).tolist()
    x, y = skin.pitch_x_mm, skin.pitch_y_mm
    return [Blob(area * x * y, sum_x / weight * x, sum_y / weight * y) for area, weight, sum_x, sum_y in sums]


@functools.cache
def example() -> tuple[Skin, Circuit, ResistiveCell]:
    """The example with three levels."""
    path = examples() / "levels.toml"
    circuit, cover = load_circuit(path), load_cover(path)
    assert circuit is not None
    assert cover is not None
    assert cover.cell is not None
    return Skin.load(path), circuit, cover.cell


def circuit_of(cover: Cover) -> Circuit:
    """The example's circuit, with a ruler in proportion to the resistance of the cover's cells at their level."""
    _, circuit, usual = example()
    assert cover.cell is not None
    ohm = float(f"{falling.parts(circuit).ruler_ohm * cover.cell.level_ohm / usual.level_ohm:.3g}")
    return circuit.replace(falling=dataclasses.replace(falling.parts(circuit), ruler_ohm=ohm))


def with_cells(skin: Skin, cover: Cover, levels: int) -> Skin:
    """``skin`` with the example's ruler, one level or three, and the shortest row time in which the circuit's columns
    fall."""
    usual = example()[0]
    names = ("guard", "ruler", "precharge_us", "release_us")
    made = skin.replace(**{name: getattr(usual, name) for name in names})
    settle_us = math.ceil(falling.latest_us(circuit_of(cover), made.row_lines, made.columns, made.ruler))
    return made.replace(settle_us=float(settle_us), harder=usual.harder[: levels - 1])
