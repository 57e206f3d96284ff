"""A sheet's circuit as equations: charge and current of every line and of every pressed switch's diode.

Volts are those of a sheet whose selected row is low (``diodes = "col2row"``); the other direction is its mirror image.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from contactfpga.design.circuit.values import THERMAL_V, Circuit, Diode, knee_v

PF = 1e-12
LEAK_S = 1e-12
"""Leakage of each line, which gives undriven lines a level."""
FORWARD = 0.5
"""Share of the junction voltage above which its capacitance is linear, as in SPICE."""
OFF = float("nan")


@dataclasses.dataclass(frozen=True, eq=False)
class CircuitState:
    """Volts of the lines, columns before rows, and across the junctions of pressed switches."""

    lines: np.ndarray
    junctions: np.ndarray


@dataclasses.dataclass(frozen=True, eq=False)
class Drive:
    """Volts of the pins, columns before rows; :data:`OFF` where a pin does not drive."""

    volts: np.ndarray

    @classmethod
    def of(cls, columns: np.ndarray | float, rows: np.ndarray | float, network: Network) -> Drive:
        """A drive of all columns and rows; a single value is for all."""
        parts = np.full(network.columns, columns, float), np.full(network.rows, rows, float)
        return cls(np.concatenate(parts))


class Network:
    """A sheet with ``pressed`` switches, (rows, columns) bool; ``bare`` ones have no diode and conduct both ways.

    ``ohm``: resistances of the same shape, by default the circuit's ``switch_ohm``; ``bare`` switches have that.
    """

    def __init__(
        self, circuit: Circuit, pressed: np.ndarray, bare: np.ndarray | None = None, ohm: np.ndarray | None = None
    ):
        self.circuit = circuit
        self.pressed = np.asarray(pressed, bool)
        self.rows, self.columns = self.pressed.shape
        self.bare = np.zeros_like(self.pressed) if bare is None else np.broadcast_to(bare, self.pressed.shape)
        rows, columns = np.nonzero(self.pressed & ~self.bare)
        self.row_of, self.column_of = rows + self.columns, columns
        self.ohm = np.broadcast_to(circuit.switch_ohm if ohm is None else ohm, self.pressed.shape)
        self.cell_s = 1 / (self.ohm[rows, columns] + circuit.diode.series_ohm)
        self.farads = _capacitances(circuit, self.rows, self.columns)
        self.siemens = self._resistors()
        pulls = [1 / circuit.column_pull_ohm] * self.columns + [1 / circuit.row_pull_ohm] * self.rows
        self.pull_s = np.array(pulls)
        self.pull_v = np.array([circuit.supply_v] * self.columns + [0.0] * self.rows)

    def _resistors(self) -> np.ndarray:
        lines = self.rows + self.columns
        found = np.eye(lines) * LEAK_S
        rows, columns = np.nonzero(self.pressed & self.bare)
        found[columns, rows + self.columns] = found[rows + self.columns, columns] = -1 / self.circuit.switch_ohm
        counts = np.bincount(np.concatenate([columns, rows + self.columns]), minlength=lines)
        found[range(lines), range(lines)] += counts / self.circuit.switch_ohm
        return found

    def drive_s(self, drive: Drive) -> np.ndarray:
        """(lines,) siemens between each line and its pin's level; 0 for a pin that does not drive."""
        return np.where(np.isnan(drive.volts), 0.0, 1 / self.circuit.drive_ohm)

    def pin_amperes(self, lines: np.ndarray, drive: Drive) -> np.ndarray:
        """(..., lines) amperes out of each driving pin, for volts of the same shape."""
        return np.asarray(self.drive_s(drive) * (np.nan_to_num(drive.volts) - lines))

    def unpressed(self) -> CircuitState:
        """All lines and junctions at 0 V, to start a search."""
        return CircuitState(np.zeros(self.rows + self.columns), np.zeros(len(self.row_of)))


def _capacitances(circuit: Circuit, rows: int, columns: int) -> np.ndarray:
    """(lines, lines): charge of each line per volt of all lines."""
    between = np.zeros((rows + columns, rows + columns))
    between[:columns, columns:] = circuit.crossing_pf
    for start, count in ((0, columns), (columns, rows)):
        beside = np.arange(start, start + count - 1)
        between[beside, beside + 1] = circuit.neighbor_pf
    between += between.T
    ground = np.full(rows + columns, circuit.line_pf)
    if circuit.falling:
        ground[:columns] += circuit.falling.column_pf
    return np.asarray(PF * (np.diag(ground + between.sum(axis=1)) - between))


def charge(diode: Diode, volts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Charge of a junction in coulombs, and its capacitance in farads."""
    edge, power = FORWARD * diode.junction_v, 1 - diode.grading
    below = 1 - np.minimum(volts, edge) / diode.junction_v
    slope = below**-diode.grading
    above = np.maximum(volts - edge, 0)
    rise = slope * diode.grading / (diode.junction_v * (1 - FORWARD)) * (above > 0)
    whole = diode.junction_v / power * (1 - below**power) + above * (slope + rise * above / 2)
    return PF * diode.junction_pf * whole, PF * diode.junction_pf * (slope + rise * above)


def current(diode: Diode, volts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Current through a junction in amperes, and its conductance in siemens."""
    step = diode.emission * THERMAL_V
    grown = diode.saturation_a * np.exp(np.minimum(volts / step, 200.0))
    return grown - diode.saturation_a, grown / step


def held_back(diode: Diode, volts: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """A Newton guess far up the exponential, limited to the junction voltage of its current."""
    step, knee = diode.emission * THERMAL_V, knee_v(diode)
    far = (wanted > knee) & (np.abs(wanted - volts) > 2 * step)
    if not far.any():
        return wanted
    start = np.maximum(volts, 0.0)
    higher = start + step * np.log1p(np.maximum(wanted - start, 0.0) / step)
    return np.where(far, np.where(wanted > volts, higher, np.maximum(wanted, volts - 10 * step)), wanted)
