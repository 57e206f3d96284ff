"""What is done to the boards of mutants."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from contactfpga.skin import Skin
from contactfpga_sim.model.golden import uart
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.hello import hello
from contactfpga_sim.model.golden.request import requests
from contactfpga_sim.model.golden.trace import Timeline
from contactfpga_sim.model.scenes import shapes
from contactfpga_sim.model.sheet.shorts import Shorts
from contactfpga_sim.verify.cosim import covering
from contactfpga_sim.verify.mutants import options

_TIME_WRAPS_US = 1 << 24
_AT_REST = 400_000
_ALL_FRAMES = 16
"""Cells of a sheet of which every frame is tried."""
_FEW_CELLS = 64
"""Cells of a sheet of which many more frames are tried, as each of them has fewer places where zones meet."""


class Stimulus(NamedTuple):
    """What is done to a board, and for how many clock cycles."""

    name: str
    timeline: Timeline
    cycles: int
    noise: Sequence[tuple[int, int]] = ()
    """At which cycle the receive pin goes low, and for how many: too short for a start bit, or with no stop bit after
    it, so that no byte is received."""
    shorts: Sequence[tuple[int, Shorts]] = ()
    """From which cycle on which lines are joined. The golden model knows no such sheet: a mutant is compared with the
    gateware, whose findings ``tests/gateware/test_self_test.py`` holds to the list of faults."""
    others: Sequence[Timeline] = ()
    """What is done to the sheets after the first one, where there are several. What is received is the first one's."""


