"""Load of many 1 kHz links on the process that uses them."""

from __future__ import annotations

import contextlib
import time
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

import contactfpga
from contactfpga_sim.lab.reader.feeder import Feeder, Pace
from contactfpga_sim.lab.speed.driver import SKIN

PACE = Pace(1_000, 1, 3.0)
LOOP_S = 0.01


class Share(NamedTuple):
    """Load and age of links."""

    used: float
    """Core share of the process with all its threads."""
    came: float
    """Share of frames that arrived while sent."""
    age_ms: float


def measured(reader: str, links: int) -> Share:
    """Load of links of which a program takes the newest frame every :data:`LOOP_S`."""
    with contextlib.closing(Feeder(links, PACE)) as feeder, contextlib.ExitStack() as opened:
        with ThreadPoolExecutor(4) as workers:
            boards = list(workers.map(lambda port: _opened(port, reader), feeder.ports))
        for board in boards:
            opened.callback(board.close)
        feeder.begin()
        while not feeder.written_s[0]:  # the frames are made first
            time.sleep(0.01)
        time.sleep(0.2)
        before = [board.stats.frames for board in boards]
        used, begun = time.process_time(), time.monotonic()
        ages: list[float] = []
        while (now := time.monotonic()) < begun + PACE.seconds - 0.5:
            ages += [_age_s(board, feeder) for board in boards]
            time.sleep(max(0.0, now + LOOP_S - time.monotonic()))
        span = time.monotonic() - begun
        used = time.process_time() - used
        came = sum(board.stats.frames - first for board, first in zip(boards, before))
        written_s = np.array(feeder.written_s)
        sent = links * max(1, int(((written_s >= begun) & (written_s < begun + span)).sum()))
    return Share(used / span, came / sent, float(np.median(ages)) * 1e3)


def _opened(port: str, reader: str) -> contactfpga.Board:
    return contactfpga.open(port, SKIN, timeout=60.0, reader=reader)


def _age_s(board: contactfpga.Board, feeder: Feeder) -> float:
    zones = board.latest(10.0)
    place = zones.time_us // PACE.step_us - feeder.first[0]
    if not 0 <= place < len(feeder.written_s) or zones.arrived_s is None:
        return 0.0
    return time.monotonic() - feeder.written_s[place]
