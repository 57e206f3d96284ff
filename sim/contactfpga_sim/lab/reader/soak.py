"""A board in real time and its driver for an hour: `make soak`. Nothing may grow, or be lost unreported.

The virtual board runs on a pseudo-terminal; three threads read it, one requests, subscriptions come and go, and the
port is reopened. Each line is a minute: frames, losses, memory and open descriptors. The status is 1 if a frame was
repeated or out of order, a count does not add up, memory or descriptors grew, or no frame arrived. The first period
with a wrong frame or count is the last.
"""

from __future__ import annotations

import argparse
import os
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import contactfpga
from contactfpga.driver.driver import Board
from contactfpga.tools.console import interrupt, numbers
from contactfpga_sim.model.board.pty_board import PtyBoard

SKIN = contactfpga.Skin(clock_hz=3_000_000, baud=750_000, settle_us=25.0)

REOPENED_S = 60.0
GROWTH_MB = 30.0
"""Growth allowed to Python after the first tenth of the time."""


class Soak:
    """Readings, and errors found."""

    def __init__(self, port: str):
        self.faults: list[str] = []
        self.frames = self.reads = self.subscribed = self.opened = 0
        self._port = port

    def run(self, seconds: float) -> None:
        self.opened += 1
        with contactfpga.open(self._port, timeout=10.0) as board:
            until = time.monotonic() + seconds
            threads = [
                threading.Thread(target=self._guarded, args=(work, board, until))
                for work in (self._every_frame, self._newest, self._subscriptions)
            ]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            stats = board.stats
            if stats.damaged or stats.unexplained or stats.restarts:
                self.faults.append(f"on a line without errors: {stats}")

    def _guarded(self, work: Callable[[Board, float], None], board: Board, until: float) -> None:
        try:
            while time.monotonic() < until:
                work(board, until)
        except Exception as error:
            self.faults.append(f"{work.__name__}: {type(error).__name__}: {error}")

    def _every_frame(self, board: Board, until: float) -> None:
        last_us = -1
        with board.subscribe(maxsize=16_384) as frames:
            for zones in frames:
                if zones.time_us <= last_us:
                    self.faults.append(f"a frame of {zones.time_us} us after one of {last_us} us")
                last_us = zones.time_us
                self.frames += 1
                if time.monotonic() >= until:
                    return

    def _newest(self, board: Board, until: float) -> None:
        last_us = -1
        while time.monotonic() < until:
            zones = board.read(timeout=5.0)
            if zones.time_us <= last_us:
                self.faults.append(f"asked for a new frame, got one of {zones.time_us} us after one of {last_us} us")
            last_us = zones.time_us
            self.reads += 1
            time.sleep(0.005)

    def _subscriptions(self, board: Board, until: float) -> None:
        with board.subscribe(maxsize=4) as frames:
            frames.next(timeout=5.0)
        self.subscribed += 1
        time.sleep(0.01)


def main(arguments: list[str] | None = None) -> int:
    """Run it; return 1 if something was wrong."""
    parser = argparse.ArgumentParser(prog="make soak", description=__doc__)
    parser.add_argument("--seconds", type=numbers.SECONDS, default=3600.0, help="how long (default: an hour)")
    seconds = parser.parse_args(arguments).seconds
    early: tuple[float, int] | None = None
    with PtyBoard(SKIN, "moving") as board:
        started = time.monotonic()
        soak = Soak(board.port)
        print(f"{'minutes':>8} {'frames':>10} {'reads':>8} {'opened':>7} {'MB':>7} {'files':>6} {'slip s':>7}  faults")
        while not soak.faults and (passed := time.monotonic() - started) < seconds:
            soak.run(min(REOPENED_S, seconds / 20, seconds - passed))
            memory, files = _megabytes(), _descriptors()
            print(
                f"{(time.monotonic() - started) / 60:8.1f} {soak.frames:10,} {soak.reads:8,} {soak.opened:7} "
                f"{memory:7.1f} {files:6} {board.slip:7.2f}  {len(soak.faults)}",
                flush=True,
            )
            if early is None and time.monotonic() - started >= seconds / 10:
                early = memory, files
        if board.failure is not None:
            soak.faults.append(f"the board ended: {board.failure}")
    if early is not None:
        if memory - early[0] > GROWTH_MB:
            soak.faults.append(f"memory grew from {early[0]:.1f} to {memory:.1f} MB")
        if files > early[1]:
            soak.faults.append(f"open descriptors grew from {early[1]} to {files}")
    if soak.frames == 0:
        soak.faults.append("no frame came")
    for fault in soak.faults[:20]:
        print(fault, file=sys.stderr)
    print(f"{soak.frames:,} frames in {(time.monotonic() - started) / 60:.1f} minutes, {len(soak.faults)} faults")
    return 1 if soak.faults else 0


def _megabytes() -> float:
    """Resident memory; 0 if unreported."""
    status = Path("/proc/self/statm")
    return int(status.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6 if status.exists() else 0.0


def _descriptors() -> int:
    folder = Path("/proc/self/fd")
    return len(list(folder.iterdir())) if folder.exists() else 0


if __name__ == "__main__":
    interrupt.leave(interrupt.guarded(main))
