"""Our results on the benchmark's scenes, and those of models of other sensors.

All read the force on each cell. What a cell, an array and a microcontroller add is assumed, and nothing was measured.
"""

from __future__ import annotations

import functools
import itertools
import math
import zlib
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from pathlib import Path
from typing import NamedTuple

import numpy as np

from contactfpga.zones import levels
from contactfpga_sim.apps import score
from contactfpga_sim.apps.covers import DOME, sheet
from contactfpga_sim.apps.light import Reading, Sensed
from contactfpga_sim.apps.score import MODELS, Archive, Entry, Scores
from contactfpga_sim.lab.benchmark.scenes import PITCHES_MM, SEED, STEPS, padded


def places(read: np.ndarray, pitch_mm: float, lasts: int = 1, weights: np.ndarray | None = None) -> np.ndarray:
    """(k, 2) x and y in mm, from the sheet's corner, of the contacts in a map of levels: barycenters of its layers, or
    of integer weights of its cells."""
    sums = levels.moments(read if weights is None else weights, levels.label(read, 4, lasts))
    return pitch_mm * (sums[:, 2:] / sums[:, 1:2] + 0.5)


# ---- sensors: places from (rows, columns) forces

Sensor = Callable[[np.ndarray, float, tuple[int, ...]], np.ndarray]
"""Places of contacts from (rows, columns) forces in N, the pitch in mm, and seeds of the sensor's own spread."""


def cells(reading: Reading, forces_n: np.ndarray, pitch_mm: float, seeds: tuple[int, ...]) -> np.ndarray:
    return places(Sensed(forces_n, *seeds).levels(reading), pitch_mm, reading.lasts)


def domes(force_n: float, forces_n: np.ndarray, pitch_mm: float, seeds: tuple[int, ...]) -> np.ndarray:
    spread = np.clip(np.random.default_rng(seeds).standard_normal(forces_n.shape), -3, 3)
    return places((forces_n >= force_n * (1 + DOME.spread * spread)).astype(int), pitch_mm)


RANGE, FULL_N, NOISE_STEPS, CROSSTALK, GAINS = 255, 10.0, 1.0, 0.01, 0.05
"""The analog array: its steps, the force of the last step in N, noise in steps (rms), the share of a force that each of
four neighbors reads, and the relative spread of gains."""


def analog(forces_n: np.ndarray, pitch_mm: float, seeds: tuple[int, ...]) -> np.ndarray:
    """Places by the barycenter of forces, of elements from the force of a dome on."""
    rng = np.random.default_rng(seeds)
    beside = np.pad(forces_n * (1 + GAINS * rng.standard_normal(forces_n.shape)), 1)
    neighbors = beside[2:, 1:-1] + beside[:-2, 1:-1] + beside[1:-1, 2:] + beside[1:-1, :-2]
    force = (beside[1:-1, 1:-1] + CROSSTALK * neighbors) / FULL_N * RANGE
    steps = np.clip(np.rint(force + NOISE_STEPS * rng.standard_normal(force.shape)), 0, RANGE).astype(int)
    return places((steps >= DOME.force_n / FULL_N * RANGE).astype(int), pitch_mm, weights=steps)


# ---- times


