"""The host's share of a touch, measured: the driver reads a board on a pseudo-terminal.

A second process runs the compiled gateware and writes each packet when the USB bridge would. Writing stands for the USB
controller's interrupt and the kernel's driver.
"""

from __future__ import annotations

import dataclasses
import multiprocessing
import os
import platform
import select
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import contactfpga
from contactfpga.skin import Skin
from contactfpga_sim.apps import pool
from contactfpga_sim.apps.latency.board import GOLDEN, Bench, RecordedTouch
from contactfpga_sim.apps.latency.spread import MixedTimes, Spread
from contactfpga_sim.apps.latency.usb import BridgeChip, BridgeSettings

TOUCHES = 100

PHASE = 0.7548776662466927
"""Fraction whose multiples sample a bridge period evenly."""

LEAD_US = 5_000
"""Time before a touch from which packets are written on time."""

SPIN_S = 300e-6
"""Possible oversleep; the rest of a wait polls the clock."""

LATE_S, LATE_US = 0.5e-3, 2_000
"""A touch is left out if a busy machine wrote a packet late by more than LATE_S in the last LATE_US before it:
bursts would keep the driver busy."""

TRIES = 3

WAIT_S = 10.0

TIME_MASK = (1 << 24) - 1


@dataclasses.dataclass(frozen=True)
class HostShare:
    """Times from bytes at the port to zones in user code, on one machine."""

    us: Spread
    touches: int
    left_out: int
    machine: str
    times: MixedTimes = dataclasses.field(repr=False, compare=False)


def measured(
    skin: Skin,
    settings: BridgeSettings,
    contacts: Sequence[np.ndarray],
    touches: int = TOUCHES,
    step: Callable[[str, int], None] = lambda name, of: None,
) -> HostShare | None:
    """The host's share over touches by these (R, C) bool contacts in turn. None without pseudo-terminals, or on too
    busy a machine."""
    if not hasattr(os, "openpty"):
        return None
    found: list[float] = []
    left_out = 0
    player = _Player(skin, settings, contacts, TRIES * touches)
    player.process.start()
    try:
        with contactfpga.open(player.port, skin, timeout=WAIT_S) as board:
            player.go.set()
            while len(found) < touches and len(found) + left_out < TRIES * touches:
                number = len(found) + left_out
                us = _taken(board, player, number)
                if player.late_s[number] > LATE_S:
                    left_out += 1
                else:
                    found.append(us)
                    step("touches through the driver", touches)
    finally:
        player.process.kill()
        player.process.join()
        player.close()
    if not found:
        return None
    times = MixedTimes.of(found)
    return HostShare(times.spread(), len(found), left_out, machine(), times)


def _taken(board: contactfpga.Board, player: _Player, number: int) -> float:
    while True:
        zones = board.next(WAIT_S)
        tuple(zones)
        now_s = time.monotonic()
        if zones.pressed and zones.time_us & TIME_MASK == player.time_us[number]:
            return 1e6 * (now_s - float(player.written_s[number]))


def machine() -> str:
    processor = platform.processor() or platform.machine()
    if (about := Path("/proc/cpuinfo")).exists():
        names = [line.partition(":")[2].strip() for line in about.read_text().splitlines() if "model name" in line]
        processor = names[0] if names else processor
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    system = f"{platform.system()} {platform.release().partition('-')[0]}"
    return f"{processor}, {os.cpu_count()} cores{load}, {system}, Python {platform.python_version()}"


class _Player:
    def __init__(self, skin: Skin, settings: BridgeSettings, contacts: Sequence[np.ndarray], touches: int):
        import tty  # no such module on Windows

        self._skin, self._settings, self._contacts = skin, settings, contacts
        context: Any = multiprocessing.get_context("fork")
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)
        self.go = context.Event()
        self.written_s = context.RawArray("d", touches)
        """``time.monotonic`` before the packet with the last byte, by touch."""
        self.time_us = context.RawArray("q", [-1] * touches)
        self.late_s = context.RawArray("d", touches)
        """Largest lateness of recent packets, by touch."""
        self.process = context.Process(target=self._run, daemon=True)

    def close(self) -> None:
        os.close(self._master)
        os.close(self._slave)

    def _run(self) -> None:
        pool.alone()
        with Bench(self._skin) as bench:
            while not self.go.is_set():
                self._pass_on(bench)
                bench.idle(self._skin.clock_hz // 1000)
                self._write_all(bench)
            for number in range(len(self.written_s)):
                self._pass_on(bench)
                self._touch(bench, number, self._contacts[number % len(self._contacts)])
        time.sleep(60.0)  # a port that is closed would take what was not read with it

    def _pass_on(self, bench: Bench) -> None:
        while select.select([self._master], [], [], 0.0)[0]:
            bench.send(os.read(self._master, 4096))

    def _write_all(self, bench: Bench) -> None:
        self._write(bytes(value for _, value in bench.line))
        bench.line.clear()

    def _touch(self, bench: Bench, number: int, contact: np.ndarray) -> None:
        settings, mhz = self._settings, self._skin.clock_hz / 1e6
        before, after = LEAD_US + settings.period_us, settings.period_us + 2 * settings.chip.frame_us
        share = number * GOLDEN % 1
        touch = bench.touch(contact, share, round(before * mhz), round(after * mhz))
        self.time_us[number] = touch.received.frame.time_us
        line, bench.line = bench.line, []
        since, until = touch.start + touch.stream.since, touch.start + touch.stream.until
        self._write(bytes(value for end, value in line if end <= since))
        self._play(number, touch, mhz)
        self._write(bytes(value for end, value in line if end > until))

    def _play(self, number: int, touch: RecordedTouch, mhz: float) -> None:
        settings, stream = self._settings, touch.stream
        period, frame = settings.period_us, settings.chip.frame_us
        at = stream.since / mhz + period * (number * PHASE % 1)
        chip = BridgeChip(settings.chip.payload_bytes, 1000 * settings.timer_ms, settings.event, at - period)
        for time_us, value in zip((stream.times / mhz).tolist(), stream.values.tolist(), strict=True):
            chip.put(time_us, value)
        written, begin_s, begin_us = 0, time.monotonic(), at
        while written < len(stream.times):
            data = b"".join(chip.take(at))
            due_s = begin_s + 1e-6 * (at - begin_us)
            _wait_until(due_s)
            if written <= touch.byte and at >= touch.last / mhz - LATE_US:
                self.late_s[number] = max(self.late_s[number], time.monotonic() - due_s)
            if written <= touch.byte < written + len(data):
                self.written_s[number] = time.monotonic()
            self._write(data)
            written += len(data)
            at += frame

    def _write(self, data: bytes) -> None:
        while data:
            data = data[os.write(self._master, data) :]


def _wait_until(moment_s: float) -> None:
    left_s = moment_s - time.monotonic()
    if left_s > SPIN_S:
        time.sleep(left_s - SPIN_S)
    while time.monotonic() < moment_s:
        pass
