"""Reaction time of the loop of ``examples/reflex.py`` on this machine: `python -m contactfpga_sim.lab.tracking.reflex`.

Another process plays a board on a pseudo-terminal, with a touch every 5 ms.
"""

from __future__ import annotations

import importlib.util
import statistics
import time
from types import ModuleType
from typing import NamedTuple

import contactfpga
from contactfpga.tools.console import interrupt
from contactfpga_sim.lab.speed.driver import FRAMES, STEP_US, stream

PACED = 3
"""Frames per write: 12,000 per second, slightly more than the reference Skin's."""

PERIOD, TOUCHED = 64, 16
"""Frames from touch to touch, a divisor of FRAMES, and of a touch."""

ROUNDS = 4

HEAD = ("stops on a touch", "median", "99 %", "worst", "stops on silence")


class ReactionTimes(NamedTuple):
    """Times in us from the last byte of a touch's first frame to the decision."""

    found_us: list[float]
    """Times in increasing order."""
    silent: int
    """Stops because the machine paused too long."""

    @property
    def cells(self) -> tuple[str, ...]:
        found = self.found_us
        p99 = found[len(found) * 99 // 100]
        times = (statistics.median(found), p99, found[-1])
        return f"{len(found):,}", *(f"{time:.0f} µs" for time in times), str(self.silent)


def example() -> ModuleType:
    spec = importlib.util.spec_from_file_location("reflex", contactfpga.examples() / "reflex.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def measured(rounds: int = ROUNDS) -> ReactionTimes:
    """Run the loop repeatedly, from an untouched sheet."""
    loop, found, last, silent = example(), [], (rounds - 1) * FRAMES, 0

    def touched(number: int) -> bool:
        return number % PERIOD >= PERIOD - TOUCHED

    with stream(rounds, PACED, touched) as (board, queue, feeder):
        queue.close()
        number = 0
        while number < last:
            while board.latest(10.0).pressed:
                pass
            stop = loop.guard(board, lambda: None, lambda: None)
            if stop.reason != "contact":
                silent += 1
                continue
            number = stop.zones.time_us // STEP_US
            touch = number - number % PERIOD + PERIOD - TOUCHED
            if number > FRAMES // 10:
                found.append((stop.decided_s - feeder.written_s[touch]) * 1e6)
    return ReactionTimes(sorted(found), silent)


def main() -> int:
    started = time.monotonic()
    for name, value in zip(HEAD, measured().cells):
        print(f"{name}: {value}")
    print(f"in {time.monotonic() - started:.0f} s")
    return 0


if __name__ == "__main__":
    interrupt.leave(interrupt.guarded(main))
