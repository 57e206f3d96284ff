"""Arm, sheet and gateware side by side in simulated time."""

from __future__ import annotations

import collections
import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from contactfpga.skin import Skin
from contactfpga_sim.lab.arm.case import Case
from contactfpga_sim.lab.arm.control import Controller, Sensed
from contactfpga_sim.lab.arm.plant import Plant, finite
from contactfpga_sim.lab.arm.switches import Switches
from contactfpga_sim.lab.arm.under import Under
from contactfpga_sim.lab.arm.usb import Chip
from contactfpga_sim.model.board.compiled import CompiledBoard

WAYS = ("latency", "pin", "uart", "torque", "force", "both")
"""How a contact comes to the controller: a fixed time after a switch closes (no gateware); the board's ``contact`` pin;
zones over UART and the host; not at all, so that the torque limit alone is left; the pin of a board with pressure units
and no switches; that of one with both."""

PINS = ("pin", "force", "both")
UNITS = ("force", "both")


@dataclasses.dataclass(frozen=True)
class Faults:
    """What goes wrong, in s from the touch; None: nothing does."""

    board_dies_s: float | None = None
    """Its pins stay as they are from then on."""
    host_dies_s: float | None = None
    """The program reads and says nothing from then on."""
    noise_s: tuple[float, float] | None = None
    """Every byte whose stop bit ends in this time has its lowest bit turned over."""


class Moment(NamedTuple):
    """A step of the course."""

    time_s: float
    angle_rad: float
    speed_rad_s: float
    current_a: float
    sensor_nm: float
    force_n: float
    """Of all touches."""
    indentation_m: float
    """The deepest."""
    closed: bool
    """Whether any switch is."""
    contact: bool
    """What the controller knows of it."""


class World:
    """One run. Time 0 is the first touch; :meth:`clock` counts from the board's power-up, as a port does."""

    def __init__(self, case: Case, way: str, skin: Skin, latency_s: float = 0.0, faults: Faults | None = None):
        self.case = case
        self.faults = faults or Faults()
        self.controller = Controller(case)
        self.course: list[Moment] = []
        self.heard: list[tuple[float, int]] = []
        """What the host said: when it came to the controller, and the number of zones."""
        self.detected_s: float | None = None
        """When the first contact was known to the controller's input."""
        self._way, self._latency_s = way, latency_s
        self._plant = Plant(case)
        self._switches = Switches(case, skin)
        self._board = CompiledBoard(skin, capture=("contact",)) if way in (*PINS, "uart") else None
        self._under = Under(case, skin) if way in UNITS else None
        if self._board is not None and self._under is not None:
            self._board.load(self._under.readings([0.0] * len(case.touch)))
            self._board.send(self._under.commands())
        self._clock_hz = skin.clock_hz
        self._chip = Chip(case.usb)
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

    def clock(self) -> float:
        """Seconds since power-up."""
        return self._number * self.case.run.step_s

    @property
    def time_s(self) -> float:
        """Seconds since the first touch."""
        return self.clock() - self.case.run.lead_s

    def delivered(self) -> bytes:
        """What came to the host's program since it was asked last."""
        data, self._bytes = self._bytes, b""
        return data

    def send(self, data: bytes) -> None:
        """Bytes from the host to the board."""
        if self._board is not None and not self._dead():
            self._catch_up()
            self._board.send(data)

    def say(self, zones: int) -> None:
        """The host's program tells the controller how many zones there are; that takes its time."""
        at = self.time_s + self.case.usb.host_s
        self.heard.append((at, zones))
        self._changes.append((at, zones > 0))

    def step(self) -> None:
        """Go on by one step of the integrator."""
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
            sensed = Sensed(theta, omega, torque, self._level, self._alive(now))
            self._wanted = self.controller.sample(now, sensed)
        total, deepest = sum(forces.contact_n), max(forces.indentation_m)
        self.course.append(
            Moment(now, theta, omega, current, forces.sensor_nm, total, max(0.0, deepest), self._closed, self._level)
        )
        self._state = self._plant.step(now, self._state, self._wanted, case.run.step_s, forces)
        if not finite(self._state):
            raise FloatingPointError(f"the integration blew up at {now:g} s with steps of {case.run.step_s:g} s")
        self._number += 1
        self._host_frame()

    def close(self) -> None:
        """Free the board."""
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
        """What the units feel changes with every step."""
        if self._under is not None and self._board is not None and not self._dead():
            self._catch_up()
            self._board.load(self._under.readings(forces_n))

    def _learn(self, now: float) -> None:
        """Bring what has come to the controller by now into its input; a pin is looked at when it samples."""
        while self._changes and self._changes[0][0] <= now + 1e-9:
            at, self._level = self._changes.popleft()
            if self._level and self.detected_s is None:
                self.detected_s = at

    def _catch_up(self) -> None:
        """Run the board to the plant's time, unless it died before. It need not run along with every step: nothing
        passes between the two but at a change of the switches, a sample of the controller, a frame of the host."""
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
        frame = self._chip.frame_at(self.clock())
        if frame != self._frame and self._way == "uart":
            self._catch_up()
            self._bytes += self._chip.take(self.clock())
        self._frame = frame

    def _noisy(self, seconds: float, value: int) -> int:
        noise = self.faults.noise_s
        return value ^ 1 if noise is not None and noise[0] <= seconds < noise[1] else value
