"""Times by the golden model, a sample also by the gateware: of a touch and of a constant scene's frame."""

from __future__ import annotations

import bisect
import dataclasses
import math
import statistics
from collections.abc import Callable, Sequence

import numpy as np

from contactfpga.skin import Skin
from contactfpga.wire.protocol import Frame
from contactfpga_sim.model.board.receiver import ReceivedFrame, frames_in
from contactfpga_sim.model.golden import Timeline, beginnings, predict, requests
from contactfpga_sim.verify.cosim import bench_native
from contactfpga_sim.verify.cosim.compare import compare

FRAMES = 12

WARM_US = 1500.0
"""Time after power-up by which the link works."""


def frame_clocks(skin: Skin, cells: np.ndarray, size: int) -> int:
    """Clocks from a frame's first row time to its last byte, with nothing else on the wire.

    ``cells``: (R, C) bool, pressed from the start; ``size``: bytes of their frame, which the keep-alive repeats.
    """
    if skin.derived.scan.waits:
        return _asked_clocks(skin, cells)
    longest = _longest(skin, size)
    quiet = skin.replace(send="on_change", keep_alive_ms=2e3 * longest / skin.clock_hz)
    last = [got for got in _held(quiet, cells, 8 * longest) if got.frame.cells == cells.sum()][-1]
    end = last.last + 10 * skin.derived.bit_clocks
    begun = beginnings(quiet, Timeline([(0, cells, None)]), end)
    whole = bisect.bisect_right(begun, last.first) - 1  # frames whose scan had ended by then
    return end - begun[whole - 1]


def _asked_clocks(skin: Skin, cells: np.ndarray) -> int:
    quiet = skin.replace(send="on_change")
    asked = round(WARM_US * skin.clock_hz / 1e6)
    received = requests([asked], skin.derived.bit_clocks)
    late = asked + 10 * skin.derived.bit_clocks * len(received[0][1])
    timeline = Timeline([(0, cells, None)], received)
    end = late + 4 * skin.derived.max_frame_clocks
    frame = next(got for got in frames_in(quiet, predict(quiet, timeline, end).bytes) if got.first > late)
    begun = beginnings(quiet, timeline, frame.first)
    whole = bisect.bisect_right(begun, frame.first) - 1
    return frame.last + 10 * skin.derived.bit_clocks - begun[whole]


def frames_per_second(skin: Skin, cells: np.ndarray, size: int) -> float:
    """Frames of ``size`` bytes per second with (R, C) bool ``cells`` pressed."""
    held = _held(skin.replace(send="always"), cells, (FRAMES + 4) * _longest(skin, size))
    ends = [got.last for got in held][-FRAMES - 1 :]
    return (len(ends) - 1) * skin.clock_hz / (ends[-1] - ends[0])


def _longest(skin: Skin, size: int) -> int:
    derived = skin.derived
    return derived.frame_clocks + 10 * derived.bit_clocks * size


def _held(skin: Skin, cells: np.ndarray, clocks: int) -> list[ReceivedFrame]:
    debounce_us = skin.debounce_press_us if skin.debounce != "none" else 0.0
    settled = round(max(debounce_us, WARM_US) * skin.clock_hz / 1e6)
    trace = predict(skin, Timeline([(0, cells, None)]), settled + clocks)
    return [got for got in frames_in(skin, trace.bytes) if got.first > settled]


STEADY = 12

MOST_SCANS = 4000

GOLDEN = 0.6180339887498949


@dataclasses.dataclass(frozen=True)
class Speed:
    """Times of a method, in us."""

    median_us: float
    worst_us: float
    bound_us: float
    """Median bound of scans of touched rows alone: (A + 1) row times, and the frame's bits."""
    bytes: float
    frame_us: float
    """Median time from a frame's first row time to its last byte, for a constant scene."""
    frames_per_s: float


def touch_cycle(skin: Skin, share: float) -> int:
    scan = skin.derived.frame_clocks
    return int((math.ceil(WARM_US * skin.clock_hz / 1e6 / scan) + share) * scan)


def touch(skin: Skin, cells: np.ndarray, share: float, check: bool = False) -> tuple[int, int]:
    """Clocks from a touch to the end of the first frame with all these (R, C) bool cells, which close at once after
    ``share`` of a scan; and the frame's bytes.

    With ``check`` the compiled gateware must agree, else :class:`~contactfpga_sim.verify.cosim.compare.Mismatch`.
    """
    whole = int(cells.sum())
    return _until(skin, [(0, cells)], share, lambda frame: frame.cells == whole, check)


def first_report(
    skin: Skin, pieces: Sequence[tuple[int, np.ndarray]], share: float, check: bool = False
) -> tuple[int, int]:
    """Clocks to the end of the first frame with any cell, and its bytes. ``pieces``: (rising clocks after the touch,
    (R, C) bool closed cells); ``check`` as in :func:`touch`."""
    return _until(skin, pieces, share, lambda frame: frame.cells > 0, check)


def _until(
    skin: Skin, pieces: Sequence[tuple[int, np.ndarray]], share: float, wanted: Callable[[Frame], bool], check: bool
) -> tuple[int, int]:
    start = touch_cycle(skin, share)
    timeline = Timeline([(start + clocks, cells, None) for clocks, cells in pieces])
    cycles = start
    while cycles < start + MOST_SCANS * skin.derived.frame_clocks:
        cycles = start + 2 * max(cycles - start, 2 * skin.derived.frame_clocks)
        trace = predict(skin, timeline, cycles)
        for got in frames_in(skin, trace.bytes):
            end = got.last + 10 * skin.derived.bit_clocks
            if wanted(got.frame) and end <= cycles:
                if check:
                    compare(trace, bench_native.run(skin, timeline, cycles))
                return end - start, got.size
    raise RuntimeError(f"no frame of the touch came in {cycles - start} clocks")


def measure(skin: Skin, frames: Sequence[np.ndarray], checked: int) -> Speed:
    """Speed over touches of (R, C) bool frames, each at another phase.

    The first ``checked`` also go through the gateware, as in :func:`touch`.
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
            whole.append(frame_clocks(skin, cells, size) / us)
            rates.append(frames_per_second(skin, cells, size))
    return Speed(statistics.median(found), max(found), *map(statistics.median, (bounds, sizes, whole, rates)))
