"""Stimuli for mutants of one sheet's board."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from contactfpga.skin import Skin
from contactfpga.skin.derived import SELF_TEST
from contactfpga.skin.units import NUMBER_BITS, SUM_THRESHOLD, THRESHOLD, ZERO, number_shift
from contactfpga_sim.model.golden import uart
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.hello import hello
from contactfpga_sim.model.golden.request import command, requests
from contactfpga_sim.model.golden.trace import Cuts, Timeline
from contactfpga_sim.model.scenes import shapes
from contactfpga_sim.model.sheet.matrix import Shorts
from contactfpga_sim.verify.cosim import covering

_TIME_WRAPS_US = 1 << 24
_AT_REST = 400_000
_ALL_FRAMES = 16
_FEW_CELLS = 64
"""Cells of a sheet of which more frames are tried, as each has fewer meetings of zones."""


class Stimulus(NamedTuple):
    """Inputs of a board, and their number of clock cycles."""

    name: str
    timeline: Timeline
    cycles: int
    noise: Sequence[tuple[int, int]] = ()
    """(cycle, length) of low levels at the receive pin that are no byte: too short, or without a stop bit."""
    shorts: Sequence[tuple[int, Shorts]] = ()
    """(cycle, joined lines from then on). The golden model has no joints, so a mutant is compared with the gateware."""
    others: Sequence[Timeline] = ()
    """Inputs of the sheets after the first, whose received bytes are the first one's."""


