"""Arm, gear motor, foam and touched things as one system of equations, integrated with a fixed step.

The state is (theta, omega, current, then position and speed of each thing that gives way, then those of a board on
its bed): theta in rad from the first touch, positive into the obstacle.

- Joint with a stiff gear: (J + N^2 J_r) d omega/dt = N k i - sum d F.
- Motor: L di/dt = u - R i - N k omega, with the voltage u = K (i_ref - i) + R i_ref + N k omega within the supply.
- Foam pressed in by delta: F = S(delta) (1 + c d delta/dt), with the case's spring S.
- A board of the mass m on a bed of foam, sunk by s at the lever l: m (l d omega/dt - d2 s/dt2) = B(s) - F; the joint
  carries the bed's force B in place of F.

The torque sensor between motor and arm reads J d omega/dt + sum d F.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

from contactfpga.skin import Skin
from contactfpga_sim.lab.arm.case import Case

State = tuple[float, ...]


class Forces(NamedTuple):
    contact_n: tuple[float, ...]
    indentation_m: tuple[float, ...]
    """Foam indentation at each touch, negative while apart."""
    acceleration: float
    """Angular acceleration of the joint, in rad/s2."""
    sensor_nm: float
    """True torque between motor and arm, even beyond the sensor's range."""


class Plant:
    def __init__(self, case: Case, skin: Skin | None = None):
        self._motor = case.motor
        self._spring, self._damping = case.spring(skin or Skin()), case.foam.damping
        places = itertools.count(3, 2)
        self._touches = [
            (touch, touch.lever_m or case.link.lever_m, next(places) if touch.mass_kg else None) for touch in case.touch
        ]
        self._bed, self._modulus_pa = case.bed, case.foam.modulus_pa
        self._arm_inertia = case.link.inertia_kgm2
        self._inertia = case.link.inertia_kgm2 + case.motor.inertia_kgm2

    def start(self, speed_rad_s: float, lead_s: float) -> State:
        """The approaching arm, ``lead_s`` before the touch."""
        yielding = sum(place is not None for _, _, place in self._touches) + (self._bed is not None)
        return (-speed_rad_s * lead_s, speed_rad_s, 0.0, *(0.0,) * (2 * yielding))

    def forces(self, seconds: float, state: State) -> Forces:
        theta, omega, current = state[:3]
        forces, depths, torque = [], [], 0.0
        sunk, sinks = (0.0, 0.0) if self._bed is None else state[-2:]
        for touch, lever, place in self._touches:
            given, rate = (0.0, 0.0) if place is None else (state[place], state[place + 1])
            depth = lever * theta - touch.gap_m - given - sunk
            force = max(0.0, self._spring.force_n(depth) * (1 + self._damping * (lever * omega - rate - sinks)))
            forces.append(force)
            depths.append(depth)
            torque += lever * (force if self._bed is None else self._bed.force_n(sunk, self._modulus_pa))
        acceleration = (self._motor.torque_nm_a * current - torque) / self._inertia
        return Forces(tuple(forces), tuple(depths), acceleration, self._arm_inertia * acceleration + torque)

    def slope(self, seconds: float, state: State, wanted_a: float, forces: Forces | None = None) -> State:
        """d state/dt while the controller requests ``wanted_a``; ``forces``: this state's, if known."""
        motor = self._motor
        forces = forces or self.forces(seconds, state)
        back = motor.torque_constant * motor.gear * state[1]
        ohmic = motor.resistance_ohm
        asked = motor.current_gain * (wanted_a - state[2]) + ohmic * wanted_a + back
        volts = min(motor.supply_v, max(-motor.supply_v, asked))
        found = [state[1], forces.acceleration, (volts - ohmic * state[2] - back) / motor.inductance_h]
        for number, (touch, _, place) in enumerate(self._touches):
            if place is None:
                continue
            given, rate = state[place], state[place + 1]
            held = touch.stiffness_n_m * given + touch.damping_ns_m * rate
            found += (rate, (forces.contact_n[number] - held) / touch.mass_kg)
        if self._bed is not None:
            ((_, lever, _),) = self._touches
            carried = self._bed.force_n(state[-2], self._modulus_pa)
            found += (state[-1], lever * forces.acceleration - (carried - forces.contact_n[0]) / self._bed.mass_kg)
        return tuple(found)

    def step(self, seconds: float, state: State, wanted_a: float, step_s: float, forces: Forces | None = None) -> State:
        """The state ``step_s`` later, by fourth-order Runge-Kutta."""
        half = step_s / 2
        one = self.slope(seconds, state, wanted_a, forces)
        two = self.slope(seconds + half, _moved(state, half, one), wanted_a)
        three = self.slope(seconds + half, _moved(state, half, two), wanted_a)
        four = self.slope(seconds + step_s, _moved(state, step_s, three), wanted_a)
        sixth = step_s / 6
        return tuple([y + sixth * (a + 2 * (b + c) + d) for y, a, b, c, d in zip(state, one, two, three, four)])


def _moved(state: State, by: float, slope: State) -> State:
    return tuple([y + by * rate for y, rate in zip(state, slope)])  # a list: twice as fast as a generator


def finite(state: State) -> bool:
    """False once the integration has blown up."""
    return all(map(math.isfinite, state))
