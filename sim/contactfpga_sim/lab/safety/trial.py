"""One fault at one place of the compiled board's sheet."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np

from contactfpga.skin import Skin
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.failures.rig import Rig, faults, hello_clocks, moments, reported
from contactfpga_sim.lab.safety.catalogue import SheetFault

LONGEST_US = 5000
"""Time that makes a fault unreported."""
STEP_US = 8
QUIET_US = 2500
"""Time without an edge of `alive` at which a watchdog acts: 2.5 of its half periods."""
DEADLINE_US = 1000
"""The host's deadline: ten frames is a short one."""

WARM_UP_US = 3000
"""Run time after the hello."""
SEEN_SCANS = 6
"""Scans watched after a report."""

PINS = ("contact", "alive")


@dataclasses.dataclass(frozen=True)
class Told:
    """Result of a fault in one scene, in us from the fault."""

    by: Mapping[str, int]
    """Report times by ``flags``, a host's ``deadline``, pins ``contact`` and ``alive``."""
    words: tuple[str, ...]
    wrong: int
    """Wrong frames before the flag or the end."""
    harmful: bool
    """Whether a frame was wrong or missing."""


def scenes(skin: Skin, hurt: SheetFault) -> dict[str, np.ndarray]:
    """Touches during the fault: nothing, a finger at it, everything."""
    finger = np.zeros((skin.rows, skin.columns), bool)
    row, column = hurt.middle(*finger.shape)
    finger[max(row - 2, 0) : row + 1, max(column - 2, 0) : column + 1] = True  # of two shorted lines on the first
    return {"rest": np.zeros_like(finger), "finger": finger, "all": np.ones_like(finger)}


def run(skin: Skin, hurt: SheetFault, touched: np.ndarray, phase: float = 0.0) -> Told:
    """Bring about a fault on a touched sheet after this share of a scan."""
    with Rig(skin, capture=PINS) as rig:
        board = rig.board
        board.hold(touched[None], hello_clocks(skin) + skin.derived.clocks(WARM_UP_US) + int(phase * rig.scan))
        rig.frames()
        before = {pin: board.take(pin)["data"] for pin in PINS}
        assert len(before["alive"]) >= 2 or not skin.alive
        watched = _Watched(skin, touched, bool(len(before["contact"])) and bool(before["contact"][-1]))
        if hurt.running:
            hurt.press(board, touched)
        return _watch(rig, hurt, watched)


def _watch(rig: Rig, hurt: SheetFault, watched: _Watched) -> Told:
    skin, board = rig.skin, rig.board
    clocks = skin.derived.clocks_per_us * STEP_US
    for step in range(1, LONGEST_US // STEP_US + 1):
        frames: list[Zones] = []
        edges: dict[str, int] = {}
        if hurt.running:
            board.run(clocks)
            frames = rig.frames() if hurt.connected else []
            for pin in PINS:
                noted = board.take(pin)
                if len(noted):
                    edges[pin] = int(noted["data"][-1])
        watched.step(step * STEP_US, frames, edges, hurt)
        if watched.done:
            break
    return watched.told()


class _Watched:
    def __init__(self, skin: Skin, touched: np.ndarray, contact: bool):
        self._skin = skin
        self._truth = [moments(touched)] if touched.any() else []  # every scene is one contact
        self._contact = contact
        self._by: dict[str, int] = {}
        self._words: tuple[str, ...] = ()
        self._wrong = 0
        self._harmful = False
        self._now_us = self._last_frame = self._last_edge = 0

    @property
    def done(self) -> bool:
        pins = {"contact"} if self._skin.fail_safe else set()
        pins |= {"alive"} if self._skin.alive else set()
        return self._now_us > SEEN_SCANS * self._scan_us and {"flags", *pins} <= set(self._by)

    def step(self, now_us: int, frames: list[Zones], edges: Mapping[str, int], hurt: SheetFault) -> None:
        self._now_us = now_us
        for zones in frames:
            self._last_frame = now_us
            said = tuple(word for word in faults(zones) if word != "motion")  # tells of a touch, not of a fault
            if said and "flags" not in self._by:
                self._by["flags"], self._words = now_us, said
            if reported(zones) != self._truth:
                self._harmful = True
                self._wrong += "flags" not in self._by
        if now_us - self._last_frame >= DEADLINE_US:
            self._by.setdefault("deadline", now_us)
            self._harmful = True
        if "alive" in edges:
            self._last_edge = now_us
        elif self._skin.alive and now_us - self._last_edge >= QUIET_US:
            self._by.setdefault("alive", now_us)
        if hurt.contact_connected and edges.get("contact") and not self._contact:
            self._by.setdefault("contact", now_us)
        self._harmful |= not hurt.contact_connected

    @property
    def _scan_us(self) -> int:
        return -(-self._skin.derived.frame_clocks // self._skin.derived.clocks_per_us)

    def told(self) -> Told:
        return Told(self._by, self._words, self._wrong, self._harmful)
