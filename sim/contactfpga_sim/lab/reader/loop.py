"""Missed deadlines and false silences of ``examples/reflex.py`` beside a computing Python thread."""

from __future__ import annotations

import contextlib
import sys
import time
from typing import NamedTuple

import contactfpga
from contactfpga_sim.lab.reader.feeder import SKIN, Feeder, Pace
from contactfpga_sim.lab.reader.latency import OPEN_S, computing
from contactfpga_sim.lab.reader.reflex import example

PACE = Pace(1_000, 1, 2.0)


class MissedDeadlines(NamedTuple):
    deadlines: int
    missed: int
    silent: int
    """Stops for lack of a recent frame, though one came every ms."""


def measured(reader: str, busy: bool, switch_s: float) -> MissedDeadlines:
    """Run the loop; ``switch_s``: Python's switch interval."""
    loop, usual = example(), sys.getswitchinterval()
    begun: list[float] = []
    silent = 0
    with contextlib.closing(Feeder(1, PACE, lambda number: False)) as feeder:
        with contactfpga.open(feeder.ports[0], SKIN, timeout=OPEN_S, reader=reader) as board, computing(busy):
            sys.setswitchinterval(switch_s)
            try:
                feeder.begin()
                board.latest(10.0)
                end = time.monotonic() + PACE.seconds - 0.5

                def step() -> None:
                    begun.append(time.monotonic())
                    if begun[-1] > end:
                        raise StopIteration

                with contextlib.suppress(StopIteration):
                    while True:
                        silent += loop.guard(board, step, lambda: None).reason == "silence"
            finally:
                sys.setswitchinterval(usual)
    periods = {int((moment - begun[0]) / loop.PERIOD_S) for moment in begun}
    deadlines = int((begun[-1] - begun[0]) / loop.PERIOD_S) + 1
    return MissedDeadlines(deadlines, deadlines - len(periods), silent)
