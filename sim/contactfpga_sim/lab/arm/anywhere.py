"""Peak forces of touches anywhere, by the parts of the sheet."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, as_completed
from typing import Any, NamedTuple

import numpy as np

from contactfpga.design.cover import Cap, Cover
from contactfpga.skin import Skin
from contactfpga_sim.apps import covers, stats
from contactfpga_sim.apps.score import wilson
from contactfpga_sim.lab.arm import places
from contactfpga_sim.lab.arm.case import Case
from contactfpga_sim.lab.arm.places import Batch, Latencies, Peaks

TOUCHES = 40

SOLID_N = 1000.0
"""Peak force at which foam and flesh are long pressed solid; what it is then, the rigid bodies decide."""

SAME = 0.03
"""Largest relative difference of the two halves of the touches at which a worst value is printed."""

QUANTILE = 0.95


BUTTON_MM = 3.5


class Geometry(NamedTuple):
    face: str
    """``flush, point force`` (the paper's half-space), ``flush``, ``buttons``, ``caps`` or ``tiles``."""
    pitch_mm: float
    threshold_n: float
    foam_mm: float

    def case(self) -> Case:
        """The paper's arm with this cover of the paper's foam."""
        paper = Case.load("paper")
        flush = self.face.startswith("flush")
        switch = paper.switch.switch if flush else covers.DOME
        side_mm = BUTTON_MM if self.face == "buttons" else self.pitch_mm - covers.GAP_MM
        cover = Cover(
            "point" if self.face == PAPER.face else "foam",
            1e-3 * self.foam_mm,
            dataclasses.replace(switch, force_n=self.threshold_n),
            cap=None if flush else Cap(1e-3 * side_mm),
            cut=self.face == "tiles",
            modulus_pa=paper.foam.modulus_pa,
        )
        return paper.wearing(cover)


PAPER = Geometry("flush, point force", 10.0, 1.0, 5.0)
FLUSH = PAPER._replace(face="flush")
BEST = Geometry("tiles", 6.4, 0.4, 5.0)
CHANGES: tuple[tuple[str, Any], ...] = (
    ("face", "buttons"),
    ("face", "caps"),
    ("face", "tiles"),
    ("pitch_mm", 6.4),
    ("threshold_n", 0.4),
    ("threshold_n", 0.2),
    ("foam_mm", 2.0),
    ("foam_mm", 10.0),
)
"""Changes to :data:`FLUSH`: a field and its value."""

GEOMETRIES = (PAPER, FLUSH, *(FLUSH._replace(**{field: value}) for field, value in CHANGES), BEST)
"""The paper's sheet by its half-space and as a layer, each change to the latter, and the best sheet."""

WAYS = ("6 ms", "UART", "pin", "limit alone")


def ways(case: Case, skin: Skin, latency_s: float = 6e-3) -> tuple[Latencies, ...]:
    """Latencies of :data:`WAYS`: one fixed, two from the gateware, none."""
    return ((latency_s,), *(places.measured_s(case, skin, way) for way in ("uart", "pin")), ())


Found = list[Sequence[Peaks]]
"""Peaks by seed for each of :data:`WAYS`."""


def touched(
    batches: Sequence[Batch], executor: Executor, step: Callable[[str, int], None] = lambda name, of: None
) -> Found:
    return many({"": batches}, executor, step)[""]


def many(
    tasks: Mapping[Any, Sequence[Batch]],
    executor: Executor,
    step: Callable[[str, int], None] = lambda name, of: None,
) -> dict[Any, Found]:
    futures = {executor.submit(places.work, batch): batch for batches in tasks.values() for batch in batches}
    done = {}
    for future in as_completed(futures):
        done[id(futures[future])] = future.result()
        step("batches of touches", len(futures))
    found: dict[Any, Found] = {}
    for key, batches in tasks.items():
        results = [done[id(batch)] for batch in batches]
        found[key] = [places.peaks(results, way) for way in range(len(batches[0].ways))]
    return found


def study() -> dict[Geometry, list[Batch]]:
    """Batches by geometry, all with the reference Skin's times: the pitch does not change them."""
    known = ways(Case.load("paper"), Skin())
    return {
        geometry: places.batches(
            geometry.case(), Skin(pitch_x_mm=geometry.pitch_mm, pitch_y_mm=geometry.pitch_mm), known, TOUCHES
        )
        for geometry in GEOMETRIES
    }


def mean_n(halves: Sequence[Peaks]) -> float:
    return float(np.concatenate([half.force_n for half in halves]).mean())


def worst_text(halves: Sequence[Peaks]) -> str:
    """Largest peak force in N if both halves agree, else the 95 % quantile with its interval."""
    most = [float(half.force_n.max()) for half in halves]
    if max(most) <= (1 + SAME) * min(most):
        return f"{max(most):.1f}"
    one = stats.quantile(np.concatenate([half.force_n for half in halves]).tolist(), QUANTILE)
    until = f"{one.low:.1f} to {one.high:.1f}" if math.isfinite(one.high) else f"at least {one.low:.1f}"
    return f"95 %: {one.value:.1f} ({until})"


def peak_text(halves: Sequence[Peaks]) -> str:
    """Worst and mean peak force in N, or ``solid`` (:data:`SOLID_N`)."""
    if max(half.force_n.max() for half in halves) > SOLID_N:
        return "solid"
    return f"{worst_text(halves)} / {mean_n(halves):.1f}"


def share_text(marks: np.ndarray) -> str:
    """A share in % with Wilson's 95 % interval."""
    hits, of = int(marks.sum()), len(marks)
    low, high = wilson(hits, of)
    return f"{100 * hits / of:.0f} % ({100 * low:.0f} to {100 * high:.0f})"


def _limited(halves: Sequence[Peaks]) -> str:
    return share_text(np.concatenate([half.limited for half in halves]))


HEADINGS = ("way", "touches", "mean peak force, N", "worst, N", "torque limit first", "pressed in, mm")


def lines(found: Found, first: str) -> list[list[str]]:
    """Headings and a line per way; ``first`` names the fixed latency."""
    told = [list(HEADINGS)]
    for name, halves in zip((first, *WAYS[1:]), found):
        count = sum(len(half.force_n) for half in halves)
        numbers = [f"{mean_n(halves):.1f}", worst_text(halves), _limited(halves), _deep(halves)]
        told.append([name, str(count), *numbers])
    return told


def as_json(found: Found, first: str) -> dict[str, Any]:
    """Peaks of each touch in SI units."""
    return {
        name: {
            "peak_force_n": np.concatenate([half.force_n for half in halves]).tolist(),
            "peak_indentation_m": np.concatenate([half.indentation_m for half in halves]).tolist(),
            "torque_limit_first": np.concatenate([half.limited for half in halves]).tolist(),
        }
        for name, halves in zip((first, *WAYS[1:]), found)
    }


def _deep(halves: Sequence[Peaks]) -> str:
    return f"{1e3 * max(half.indentation_m.max() for half in halves):.1f}"


def geometry_lines(found: Mapping[Geometry, Found]) -> list[list[str]]:
    head = ["face", "pitch, mm", "threshold, N", "foam, mm"]
    told = [[*head, *(f"{way}: worst / mean, N" for way in WAYS), "limit first, UART", "pressed in by UART, mm"]]
    for geometry, ways_found in found.items():
        by_uart = ways_found[WAYS.index("UART")]
        told.append(
            [
                geometry.face,
                *(f"{value:g}" for value in geometry[1:]),
                *(peak_text(halves) for halves in ways_found),
                _limited(by_uart),
                _deep(by_uart),
            ]
        )
    return told


def matters(found: Mapping[Geometry, Found]) -> str:
    def mean(geometry: Geometry, way: str = "UART") -> float:
        return mean_n(found[geometry][WAYS.index(way)])

    gained = [
        (mean(FLUSH._replace(**{field: value})) - mean(FLUSH), field.partition("_")[0], f"{value}")
        for field, value in CHANGES
    ]
    gained.append((mean(FLUSH, "pin") - mean(FLUSH, "6 ms"), "latency", "pin"))
    least = {factor: (newtons, value) for newtons, factor, value in sorted(gained, reverse=True)}
    first, *others = sorted((newtons, f"{factor}: {value}") for factor, (newtons, value) in least.items())
    told = [f"{what.replace(':', '')} {newtons:+.1f} N" for newtons, what in others]
    before, after = (found[base][WAYS.index("UART")] for base in (FLUSH, BEST))
    return (
        f"**What matters most against a rigid body is the {first[1]} {first[0]:+.1f} N in the mean peak force over "
        f"touches anywhere**; {', '.join(told)}, each changed alone from the paper's sheet, with its foam as a layer. "
        f"Tiles {BEST.pitch_mm:g} mm apart on switches of {BEST.threshold_n:g} N: {peak_text(after)} N (worst / mean) "
        f"by UART, the torque limit first at {_limited(after)}; the paper's sheet: {peak_text(before)} N, "
        f"{_limited(before)}. With these tiles latency from 6 ms to the pin changes the mean by "
        f"{mean(BEST, 'pin') - mean(BEST, '6 ms'):+.1f} N."
    )
