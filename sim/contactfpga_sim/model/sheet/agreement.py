"""Circuits in the project's model and in ngspice, in each phase of the scan."""

from __future__ import annotations

import dataclasses
import math
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from contactfpga.design.circuit import patterns, phases
from contactfpga.design.circuit.network import Network
from contactfpga.design.circuit.phases import Levels, Phase
from contactfpga.design.circuit.values import SCHOTTKY, SILICON, Circuit
from contactfpga.errors import MissingTool

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
"""Rounds per phase, the first with the nominal circuit at 16x16."""
PATTERN_SEED = 13


@dataclasses.dataclass(frozen=True, eq=False)
class SpiceCase:
    """A circuit with a pattern, in a phase."""

    circuit: Circuit
    pattern: str
    phase: Phase


@dataclasses.dataclass(frozen=True, eq=False)
class SpiceComparison:
    """Seconds by both models, and the lowest volts of a column that should stay high."""

    case: SpiceCase
    ours_s: float
    spice_s: float
    ours_v: float
    spice_v: float

    @property
    def error(self) -> float:
        """Relative excess of the model's time over ngspice's."""
        return self.ours_s / self.spice_s - 1


def cases() -> Iterator[SpiceCase]:
    """Some 40 reproducible circuits."""
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
    pressed = rng.random(size) < 0.3 if pattern == "random" else patterns.named(*size)[pattern]
    while True:
        circuit = Circuit() if nominal else _drawn(rng)
        phase = make(Network(circuit, pressed), Levels.of(circuit))
        if not phase.bad(phases.rest_volts(phase)).any():
            return SpiceCase(circuit, pattern, phase)
        nominal = False


def _drawn(rng: np.random.Generator) -> Circuit:
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
    """Run both models on a case."""
    phase = case.phase
    ours = phases.passed(phase)
    seconds, volts = run(phase, float(ours.trace.seconds[-1]))
    last = phase.arrived(seconds, volts).max()
    return SpiceComparison(case, ours.seconds, float(last), _lowest(phase, ours.trace.volts), _lowest(phase, volts))


def _lowest(phase: Phase, volts: np.ndarray) -> float:
    if phase.name != "settle":
        return math.nan
    return float(volts[:, np.isfinite(phase.least)].min(initial=math.inf))


EDGE_S = 1e-12
"""Rise time of a pin's drive."""
OPEN_OHM = 1e12
TIMEOUT_S = 600


def installed() -> bool:
    """Whether ngspice is on the PATH."""
    return shutil.which("ngspice") is not None