class Pace(NamedTuple):
    """Times in us from a scan to the last byte of its message. Scans repeat."""

    scan_us: float
    work_us: float
    wire_us: float
    slot_us: float = 0.0
    """Interval of sending instants; 0: any."""

    def late_s(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """(count,) s from the force to the last byte: until the cell's row comes, until the scan and the work end,
        and until the message may be sent."""
        loop, rest, slot = rng.random((3, count))
        every = max(self.scan_us + self.work_us, self.wire_us)
        return 1e-6 * (loop * every + rest * self.scan_us + self.work_us + slot * self.slot_us + self.wire_us)


BYTE_US = 10 / 3
"""At 3 Mbaud."""
ZONES, FRAME = 19, 7
"""Bytes of a frame of one zone, and of a frame beside its map."""
ROW_US = 6.0
"""Time of a row of domes."""
LIGHT_US, LIGHT_N = 22.0, 0.2
"""Time of a row of cells whose lightest level this is (``examples/cells.toml``). It goes as one over that force."""


KITS_MM = 6.4
ONE_N = (0.07, 0.1, 0.2, 0.4)
THREE_N = ((0.07, 0.57, 1.13), (0.07, 0.57, 2.26), (0.07, 0.57, 2.26), (0.2, 1.6, 3.2))
SOFT, SOFT_N = "soft kit", (0.13, 0.53, 1.74)
"""The kits' pitch; the best one level and three levels by pitch; the entry with the levels of the soft kit."""


class Method(NamedTuple):
    kind: str
    pitch_mm: float
    force_n: float
    """Least force that is noticed."""
    sensor: Sensor
    pace: Pace


def light(pitch_mm: float, forces_n: tuple[float, ...], lasts: int = 1) -> Method:
    """Cells with levels, whose map goes to the host."""
    skin, reading = sheet(pitch_mm), Reading(forces_n, lasts)
    size = FRAME + math.ceil(skin.rows * skin.columns * reading.bits / 8)
    pace = Pace(skin.rows * LIGHT_US * LIGHT_N / forces_n[0], 0.0, BYTE_US * size)
    return Method("simulated", pitch_mm, forces_n[0], functools.partial(cells, reading), pace)


def _of_domes(kind: str, pitch_mm: float, pace: Pace, force_n: float = DOME.force_n) -> Method:
    return Method(kind, pitch_mm, force_n, functools.partial(domes, force_n), pace)


def _methods() -> dict[str, Method]:
    """Forces of levels are those that docs/levels.md chooses."""
    skin = sheet(KITS_MM)
    cells, scan_us = skin.rows * skin.columns, skin.rows * ROW_US
    zones, array = Pace(scan_us, 0.0, BYTE_US * ZONES), Pace(1000.0, 0.0, BYTE_US * (4 + cells))
    # 100 MHz: 60 cycles and the settle time per row, 15 cycles per cell, 500 per frame; full-speed USB.
    mcu = Pace(skin.rows * (skin.settle_us + 0.6), (15 * cells + 500) / 100, 8 * ZONES / 12, 1000.0)
    found = {
        f"domes, {pitch:g} mm": _of_domes("simulated", pitch, zones._replace(scan_us=sheet(pitch).rows * ROW_US))
        for pitch in PITCHES_MM
    }
    for force in (0.2, 0.6, 1.0):
        found[f"domes of {force:g} N, {KITS_MM:g} mm"] = _of_domes("simulated", KITS_MM, zones, force)
    for pitch, one, three in zip(PITCHES_MM, ONE_N, THREE_N, strict=True):
        found[f"one level, {pitch:g} mm"] = light(pitch, (one,))
        found[f"three levels, {pitch:g} mm"] = light(pitch, three, 2)
    return found | {
        SOFT: light(KITS_MM, SOFT_N, 2),
        "analog array": Method("model", KITS_MM, DOME.force_n, analog, array),
        "microcontroller": _of_domes("model", KITS_MM, mcu),
        "OpenCV": _of_domes("model", KITS_MM, Pace(scan_us, 0.0, BYTE_US * (FRAME + math.ceil(cells / 8)))),
    }


METHODS: Mapping[str, Method] = _methods()


def entry(name: str, method: Method, folder: Path) -> Entry:
    """Results of a method on the scenes in a folder."""
    found, seconds, head = {}, {}, f"{method.pitch_mm:g}mm"
    for path in sorted(folder.glob("*.npz")):
        family, seed, scenes = path.stem, zlib.crc32(path.stem.encode()), Archive(path)
        for model in MODELS:
            forces = scenes.read(f"{model}_{head}_forces", "f", (None, None, None))
            each = [method.sensor(one, method.pitch_mm, (seed, SEED, number)) for number, one in enumerate(forces)]
            found[family, model] = padded(each)
        rises = zip(*(scenes.read(f"{head}_rise_{what}", "f", (None, STEPS + 1)) for what in "sn"))
        felt = [float(np.interp(method.force_n, n, s)) if n[-1] >= method.force_n else math.inf for s, n in rises]
        seconds[family] = felt + method.pace.late_s(len(felt), np.random.default_rng((seed, SEED)))
    return Entry(name, method.kind, method.pitch_mm, found, seconds)


def judged(methods: Mapping[str, Method], folder: Path, workers: Executor) -> list[tuple[Entry, Scores]]:
    found = workers.map(entry, methods, methods.values(), itertools.repeat(folder))
    return [(one, score.scored(one, score.truths(folder, one.pitch_mm))) for one in found]
