"""What is done to the boards of several sheets."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from contactfpga.skin.several import Several
from contactfpga_sim.golden.facts import facts
from contactfpga_sim.golden.request import request
from contactfpga_sim.golden.trace import Timeline
from contactfpga_sim.mutants.stimuli import Stimulus


def quick(several: Several) -> Iterator[Stimulus]:
    """Cells that come and go at any time; requests of each sheet, of one that is not there and of none, damaged ones,
    and hellos one after the other."""
    for seed in range(3):
        yield _random(several, seed, 40_000)


def thorough(several: Several) -> Iterator[Stimulus]:
    """The same for longer, and until hellos come unasked."""
    for seed in range(3, 7):
        yield _random(several, seed, 120_000)
    yield _random(several, 7, several.clock_hz * 6 // 10)


def _random(several: Several, seed: int, cycles: int) -> Stimulus:
    rng = np.random.default_rng([seed, 43])
    received = _asked(several, rng, cycles)
    timelines = []
    for skin in several.skins:
        starts = np.cumsum(rng.integers(1, 6 * facts(skin).scan_clocks, size=cycles // 100))
        shape = (skin.rows, skin.columns)
        starts = starts[starts < cycles].tolist()
        pieces = [(start, rng.random(shape) < rng.choice([0, 0.1, 0.5]), None) for start in starts]
        timelines.append(Timeline(pieces, received))
    return Stimulus(f"random {seed}", timelines[0], cycles, others=timelines[1:])


def _asked(several: Several, rng: np.random.Generator, cycles: int) -> list[tuple[int, bytes]]:
    """Requests at any time after the first hellos, some in a row."""
    sheets, bit_clocks = len(several.skins), facts(several.skins[0]).bit_clocks
    sent: list[tuple[int, bytes]] = []
    start, number = 600, 129 * 128 + 1
    while True:
        of = int(rng.integers(-1, sheets + 1))
        closing = b"" if of < 0 else bytes([2, 0xB0 + of])
        data = bytearray(request(number, bool(rng.random() < 0.3), bit_clocks, closing))
        if rng.random() < 0.3:
            data[int(rng.integers(len(data)))] ^= 1 << int(rng.integers(8))
        start += int(rng.choice([0, 1, 300, int(rng.integers(8_000))]))
        if start + 10 * bit_clocks * len(data) >= cycles:
            return sent
        sent.append((start, bytes(data)))
        start += 10 * bit_clocks * len(data)
        number += 2 if number % 8 == 7 else 1
