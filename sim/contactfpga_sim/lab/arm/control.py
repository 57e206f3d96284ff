"""The motor's controller."""

from __future__ import annotations

import collections
from typing import NamedTuple

from contactfpga_sim.lab.arm.case import Case


class SensorReadings(NamedTuple):
    angle_rad: float
    speed_rad_s: float
    torque_nm: float
    contact: bool
    alive: bool


class Controller:
    """PI speed controller.

    On contact, or torque at the limit, the arm goes back until the contact is resolved, then slows to rest, as in the
    paper. A silent host stops the arm; in a contact it first retreats the full distance. If the
    contact persists it may be stale: only the torque limit causes another retreat until it was away once.
    """

    def __init__(self, case: Case):
        self.state = "moving"
        """``moving``, ``reversing``, ``slowing``, ``resting`` or, without a host, ``stopped``."""
        self.events: list[tuple[float, str, str]] = []
        """(time in s, new state, reason): ``contact``, ``torque``, ``silence``, ``resolved``, ``retreat``, ``rest``."""
        self._control = case.control
        self._lever = case.link.lever_m
        self._most = case.motor.current_a
        self._wanted = case.link.speed_m_s / self._lever
        self._sum = 0.0
        self._touched_at = -float("inf")
        self._stale = False  # this contact was gone back from as far as it goes
        self._turned_at = 0.0
        self._old: collections.deque[SensorReadings] = collections.deque()

    def sample(self, seconds: float, now: SensorReadings) -> float:
        """Requested current in A until the next sample."""
        sensed = self._late(now)
        over = abs(sensed.torque_nm) >= self._control.torque_limit_nm
        if now.contact:
            self._touched_at = seconds
        else:
            self._stale = False
        self._decide(seconds, sensed, now.contact and not self._stale, over, now.alive)
        return self._speed(sensed)

    def _late(self, now: SensorReadings) -> SensorReadings:
        self._old.append(now)
        if len(self._old) > 1 + round(self._control.delay_s / self._control.period_s):
            self._old.popleft()
        return self._old[0]

    def _decide(self, seconds: float, sensed: SensorReadings, contact: bool, over: bool, alive: bool) -> None:
        if self.state != "reversing" and (over or contact):
            self._turn(seconds, sensed, "contact" if contact else "torque")
        elif self.state == "reversing":
            self._retreat(seconds, sensed)
        elif self.state == "moving" and not alive:
            self._wanted = 0.0
            self._now(seconds, "stopped", "silence")
        elif self.state == "slowing":
            slower = self._control.slowing_m_s2 * self._control.period_s / self._lever
            self._wanted = min(0.0, self._wanted + slower)
            if self._wanted == 0:
                self._now(seconds, "resting", "rest")

    def _turn(self, seconds: float, sensed: SensorReadings, reason: str) -> None:
        self._turned_at = sensed.angle_rad
        self._wanted = -self._control.reverse_m_s / self._lever
        self._now(seconds, "reversing", reason)

    def _retreat(self, seconds: float, sensed: SensorReadings) -> None:
        gone = self._lever * (self._turned_at - sensed.angle_rad)
        by_contact = self.events[-1][2] == "contact"
        if gone >= self._control.retreat_m:
            self._stale = True
            self._now(seconds, "slowing", "retreat")
        elif by_contact and seconds > self._touched_at and seconds - self._touched_at >= self._control.clear_s - 1e-9:
            self._now(seconds, "slowing", "resolved")

    def _speed(self, sensed: SensorReadings) -> float:
        control = self._control
        error = self._wanted - sensed.speed_rad_s
        grown = self._sum + control.integral * error * control.period_s
        asked = control.proportional * error + grown
        if abs(asked) <= self._most or error * asked < 0:
            self._sum = grown
        return min(self._most, max(-self._most, asked))

    def _now(self, seconds: float, state: str, reason: str) -> None:
        self.state = state
        self.events.append((seconds, state, reason))
