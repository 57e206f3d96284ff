"""Points of the charts, by any executor."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, as_completed
from typing import Any

import numpy as np

from contactfpga.skin import Skin
from contactfpga.skin.latency import AROUND_S, latency_s
from contactfpga_sim.apps import result_cache
from contactfpga_sim.lab.arm.case import Case
from contactfpga_sim.lab.arm.report import UNLIMITED
from contactfpga_sim.lab.arm.run import run

STEP_S = 25e-6
"""Integrator step for runs without gateware; halving it changes no result by more than 1 %."""

ENDS_S, ENDS_M = 60e-3, 4e-3
"""An arm has retreated after this time plus the time for this distance."""


@dataclasses.dataclass(frozen=True)
class SweepTask:
    """A run."""

    case: Case
    way: str = "latency"
    latency_s: float = 0.0


@dataclasses.dataclass(frozen=True)
class SweepPoint:
    """Results in SI; NaN for an event that did not happen."""

    peak_force_n: float
    force_before_n: float
    peak_indentation_m: float
    closes_s: float
    takes_s: float
    """Time from the switch to the controller's input."""


def work(task: SweepTask) -> dict[str, float]:
    """Fields of the task's :class:`SweepPoint`, cached by code."""
    key = f"{result_cache.made_by(__name__)} {json.dumps(dataclasses.asdict(task), sort_keys=True)}"
    return result_cache.cached("arm", key, lambda: dataclasses.asdict(_point(task)))


def sweep(tasks: Sequence[SweepTask], executor: Executor, step: Callable[[str, int], None]) -> list[SweepPoint]:
    """The tasks' points in order. After each, ``step(name, number of all)`` is called."""
    found: dict[SweepTask, SweepPoint] = {}
    futures = {executor.submit(work, task): task for task in tasks}
    for future in as_completed(futures):
        found[futures[future]] = SweepPoint(**future.result())
        step("runs of the arm", len(futures))
    return [found[task] for task in tasks]


def _point(task: SweepTask) -> SweepPoint:
    short: dict[str, Any] = {"duration_s": ENDS_S + ENDS_M / task.case.link.speed_m_s}
    if task.way == "latency":
        short |= {"step_s": STEP_S, "lead_s": task.case.control.period_s}
    outcome = run(task.case.but(run=short), task.way, latency_s=task.latency_s).outcome
    closes, detected = _number(outcome.closes_s), _number(outcome.detected_s)
    return SweepPoint(
        outcome.peak_force_n,
        _number(outcome.force_before_n),
        outcome.peak_indentation_m,
        closes,
        detected - closes,
    )


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def bounds_s(case: Case, skin: Skin) -> dict[str, float]:
    """Longest time in s from a switch to the controller's input by each way, for one zone."""
    usb = case.usb
    scan = skin.derived.max_frame_clocks / skin.clock_hz
    wire = latency_s(skin)
    return {"pin": scan + AROUND_S, "UART": wire + usb.timer_s + usb.frame_s + usb.host_s, "last byte": wire}


def unlimited(case: Case) -> Case:
    """The case without the torque limit, to judge the sheet alone."""
    return case.but(control=UNLIMITED)


def safe_speed(speeds: np.ndarray, forces: np.ndarray, limit_n: float) -> float:
    """Highest speed up to which no force exceeds the limit, interpolated; NaN if the slowest exceeds or the fastest
    is safe."""
    worst = np.maximum.accumulate(forces)
    above = np.flatnonzero(worst > limit_n)
    if not worst[0] <= limit_n or not len(above):
        return math.nan
    at = int(above[0])
    share = (limit_n - worst[at - 1]) / (worst[at] - worst[at - 1])
    return float(speeds[at - 1] + share * (speeds[at] - speeds[at - 1]))
