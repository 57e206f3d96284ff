"""Arm, sheet, gateware and USB chip in lockstep in simulated time."""

from __future__ import annotations

import collections
import dataclasses
import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from contactfpga.design.cover import BODIES, Cells, Indentation, Indenter, Load, cells_of
from contactfpga.skin import Skin
from contactfpga.wire.command import Command, encode_command
from contactfpga.wire.units import UnitFacts, sum_threshold_value, zero_value
from contactfpga_sim.apps.latency.usb import BridgeChip
from contactfpga_sim.lab.arm.case import Case
from contactfpga_sim.lab.arm.control import Controller, SensorReadings
from contactfpga_sim.lab.arm.parts import Touch
from contactfpga_sim.lab.arm.plant import Plant, finite
from contactfpga_sim.model.board.compiled import CompiledBoard

_MM = 1e-3

_LEAST_N, _FINE = 0.01, 1.1
"""Forces at which shares are computed: the least, and the ratio of successive ones."""


class Switches:
    def __init__(self, case: Case, skin: Skin, sheet: int = 0):
        pitches = (skin.pitch_x_mm * _MM, skin.pitch_y_mm * _MM)
        self._cells = cells_of(case.cover, skin.rows, skin.columns, *pitches, sheet)
        self._bounce_s, self._period_s = case.switch.bounce_s, case.switch.bounce_period_s
        self._touches = case.touch
        body = BODIES[case.body]
        self._indentation = self._cells.indentation([body.ball(case.foam.radius_m)], body)
        self._made = np.zeros((skin.rows, skin.columns), bool)
        self._since = np.full(self._made.shape, -np.inf)
        self._any = False
        self._closed = self._made
        self._bounces_until = -np.inf

    def forces_n(self, forces_n: Sequence[float]) -> np.ndarray:
        """(rows, columns) N on each switch."""
        found = np.zeros(self._made.shape)
        for touch, force in zip(self._touches, forces_n):
            if force > 0:
                found += force * self._per_newton(touch, force)
        return found

    def at(self, seconds: float, forces_n: Sequence[float]) -> np.ndarray:
        """(rows, columns) bool closed switches; moments must not go back. Unchanged results are the same array."""
        if any(forces_n) or self._any:
            made = self._cells.closed_by(self.forces_n(forces_n), self._made)
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

    def _per_newton(self, touch: Touch, force_n: float) -> np.ndarray:
        """(rows, columns) share of the force on each switch, between forces at which it is computed."""
        place = max(0.0, math.log(force_n / _LEAST_N) / math.log(_FINE))
        below = math.floor(place)
        one, other = (
            shares(self._cells, self._indentation, touch.x_mm, touch.y_mm, _LEAST_N * _FINE**number)
            for number in (below, below + 1)
        )
        found: np.ndarray = one + (place - below) * (other - one)
        return found


@functools.lru_cache(maxsize=2048)
def shares(cells: Cells, indentation: Indenter, x_mm: float, y_mm: float, force_n: float) -> np.ndarray:
    """(rows, columns) share of a force on each switch, at this force."""
    parts = indentation.parts_at(indentation.depth_m(force_n))
    return cells.forces_n([Load(tuple(part.placed(x_mm * _MM, y_mm * _MM, 0.0) for part in parts), 1.0)])


THRESHOLD_N = 2.0
"""Threshold of the whole push; noise of the sum is 0.09 N."""
GAIN_N = 0.02
ZERO = 1000
SIGMA_N = 0.05
RING_MM = 75.0

FIRST_NUMBER = 129 * 128 + 1
"""First command number; each of its two digits is above 0."""


