"""A sheet of resistive cells: the time in which each column falls through each, from the forces on them."""

from __future__ import annotations

import dataclasses

import numpy as np

from contactfpga.design.circuit import Circuit, falling
from contactfpga.design.circuit.falling import GRID_OHM, Corner
from contactfpga.design.cover import ResistiveCell
from contactfpga.skin import Skin

LEAK_SHARE = 0.1
"""Largest leakage drawn for a pin, of the data sheet's limit: an assumption."""
REST_V = 0.4
"""Level at which a column stays above ground, about, by its diode."""


@dataclasses.dataclass(eq=False)
class FallingSheet:
    """Cells, capacitors and pins of one sheet, drawn with ``seed``, at ``celsius``."""

    skin: Skin
    circuit: Circuit
    cell: ResistiveCell
    celsius: float = 25.0
    seed: int = 0

    def __post_init__(self) -> None:
        rows, columns = self.skin.row_lines, self.skin.column_lines
        parts, rng = falling.parts(self.circuit), np.random.default_rng([self.seed, 1])
        leak_a = LEAK_SHARE * 1e-6 * parts.leak_ua * rng.uniform(-1, 1, columns)
        caps, spread = parts.tolerance * rng.uniform(-1, 1, columns), parts.threshold_spread_v
        self.threshold_v = float(rng.uniform(-spread, spread))  # less the usual one; of the FPGA
        self._corners = [
            Corner(celsius=self.celsius, threshold_v=self.threshold_v, leak_a=leak, tolerance=cap)
            for leak, cap in zip(leak_a.tolist(), caps.tolist())
        ]
        ruler = [falling.ruler_s(self.circuit, rows, self.skin.columns, corner) for corner in self._corners]
        alone = [falling.fall_s(self.circuit, parts.ruler_ohm, rows, self._corners[-1])[0]] * self.skin.rows
        self._times = np.full((rows, columns), np.inf)
        self._times[-1, :-1], self._times[:-1, -1] = ruler[:-1], alone
        self._falls = [
            [self._logs(dataclasses.replace(corner, others=others)) for corner in self._corners[:-1]]
            for others in (0, self.skin.rows - 1)
        ]
        self._gains, self._preload_n = self.cell.drawn((self.skin.rows, self.skin.columns), self.seed)
        self._force_n, self._since = self._preload_n, np.zeros(self._preload_n.shape)
        self._lowers = np.zeros(self._preload_n.shape, bool)

    def _logs(self, corner: Corner) -> np.ndarray:
        return np.log(np.minimum(falling.fall_s(self.circuit, GRID_OHM, self.skin.row_lines, corner), 1.0))

    def ohm(self, force_n: np.ndarray, seconds: float) -> np.ndarray:
        """(rows, columns) resistances under forces, with preload, creep and hysteresis of the calls before."""
        force = np.maximum(force_n, 0.0) + self._preload_n
        self._lowers = np.where(force == self._force_n, self._lowers, force < self._force_n)
        self._since = np.where(
            (force >= self.cell.break_n) & (self._force_n >= self.cell.break_n), self._since, seconds
        )
        self._force_n = force
        decades = np.log10(np.maximum(1.0, seconds - self._since))
        share = (1 - self.cell.creep * decades) * (1 - self.cell.hysteresis * self._lowers)
        return np.maximum(self._gains * share * self.cell.ohm(force, self.celsius), self.cell.least_ohm)

    def times_s(self, ohm: np.ndarray) -> np.ndarray:
        """(row lines, column lines) seconds of each column's fall through each cell, and through the ruler."""
        closed = np.isfinite(ohm)
        others = np.maximum(closed.sum(axis=0) - closed, 0) / max(1, self.skin.rows - 1)
        logs = np.log(np.where(closed, ohm, GRID_OHM[-1]))
        found = self._times.copy()
        for column in range(self.skin.columns):
            alone, among = (np.interp(logs[:, column], np.log(GRID_OHM), each[column]) for each in self._falls)
            found[:-1, column] = np.exp(alone + others[:, column] * (among - alone))
        return found

    @property
    def threshold(self) -> float:
        """Share of the way to ground at which the pins read pressed."""
        return 1 - (falling.parts(self.circuit).threshold_v + self.threshold_v) / self.circuit.supply_v

    @property
    def end(self) -> float:
        """Share of the way at which a column stays."""
        return 1 - REST_V / self.circuit.supply_v
