"""Touches anywhere on the sheet.

Places fill pitch cells in the sheet's middle evenly; each has a sheet with drawn closing forces, a measured latency and
an instant between controller samples.
"""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np

from contactfpga.design.cover.numerics import Floats
from contactfpga.skin import Skin
from contactfpga_sim.apps import result_cache
from contactfpga_sim.lab.arm.case import STEPS_A_TIME_CONSTANT, Case, CaseError
from contactfpga_sim.lab.arm.run import run
from contactfpga_sim.lab.arm.sweep import ENDS_M, STEP_S

ENDS_S = 20e-3
"""Time that, with the time for :data:`contactfpga_sim.lab.arm.sweep.ENDS_M`, ends a peak."""

INSTANTS = 8
"""Touches that measure latencies, a controller period apart."""

SPAN = 3
"""Pitches along each touched side."""

SEEDS = (0, 1)
"""Seeds of half of the touches each; the halves' difference shows the uncertainty."""

Latencies = tuple[float, ...]
"""Equally likely latencies in s; empty: the sheet reports nothing."""


@dataclasses.dataclass(frozen=True)
class Batch:
    """Touches of one seed, each by every way."""

    case: Case
    skin: Skin
    ways: tuple[Latencies, ...]
    count: int
    seed: int


@dataclasses.dataclass(frozen=True)
class Peaks:
    """Arrays (touches,) of one way."""

    force_n: Floats
    indentation_m: Floats
    limited: np.ndarray
    """Whether the torque limit reacted first."""
    detected_m: Floats
    """Indentation when the contact arrived at the controller; NaN if it did not."""


def check(case: Case) -> None:
    """Raise :class:`CaseError` for a case without a place to vary."""
    if len(case.touch) != 1:
        raise CaseError("touches anywhere need a case with one touch; take --places 0")


_GOLDEN = 1.32471795724
"""Root of x^3 = x + 1: steps by its powers fill a square evenly (Roberts)."""


def evenly(count: int, seed: int) -> Floats:
    """(count, 6) numbers from 0 to 1: the first two fill a square evenly, the others are shuffled even shares."""
    rng = np.random.default_rng(seed)
    square = (rng.random(2) + np.outer(np.arange(count), [1 / _GOLDEN, 1 / _GOLDEN**2])) % 1
    orders = np.stack([rng.permutation(count) for _ in range(4)], axis=1)
    return np.hstack([square, (orders + rng.random(orders.shape)) / count])


def batches(case: Case, skin: Skin, ways: tuple[Latencies, ...], count: int) -> list[Batch]:
    """Half of the touches by each seed."""
    check(case)
    return [Batch(case, skin, ways, math.ceil(count / len(SEEDS)), seed) for seed in SEEDS]


def work(batch: Batch) -> list[list[tuple[float, float, bool, float]]]:
    """Peak force in N, peak indentation in m, whether the torque limit reacted first, and indentation at detection, of
    each touch for each way. Cached."""
    what = dataclasses.asdict(dataclasses.replace(batch, skin=None))  # type: ignore[arg-type]
    key = f"{result_cache.made_by(__name__, batch.skin)} {json.dumps(what, sort_keys=True)}"
    found: list[list[tuple[float, float, bool, float]]] = result_cache.cached("places", key, lambda: _touched(batch))
    return found


def peaks(found: list[list[list[tuple[float, float, bool, float]]]], way: int) -> list[Peaks]:
    arrays = [np.array(one[way], float) for one in found]
    return [Peaks(array[:, 0], array[:, 1], array[:, 2] > 0, array[:, 3]) for array in arrays]


def _touched(batch: Batch) -> list[list[tuple[float, float, bool, float]]]:
    case, skin = batch.case, batch.skin
    step = _step_s(case)
    phases = round(case.control.period_s / step)
    found: list[list[tuple[float, float, bool, float]]] = [[] for _ in batch.ways]
    touches = evenly(batch.count, batch.seed).tolist()
    for sheet, (x, y, phase, late, column, row) in enumerate(touches, batch.seed * batch.count):
        place = {
            "x_mm": _place_mm(x, column, skin.columns, skin.pitch_x_mm),
            "y_mm": _place_mm(y, row, skin.rows, skin.pitch_y_mm),
        }
        times = {
            "step_s": step,
            "lead_s": case.control.period_s + math.floor(phase * phases) * step,
            "duration_s": ENDS_S + ENDS_M / case.link.speed_m_s,
        }
        moved = case.but(touch=(place,), run=times)
        for number, latencies in enumerate(batch.ways):
            latency = float(np.quantile(latencies, late)) if latencies else 0.0
            way = "latency" if latencies else "torque"
            outcome = run(moved, way, latency_s=latency, skin=skin, sheet=sheet, to_peak=True).outcome
            detected_m = math.nan if outcome.detected_m is None else outcome.detected_m
            limited = outcome.reason == "torque"
            found[number].append((outcome.peak_force_n, outcome.peak_indentation_m, limited, detected_m))
    return found


def _place_mm(inside: float, cell: float, count: int, pitch_mm: float) -> float:
    span = min(SPAN, count - 1)
    if not span:
        return 0.5 * inside * pitch_mm
    return ((count - 1 - span) // 2 + math.floor(cell * span) + inside) * pitch_mm


def _step_s(case: Case) -> float:
    period = case.control.period_s / STEP_S
    fits = abs(period - round(period)) < 1e-6 and case.motor.time_constant_s / STEPS_A_TIME_CONSTANT >= STEP_S
    return STEP_S if fits else case.run.step_s


def measured_s(case: Case, skin: Skin, way: str) -> Latencies:
    """Times in s from a switch to the controller's input over :data:`INSTANTS` touches, by ``uart`` or ``pin``."""
    key = f"{result_cache.made_by(__name__, skin)} {way} {dataclasses.asdict(case.usb)} {case.control.period_s}"
    found: list[float] = result_cache.cached("latencies", key, lambda: _measured(case, skin, way))
    return tuple(found)


def _measured(case: Case, skin: Skin, way: str) -> list[float]:
    on = {"x_mm": skin.columns // 2 * skin.pitch_x_mm, "y_mm": skin.rows // 2 * skin.pitch_y_mm}
    paper = Case.load("paper")
    found = []
    for number in range(INSTANTS):
        times = {"lead_s": paper.run.lead_s + number * case.control.period_s, "duration_s": 30e-3}
        outcome = run(paper.but(touch=(on,), run=times, usb=dataclasses.asdict(case.usb)), way, skin=skin).outcome
        if outcome.closes_s is not None and outcome.detected_s is not None:
            found.append(outcome.detected_s - outcome.closes_s)
    if not found:
        raise CaseError(f"no touch on a switch came to the controller by {way} within 30 ms")
    return found
