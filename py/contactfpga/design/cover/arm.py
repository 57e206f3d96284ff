"""An arm that runs into an obstacle, and the energy balance by which the foam slows it.

One joint, constant motor torque u, gravity if wanted, the foam a spring F = K_s delta^1.5 (Hertz). With
theta - theta0 = delta/d, delta(0) = 0 and +v0 at the touch, (3) as corrected is

    J/(2 d^2) (v^2 - v0^2) = u delta/d - M g l [cos theta0 - cos(theta0 + delta/d)] - 2/5 K_s delta^(5/2).

The paper prints -v0 and drops cos theta0.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from contactfpga.design.cover.answer import finite, not_negative, positive
from contactfpga.design.cover.solve import Floats

GRAVITY = 9.81
"""g in m/s2, the paper's."""


@dataclasses.dataclass(frozen=True)
class Arm:
    """A link that turns about one joint, and what drives it."""

    inertia_kgm2: float
    """J about the joint, in kg m2."""
    lever_m: float
    """d, from the joint to the contact, in m."""
    torque_nm: float = 0.0
    """u, the motor's constant torque in Nm; positive presses into the obstacle."""
    weight_nm: float = 0.0
    """M g l in Nm; 0 leaves gravity out."""
    angle_rad: float = 0.0
    """theta0, the joint's angle at the touch, from hanging down toward the obstacle, in rad."""

    def __post_init__(self) -> None:
        positive("inertia_kgm2", self.inertia_kgm2, "kg m2")
        positive("lever_m", self.lever_m, "m")
        not_negative("weight_nm", self.weight_nm, "Nm")
        for name in ("torque_nm", "angle_rad"):
            finite(name, getattr(self, name))

    @classmethod
    def link(
        cls,
        mass_kg: float,
        radius_m: float,
        com_m: float,
        lever_m: float,
        *,
        length_m: float | None = None,
        tube: bool = False,
        torque_nm: float = 0.0,
        gravity: bool = False,
        angle_rad: float = 0.0,
    ) -> Arm:
        """A cylinder of that radius and length whose center of mass is ``com_m`` from the joint.

        J = m/12 (3 R^2 + L^2) + m l^2, a thin tube 6 R^2; without ``length_m`` L is the lever, as printed.
        """
        positive("mass_kg", mass_kg, "kg")
        positive("lever_m", lever_m, "m")
        not_negative("radius_m", radius_m, "m")
        not_negative("com_m", com_m, "m")
        length = positive("length_m", lever_m if length_m is None else length_m, "m")
        inertia = mass_kg / 12 * ((6 if tube else 3) * radius_m**2 + length**2) + mass_kg * com_m**2
        weight = mass_kg * GRAVITY * com_m if gravity else 0.0
        return cls(inertia, lever_m, torque_nm, weight, angle_rad)

    @property
    def mass_kg(self) -> float:
        """J/d^2, the mass that the contact feels, in kg."""
        return self.inertia_kgm2 / self.lever_m**2

    @property
    def free(self) -> bool:
        """Neither torque nor gravity, so that there is a closed form."""
        return self.torque_nm == 0 and self.weight_nm == 0

    def push_n(self, indentation_m: float) -> float:
        """What motor and gravity press with at the contact, in N."""
        angle = self.angle_rad + indentation_m / self.lever_m
        return (self.torque_nm - self.weight_nm * math.sin(angle)) / self.lever_m

    def work_j(self, indentation_m: Floats | float) -> Floats:
        """What motor and gravity have done since the touch, in J."""
        half = np.asarray(indentation_m, float) / (2 * self.lever_m)
        lifted = 2 * self.weight_nm * np.sin(self.angle_rad + half) * np.sin(half)
        return np.asarray(2 * self.torque_nm * half - lifted)


def speed2(arm: Arm, speed_m_s: float, stiffness: float, indentation_m: Floats | float) -> Floats:
    """v^2 in m2/s2 at an indentation, (3) solved for it; negative where the arm does not come."""
    gained = arm.work_j(indentation_m) - 0.4 * stiffness * np.asarray(indentation_m, float) ** 2.5
    return np.asarray(speed_m_s**2 + 2 / arm.mass_kg * gained)


def slowness(arm: Arm, speed_m_s: float, stiffness: float, depth_m: float, phi: Floats) -> Floats:
    """dt/dphi in s at delta = ``depth_m`` sin^2(phi); ``phi`` in rad, below pi/2."""
    s = np.sin(phi)
    share = s * s
    rest = np.cos(phi) ** 2
    spring = 0.4 * stiffness * depth_m**2.5
    half = depth_m / (2 * arm.lever_m)
    ending = spring * (1 + s + share + share * s + share * share) / (1 + s) - 2 * arm.torque_nm * half
    if arm.weight_nm:
        ending = ending + 2 * arm.weight_nm * np.sin(arm.angle_rad + half * (1 + share)) * half * np.sinc(
            half * rest / math.pi
        )
    starting = speed2(arm, speed_m_s, stiffness, depth_m * share) / rest
    square = np.where(share < 0.5, starting, 2 / arm.mass_kg * ending)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(square > 0, 2 * depth_m * s / np.sqrt(np.where(square > 0, square, 1.0)), np.inf)
