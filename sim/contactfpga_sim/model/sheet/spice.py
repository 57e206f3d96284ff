"""A phase of the scan in ngspice, where it is installed: an opinion on the circuit model that shares no code."""

from __future__ import annotations

import math
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from contactfpga.design.circuit.network import Network
from contactfpga.design.circuit.phases import Phase
from contactfpga.errors import MissingTool

EDGE_S = 1e-12
"""In which a pin begins or ends to drive."""
OPEN_OHM = 1e12
TIMEOUT_S = 600


def installed() -> bool:
    """ngspice is on the PATH."""
    return shutil.which("ngspice") is not None


def run(phase: Phase, seconds: float, steps: int = 2000) -> tuple[np.ndarray, np.ndarray]:
    """(n,) seconds and (n, lines) volts under the phase's last drive."""
    if not installed():
        raise MissingTool("the comparison", "ngspice", "apt install ngspice")
    with tempfile.TemporaryDirectory() as folder:
        deck, table = Path(folder, "sheet.cir"), Path(folder, "volts.txt")
        deck.write_text(netlist(phase, seconds, steps, table), encoding="ascii")
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


def netlist(phase: Phase, seconds: float, steps: int, table: Path) -> str:
    """The deck: it comes to rest under the first drive, and writes time and volts of all lines."""
    lines = phase.network.rows + phase.network.columns
    end = sum(phase.seconds) + seconds
    names = " ".join(f"v({line})" for line in range(1, lines + 1))
    diode = phase.network.circuit.diode
    return "\n".join(
        [
            f"* {phase.name}",
            ".options reltol=1e-4 method=gear",
            f".model junction D(IS={diode.saturation_a} N={diode.emission} RS={diode.series_ohm} "
            f"CJO={diode.junction_pf}p VJ={diode.junction_v} M={diode.grading} FC=0.5 TT=0 BV=1000)",
            f".model pin SW(RON={phase.network.circuit.drive_ohm} ROFF={OPEN_OHM} VT=0.5 VH=0)",
            *_parts(phase.network),
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
                yield f"Rx{name} {upper} x{name} {circuit.switch_ohm}"
                yield f"Dx{name} x{name} {lower} junction"


def _pins(phase: Phase) -> Iterator[str]:
    """Of each line a source with the level, and a switch that is closed while the pin drives."""
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
    """A source that has the first value at first, and each further one from its start on."""
    points = [f"0 {values[0]:g}"]
    for start, before, after in zip(starts[1:], values, values[1:]):
        if before != after:
            points.append(f"{start + EDGE_S / 2:.15g} {before:g} {start + EDGE_S:.15g} {after:g}")
    return f"PWL({' '.join(points)})" if len(points) > 1 else f"DC {values[0]:g}"
