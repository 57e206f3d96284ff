"""The paper's arm written a second time, with the numbers that the set states."""

from types import SimpleNamespace

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

STIFFNESS = 119560.68
"""K_s in N/m^1.5."""


def paper_set(force_to_close=4.1556, latency=6e-3, end=20e-3):
    """The same experiment by an adaptive integrator from one controller sample to the next."""
    inertia, arm, lever, period = 0.0157166 + 50**2 * 6e-6, 0.0157166, 0.2, 0.25e-3
    come, per_amp, emf = 0.23 / lever, 50 * 0.05, 50 * 0.05

    def force(theta):
        return STIFFNESS * max(lever * theta, 0.0) ** 1.5

    def slope(_, y, asked):
        volts = np.clip(3 * (asked - y[2]) + 1.0 * asked + emf * y[1], -24, 24)
        return y[1], (per_amp * y[2] - lever * force(y[0])) / inertia, (volts - y[2] - emf * y[1]) / 0.5e-3

    y, total, closes, reacts, goal = np.array([0.0, come, 0.0]), 0.0, None, None, come
    times, states = [], []
    for number in range(round(end / period)):
        now = number * period
        if closes is not None and reacts is None and now >= closes + latency:
            reacts, goal = now, -come
        error = goal - y[1]
        grown = total + 600 * error * period
        asked = 6 * error + grown
        if abs(asked) <= 1.2:
            total = grown
        found = solve_ivp(
            slope, (now, now + period), y, args=(np.clip(asked, -1.2, 1.2),), rtol=1e-10, atol=1e-12, dense_output=True
        )
        fine = np.linspace(now, now + period, 251)[:-1]
        times.append(fine)
        states.append(found.sol(fine))
        if closes is None and force(found.y[0, -1]) >= force_to_close:
            closes = brentq(lambda t, sol=found.sol: force(sol(t)[0]) - force_to_close, now, now + period)
        y = found.y[:, -1]
    time, (theta, omega, current) = np.concatenate(times), np.concatenate(states, axis=1)
    pressed = STIFFNESS * np.maximum(lever * theta, 0) ** 1.5
    sensor = arm * (per_amp * current - lever * pressed) / inertia + lever * pressed
    at, after = (np.searchsorted(time, reacts + later - 1e-9) for later in (0, 0.25e-3))
    back = time[np.flatnonzero((omega < 0) & (time > reacts))[0]]
    return SimpleNamespace(
        closes_s=closes,
        reacts_s=reacts,
        torque_before_nm=sensor[at],
        torque_after_nm=sensor[after],
        force_before_n=pressed[at],
        positive_s=back - reacts,
        peak_force_n=pressed.max(),
        peak_indentation_m=lever * theta.max(),
    )