class UnitsUnderSheet:
    """Three units in a triangle under a weightless bumper."""

    def __init__(self, case: Case, skin: Skin):
        turn = np.radians([90, 210, 330])
        middle = [0.5 * (skin.columns - 1) * skin.pitch_x_mm, 0.5 * (skin.rows - 1) * skin.pitch_y_mm]
        places = np.stack([middle[0] + RING_MM * np.cos(turn), middle[1] + RING_MM * np.sin(turn), np.ones(3)])
        touches = np.array([[touch.x_mm, touch.y_mm, 1.0] for touch in case.touch]).T
        self._shares = np.linalg.solve(places, touches) / GAIN_N
        self._rng = np.random.default_rng(0)
        self._skin = skin

    def readings(self, forces_n: Sequence[float]) -> list[int]:
        loads = self._shares @ np.maximum(forces_n, 0.0) + SIGMA_N / GAIN_N * self._rng.standard_normal(3)
        found: list[int] = np.clip(np.rint(ZERO + loads), 0, 4095).astype(int).tolist()
        return found

    def commands(self) -> bytes:
        """Commands that set the zeros and the threshold of the plain sum."""
        derived = self._skin.derived
        facts = UnitFacts.of(derived.units)
        wanted = [zero_value(facts, unit, ZERO) for unit in range(3)]
        wanted.append(sum_threshold_value(facts, 0, round(THRESHOLD_N / GAIN_N)))
        numbered = enumerate(wanted, FIRST_NUMBER)
        return b"".join(encode_command(number, Command(*one), pulsed=derived.pulsed) for number, one in numbered)


WAYS = ("latency", "pin", "uart", "torque", "force", "both")
"""Ways from a contact to the controller: a fixed time after a switch closes (no gateware); the ``contact`` pin; zones
over UART and host; none but the torque limit; the pin with units alone; the pin with both."""

PINS = ("pin", "force", "both")
UNITS = ("force", "both")


@dataclasses.dataclass(frozen=True)
class Faults:
    board_dies_s: float | None = None
    """Time from which the board's pins freeze."""
    host_dies_s: float | None = None
    noise_s: tuple[float, float] | None = None
    """Interval in which each byte (by its stop bit) has its lowest bit inverted."""


class CourseStep(NamedTuple):
    time_s: float
    angle_rad: float
    speed_rad_s: float
    current_a: float
    sensor_nm: float
    force_n: float
    indentation_m: float
    closed: bool
    contact: bool