def quick(skin: Skin) -> Iterator[Stimulus]:
    """Cells that change at any time, requests, stuck columns and noise; every adversarial shape for one scan. With
    guard lines or a self-test also a resting sheet with broken and joined lines."""
    for seed in range(3):
        yield _random(skin, seed, max(12_000, 20 * facts(skin).scan_clocks, least_cycles(skin)))
    yield from _noisy(skin, max(60, 15_000 // facts(skin).scan_clocks))
    yield from _optional(skin)
    yield _frames(skin, "shapes", np.stack([cells for _, cells in shapes.variants(skin.rows, skin.columns)]))
    if skin.closed:
        yield _frames(skin, "shapes around", shapes.around(skin.rows, skin.columns))


def thorough(skin: Skin) -> Iterator[Stimulus]:
    """Stimuli for survivors of :func:`quick`: longer ones, all frames of a small sheet, random ones of a larger one,
    and over half a second of board time, with an unrequested hello."""
    for seed in range(3, 9):
        yield _random(skin, seed, max(50_000, 60 * facts(skin).scan_clocks, 4 * least_cycles(skin)))
    if skin.units:
        timeline, cycles = thresholds(skin, 240)
        yield Stimulus("more thresholds", timeline, cycles)
    yield from _noisy(skin, 300)
    yield _crowded(skin, 300)
    yield _meeting(skin, 200)
    yield _frames(skin, "frames", _various_frames(skin))
    yield _rare(skin, "a second", 1_100_000)


def until_time_wraps(skin: Skin) -> Stimulus:
    """Few events until the device time wraps, the only way to its upper bits."""
    return _rare(skin, "until the time wraps", _TIME_WRAPS_US + 500_000)


def _random(skin: Skin, seed: int, cycles: int) -> Stimulus:
    rng = np.random.default_rng([seed, 11])
    known = facts(skin)
    scan = known.scan_clocks
    usual = [0, 0, 1, 7, scan, 8 * scan, 30 * scan]
    if skin.self_test:
        usual += [test_clocks(skin)] * 3
    gaps = rng.choice(usual, size=cycles // (10 * known.bit_clocks))
    received = covering.traffic(skin, gaps.tolist(), int(rng.integers(scan)), cycles, rng)
    timeline = Timeline(covering.stimulus(skin, cycles, seed).pieces, received)
    return Stimulus(f"random {seed}", added(skin, timeline, cycles, seed), cycles)


def _optional(skin: Skin) -> Iterator[Stimulus]:
    if skin.units:
        timeline, cycles = thresholds(skin, 60)
        yield Stimulus("thresholds", timeline, cycles)
    if skin.guard or skin.self_test:
        yield Stimulus("at rest", at_rest(skin, _AT_REST), _AT_REST)
    if skin.self_test:
        for timeline, shorts, cycles in (joined(skin), *bridged(skin)):
            yield Stimulus("joined lines", timeline, cycles, shorts=shorts)


def _noisy(skin: Skin, scans: int) -> Iterator[Stimulus]:
    """Requests with low levels between them, of up to half a bit or past the stop bit's middle."""
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
    """Hellos in a row, so that more frames are overwritten than their counter holds."""
    known = facts(skin)
    scan = known.scan_clocks
    asked = range(scan, (scans - 5) * scan, 130 * known.bit_clocks)
    pieces = covering.stimulus(skin, scans * scan, 29).pieces
    return Stimulus("crowded", Timeline(pieces, requests(asked, known.bit_clocks)), scans * scan)


def _meeting(skin: Skin, chains: int) -> Stimulus:
    """Chains of hellos, then a waiting frame, ending at all clocks of a hello's time around the next frame's end
    mark."""
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
    """(n, R, C) bool: every frame of a small sheet, else random ones of all densities."""
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
    rng = np.random.default_rng(13)
    clocks = skin.clock_hz // 1_000_000
    shape = (skin.rows, skin.columns)
    pieces = [
        (start * clocks, rng.random(shape) < 0.1, rng.random(skin.columns) < 0.5 if start % 2 else None)
        for start in range(0, microseconds, 300_001)
    ]
    cycles = microseconds * clocks
    return Stimulus(name, added(skin, Timeline(pieces), cycles, 13), cycles)


def least_cycles(skin: Skin) -> int:
    """Cycles by which each option has worked."""
    sweeps = 40 * skin.derived.units.sweep_clocks if skin.units else 0
    return max(sweeps, 5 * test_clocks(skin) if skin.self_test else 0)


def added(skin: Skin, timeline: Timeline, cycles: int, seed: int) -> Timeline:
    """The timeline with occasional broken lines, a stuck guard column and unit readings."""
    rng = np.random.default_rng([seed, 23])
    pieces, cuts, units = list(timeline.pieces), [], []
    if skin.guard:
        pieces = [(start, cells, _with_guard(skin, stuck, rng)) for start, cells, stuck in pieces]
        cuts = [(start, _cuts(skin, rng)) for start in _starts(rng, cycles, 6 * facts(skin).scan_clocks)]
    if skin.units:
        most = 2**skin.derived.units.converter.bits - 1
        sweep = skin.derived.units.sweep_clocks
        units = [(start, _readings(skin.units, most, rng)) for start in _starts(rng, cycles, sweep)]
    return Timeline(pieces, timeline.received, cuts, units)


def at_rest(skin: Skin, cycles: int) -> Timeline:
    """Few touches; cuts long enough for renewed reports, and complete self-tests."""
    rng = np.random.default_rng(37)
    pieces: list[tuple[int, np.ndarray, None]] = []
    for start in range(100, cycles, 30_000):
        cells = rng.random((skin.rows, skin.columns)) < 0.1
        pieces += [(start, cells, None), (start + 40 * facts(skin).scan_clocks, np.zeros_like(cells), None)]
    cuts = [(start, _cuts(skin, rng)) for start in _starts(rng, cycles, 70_000)] if skin.guard else []
    return Timeline(pieces, _self_tests(skin, range(5_000, cycles, 40_000)), cuts)


def thresholds(skin: Skin, epochs: int) -> tuple[Timeline, int]:
    """Zeros and thresholds, with readings around them and on either side of the zero; no touches."""
    rng = np.random.default_rng(41)
    units, bits = skin.derived.units, facts(skin).bit_clocks
    most = 2**units.converter.bits - 1
    zeros = [0] * skin.units
    received: list[tuple[int, bytes]] = []
    readings: list[tuple[int, list[int]]] = []
    start, before = 0, (THRESHOLD, 0)
    for _ in range(epochs):
        around = [_of_bits(units.converter.bits, rng) for _ in range(skin.units)]
        what, place, weights, shift = _watched(skin, rng)
        unit, zero = int(rng.choice(np.flatnonzero(weights))), _of_bits(NUMBER_BITS, rng)
        zeros[unit] = (zero << number_shift(units.converter.bits)) % (most + 1)
        total = sum(weight * (read - zero) for weight, read, zero in zip(weights, around, zeros, strict=True))
        number = _number(abs(total) >> shift, rng)
        if rng.random() < 0.5:  # numbers are coarse: without this no reading comes close
            wanted = number << shift if total >= 0 else -(number << shift)
            around[unit] = min(max(around[unit] + (wanted - total) // weights[unit], 0), most)
        for order, value in (before, (ZERO, unit | zero << 3), (what, place | number << 3)):
            received.append((start, command(129 + len(received) % 64, order, value, False, bits)))
            start += 14 * 10 * bits
        before = (what, place)
        for step in (0, -1, 1, 2):
            moved = min(max(around[unit] + step, 0), most)
            readings.append((start, [*around[:unit], moved, *around[unit + 1 :]]))
            start += 2 * units.sweep_clocks
    return Timeline([], received, units=readings), start


def _watched(skin: Skin, rng: np.random.Generator) -> tuple[int, int, list[int], int]:
    """The next threshold: command, place, weights, and exponent of its steps."""
    units, of_sum = skin.derived.units, bool(rng.random() < 0.5)
    if of_sum:
        place = int(rng.integers(len(skin.unit_sums)))
        return SUM_THRESHOLD, place, list(skin.unit_sums[place]), number_shift(units.sum_bits)
    place = int(rng.integers(skin.units))
    weights = [int(place == unit) for unit in range(skin.units)]
    return THRESHOLD, place, weights, number_shift(units.converter.bits)


def _number(reached: int, rng: np.random.Generator) -> int:
    number = reached + int(rng.integers(2))
    if rng.random() < 0.25:
        number |= 1 << int(rng.integers(min(reached.bit_length(), NUMBER_BITS - 1), NUMBER_BITS))
    return min(2**NUMBER_BITS - 1, max(1, number))


def _of_bits(most: int, rng: np.random.Generator) -> int:
    return int(rng.integers(1 << (most if rng.random() < 0.5 else int(rng.integers(most + 1)))))


def joined(skin: Skin) -> tuple[Timeline, list[tuple[int, Shorts]], int]:
    """Each pair of rows and of columns joined, each row with the supply and each column with a strong pull, alone and
    with another; each followed by a whole sheet, both with a self-test. Returns the timeline, joints by cycle, and
    number of cycles."""
    shorts = [Shorts(rows=(pair,)) for pair in itertools.combinations(range(skin.rows), 2)]
    shorts += [Shorts(columns=(pair,)) for pair in itertools.combinations(range(skin.columns), 2)]
    shorts += [Shorts(supplied=(row,)) for row in range(skin.rows)]
    pulled = [
        (column, pair) for column in range(skin.columns) for pair in (((column - 1) % skin.columns, column), None)
    ]
    shorts += [Shorts(pulled=(column,), columns=(pair,) if pair else ()) for column, pair in pulled]
    each = 2 * test_clocks(skin)
    starts = range(each, each * (1 + 2 * len(shorts)), each)
    changes = list(zip(starts, itertools.chain(*((one, Shorts()) for one in shorts)), strict=True))
    return Timeline([], _self_tests(skin, starts)), changes, starts[-1] + each


def bridged(skin: Skin) -> Iterator[tuple[Timeline, list[tuple[int, Shorts]], int]]:
    """Each diode bridged at power-up, its switch pressed for the self-test. Returns as :func:`joined`."""
    first = (1 + skin.rows + skin.columns) * (2 * facts(skin).project + facts(skin).settle + 8)
    for place in itertools.product(range(skin.rows), range(skin.columns)):
        cells = np.zeros((skin.rows, skin.columns), bool)
        cells[place] = True
        timeline = Timeline([(0, cells, None), (first, np.zeros_like(cells), None)])
        yield timeline, [(0, Shorts(bridged=(place,)))], 300 * 10 * facts(skin).bit_clocks


def test_clocks(skin: Skin) -> int:
    """Upper bound on the clocks of a self-test whose slots are sent."""
    slots = 1 + skin.rows + skin.columns
    packet = 10 * facts(skin).bit_clocks * (12 + (skin.rows + skin.columns) // 7)
    return slots * (3 * packet + facts(skin).scan_clocks)


def _self_tests(skin: Skin, starts: range) -> list[tuple[int, bytes]]:
    if not skin.self_test:
        return []
    return [(start, command(129 + index % 64, SELF_TEST, 0, False, facts(skin).bit_clocks)) for index, start in
            enumerate(starts)]  # fmt: skip


def _starts(rng: np.random.Generator, cycles: int, mean: int) -> Iterator[int]:
    start = int(rng.integers(mean))
    while start < cycles:
        yield start
        start += 1 + int(rng.integers(2 * mean))


def _with_guard(skin: Skin, stuck: np.ndarray | None, rng: np.random.Generator) -> np.ndarray:
    return np.append(np.zeros(skin.columns, bool) if stuck is None else stuck, rng.random() < 0.2)


def _cuts(skin: Skin, rng: np.random.Generator) -> Cuts:
    share = rng.choice([0, 0, 0.2, 0.5])
    ends = (
        {line: int(rng.integers(across + 1)) for line in range(lines) if rng.random() < share}
        for lines, across in ((skin.row_lines, skin.column_lines), (skin.column_lines, skin.row_lines))
    )
    return Cuts(*ends)


def _readings(units: int, most: int, rng: np.random.Generator) -> list[int]:
    low = rng.integers(min(most + 1, 256), size=units)
    return [int(rng.choice(np.array([0, 1, most // 2, most, near, rng.integers(most + 1)], np.int64))) for near in low]
