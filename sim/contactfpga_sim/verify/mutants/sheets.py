"""Stimuli for the boards of several sheets."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from contactfpga.skin.several import Several
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.request import request
from contactfpga_sim.model.golden.trace import Timeline
from contactfpga_sim.verify.mutants.stimuli import Stimulus


def quick(several: Several) -> Iterator[Stimulus]:
    """Cells that change at any time; requests of each sheet, of an absent one and of none, damaged ones, and hellos in
    a row. Then resting sheets with so few hellos that frames overflow a digit."""
    for seed in range(3):
        yield _random(several, seed, 40_000)
    yield _rare(several, 400_000)


def thorough(several: Several) -> Iterator[Stimulus]:
    """Ten seconds of stimuli like :func:`quick`, with unrequested hellos, and counters that reach their high digits."""
    for seed in range(3, 7):
        yield _random(several, seed, 120_000)
    yield _rare(several, 10 * several.clock_hz)


def _random(several: Several, seed: int, cycles: int) -> Stimulus:
    rng = np.random.default_rng([seed, 43])
    gaps = [0, 1, 300, *rng.integers(8_000, size=3)]
    return _stimulus(several, f"random {seed}", cycles, 6 * facts(several.skins[0]).scan_clocks, gaps, rng)


def _rare(several: Several, cycles: int) -> Stimulus:
    rng = np.random.default_rng(47)
    return _stimulus(several, "at rest", cycles, 40_000, [30_000, 60_000], rng)


def _stimulus(
    several: Several, name: str, cycles: int, most: int, gaps: Sequence[int], rng: np.random.Generator
) -> Stimulus:
    received = _asked(several, gaps, rng, cycles)
    timelines = []
    for skin in several.skins:
        starts = np.cumsum(rng.integers(1, most, size=2 * cycles // most + 10))
        shape = (skin.rows, skin.columns)
        pieces = [
            (start, rng.random(shape) < rng.choice([0, 0.1, 0.5]), None) for start in starts[starts < cycles].tolist()
        ]
        timelines.append(Timeline(pieces, received))
    return Stimulus(name, timelines[0], cycles, others=timelines[1:])


def _asked(several: Several, gaps: Sequence[int], rng: np.random.Generator, cycles: int) -> list[tuple[int, bytes]]:
    sheets, bit_clocks = len(several.skins), facts(several.skins[0]).bit_clocks
    sent: list[tuple[int, bytes]] = []
    start = 600
    while True:
        of = int(rng.integers(-1, sheets + 1))
        closing = b"" if of < 0 else bytes([2, 0xB0 + of])
        number = 8 * int(rng.integers(1 << 18)) + int(rng.integers(1, 8))
        data = bytearray(request(number, bool(rng.random() < 0.3), bit_clocks, closing))
        if rng.random() < 0.3:
            data[int(rng.integers(len(data)))] ^= 1 << int(rng.integers(8))
        start += int(rng.choice(gaps))
        if start + 10 * bit_clocks * len(data) >= cycles:
            return sent
        sent.append((start, bytes(data)))
        start += 10 * bit_clocks * len(data)
