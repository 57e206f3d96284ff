"""How far a force reaches through the cover: which switches it closes, as a table that is quick to ask."""

from __future__ import annotations

import math

import numpy as np

from contactfpga.design.cover import medium, sense
from contactfpga.design.cover.answer import NoSolution
from contactfpga.robot.haptics.answer import Floats, HapticsError

STEPS, PATCH_STEPS = 512, 240
"""Entries of the table, of a point and of a patch, which takes longer; between them it is straight."""

LARGEST_N = 1e4


class Reach:
    """The force that closes a switch at a distance, and the distance at which a force still does. Both are tables
    (:mod:`contactfpga.design.cover` computes them), within 0.01 % of the force.

    Args:
        cover: foam, switch and, for a patch, what touches.
        model: the assumed contact, for instance ``Model("bonded", "point")``.
        farthest_m: largest distance asked; None: four times the foam's thickness.
    """

    def __init__(self, cover: sense.Sheet, model: sense.Model, farthest_m: float | None = None):
        self.model = model
        farthest = 4 * cover.thickness_m if farthest_m is None else farthest_m
        steps = STEPS if model.contact == "point" else PATCH_STEPS
        self._distances = np.linspace(0, farthest, steps)
        if model.contact == "point":
            spread = medium.spread(model.within, self._distances / cover.thickness_m)
            found = cover.switch.closing_pa * cover.thickness_m**2 / np.maximum(spread, 1e-30)
        else:
            found = np.array([_force(cover.force_n(model, float(distance))) for distance in self._distances])
        # In a layer a force far away presses no more, and just before that takes more than any arm has.
        grows = np.concatenate([[True], found[1:] > found[:-1]]) & (found < LARGEST_N)
        count = steps if grows.all() else int(grows.argmin())
        if count < 2:
            raise HapticsError(f"model is '{model}'; no force closes a switch under this cover")
        self._distances = self._distances[:count]
        forces = found[:count]
        # Over a half-space this root is straight in the distance's square, and nearly so in a layer.
        self._squares = self._distances**2
        self._roots = forces**0.4

    def closing_n(self, distance_m: Floats) -> Floats:
        """Force in N that closes a switch at each distance; 1e9 where none does."""
        roots = np.interp(distance_m * distance_m, self._squares, self._roots)
        return np.where(distance_m > self._distances[-1], 1e9, roots * roots * np.sqrt(roots))

    def reach_m(self, force_n: float) -> float:
        """How far in m the force closes switches; 0 if it does not even close the one below it."""
        return math.sqrt(np.interp(max(0.0, force_n) ** 0.4, self._roots, self._squares, left=0.0))


def _force(found: float | NoSolution) -> float:
    return math.inf if isinstance(found, NoSolution) else found
