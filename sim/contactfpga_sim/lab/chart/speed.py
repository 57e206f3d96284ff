"""From touch to the last byte of the frame that holds all of it: by the golden model, a sample by the gateware, too."""

from __future__ import annotations

import dataclasses
import math
import statistics
from collections.abc import Sequence

import numpy as np

from contactfpga.skin import Skin
from contactfpga_sim.lab.chart import steady
from contactfpga_sim.model.board.receiver import frames_in
from contactfpga_sim.model.golden import Timeline, Trace, predict
from contactfpga_sim.verify.cosim import bench_native
from contactfpga_sim.verify.cosim.compare import compare

STEADY = 12
"""This many scenes are also looked at while they stay as they are."""

MOST_SCANS = 4000
"""That a touch may take until it is reported."""

GOLDEN = 0.6180339887498949
"""Its multiples lie evenly in a scan, whatever their number."""


@dataclasses.dataclass(frozen=True)
class Speed:
    """Times in us."""

    median_us: float
    worst_us: float
    bound_us: float
    """Median of what no scan that looks at each touched row alone can beat: (A + 1) row times, and the frame's bits."""
    bytes: float
    """Median of the frame's bytes on the wire."""
    frame_us: float
    """Once the scene stays as it is, from a frame's first row time to its last byte: median."""
    frames_per_s: float
    """Then, median."""


def touch_cycle(skin: Skin, share: float) -> int:
    """When a touch begins, after ``share`` of a scan."""
    scan = skin.derived.frame_clocks
    return int((math.ceil(steady.WARM_US * skin.clock_hz / 1e6 / scan) + share) * scan)


def last_byte(skin: Skin, trace: Trace, cells: int) -> tuple[int, int] | None:
    """Cycle in which the stop bit ends of the first frame that holds this many cells, and the frame's bytes; None where
    the trace ends before."""
    for got in frames_in(skin, trace.bytes):
        if got.frame.cells == cells:
            return got.last + 10 * skin.derived.bit_clocks, got.size
    return None


def touch(skin: Skin, cells: np.ndarray, share: float, check: bool = False) -> tuple[int, int]:
    """Clocks from the touch to the end of the frame's last byte, and the frame's bytes.

    With ``check`` the compiled gateware goes through the same; raises
    :class:`contactfpga_sim.verify.cosim.compare.Mismatch` where it does anything else.
    """
    start = touch_cycle(skin, share)
    timeline = Timeline([(start, cells, None)])
    cycles = start
    while cycles < start + MOST_SCANS * skin.derived.frame_clocks:
        cycles = start + 2 * max(cycles - start, 2 * skin.derived.frame_clocks)
        trace = predict(skin, timeline, cycles)
        if found := last_byte(skin, trace, int(cells.sum())):
            if check:
                compare(trace, bench_native.run(skin, timeline, cycles))
            return found[0] - start, found[1]
    raise RuntimeError(f"no frame with all {int(cells.sum())} cells came in {cycles - start} clocks")


def measure(skin: Skin, frames: Sequence[np.ndarray], checked: int) -> Speed:
    """The touches that (R, C) bool frames show, each at another instant of the scan.

    The first ``checked`` of them go through the compiled gateware as well; raises
    :class:`contactfpga_sim.verify.cosim.compare.Mismatch` where it differs from the golden model.
    """
    derived = skin.derived
    us = skin.clock_hz / 1e6
    found: list[float] = []
    bounds: list[float] = []
    sizes: list[float] = []
    whole: list[float] = []
    rates: list[float] = []
    for number, cells in enumerate(frames):
        clocks, size = touch(skin, cells, number * GOLDEN % 1, check=number < checked)
        rows = int(cells.any(axis=1).sum()) + 1
        found.append(clocks / us)
        sizes.append(size)
        bounds.append((rows * derived.row_clocks + size * 10 * derived.bit_clocks) / us)
        if number < STEADY:
            whole.append(steady.frame_clocks(skin, cells, size) / us)
            rates.append(steady.frames_per_second(skin, cells, size))
    return Speed(statistics.median(found), max(found), *map(statistics.median, (bounds, sizes, whole, rates)))
