"""The paper's arm written a second time, with the numbers that the set states."""

from types import SimpleNamespace

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

STIFFNESS = 119560.68
"""K_s in N/m^1.5."""


def hertz(depth):
    return STIFFNESS * max(depth, 0.0) ** 1.5


class Layers:
    """A round body of R* = 38 mm on foam over domes of 0.2 mm, by its closed form in the pressure at the middle.

    ``foam`` and ``flesh`` are (thickness in m, modulus in Pa); a rigid body has no flesh. The pressure p presses a
    layer with p = E e/(1 - e) in by h p/(E + p), which takes the energy h E (ln(1 + p/E) - p/(E + p)) per area.
    """

    def __init__(self, foam, flesh, dome_pa_m):
        self.foam, self.soft, self.dome = foam, [foam, *([flesh] if flesh else [])], dome_pa_m
        self.pressures = np.geomspace(1e-2, 1e8, 20_000)
        self.depths, self.forces = self.depth_m(self.pressures), self.force_at(self.pressures)

    def depth_m(self, p):
        return sum(h * p / (E + p) for h, E in self.soft) + np.minimum(p / self.dome, 0.2e-3)

    def force_at(self, p):
        """2 pi R times the integral of p over the depth, and what couples the foam's columns."""
        energy = sum(h * E * (np.log1p(p / E) - p / (E + p)) for h, E in self.soft)
        energy = energy + self.dome / 2 * np.minimum(p / self.dome, 0.2e-3) ** 2
        return 2 * np.pi * 0.038 * energy * self.stiffer(p)

    def stiffer(self, p):
        (h, E), depth = self.foam, self.depth_m(p)
        return 1 + 0.16 * h**2 / (2 * 0.038 * depth) * h * p / (E + p) / depth

    def __call__(self, depth):
        return float(np.interp(depth, self.depths, self.forces, left=0))

    def tile_closes_n(self, x_mm, y_mm, pitch_mm, threshold_n):
        """Force at which the pressure on the square tile around (0, 0) mm adds up to the threshold, point by point."""
        middles = 1e-3 * pitch_mm * ((np.arange(600) + 0.5) / 600 - 0.5)
        r2 = np.add.outer((middles - 1e-3 * y_mm) ** 2, (middles - 1e-3 * x_mm) ** 2)

        def above(p):
            here = np.interp(self.depth_m(p) - r2 / (2 * 0.038), self.depths, self.pressures, left=0)
            return here.sum() * (middles[1] - middles[0]) ** 2 * self.stiffer(p) - threshold_n

        return float(self.force_at(brentq(above, 1.0, 1e7)))


def paper_set(force_to_close=4.1556, latency=6e-3, force=hertz, end=28e-3):
    """The paper's set of an arm that runs into a bar, by an adaptive integrator from one controller sample to the next.

    ``force``: the force in N at a depth in m.
    """
    inertia, arm, lever, period = 0.0157166 + 50**2 * 6e-6, 0.0157166, 0.2, 0.25e-3
    come, per_amp, emf = 0.23 / lever, 50 * 0.05, 50 * 0.05

    def slope(_, y, asked):
        volts = np.clip(3 * (asked - y[2]) + 1.0 * asked + emf * y[1], -24, 24)
        return y[1], (per_amp * y[2] - lever * force(lever * y[0])) / inertia, (volts - y[2] - emf * y[1]) / 0.5e-3

    def sensed(y):
        pressed = force(lever * y[0])
        return arm * (per_amp * y[2] - lever * pressed) / inertia + lever * pressed

    y, total, closes, reacts, goal = np.array([0.0, come, 0.0]), 0.0, None, None, come
    times, states = [], []
    for number in range(round(end / period)):
        now = number * period
        if reacts is None and ((closes is not None and now >= closes + latency) or sensed(y) >= 3.0):
            reacts, goal = now, -come
        error = goal - y[1]
        grown = total + 600 * error * period
        asked = 6 * error + grown
        if abs(asked) <= 1.2:
            total = grown
        found = solve_ivp(
            slope, (now, now + period), y, args=(np.clip(asked, -1.2, 1.2),), rtol=1e-8, atol=1e-11, dense_output=True
        )
        fine = np.linspace(now, now + period, 251)[:-1]
        times.append(fine)
        states.append(found.sol(fine))
        if closes is None and force(lever * found.y[0, -1]) >= force_to_close:
            closes = brentq(lambda t, sol=found.sol: force(lever * sol(t)[0]) - force_to_close, now, now + period)
        y = found.y[:, -1]
    time, states = np.concatenate(times), np.concatenate(states, axis=1)
    sensor = np.array([sensed(y) for y in states.T])
    pressed = np.array([force(lever * theta) for theta in states[0]])
    at, after = (np.searchsorted(time, reacts + later - 1e-9) for later in (0, 0.25e-3))
    back = time[np.flatnonzero((states[1] < 0) & (time > reacts))[0]]
    return SimpleNamespace(
        closes_s=closes,
        reacts_s=reacts,
        torque_before_nm=sensor[at],
        torque_after_nm=sensor[after],
        force_before_n=pressed[at],
        positive_s=back - reacts,
        peak_force_n=pressed.max(),
        peak_indentation_m=lever * states[0].max(),
    )
