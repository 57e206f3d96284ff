"""Load of many links of 1 kHz on the process that uses them, with either reader."""

from __future__ import annotations

import contextlib
import os
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np

import contactfpga
from contactfpga_sim.lab.reader.feeder import Feeder, Pace
from contactfpga_sim.lab.speed.driver import SKIN

PACE = Pace(1_000, 1, 3.0)
LOOP_S = 0.01
"""Interval of reading each link."""
TICKS = os.sysconf("SC_CLK_TCK")


class Share(NamedTuple):
    """Load, in shares of a core."""

    used: float
    """Share used by the process with the links."""
    readers: float
    """Share used by its reader processes together."""
    came: float
    """Share of the frames that arrived while they were sent."""
    age_ms: float
    """Median age of a link's newest frame when taken."""


def measured(reader: str, links: int, call: str) -> Share:
    """``call``: ``latest`` takes each link's newest frame, ``batch`` all of them."""
    with contextlib.closing(Feeder(links, PACE)) as feeder, contextlib.ExitStack() as opened:
        with ThreadPoolExecutor(4) as workers:
            boards = list(workers.map(lambda port: _opened(port, reader), feeder.ports))
        for board in boards:
            opened.callback(board.close)
        queues = [board.subscribe(int(PACE.per_second * PACE.seconds)) for board in boards]
        feeder.begin()
        time.sleep(0.2)
        before = [board.stats.frames for board in boards]
        used, others, begun = time.process_time(), _children_s(), time.monotonic()
        ages: list[float] = []
        while (now := time.monotonic()) < begun + PACE.seconds - 0.5:
            for board, queue in zip(boards, queues):
                ages.append(_age_s(board, queue, call, feeder))
            time.sleep(max(0.0, now + LOOP_S - time.monotonic()))
        span = time.monotonic() - begun
        used, others = time.process_time() - used, _children_s() - others
        came = sum(board.stats.frames - first for board, first in zip(boards, before))
        written_s = np.array(feeder.written_s)
        sent = links * max(1, int(((written_s >= begun) & (written_s < begun + span)).sum()))
    return Share(used / span, others / span, came / sent, float(np.median(ages)) * 1e3)


def _opened(port: str, reader: str) -> contactfpga.Board:
    return contactfpga.open(port, SKIN, timeout=60.0, reader=reader)


def _age_s(board: contactfpga.Board, queue: contactfpga.Subscription, call: str, feeder: Feeder) -> float:
    """Age of a link's newest frame."""
    if call == "latest":
        zones = board.latest(10.0)
        time_us, arrived_s = zones.time_us, zones.arrived_s
    else:
        frames = queue.batch(0.0, 10.0).frames
        time_us, arrived_s = int(frames["time_us"][-1]), float(frames["arrived_s"][-1])
    place = time_us // PACE.step_us - feeder.first[0]
    if not 0 <= place < len(feeder.written_s) or arrived_s is None:
        return 0.0
    return time.monotonic() - feeder.written_s[place]


def _children_s() -> float:
    """CPU time of this process's readers."""
    total = 0
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
            if int(fields[1]) == os.getpid() and b"reader of" in (folder / "cmdline").read_bytes():
                total += int(fields[11]) + int(fields[12])
    return total / TICKS
