"""Peak forces of touches anywhere, by the parts of the sheet."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, as_completed
from typing import Any, NamedTuple

import numpy as np

from contactfpga.skin import Skin
from contactfpga_sim.apps import covers
from contactfpga_sim.apps.stats import wilson
from contactfpga_sim.lab.arm import places
from contactfpga_sim.lab.arm.case import Case
from contactfpga_sim.lab.arm.places import Batch, Latencies, Peaks

TOUCHES = 120

SAME = 0.03
"""Largest relative difference of the two halves of the touches at which a worst value is printed."""

QUANTILE = 0.95


class Geometry(NamedTuple):
    face: str
    """One of :data:`FACES`."""
    pitch_mm: float
    threshold_n: float
    foam_mm: float

    def case(self) -> Case:
        """The paper's arm with this cover."""
        return Case.load("paper").but(
            **FACES[self.face](self.pitch_mm, self.threshold_n),
            foam={"thickness_m": 1e-3 * self.foam_mm, "cut": self.face == "tiles"},
        )


def _flush(model: str) -> Callable[[float, float], dict[str, Any]]:
    return lambda pitch_mm, force_n: {"model": model, "switch": {"force_n": force_n}}


def _proud(side_mm: Callable[[float], float]) -> Callable[[float, float], dict[str, Any]]:
    dome = {name: getattr(covers.DOME, name) for name in ("travel_m", "spread", "hysteresis")}

    def changes(pitch_mm: float, force_n: float) -> dict[str, Any]:
        cap = {"side_m": 1e-3 * side_mm(pitch_mm)}
        return {"model": "frictionless", "switch": {"force_n": force_n, **dome}, "cap": cap}

    return changes


BUTTON_MM = 3.5
_CAP = _proud(lambda pitch_mm: pitch_mm - covers.GAP_MM)
FACES: dict[str, Callable[[float, float], dict[str, Any]]] = {
    "flush, point force": _flush("point"),
    "flush": _flush("hertz"),
    "buttons": _proud(lambda pitch_mm: BUTTON_MM),
    "caps": _CAP,
    "tiles": _CAP,
}
"""Changes to the paper's case by face, for pitch in mm and closing force in N."""

PAPER = Geometry("flush, point force", 10.0, 1.0, 5.0)
BEST = Geometry("tiles", 6.4, 0.4, 5.0)
_CHANGES = (
    {"face": "flush"},
    {"face": "buttons"},
    {"face": "caps"},
    {"face": "tiles"},
    {"pitch_mm": 6.4},
    {"threshold_n": 0.4},
    {"threshold_n": 0.2},
    {"foam_mm": 2.0},
    {"foam_mm": 10.0},
)


GEOMETRIES = (PAPER, *(PAPER._replace(**change) for change in _CHANGES), BEST, BEST._replace(foam_mm=2.0))
"""The paper's sheet and each change to it, the best sheet, and the kits'."""

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
    values = np.sort(np.concatenate([half.force_n for half in halves]))
    n = len(values)
    middle, half = n * QUANTILE, 1.96 * math.sqrt(n * QUANTILE * (1 - QUANTILE))
    ranks = [min(n - 1, max(0, math.ceil(rank) - 1)) for rank in (middle, middle - half, middle + half)]
    value, low, high = values[ranks]
    return f"95 %: {value:.1f} ({low:.1f} to {high:.1f})"


def share_text(marks: np.ndarray) -> str:
    """A share in % with Wilson's 95 % interval."""
    hits, of = int(marks.sum()), len(marks)
    low, high = wilson(hits, of)
    return f"{100 * hits / of:.0f} % ({100 * low:.0f} to {100 * high:.0f})"


def _limited(halves: Sequence[Peaks]) -> str:
    return share_text(np.concatenate([half.limited for half in halves]))


HEADINGS = ("way", "touches", "mean peak force, N", "worst, N", "torque limit first", "pressed in, mm")


