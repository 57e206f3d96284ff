"""An elastic layer on rigid caps by boundary elements, the reference for :class:`contactfpga.design.cover.Cells`.

The layer is frictionless above and below. By wave number k, with t = k h/2 and E' = E/(1 - nu^2), equal pressures p on
both faces move each inward by 2 p/(E' k) sinh^2 t/(sinh t cosh t + t), opposite ones both along by 2 p/(E' k) cosh^2
t/(sinh t cosh t - t). Lengths in mm, forces in N; the sheet repeats itself beyond its edges.
"""

from __future__ import annotations

import numpy as np

from contactfpga.design.cover.numerics import Floats

STEP = 0.5


class FoamOnCaps:
    """A layer of ``thickness`` over ``count`` by ``count`` square caps of ``side``, ``pitch`` apart.

    ``stiffness``: N/mm of the switch under each cap; inf: rigid. ``proud``: the foam hangs free between caps; else it
    is on a rigid base.
    """

    def __init__(
        self,
        thickness: float,
        side: float,
        pitch: float = 10.0,
        count: int = 8,
        modulus: float = 0.345,
        poisson: float = 0.3,
        stiffness: float = np.inf,
        proud: bool = True,
    ):
        size = round(count * pitch / STEP)
        place = (np.arange(size) + 0.5) * STEP
        self.place, self.count, self.give = place, count, 0.0 if np.isinf(stiffness) else 1 / stiffness
        number = (place // pitch).astype(int)
        on = np.abs(place % pitch - pitch / 2) < side / 2
        self.cap = np.where(np.outer(on, on), np.add.outer(number * count, number), -1)
        self.held = self.cap >= 0 if proud else np.ones(self.cap.shape, bool)
        wave = 2 * np.pi * np.fft.fftfreq(size, STEP)
        k = np.hypot(wave[:, None], wave)
        k[0, 0] = 1.0
        t = np.minimum(k * thickness / 2, 40.0)
        effective = modulus / (1 - poisson**2)
        self.equal = 2 / (effective * k) * np.sinh(t) ** 2 / (np.sinh(t) * np.cosh(t) + t)
        self.opposite = 2 / (effective * k) * np.cosh(t) ** 2 / (np.sinh(t) * np.cosh(t) - t)
        confined = modulus * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson))
        self.equal[0, 0], self.opposite[0, 0] = thickness / 2 / confined, 0.0

    def ellipse(self, x: float, y: float, half_x: float, half_y: float, force: float) -> Floats:
        """Hertz's pressure on an ellipse, in N/mm2."""
        square = ((self.place - x) / half_x) ** 2 + ((self.place[:, None] - y) / half_y) ** 2
        found = np.sqrt(np.maximum(0.0, 1 - square))
        return force * found / (found.sum() * STEP**2)

    def forces(self, pressure: Floats) -> Floats:
        """(count, count) N on each cap under a pressure in N/mm2."""
        found = self._solved(pressure)[self.cap >= 0]
        total = np.bincount(self.cap[self.cap >= 0], found * STEP**2, self.count**2)
        return np.asarray(total, float).reshape(self.count, self.count)

    def _solved(self, pressure: Floats) -> Floats:
        below = np.where(self.held, pressure.sum() / self.held.sum(), 0.0)
        rest = self._free(self._moves(pressure, below) - self._given(below))
        step, size = rest.copy(), (rest**2).sum()
        start = size
        for _ in range(4000):
            pushed = self._free(self._moves(0 * below, step) - self._given(step))
            far = size / -(step * pushed).sum()
            below, rest = below + far * step, rest + far * pushed
            size, before = (rest**2).sum(), size
            if size < 1e-14 * start:
                return below
            step = rest + size / before * step
        raise AssertionError("the conjugate gradients did not converge")

    def _free(self, moved: Floats) -> Floats:
        return np.where(self.held, moved - moved[self.held].mean(), 0.0)

    def _moves(self, above: Floats, below: Floats) -> Floats:
        top, bottom = np.fft.fft2(above), np.fft.fft2(below)
        return np.fft.ifft2(self.opposite * (top - bottom) / 2 - self.equal * (top + bottom) / 2).real

    def _given(self, below: Floats) -> Floats:
        on = self.cap >= 0
        total = np.bincount(self.cap[on], below[on] * STEP**2, self.count**2)
        found = np.zeros(below.shape)
        found[on] = (total * self.give)[self.cap[on]]
        return found