class World:
    """One run. Time 0 is the first touch; :meth:`clock`, like a port, counts from power-up."""

    def __init__(
        self, case: Case, way: str, skin: Skin, latency_s: float = 0.0, faults: Faults | None = None, sheet: int = 0
    ):
        self.case = case
        self.faults = faults or Faults()
        self.controller = Controller(case)
        self.course: list[CourseStep] = []
        self.heard: list[tuple[float, int]] = []
        """Host reports: arrival at the controller, zones."""
        self.detected_s: float | None = None
        """Arrival of the first contact at the controller's input."""
        self.peak_n = 0.0
        self._way, self._latency_s, self._skin = way, latency_s, skin
        self._plant = Plant(case, skin)
        self._switches = Switches(case, skin, sheet)
        self._board = CompiledBoard(skin, capture=("contact",)) if way in (*PINS, "uart") else None
        self._under = UnitsUnderSheet(case, skin) if way in UNITS else None
        if self._board is not None and self._under is not None:
            self._board.load(self._under.readings([0.0] * len(case.touch)))
            self._board.send(self._under.commands())
        self._clock_hz = skin.clock_hz
        self._chip = BridgeChip(int(case.usb.packet_bytes), case.usb.timer_s)
        self._bytes = b""
        self._cells = self._switches.at(-case.run.lead_s, (0.0,))
        self._closed = False
        self._frame = 0
        self._changes: collections.deque[tuple[float, bool]] = collections.deque()
        self._level = False
        self._number = 0
        self._wanted = 0.0
        self._state = self._plant.start(case.link.speed_m_s / case.link.lever_m, case.run.lead_s)
        self._ticks = round(case.control.period_s / case.run.step_s)

    @property
    def deepest_m(self) -> float:
        """Depth from which on the foam is pressed flat: by the paper, its thickness."""
        spring = self.case.spring(self._skin)
        return spring.flat_m if isinstance(spring, Indentation) else spring.thickness_m

    def clock(self) -> float:
        return self._number * self.case.run.step_s

    @property
    def time_s(self) -> float:
        return self.clock() - self.case.run.lead_s

    def delivered(self) -> bytes:
        """Bytes that reached the host since the last call."""
        data, self._bytes = self._bytes, b""
        return data

    def send(self, data: bytes) -> None:
        if self._board is not None and not self._dead():
            self._catch_up()
            self._board.send(data)

    def say(self, zones: int) -> None:
        """Report zones to the controller, after the host's delay."""
        at = self.time_s + self.case.usb.host_s
        self.heard.append((at, zones))
        self._changes.append((at, zones > 0))

    def step(self) -> None:
        case, now = self.case, self.time_s
        forces = self._plant.forces(now, self._state)
        self._press(self._switches.at(now, forces.contact_n))
        self._load(forces.contact_n)
        tick = self._number % self._ticks == 0
        if tick and self._way in PINS:
            self._catch_up()
        self._learn(now)
        theta, omega, current = self._state[:3]
        if tick:
            torque = max(-case.control.sensor_nm, min(case.control.sensor_nm, forces.sensor_nm))
            sensed = SensorReadings(theta, omega, torque, self._level, self._alive(now))
            self._wanted = self.controller.sample(now, sensed)
        total, deepest = sum(forces.contact_n), max(forces.indentation_m)
        self.peak_n = max(self.peak_n, total)
        self.course.append(
            CourseStep(
                now, theta, omega, current, forces.sensor_nm, total, max(0.0, deepest), self._closed, self._level
            )
        )
        self._state = self._plant.step(now, self._state, self._wanted, case.run.step_s, forces)
        if not finite(self._state):
            raise FloatingPointError(f"the integration blew up at {now:g} s with steps of {case.run.step_s:g} s")
        self._number += 1
        self._host_frame()

    def close(self) -> None:
        if self._board is not None:
            self._board.close()

    def _dead(self) -> bool:
        return self.faults.board_dies_s is not None and self.time_s >= self.faults.board_dies_s

    def _alive(self, now: float) -> bool:
        if self._way != "uart" or not self.heard:
            return True
        return now - self.heard[-1][0] <= self.case.control.watchdog_s

    def _press(self, cells: np.ndarray) -> None:
        if cells is self._cells:
            return
        self._cells, before, self._closed = cells, self._closed, bool(cells.any())
        if self._way == "latency" and self._closed != before:
            self._changes.append((self.time_s + self._latency_s, self._closed))
        if self._board is not None and self._way != "force":
            self._catch_up()
            self._board.press(cells)

    def _load(self, forces_n: Sequence[float]) -> None:
        if self._under is not None and self._board is not None and not self._dead():
            self._catch_up()
            self._board.load(self._under.readings(forces_n))

    def _learn(self, now: float) -> None:
        while self._changes and self._changes[0][0] <= now + 1e-9:
            at, self._level = self._changes.popleft()
            if self._level and self.detected_s is None:
                self.detected_s = at

    def _catch_up(self) -> None:
        board, lead, hz = self._board, self.case.run.lead_s, self._clock_hz
        if board is None:
            return
        dies = self.faults.board_dies_s
        until = self.clock() if dies is None else min(self.clock(), dies + lead)
        board.run(max(0, round(until * hz) - board.cycle))
        for cycle, level, _ in board.take("contact").tolist():
            if self._way in PINS:
                self._changes.append((cycle / hz - lead, bool(level)))
        for cycle, value, _ in board.take("received").tolist():
            self._chip.put(cycle / hz, self._noisy(cycle / hz - lead, value))

    def _host_frame(self) -> None:
        frame = math.floor(self.clock() / self.case.usb.frame_s + 1e-9)
        if frame != self._frame and self._way == "uart":
            self._catch_up()
            self._bytes += b"".join(self._chip.take(self.clock()))
        self._frame = frame

    def _noisy(self, seconds: float, value: int) -> int:
        noise = self.faults.noise_s
        return value ^ 1 if noise is not None and noise[0] <= seconds < noise[1] else value