def quick(skin: Skin) -> Iterator[Stimulus]:
    """Cells that come and go at any time, requests, stuck columns and noise; every adversarial shape for one scan, on a
    closed sheet also shapes around it. With guard lines or a self-test also a sheet at rest with lines that break and
    touch."""
    for seed in range(3):
        yield _random(skin, seed, max(12_000, 20 * facts(skin).scan_clocks, options.least_cycles(skin)))
    yield from _noisy(skin, max(60, 15_000 // facts(skin).scan_clocks))
    yield from _optional(skin)
    yield _frames(skin, "shapes", np.stack([cells for _, cells in shapes.variants(skin.rows, skin.columns)]))
    if skin.closed:
        yield _frames(skin, "shapes around", shapes.around(skin.rows, skin.columns))


def thorough(skin: Skin) -> Iterator[Stimulus]:
    """For the mutants that :func:`quick` leaves: the same for longer, all frames of a small sheet, random ones of a
    larger one, and more than half a second of board time, after which a hello comes unasked."""
    for seed in range(3, 9):
        yield _random(skin, seed, max(50_000, 60 * facts(skin).scan_clocks, 4 * options.least_cycles(skin)))
    if skin.units:
        timeline, cycles = options.thresholds(skin, 240)
        yield Stimulus("more thresholds", timeline, cycles)
    yield from _noisy(skin, 300)
    yield _crowded(skin, 300)
    yield _meeting(skin, 200)
    yield _frames(skin, "frames", _various_frames(skin))
    yield _rare(skin, "a second", 1_100_000)


def until_time_wraps(skin: Skin) -> Stimulus:
    """Little happens, until the device time has begun again: the only way to its upper bits."""
    return _rare(skin, "until the time wraps", _TIME_WRAPS_US + 500_000)


def _random(skin: Skin, seed: int, cycles: int) -> Stimulus:
    """Requests come all along, in bursts and one by one."""
    rng = np.random.default_rng([seed, 11])
    known = facts(skin)
    scan = known.scan_clocks
    usual = [0, 0, 1, 7, scan, 8 * scan, 30 * scan]
    if skin.self_test:
        usual += [options.test_clocks(skin)] * 3
    gaps = rng.choice(usual, size=cycles // (10 * known.bit_clocks))
    received = covering.traffic(skin, gaps.tolist(), int(rng.integers(scan)), cycles, rng)
    timeline = Timeline(covering.stimulus(skin, cycles, seed).pieces, received)
    return Stimulus(f"random {seed}", options.added(skin, timeline, cycles, seed), cycles)


def _optional(skin: Skin) -> Iterator[Stimulus]:
    if skin.units:
        timeline, cycles = options.thresholds(skin, 60)
        yield Stimulus("thresholds", timeline, cycles)
    if skin.guard or skin.self_test:
        yield Stimulus("at rest", options.at_rest(skin, _AT_REST), _AT_REST)
    if skin.self_test:
        for timeline, shorts, cycles in (options.joined(skin), *options.bridged(skin)):
            yield Stimulus("joined lines", timeline, cycles, shorts=shorts)


def _noisy(skin: Skin, scans: int) -> Iterator[Stimulus]:
    """Requests, and between them what is none: a low level of up to half a bit, or until after the stop bit's middle.

    Most come so far apart that what each does is seen. A board that takes pulses for bits would take these for some.
    """
    if uart.pulsed(facts(skin).bit_clocks):
        return
    rng = np.random.default_rng(17)
    known = facts(skin)
    bit, cycles = known.bit_clocks, scans * known.scan_clocks
    asked, noise = [], []
    start = 5
    while start < cycles:
        kind = rng.choice(["request", "pulse", "break"], p=[0.2, 0.5, 0.3])
        if kind == "request":
            asked.append(start)
            start += 100 * bit
        else:
            longest = 9 * bit + bit // 2 + 1
            noise.append((start, longest if kind == "break" else int(rng.integers(1, bit // 2 + 1))))
        start += 11 * bit + int(rng.integers(2 * bit)) + int(rng.choice([0, 2, 15])) * known.scan_clocks
    pieces = covering.stimulus(skin, cycles, 19).pieces
    yield Stimulus("noise", Timeline(pieces, requests(asked, bit)), cycles, noise)


def _crowded(skin: Skin, scans: int) -> Stimulus:
    """Hellos one after the other: more frames are overwritten than the counter of them can count."""
    known = facts(skin)
    scan = known.scan_clocks
    asked = range(scan, (scans - 5) * scan, 130 * known.bit_clocks)
    pieces = covering.stimulus(skin, scans * scan, 29).pieces
    return Stimulus("crowded", Timeline(pieces, requests(asked, known.bit_clocks)), scans * scan)


def _meeting(skin: Skin, chains: int) -> Stimulus:
    """Chains of hellos, then a frame that waits. Their ends are spread over a hello's time around the next frame's
    end mark, so that the wire comes free in any clock of it."""
    known = facts(skin)
    scan, byte = known.scan_clocks, 10 * known.bit_clocks
    hello_clocks = byte * (len(hello(known)) + 1)
    scans = math.ceil((2 * scan + 2 * hello_clocks) / scan) + 1
    asked: list[int] = []
    for chain in range(1, chains + 1):
        mark = chain * scans * scan
        begin = mark - scan - 2 * hello_clocks - chain * hello_clocks // chains
        asked += range(max(begin, 0), mark - hello_clocks, 13 * byte)
    cycles = (chains + 1) * scans * scan
    pieces = covering.stimulus(skin, cycles, 31).pieces
    return Stimulus("meeting", Timeline(pieces, requests(asked, known.bit_clocks)), cycles)


def _various_frames(skin: Skin) -> np.ndarray:
    """(n, R, C) bool: every frame of a sheet that is small enough, else random ones of all densities."""
    cells = skin.rows * skin.columns
    if cells <= _ALL_FRAMES:
        numbers = np.arange(1 << cells)
        return (numbers[:, None] >> np.arange(cells) & 1).astype(bool).reshape(-1, skin.rows, skin.columns)
    rng = np.random.default_rng(5)
    count = 3000 if cells > _FEW_CELLS else 15_000
    density = rng.choice([0.02, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 0.95, 1.0], (count, 1, 1))
    return rng.random((count, skin.rows, skin.columns)) < density


def _frames(skin: Skin, name: str, frames: np.ndarray) -> Stimulus:
    if facts(skin).scan.waits:  # its frames may take longer than a scan period, and wait for the wire
        frames = np.repeat(frames, 4, axis=0)
    return Stimulus(name, Timeline.frames(skin, frames), (len(frames) + 2) * facts(skin).scan_clocks)


def _rare(skin: Skin, name: str, microseconds: int) -> Stimulus:
    """Other cells every 0.3 s, and stuck columns with some of them."""
    rng = np.random.default_rng(13)
    clocks = skin.clock_hz // 1_000_000
    shape = (skin.rows, skin.columns)
    pieces = [
        (start * clocks, rng.random(shape) < 0.1, rng.random(skin.columns) < 0.5 if start % 2 else None)
        for start in range(0, microseconds, 300_001)
    ]
    cycles = microseconds * clocks
    return Stimulus(name, options.added(skin, Timeline(pieces), cycles, 13), cycles)