def run(
    phase: Phase, seconds: float, steps: int = 2000, celsius: float = 27.0, leak_a: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """(n,) seconds and (n, lines) volts under the phase's last drive; ``celsius``: of the diodes, 27 in the project's
    model; ``leak_a``: out of each column."""
    if not installed():
        raise MissingTool("the comparison", "ngspice", "apt install ngspice")
    with tempfile.TemporaryDirectory() as folder:
        deck, table = Path(folder, "sheet.cir"), Path(folder, "volts.txt")
        deck.write_text(netlist(phase, seconds, steps, table, celsius, leak_a), encoding="ascii")
        done = subprocess.run(
            ["ngspice", "-b", deck.name], cwd=folder, capture_output=True, text=True, timeout=TIMEOUT_S, check=False
        )
        if not table.exists():
            raise RuntimeError(f"ngspice found no solution: {done.stdout[-500:]}{done.stderr[-500:]}")
        values = np.loadtxt(table)
    start = sum(phase.seconds)
    times, volts = values[:, 0] - start, values[:, 1:]
    after = times >= 2 * EDGE_S
    return times[after], volts[after]


SCHOTTKY_GAP = "EG=0.69 XTI=2"
"""Band gap and exponent of a Schottky diode's temperature in SPICE."""


def netlist(phase: Phase, seconds: float, steps: int, table: Path, celsius: float = 27.0, leak_a: float = 0.0) -> str:
    """Deck that settles under the first drive, and writes time and volts of all lines."""
    lines = phase.network.rows + phase.network.columns
    end = sum(phase.seconds) + seconds
    names = " ".join(f"v({line})" for line in range(1, lines + 1))
    diode = phase.network.circuit.diode
    return "\n".join(
        [
            f"* {phase.name}",
            f".options reltol=1e-4 method=gear temp={celsius}",
            f".model junction D(IS={diode.saturation_a} N={diode.emission} RS={diode.series_ohm} "
            f"CJO={diode.junction_pf}p VJ={diode.junction_v} M={diode.grading} FC=0.5 TT=0 BV=1000 "
            f"{SCHOTTKY_GAP if diode.emission < 1.3 else ''})",
            f".model pin SW(RON={phase.network.circuit.drive_ohm} ROFF={OPEN_OHM} VT=0.5 VH=0)",
            *_parts(phase.network),
            *(f"Il{column + 1} {column + 1} 0 {leak_a}" for column in range(phase.network.columns) if leak_a),
            *_pins(phase),
            ".control",
            "set filetype=ascii",
            "set wr_singlescale",
            "option numdgt=7",
            f"tran {end / steps:.6g} {end:.9g} 0 {end / 500:.6g}",
            f"wrdata {table.name} {names}",
            ".endc",
            ".end",
            "",
        ]
    )


def _parts(network: Network) -> Iterator[str]:
    """Node 1 is the first column; rows follow the columns."""
    circuit, rows, columns = network.circuit, network.rows, network.columns
    for line in range(1, rows + columns + 1):
        yield f"Cg{line} {line} 0 {circuit.line_pf}p"
        if line not in (columns, rows + columns) and circuit.neighbor_pf:
            yield f"Cn{line} {line} {line + 1} {circuit.neighbor_pf}p"
        if line <= columns and circuit.falling:
            yield f"Cc{line} {line} 0 {circuit.falling.column_pf}p"
        pull = circuit.column_pull_ohm if line <= columns else circuit.row_pull_ohm
        yield f"Rp{line} {line} {'supply' if line <= columns else 0} {pull}"
    yield f"Vsupply supply 0 {circuit.supply_v}"
    for row in range(rows):
        for column in range(columns):
            name, upper, lower = f"{row}_{column}", column + 1, columns + row + 1
            if circuit.crossing_pf:
                yield f"Cx{name} {upper} {lower} {circuit.crossing_pf}p"
            if network.pressed[row, column] and network.bare[row, column]:
                yield f"Rx{name} {upper} {lower} {circuit.switch_ohm}"
            elif network.pressed[row, column]:
                yield f"Rx{name} {upper} x{name} {network.ohm[row, column]}"
                yield f"Dx{name} x{name} {lower} junction"


def _pins(phase: Phase) -> Iterator[str]:
    starts = [0.0, *np.cumsum([0.0, *phase.seconds]).tolist()]
    for line in range(phase.network.rows + phase.network.columns):
        levels = [float(drive.volts[line]) for drive in phase.drives]
        driven = [0.0 if math.isnan(level) else 1.0 for level in levels]
        held = [0.0 if math.isnan(level) else level for level in levels]
        for index, level in enumerate(levels):  # a pin that lets go does so at its level
            if math.isnan(level) and index:
                held[index] = held[index - 1]
        yield f"Vl{line + 1} l{line + 1} 0 {_steps(starts, held)}"
        yield f"Ve{line + 1} e{line + 1} 0 {_steps(starts, driven)}"
        yield f"Sl{line + 1} {line + 1} l{line + 1} e{line + 1} 0 pin"


def _steps(starts: list[float], values: list[float]) -> str:
    points = [f"0 {values[0]:g}"]
    for start, before, after in zip(starts[1:], values, values[1:]):
        if before != after:
            points.append(f"{start + EDGE_S / 2:.15g} {before:g} {start + EDGE_S:.15g} {after:g}")
    return f"PWL({' '.join(points)})" if len(points) > 1 else f"DC {values[0]:g}"
