"""Reaction time of the loop of ``examples/reflex.py`` on this machine: `python -m contactfpga_sim.lab.reader.reflex`.

Another process plays a board on a pseudo-terminal, with a touch every 5 ms.
"""

from __future__ import annotations

import contextlib
import importlib.util
import statistics
import time
from types import ModuleType
from typing import NamedTuple

import contactfpga
from contactfpga.tools.console import interrupt
from contactfpga_sim.lab.reader.feeder import SKIN, Feeder, Pace

PACE = Pace(12_000, 3, 5.0)
"""Slightly faster than the reference Skin."""

PERIOD, TOUCHED = 64, 16
"""Frames from touch to touch, and of a touch."""

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


def measured(pace: Pace = PACE) -> ReactionTimes:
    """Run the loop repeatedly, from an untouched sheet."""
    loop, silent = example(), 0
    found: list[float] = []

    def touched(number: int) -> bool:
        return number % PERIOD >= PERIOD - TOUCHED

    with contextlib.closing(Feeder(1, pace, touched)) as feeder:
        with contactfpga.open(feeder.ports[0], SKIN, timeout=10.0) as board:
            feeder.begin()
            while feeder.end.value < 0:
                with contextlib.suppress(contactfpga.ReadTimeout):
                    while board.latest(1.0).pressed:
                        pass
                stop = loop.guard(board, lambda: None, lambda: None)
                if stop.reason == "contact":
                    number = stop.zones.time_us // pace.step_us
                    touch = number - number % PERIOD + PERIOD - TOUCHED - feeder.first[0]
                    found.append((stop.decided_s - feeder.written_s[touch]) * 1e6)
                elif feeder.end.value < 0:
                    silent += bool(found)  # the board makes its frames before the first touch, and sends none
            assert not board.stats.lost
    return ReactionTimes(sorted(found[len(found) // 10 :]), silent)


def main() -> int:
    started = time.monotonic()
    for name, value in zip(HEAD, measured().cells):
        print(f"{name}: {value}")
    print(f"in {time.monotonic() - started:.0f} s")
    return 0


if __name__ == "__main__":
    interrupt.leave(interrupt.guarded(main))
