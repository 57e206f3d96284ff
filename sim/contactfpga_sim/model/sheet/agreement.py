"""Circuits of many kinds in the project's model and in ngspice: do both say the same of each phase?"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator

import numpy as np

from contactfpga.design.circuit import patterns, phases
from contactfpga.design.circuit.network import Network
from contactfpga.design.circuit.phases import Levels, Phase
from contactfpga.design.circuit.values import SCHOTTKY, SILICON, Circuit
from contactfpga_sim.model.sheet import spice

SIZES = ((8, 8), (16, 16), (8, 24), (32, 32), (40, 16), (64, 64))
PHASES: dict[str, tuple[Callable[[Network, Levels], Phase], tuple[str, ...]]] = {
    "settle": (phases.settle, ("one cell", "one row", "one row but a cell", "all", "all but a column", "checker")),
    "pulled release": (lambda network, levels: phases.pulled_release(network, levels, 0.3), ("one row", "all")),
    "precharge": (lambda network, levels: phases.precharge(network, 40e-9), ("one row", "checker", "all")),
    "project rows": (phases.project_rows, ("one cell", "one column but a cell", "all but a row")),
    "lifted rows": (
        lambda network, levels: phases.project_rows(network, levels, True),
        ("one cell", "all but a row"),
    ),
    "project columns": (phases.project_columns, ("one cell", "all but a column", "checker")),
}
ROUNDS = 7
"""Of each phase; the first one has the nominal circuit at 16x16."""
PATTERN_SEED = 13


@dataclasses.dataclass(frozen=True, eq=False)
class SpiceCase:
    """A circuit with a pattern, in a phase that ends."""

    circuit: Circuit
    pattern: str
    phase: Phase


@dataclasses.dataclass(frozen=True, eq=False)
class SpiceComparison:
    """Seconds of both, and the lowest volts of a column that should stay high, in a phase that settles."""

    case: SpiceCase
    ours_s: float
    spice_s: float
    ours_v: float
    spice_v: float

    @property
    def error(self) -> float:
        """Share by which ours is longer."""
        return self.ours_s / self.spice_s - 1


def cases() -> Iterator[SpiceCase]:
    """Some 40 circuits, the same ones each time."""
    rng = np.random.default_rng(PATTERN_SEED)
    for again in range(ROUNDS):
        for number, (make, names) in enumerate(PHASES.values()):
            size = (16, 16) if again == 0 else SIZES[(again + number) % len(SIZES)]
            yield _case(make, [*names, "random"][again % (len(names) + 1)], size, rng, nominal=again == 0)


def _case(
    make: Callable[[Network, Levels], Phase],
    pattern: str,
    size: tuple[int, int],
    rng: np.random.Generator,
    nominal: bool,
) -> SpiceCase:
    """Circuits are drawn until one comes to levels that can be read."""
    pressed = rng.random(size) < 0.3 if pattern == "random" else patterns.named(*size)[pattern]
    while True:
        circuit = Circuit() if nominal else _drawn(rng)
        phase = make(Network(circuit, pressed), Levels.of(circuit))
        if not phase.bad(phases.rest_volts(phase)).any():
            return SpiceCase(circuit, pattern, phase)
        nominal = False


def _drawn(rng: np.random.Generator) -> Circuit:
    """Each value anywhere in a range, on a logarithmic scale, to two digits."""

    def between(low: float, high: float) -> float:
        return float(f"{low * (high / low) ** rng.random():.2g}")

    return Circuit(
        line_pf=between(10, 300),
        crossing_pf=between(0.5, 6),
        neighbor_pf=between(0.5, 15),
        pin_ohm=between(20, 120),
        series_ohm=between(1, 100),
        line_ohm=between(1, 200),
        switch_ohm=between(10, 3000),
        diode=SILICON if rng.random() < 0.3 else SCHOTTKY,
        column_pull_ohm=between(20_000, 400_000),
        row_pull_ohm=between(10_000, 50_000),
    )


def compared(case: SpiceCase) -> SpiceComparison:
    """Both opinions."""
    phase = case.phase
    ours = phases.passed(phase)
    seconds, volts = spice.run(phase, float(ours.trace.seconds[-1]))
    last = phase.arrived(seconds, volts).max()
    return SpiceComparison(case, ours.seconds, float(last), _lowest(phase, ours.trace.volts), _lowest(phase, volts))


def _lowest(phase: Phase, volts: np.ndarray) -> float:
    if phase.name != "settle":
        return math.nan
    return float(volts[:, np.isfinite(phase.least)].min(initial=math.inf))
