"""A link's sheet: switches, board, and USB chip."""

from __future__ import annotations

import collections
import random
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from contactfpga.design.cover import Body, Cover, Indenter, cells_of
from contactfpga.design.cover.moving import MovingBody
from contactfpga.driver.board import Board
from contactfpga.errors import ContactFPGAError, ReadTimeout
from contactfpga.robot.body.plan import Plan
from contactfpga.robot.body.reader import LinkMemory
from contactfpga.surfaces.shapes import Floats
from contactfpga.tools.view.fingers import Finger
from contactfpga.tracking.tracker import Tracker
from contactfpga_sim.apps.latency.usb import HOST_S, BridgeChip, BridgeSettings
from contactfpga_sim.apps.mujoco.golden import GoldenBoard
from contactfpga_sim.apps.mujoco.touch import SheetTouch
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.scenes.felt import LoadedUnits

POLL_S = 1e-6
"""Advance of the board, but not the robot, in a read without waiting."""


class WornSheet:
    """A sheet on its link in simulated time; :attr:`board` reads it."""

    board: Board

    def __init__(
        self, plan: Plan, cover: Cover, radius_m: float, body: Body, bridge: BridgeSettings, golden: bool, seed: int
    ):
        skin = self.skin = plan.skin
        self.plan = plan
        self.touches: list[SheetTouch] = []
        self.fingers: tuple[Finger, ...] = ()
        self.contact = False
        self.dead = False
        """Set it to freeze the board's pins and silence it."""
        self.line: Callable[[bytes], bytes] = bytes
        """Transforms each packet of the USB chip; if it raises :class:`~contactfpga.PortLost`, the plug is pulled."""
        pitches = (1e-3 * skin.pitch_x_mm, 1e-3 * skin.pitch_y_mm)
        self._cells = cells_of(cover, skin.rows, skin.columns, *pitches, seed)
        self._moving = MovingBody(cover, self._cells.shape, pitches, (body.ball(radius_m),), body, skin.closed)
        self.forces_n: Floats = np.zeros((skin.rows, skin.columns))
        """(rows, columns) force in N on each switch."""
        self.closed = np.zeros((skin.rows, skin.columns), bool)
        """(rows, columns) bool closed switches."""
        self._units = LoadedUnits(plan.units, skin, seed) if plan.units is not None else None
        self._device = GoldenBoard(skin) if golden else CompiledBoard(skin, capture=("contact",))
        self._hz = skin.clock_hz
        self._chip = BridgeChip(bridge.chip.payload_bytes, 1e-3 * bridge.timer_ms, bridge.event)
        self._frame_s = 1e-6 * bridge.chip.frame_us
        self._frames = 0
        self._clock_s = 0.0
        self._coming: collections.deque[tuple[float, bytes]] = collections.deque()
        self._tracker, self._known = Tracker(), LinkMemory(opened=True, open_s=0.0)
        self._load()

    def cut(self, rows: Mapping[int, int] | None = None, columns: Mapping[int, int] | None = None) -> None:
        """Cut lines, like :meth:`contactfpga_sim.model.board.compiled.CompiledBoard.cut`. Raises ContactFPGAError
        for golden zones."""
        if isinstance(self._device, GoldenBoard):
            raise ContactFPGAError("golden zones come from cells and know no lines: take the gateware")
        self._device.cut(rows or {}, columns or {})

    # ---- fingers, as the view presses a :class:`contactfpga.tools.view.fingers.Touchable`

    by_force = True

    def touch(self, fingers: Sequence[Finger]) -> None:
        """From the next step on, push the link with fingers along the normal; from any thread."""
        self.fingers = tuple(fingers)

    @property
    def pressed(self) -> np.ndarray:
        return self.closed

    # ---- what MuJoCo does to it

    def press(self, touches: list[SheetTouch]) -> None:
        """Apply touches from now on."""
        if touches or self.touches:
            self.touches = touches
            self.forces_n = sum((self._under(touch) for touch in touches), np.zeros(self.closed.shape))
            closed = self._cells.closed_by(self.forces_n, self.closed)
            if not np.array_equal(closed, self.closed):
                self.closed = closed
                self._device.press(closed)
        self._load()

    @property
    def indentation(self) -> Indenter:
        """The cover between the link and what touches it."""
        return self._moving.indentation

    def _under(self, touch: SheetTouch) -> Floats:
        if touch.x_mm is None or touch.y_mm is None:
            return np.zeros(self.closed.shape)
        return self._moving.forces_n(1e-3 * touch.x_mm, 1e-3 * touch.y_mm, touch.push_n)

    def _load(self) -> None:
        if self._units is not None:
            self._device.load(self._units.under(self.wrench()))

    def wrench(self) -> Floats:
        """(6,): force in N and moment in Nm of all contacts, in the link's frame about its origin."""
        total = np.zeros(6)
        for touch in self.touches:
            total += np.concatenate([touch.force_n, np.cross(touch.point_m, touch.force_n)])
        return total

    # ---- its time

    def run(self, until_s: float) -> None:
        """Run the board until this time since power-up."""
        self._clock_s = max(self._clock_s, until_s)
        if not self.dead:
            self._device.run(max(0, round(until_s * self._hz) - self._device.cycle))
            for _, level, _ in self._device.take("contact").tolist():
                self.contact = bool(level)
            for cycle, value, _ in self._device.take("received").tolist():
                self._chip.put(cycle / self._hz, value)
        while (self._frames + 1) * self._frame_s <= self._clock_s + 1e-12:
            self._frames += 1
            at = self._frames * self._frame_s
            data = b"".join(self._chip.take(at))
            if data:
                self._coming.append((at + HOST_S, data))

    def clock(self) -> float:
        return self._clock_s

    def arrived(self) -> bytes:
        """Bytes that reached the program since the last call."""
        found = b""
        while self._coming and self._coming[0][0] <= self._clock_s + 1e-12:
            found += self.line(self._coming.popleft()[1])
        return found

    def send(self, data: bytes) -> None:
        if not self.dead:
            self._device.send(data)

    # ---- what the host knows of it

    def observe(self) -> tuple[LinkMemory, float]:
        """Read all received frames; return the link's state and the board's clock."""
        try:
            while True:
                self._take()
        except ReadTimeout:
            pass
        except ContactFPGAError as error:
            self._known = LinkMemory(down="lost", reason=str(error), frame_s=self._known.frame_s)
        return self._known, self.clock()

    def _take(self) -> None:
        zones = self.board.next(0)
        sampled_s = self.clock() if zones.host_time_s is None else min(zones.host_time_s, self.clock())
        self._known = LinkMemory(True, 0.0, zones, self._tracker.update(zones), sampled_s, sampled_s)

    def close(self) -> None:
        self._device.close()


class SteppedPort:
    """A :class:`contactfpga.driver.transport.SimulatedPort` that steps the whole robot while a program waits."""

    def __init__(self, worn: WornSheet, step: Callable[[], None], seed: int):
        self._worn, self._step = worn, step
        self.rng = random.Random(seed)
        self.still = True
        """Set it to run the board without the robot."""

    def read(self, seconds: float) -> bytes:
        worn, until_s = self._worn, self._worn.clock() + seconds
        while not (data := worn.arrived()) and worn.clock() < until_s - 1e-12:
            if self.still or seconds <= POLL_S:
                worn.run(min(until_s, worn.clock() + worn.skin.derived.frame_clocks / worn.skin.clock_hz))
            else:
                self._step()
        return data

    def write(self, data: bytes) -> None:
        self._worn.send(data)

    def clock(self) -> float:
        return self._worn.clock()

    def close(self) -> None:
        self._worn.close()
