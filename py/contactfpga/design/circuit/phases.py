"""The steps of a scan on the sheet, and when their lines have settled."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from contactfpga.design.circuit import transient
from contactfpga.design.circuit.network import OFF, Drive, Network
from contactfpga.design.circuit.patterns import middle
from contactfpga.design.circuit.values import Circuit

FULL = 0.95
"""Share of the supply at which a line is charged and a row released."""
NEAR_V = 0.05
"""Distance from its rest below which a line no longer pulls others."""


@dataclasses.dataclass(frozen=True)
class Levels:
    """Volts in the frame of :mod:`contactfpga.design.circuit.network` that are guaranteed to read as low and high."""

    low: float
    high: float

    @classmethod
    def of(cls, circuit: Circuit, diodes: str = "col2row") -> Levels:
        """Levels of a circuit, mirrored for a sheet whose selected row is high."""
        if diodes == "row2col":
            return cls(circuit.supply_v - circuit.high_v, circuit.supply_v - circuit.low_v)
        return cls(circuit.low_v, circuit.high_v)


@dataclasses.dataclass(frozen=True, eq=False)
class Phase:
    """A phase of a scan, which ends when all lines are within their limits under the last drive.

    The sheet rests under the first drive; each further one but the last acts for its time.
    """

    name: str
    network: Network
    drives: tuple[Drive, ...]
    seconds: tuple[float, ...]
    """Times of the drives between the first and the last."""
    most: np.ndarray
    """(lines,) upper limits in volts; infinite for a free line."""
    least: np.ndarray
    """(lines,) lower limits in volts; negative infinite for a free line."""

    def bad(self, volts: np.ndarray) -> np.ndarray:
        """Bool of the same shape: lines outside their limits."""
        return np.asarray((volts > self.most) | (volts < self.least))

    def arrived(self, seconds: np.ndarray, volts: np.ndarray) -> np.ndarray:
        """(lines,) time from which each line stays within its limits, 0 if always, infinite if not at the end."""
        bad = self.bad(volts)
        found = np.zeros(volts.shape[1])
        found[bad[-1]] = math.inf
        for line in np.flatnonzero(bad.any(axis=0) & ~bad[-1]):
            last = int(np.flatnonzero(bad[:, line])[-1])
            before, after = volts[last : last + 2, line]
            goal = self.most[line] if before > self.most[line] else self.least[line]
            found[line] = seconds[last] + (goal - before) / (after - before) * (seconds[last + 1] - seconds[last])
        return found


@dataclasses.dataclass(frozen=True, eq=False)
class PhaseResult:
    phase: Phase
    trace: transient.Waveform

    @property
    def seconds(self) -> float:
        """Time from the last change of drive until all lines stay within their limits; infinite if never."""
        return float(self.phase.arrived(self.trace.seconds, self.trace.volts).max())


def rest_volts(phase: Phase) -> np.ndarray:
    """(lines,) final volts under the last drive."""
    return transient.at_rest(phase.network, phase.drives[-1]).lines


def passed(phase: Phase) -> PhaseResult:
    """Simulate the phase until nothing relevant can change."""
    network = phase.network
    state = transient.at_rest(network, phase.drives[0])
    for drive, seconds in zip(phase.drives[1:-1], phase.seconds, strict=True):
        state = transient.run(network, drive, state, seconds).end
    rest = rest_volts(phase)
    never = phase.bad(rest)

    def enough(volts: np.ndarray) -> bool:
        low = (np.abs(volts - rest) < NEAR_V)[np.isfinite(phase.most)].all()
        return bool(low) and not (phase.bad(volts) & ~never).any()

    trace = transient.run(network, phase.drives[-1], state, longest_s(network), enough)
    if never.any():  # a line may be right for a while, on its way
        trace = dataclasses.replace(
            trace, seconds=np.append(trace.seconds, 2 * longest_s(network)), volts=np.vstack([trace.volts, rest])
        )
    return PhaseResult(phase, trace)


def longest_s(network: Network) -> float:
    """An upper bound on the time for which lines move."""
    circuit = network.circuit
    farads = network.farads.diagonal().max() + 1e-12 * circuit.diode.junction_pf * max(network.pressed.shape) * 3
    ohms = max(circuit.column_pull_ohm, circuit.row_pull_ohm) + circuit.switch_ohm
    return float(10 * farads * ohms)


def _any(network: Network) -> tuple[np.ndarray, np.ndarray]:
    lines = network.rows + network.columns
    return np.full(lines, math.inf), np.full(lines, -math.inf)


def _rows(network: Network, row: int | None = None) -> np.ndarray:
    volts = np.full(network.rows, network.circuit.supply_v)
    if row is not None:
        volts[row] = 0.0
    return volts


def settle(network: Network, levels: Levels, row: int | None = None) -> Phase:
    """A row is selected with columns undriven: pressed columns must be low, others high."""
    row = middle(network.rows) if row is None else row
    supply, columns = network.circuit.supply_v, network.columns
    most, least = _any(network)
    most[:columns][network.pressed[row]] = levels.low
    least[:columns][~network.pressed[row]] = levels.high
    drives = Drive.of(supply, supply, network), Drive.of(OFF, _rows(network, row), network)
    return Phase("settle", network, drives, (), most, least)


def pulled_release(network: Network, levels: Levels, dip_v: float = 0.0) -> Phase:
    """A selected row is released, and resistors pull its columns back: they must be high, also ``dip_v`` lower."""
    most, least = _any(network)
    least[: network.columns] = min(levels.high + dip_v, FULL * network.circuit.supply_v)
    selected = Drive.of(OFF, _rows(network, middle(network.rows)), network)
    return Phase("pulled release", network, (selected, Drive.of(OFF, _rows(network), network)), (), most, least)


def row_release(network: Network) -> Phase:
    """A selected row is released; it must be charged before columns drive."""
    row = middle(network.rows)
    most, least = _any(network)
    least[network.columns + row] = FULL * network.circuit.supply_v
    selected = Drive.of(OFF, _rows(network, row), network)
    return Phase("row release", network, (selected, Drive.of(OFF, _rows(network), network)), (), most, least)


def precharge(network: Network, gap_s: float) -> Phase:
    """Columns drive ``gap_s`` after the row is released: they must be charged."""
    supply = network.circuit.supply_v
    most, least = _any(network)
    least[: network.columns] = FULL * supply
    selected = Drive.of(OFF, _rows(network, middle(network.rows)), network)
    released = Drive.of(OFF, _rows(network), network)
    driven = Drive.of(supply, _rows(network), network)
    return Phase("precharge", network, (selected, released, driven), (gap_s,), most, least)


def project_rows(network: Network, levels: Levels, lifted: bool = False) -> Phase:
    """Columns drive and rows are undriven: touched rows must be high, others low.

    Rows start at the released level; with ``lifted`` at the other one, and rising columns lift them.
    """
    supply, columns = network.circuit.supply_v, network.columns
    touched = network.pressed.any(axis=1)
    most, least = _any(network)
    least[columns:][touched] = levels.high
    most[columns:][~touched] = levels.low
    start = 0.0 if lifted else supply
    drives = Drive.of(start, start, network), Drive.of(supply, OFF, network)
    return Phase("lifted rows" if lifted else "project rows", network, drives, (), most, least)


def project_columns(network: Network, levels: Levels) -> Phase:
    """All rows are selected with columns undriven: touched columns must be low, others high."""
    supply, columns = network.circuit.supply_v, network.columns
    touched = network.pressed.any(axis=0)
    most, least = _any(network)
    most[:columns][touched] = levels.low
    least[:columns][~touched] = levels.high
    drives = Drive.of(supply, supply, network), Drive.of(OFF, 0.0, network)
    return Phase("project columns", network, drives, (), most, least)
