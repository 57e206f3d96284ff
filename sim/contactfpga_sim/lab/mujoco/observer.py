"""A momentum observer of a two-joint arm, with realistic errors (De Luca and Mattone 2005; Haddadin, De Luca and
Albu-Schaeffer 2017)."""

from __future__ import annotations

import dataclasses

import numpy as np

FIRST_M = SECOND_M = 0.3
"""Lengths of upper arm and forearm."""
MASS_KG = (1.5, 1.0)
DAMPING = (0.4, 0.2)
"""Joint damping in Nm s/rad."""
FRICTION_NM = (0.3, 0.15)
"""Coulomb friction, known to the observer like the damping."""
ROTOR = (0.03, 0.015)
"""Inertia of motors and gears about the joints, in kg m2."""
CONTROL_S = 1e-3
SLOW = 0.02
"""Speed in rad/s below which Coulomb friction is proportional to it."""


@dataclasses.dataclass(frozen=True)
class Wrong:
    """Model errors as shares of the truth, and noise."""

    masses: tuple[float, float]
    friction: tuple[float, float]
    torque_nm: float = 0.05
    """RMS noise of a torque sample."""
    speed_rad_s: float = 0.002

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Wrong:
        """Masses off by up to 5 %, friction by up to 20 %."""
        masses, friction = rng.uniform(-0.05, 0.05, 2) + 1, rng.uniform(-0.2, 0.2, 2) + 1
        return cls((float(masses[0]), float(masses[1])), (float(friction[0]), float(friction[1])))


class Observer:
    """Residuals r = K (p - integral(tau + dT/dq - friction + r)) of the generalized momentum p = M(q) q'."""

    def __init__(self, gain: float, wrong: Wrong, noise: np.random.Generator):
        self.gain, self._wrong, self._noise = gain, wrong, noise
        one, two = (mass * share for mass, share in zip(MASS_KG, wrong.masses))
        self._coupled = two * FIRST_M * SECOND_M / 2
        self._outer = two * SECOND_M**2 / 3 + ROTOR[1]
        self._inner = one * FIRST_M**2 / 3 + two * FIRST_M**2 + two * SECOND_M**2 / 3 + ROTOR[0]
        self._sum: np.ndarray | None = None
        self.residual_nm = np.zeros(2)

    def take(self, angles: np.ndarray, speeds: np.ndarray, torques: np.ndarray) -> np.ndarray:
        """Update with (2,) angles in rad, speeds and torques since the last sample; return (2,) residuals in Nm."""
        speeds = speeds + self._noise.normal(0, self._wrong.speed_rad_s, 2)
        torques = torques + self._noise.normal(0, self._wrong.torque_nm, 2)
        cross, link = self._coupled * np.cos(angles[1]), self._outer - ROTOR[1]
        momentum = np.array(
            [
                (self._inner + 2 * cross) * speeds[0] + (link + cross) * speeds[1],
                (link + cross) * speeds[0] + self._outer * speeds[1],
            ]
        )
        turned = np.array([0.0, -self._coupled * np.sin(angles[1]) * speeds[0] * (speeds[0] + speeds[1])])
        believed = np.array(self._wrong.friction)
        lost = believed * (np.array(DAMPING) * speeds + np.array(FRICTION_NM) * np.clip(speeds / SLOW, -1, 1))
        if self._sum is None:
            self._sum = momentum
        self._sum = self._sum + CONTROL_S * (torques + turned - lost + self.residual_nm)
        self.residual_nm = self.gain * (momentum - self._sum)
        return self.residual_nm

    def place_m(self, angle: float) -> float:
        """Position of a push across the forearm, clipped to it; ``angle`` of the elbow in rad."""
        first, second = self.residual_nm
        push_n = (first - second) / (FIRST_M * np.cos(angle))
        return float(np.clip(second / push_n, 0.0, SECOND_M)) if push_n else SECOND_M / 2