def lines(case: Case, found: Found, first: str) -> list[list[str]]:
    """Headings and a line per way; ``first`` names the fixed latency."""
    told = [list(HEADINGS)]
    for name, halves in zip((first, *WAYS[1:]), found):
        count = sum(len(half.force_n) for half in halves)
        numbers = [f"{mean_n(halves):.1f}", worst_text(halves), _limited(halves), _deep(case.foam.thickness_m, halves)]
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


def _deep(thickness_m: float, halves: Sequence[Peaks]) -> str:
    deep = np.concatenate([half.indentation_m for half in halves])
    flat = deep > thickness_m
    return f"{1e3 * deep.max():.1f}" + (f", flat {share_text(flat)}" if flat.any() else "")


def geometry_lines(found: Mapping[Geometry, Found]) -> list[list[str]]:
    head = ["face", "pitch, mm", "threshold, N", "foam, mm"]
    told = [[*head, *(f"{way}: mean / worst, N" for way in WAYS), "limit first, UART", "pressed in by UART, mm"]]
    for geometry, ways_found in found.items():
        by_uart = ways_found[WAYS.index("UART")]
        told.append(
            [
                geometry.face,
                *(f"{value:g}" for value in geometry[1:]),
                *(f"{mean_n(halves):.1f} / {worst_text(halves)}" for halves in ways_found),
                _limited(by_uart),
                _deep(1e-3 * geometry.foam_mm, by_uart),
            ]
        )
    return told


FACTORS = {"face": "face", "pitch_mm": "pitch, mm", "threshold_n": "threshold, N", "foam_mm": "foam, mm"}


class Effect(NamedTuple):
    factor: str
    before: str
    after: str
    newtons: float


def effects(found: Mapping[Geometry, Found], base: Geometry) -> list[Effect]:
    """Effects by UART of each geometry one change away from ``base``, and of the least latency."""
    uart = WAYS.index("UART")
    told = []
    for geometry in found:
        changed = [name for name in FACTORS if getattr(geometry, name) != getattr(base, name)]
        if len(changed) == 1:
            before, after = (_shown(getattr(one, changed[0])) for one in (base, geometry))
            told.append(
                Effect(FACTORS[changed[0]], before, after, mean_n(found[geometry][uart]) - mean_n(found[base][uart]))
            )
    late, pin = (mean_n(found[base][WAYS.index(way)]) for way in ("6 ms", "pin"))
    return [*told, Effect("latency", "6 ms", "pin", pin - late)]


def _shown(value: str | float) -> str:
    return value if isinstance(value, str) else f"{value:g}"


def matters(found: Mapping[Geometry, Found]) -> str:
    least: dict[str, Effect] = {}
    for one in effects(found, PAPER):
        if one.factor not in least or one.newtons < least[one.factor].newtons:
            least[one.factor] = one
    first, *others = sorted(least.values(), key=lambda effect: effect.newtons)
    told = [f"{one.factor.partition(',')[0]} {one.after} {one.newtons:+.1f} N" for one in others]
    before, after = (found[base][WAYS.index("UART")] for base in (PAPER, BEST))
    latency = next(one for one in effects(found, BEST) if one.factor == "latency")
    return (
        f"**What matters most is the {first.factor.partition(',')[0]}: {first.after} in place of "
        f'"{first.before}" change the mean peak force over touches anywhere by {first.newtons:+.1f} N**; '
        f"{', '.join(told)}, each changed alone from the paper's sheet. Tiles {BEST.pitch_mm:g} mm apart on switches "
        f"of {BEST.threshold_n:g} N: {mean_n(after):.1f} N in the mean and {worst_text(after)} N at worst by UART, the "
        f"torque limit first at {_limited(after)}; the paper's sheet: {mean_n(before):.1f} N, {worst_text(before)} N, "
        f"{_limited(before)}. With these tiles latency from {latency.before} to the {latency.after} "
        f"changes the mean by {latency.newtons:+.1f} N."
    )
