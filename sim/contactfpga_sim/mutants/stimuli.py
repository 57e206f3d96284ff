"""Skins in which every option's logic exists, and what is done to their boards."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from contactfpga.skin import Skin
from contactfpga_sim.cosim import covering
from contactfpga_sim.golden.facts import facts
from contactfpga_sim.golden.hello import hello
from contactfpga_sim.golden.request import requests
from contactfpga_sim.golden.trace import Timeline
from contactfpga_sim.scenes import shapes

# Slow clocks bring what comes once in half a second within reach.
SKINS = {
    "8x8": Skin(rows=8, columns=8, clock_hz=1_000_000, baud=250_000, settle_us=30.0),
    "8x8, 4-connectivity": Skin(
        rows=8,
        columns=8,
        connectivity=4,
        diodes="row2col",
        mask=((0, 0), (7, 7), *((row, 3) for row in range(8))),
        zone_capacity=5,
        clock_hz=2_000_000,
        baud=250_000,
        settle_us=20.5,
        release_us=1.5,
    ),
    "4x4, debounced": Skin(
        rows=4,
        columns=4,
        debounce="sym_defer_pk",
        debounce_press_us=250.0,
        debounce_release_us=150.0,
        send="on_change",
        keep_alive_ms=0.7,
        clock_hz=1_000_000,
        baud=500_000,
        settle_us=20.0,
        release_us=2.0,
    ),
    "5x6, eager, 4-connectivity": Skin(
        rows=5,
        columns=6,
        connectivity=4,
        debounce="asym_eager_defer_pk",
        debounce_press_us=400.0,
        debounce_release_us=200.0,
        mask=((2, 1), (4, 5)),
        zone_capacity=1,
        clock_hz=1_000_000,
        baud=500_000,
        settle_us=28.0,
    ),
    "5x9, cells": Skin(
        rows=5,
        columns=9,
        diodes="row2col",
        report="cells",
        send="on_change",
        keep_alive_ms=1.0,
        mask=((1, 1),),
        clock_hz=1_000_000,
        baud=500_000,
        settle_us=14.0,
        release_us=3.0,
    ),
    "4x4, fast": Skin(rows=4, columns=4, clock_hz=1_000_000, baud=250_000, settle_us=10.0, release_us=1.0),
    "64x32, cells, shift registers": Skin(
        rows=64,
        columns=32,
        report="cells",
        row_drive="74hc595",
        row_chains=2,
        column_read="74hc165",
        column_chains=4,
        shift_hz=500_000,
        clock_hz=1_000_000,
        baud=500_000,
        settle_us=80.0,
        release_us=30.0,
    ),
    "6x7, serial": Skin(
        rows=6,
        columns=7,
        labeller="serial",
        mask=((2, 3),),
        zone_capacity=6,
        clock_hz=1_000_000,
        baud=250_000,
        settle_us=24.0,
        release_us=2.0,
    ),
    "5x6, adaptive": Skin(
        rows=5,
        columns=6,
        scan="adaptive",
        debounce="sym_defer_pk",
        debounce_press_us=400.0,
        debounce_release_us=600.0,
        mask=((1, 4),),
        clock_hz=1_000_000,
        baud=500_000,
        settle_us=60.0,
        release_us=4.0,
    ),
    "5x6, reversal": Skin(
        rows=5,
        columns=6,
        scan="reversal",
        settle_us=3.0,
        release_us=1.0,
        precharge_us=2.0,
        project_us=4.0,
        debounce="sym_defer_pk",
        debounce_press_us=40.0,
        debounce_release_us=70.0,
        mask=((1, 4), *((row, 2) for row in range(5))),
        send="on_change",
        keep_alive_ms=4.5,
        clock_hz=1_000_000,
        baud=250_000,
    ),
    "4x5, cells, reversal": Skin(
        rows=4,
        columns=5,
        diodes="row2col",
        scan="reversal",
        settle_us=2.0,
        release_us=1.0,
        precharge_us=1.0,
        project_us=1.0,
        report="cells",
        mask=tuple((1, column) for column in range(5)),
        clock_hz=1_000_000,
        baud=250_000,
    ),
    "4x4, precharge": Skin(
        rows=4,
        columns=4,
        settle_us=20.0,
        release_us=2.0,
        precharge_us=3.0,
        mask=tuple((row, 1) for row in range(4)),
        clock_hz=1_000_000,
        baud=250_000,
    ),
    "1x5, slow": Skin(rows=1, columns=5, clock_hz=1_000_000, baud=100_000, settle_us=9_000.0, release_us=1_000.0),
}

_TIME_WRAPS_US = 1 << 24
_ALL_FRAMES = 16
"""Cells of a sheet of which every frame is tried."""


class Stimulus(NamedTuple):
    """What is done to a board, and for how many clock cycles."""

    name: str
    timeline: Timeline
    cycles: int
    noise: Sequence[tuple[int, int]] = ()
    """At which cycle the receive pin goes low, and for how many: too short for a start bit, or with no stop bit after
    it, so that no byte is received."""


def quick(skin: Skin) -> Iterator[Stimulus]:
    """Cells that come and go at any time, requests, stuck columns and noise; every adversarial shape for one scan."""
    for seed in range(3):
        yield _random(skin, seed, max(12_000, 20 * facts(skin).scan_clocks))
    yield _noisy(skin, max(60, 15_000 // facts(skin).scan_clocks))
    yield _frames(skin, "shapes", np.stack([cells for _, cells in shapes.variants(skin.rows, skin.columns)]))


def thorough(skin: Skin) -> Iterator[Stimulus]:
    """For the mutants that :func:`quick` leaves: the same for longer, all frames of a small sheet, random ones of a
    larger one, and more than half a second of board time, after which a hello comes unasked."""
    for seed in range(3, 9):
        yield _random(skin, seed, max(50_000, 60 * facts(skin).scan_clocks))
    yield _noisy(skin, 300)
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
    gaps = rng.choice([0, 0, 1, 7, scan, 8 * scan, 30 * scan], size=cycles // (10 * known.bit_clocks))
    received = covering.traffic(skin, gaps.tolist(), int(rng.integers(scan)), cycles, rng)
    return Stimulus(f"random {seed}", Timeline(covering.stimulus(skin, cycles, seed).pieces, received), cycles)


def _noisy(skin: Skin, scans: int) -> Stimulus:
    """Requests, and between them what is none: a low level of up to half a bit, or until after the stop bit's middle.

    Most come so far apart that what each does is seen.
    """
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
    return Stimulus("noise", Timeline(pieces, requests(asked, bit)), cycles, noise)


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
    density = rng.choice([0.02, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 0.95, 1.0], (3000, 1, 1))
    return rng.random((3000, skin.rows, skin.columns)) < density


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
    return Stimulus(name, Timeline(pieces), microseconds * clocks)
