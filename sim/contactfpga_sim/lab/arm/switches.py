"""Switches under the cover: they close where the stress passes their threshold, open below it, and bounce."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contactfpga.design.cover import Ball, Ellipse, Load, elastic
from contactfpga.skin import Skin
from contactfpga_sim.lab.arm.case import Case

_MM = 1e-3
_PATCH_M = 1e-3
"""Radius of a patch where the model does not look at it."""


class Switches:
    """The (rows, columns) switches of a sheet under the case's cover."""

    def __init__(self, case: Case, skin: Skin):
        self._cover = case.cover
        self._closing = case.switch.switch.closing_pa
        self._opening = self._closing * (1 - case.switch.hysteresis)
        self._bounce_s, self._period_s = case.switch.bounce_s, case.switch.bounce_period_s
        self._touches = case.touch
        foam = case.foam
        self._ball = Ball(foam.radius_m, elastic.effective_modulus_pa(foam.modulus_pa, foam.poisson))
        self._x = np.arange(skin.columns) * skin.pitch_x_mm * _MM
        self._y = (np.arange(skin.rows) * skin.pitch_y_mm * _MM)[:, None]
        self._per_newton = [self._under(number, 1.0) for number in range(len(case.touch))]
        self._made = np.zeros((skin.rows, skin.columns), bool)
        self._since = np.full(self._made.shape, -np.inf)
        self._any = False
        self._closed = self._made
        self._bounces_until = -np.inf

    def stress_pa(self, forces_n: Sequence[float]) -> np.ndarray:
        """(rows, columns) normal stress in Pa below the forces of the touches."""
        stress = np.zeros(self._made.shape)
        for number, force in enumerate(forces_n):
            if force > 0:
                point = self._cover.model == "point"  # in which stress is proportional to force
                stress += force * self._per_newton[number] if point else self._under(number, force)
        return stress

    def at(self, seconds: float, forces_n: Sequence[float]) -> np.ndarray:
        """(rows, columns) bool: which are closed at a moment; moments come in order. The same array as long as nothing
        changes."""
        if any(forces_n) or self._any:
            stress = self.stress_pa(forces_n)
            made = np.where(self._made, stress > self._opening, stress >= self._closing)
            changed = made != self._made
            if changed.any():
                self._since[changed] = seconds
                self._made, self._any = made, bool(made.any())
                self._bounces_until = seconds + self._bounce_s
                self._closed = self._bouncing(seconds)
        if self._closed is not self._made and seconds < self._bounces_until + self._period_s:
            closed = self._bouncing(seconds)
            self._closed = self._closed if np.array_equal(closed, self._closed) else closed
        return self._closed

    def _bouncing(self, seconds: float) -> np.ndarray:
        if not self._bounce_s:
            return self._made
        age = seconds - self._since
        bouncing = age < self._bounce_s
        half_periods = np.where(bouncing, age, 0.0) // (self._period_s / 2)
        found: np.ndarray = self._made ^ (bouncing & (half_periods % 2 == 1))
        return found

    def _under(self, number: int, force_n: float) -> np.ndarray:
        touch = self._touches[number]
        radius = _PATCH_M if self._cover.model == "point" else self._ball.patch_m(force_n)
        part = Ellipse(radius, radius, touch.x_mm * _MM, touch.y_mm * _MM)
        return self._cover.stress_pa([Load((part,), force_n)], self._x, self._y)
