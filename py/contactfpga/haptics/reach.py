"""How far a force reaches through the cover: which switches it closes, as a table that is quick to ask."""

from __future__ import annotations

import math

import numpy as np

from contactfpga.cover.answer import NoSolution
from contactfpga.cover.sense import Model, Sheet
from contactfpga.haptics.answer import Floats, HapticsError

STEPS = 512
"""Entries of the table; between them it is straight."""


class Reach:
    """The force that closes a switch at a distance, and back; grows with the distance.

    Args:
        cover: foam, switch and, for a patch, what touches.
        model: the assumed contact, for instance ``Model("bonded", "point")``.
        farthest_m: largest distance asked; None: four times the foam's thickness.
    """

    def __init__(self, cover: Sheet, model: Model, farthest_m: float | None = None):
        self.model = model
        farthest = 4 * cover.thickness_m if farthest_m is None else farthest_m
        self._distances = np.linspace(0, farthest, STEPS)
        forces: list[float] = []
        for distance in self._distances:
            force = cover.force_n(model, float(distance))
            # In a layer a force far away presses no more, and just before that takes more than any arm has.
            if isinstance(force, NoSolution) or force > 1e4 or (forces and force <= forces[-1]):
                break
            forces.append(force)
        if len(forces) < 2:
            raise HapticsError(f"model is '{model}'; no force closes a switch under this cover")
        self._distances = self._distances[: len(forces)]
        # Between entries a root of the force is straighter than the force.
        self._roots = np.array(forces) ** 0.25

    def closing_n(self, distance_m: Floats) -> Floats:
        """Force in N that closes a switch at each distance; 1e9 where none does."""
        roots = np.interp(distance_m, self._distances, self._roots)
        square = roots * roots
        return np.where(distance_m > self._distances[-1], 1e9, square * square)

    def reach_m(self, force_n: float) -> float:
        """How far the force closes switches; 0 where it does not even close the one below it."""
        return float(np.interp(math.sqrt(math.sqrt(max(0.0, force_n))), self._roots, self._distances, left=0.0))
