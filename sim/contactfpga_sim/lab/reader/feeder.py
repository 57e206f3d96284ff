"""Boards on pseudo-terminals in a process that notes the time of each frame."""

from __future__ import annotations

import multiprocessing
import os
import select
import time
import tty
from collections.abc import Callable
from typing import Any, NamedTuple

from contactfpga.skin import Skin
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.frame import join
from contactfpga_sim.model.golden.hello import hello
from contactfpga_sim.model.golden.packet import Packet
from contactfpga_sim.model.golden.request import heard

SKIN = Skin(clock_hz=24_000_000, baud=12_000_000, settle_us=2.5)

ALIVE_S = 0.25
"""Interval of frames before the start."""


class Pace(NamedTuple):
    """Timing of written frames."""

    per_second: int
    at_once: int
    seconds: float

    @property
    def step_us(self) -> int:
        return round(1e6 / self.per_second)

    @property
    def pause_s(self) -> float:
        return self.at_once / self.per_second


PACES = Pace(1_000, 1, 1.5), Pace(10_000, 1, 1.0), Pace(72_000, 18, 0.5)
"""The reference sheet's slow and fast scan, and 12 Mbaud's capacity."""


def frame(number: int, low: int, fingers: int = 1, step_us: int = 1024) -> bytes:
    """A frame of fingertips of 3x3 cells, 4 rows apart, that move along rows."""
    known = facts(SKIN)
    x, y = 1 + number // 40 % (SKIN.columns - 2), SKIN.rows // 2
    counted = 24 + 8 + 3 + known.area_bits + known.zones_bits
    room = -(-(counted + 4) // 8) * 8 - counted
    records = b""
    for finger in range(fingers):
        sums = ((9, known.area_bits), (9 * x, known.sum_x_bits), (9 * (y + 4 * finger), known.sum_y_bits))
        records += join(sums)[0].to_bytes(known.item_bytes, "little")
    trailer, width = join(
        (
            (number * step_us % 2**24, 24),
            (number % 256, 8),
            (low, 3),
            (9 * fingers, known.area_bits),
            (fingers, known.zones_bits),
            (0, room + 4),
            (5, 4),
        )
    )
    packet = Packet()
    packet.push(records + trailer.to_bytes(width // 8, "little"))
    return packet.wire(before=known.fingerprint[:2])


def greeting(number: int = 0) -> bytes:
    """Hello of a new board that received this request."""
    digits = [0] * 11 + [number >> 7 * place & 127 for place in range(3)] + [0, 0]
    return hello(facts(SKIN), digits)


class Feeder:
    """Boards that answer requests until started, then write frames at their pace. ``touched``: frames with the
    fingertip, by number."""

    def __init__(self, boards: int, pace: Pace, touched: Callable[[int], bool] = lambda number: True):
        count = int(pace.per_second * pace.seconds)
        self._pace, self._touched = pace, touched
        context: Any = multiprocessing.get_context("fork")
        pairs = [os.openpty() for _ in range(boards)]
        for _, slave in pairs:
            tty.setraw(slave)
        self._masters = [master for master, _ in pairs]
        self._slaves = [slave for _, slave in pairs]
        self.ports = [os.ttyname(slave) for slave in self._slaves]
        self.go = context.Event()
        self.first = context.RawArray("q", boards)
        """Each board's first frame after the start."""
        self.written_s = context.RawArray("d", count)
        """``time.monotonic`` just before each frame's write to the first board."""
        self.end = context.RawValue("q", -1)
        """Frames written by each board; -1: still writing."""
        self.greeted = context.RawValue("q", 0)
        self.process = context.Process(target=self._run, daemon=True)
        self.process.start()

    def _run(self) -> None:
        asked = [b""] * len(self._masters)
        taken, lows, sent = [0] * len(asked), [0] * len(asked), [0] * len(asked)
        alive_s = time.monotonic()
        while not self.go.is_set():
            for master in select.select(self._masters, [], [], 0.01)[0]:
                board = self._masters.index(master)
                asked[board] += os.read(master, 4096)
                for one in heard([(0, asked[board])], facts(SKIN).bit_clocks).requests[taken[board] :]:
                    taken[board] += 1
                    lows[board] = one.number % 8
                    said = greeting(one.number) if one.hello and not sent[board] else b""
                    os.write(master, said + self._frame(sent[board], lows[board]))
                    sent[board] += 1
                    self.greeted.value += 1
            if time.monotonic() > alive_s + ALIVE_S:
                alive_s = time.monotonic()
                for board, master in enumerate(self._masters):
                    if taken[board]:
                        os.write(master, self._frame(sent[board], lows[board]))
                        sent[board] += 1
        self.first[:] = sent
        self._stream(lows, sent)
        time.sleep(60.0)  # a port that is closed would take what was not read with it

    def _stream(self, lows: list[int], sent: list[int]) -> None:
        size, pause_s = self._pace.at_once, self._pace.pause_s
        count = len(self.written_s) + max(sent)
        made = {low: [self._frame(number, low) for number in range(count)] for low in set(lows)}
        begun_s = due_s = time.monotonic()
        end = 0
        while end + size <= len(self.written_s) and time.monotonic() < begun_s + self._pace.seconds:
            chosen = range(end, end + size)
            for board, master in enumerate(self._masters):
                data = b"".join([made[lows[board]][sent[board] + number] for number in chosen])
                if not board:
                    now_s = time.monotonic()
                    for number in chosen:
                        self.written_s[number] = now_s
                while data:
                    data = data[os.write(master, data) :]
            end += size
            due_s += pause_s
            left_s = due_s - time.monotonic()
            if left_s > 0:
                time.sleep(left_s)
            else:
                due_s = time.monotonic()  # what came too late is not made up for
        self.end.value = end

    def _frame(self, number: int, low: int) -> bytes:
        return frame(number, low, int(self._touched(number)), self._pace.step_us)

    def begin(self) -> None:
        """Start writing once each board was asked."""
        while self.greeted.value < len(self.ports):
            time.sleep(0.01)
        time.sleep(0.1)
        self.go.set()

    def close(self) -> None:
        self.process.kill()
        self.process.join()
        for descriptor in self._masters + self._slaves:
            os.close(descriptor)
