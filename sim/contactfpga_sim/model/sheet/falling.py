"""A sheet of resistive cells: the time in which a column falls through each, from the forces on them."""

from __future__ import annotations

import dataclasses

import numpy as np

from contactfpga.design.circuit import Circuit, falling
from contactfpga.design.circuit.falling import GRID_OHM, Corner
from contactfpga.design.cover import ResistiveCell
from contactfpga.skin import Skin

REST_V = 0.4
"""Level at which a column stays above ground, about, by its diode."""


class FallingSheet:
    """A sheet at ``celsius`` whose cells and preload are drawn with ``seed``, on usual columns and pins.

    ``threshold`` and ``end`` are the shares of the way to ground at which pins read pressed, and columns stay.
    """

    def __init__(self, skin: Skin, circuit: Circuit, cell: ResistiveCell, celsius: float = 25.0, seed: int = 0):
        self.cell, self._celsius, self._others = cell, celsius, max(1, skin.rows - 1)
        volts, corner = falling.parts(circuit).threshold_v, Corner(celsius=celsius)
        self.threshold, self.end = 1 - volts / circuit.supply_v, 1 - REST_V / circuit.supply_v
        among = dataclasses.replace(corner, others=self._others)
        self._logs = [np.log(falling.fall_s(circuit, GRID_OHM, skin.row_lines, one)) for one in (corner, among)]
        self._times_s = np.full((skin.row_lines, skin.column_lines), np.inf)
        self._times_s[-1, :-1] = falling.ruler_s(circuit, skin.row_lines, skin.columns, corner)
        self._times_s[:-1, -1] = falling.fall_s(circuit, falling.parts(circuit).ruler_ohm, skin.row_lines, corner)
        self._gains, self._preload_n = cell.drawn((skin.rows, skin.columns), seed)
        self._force_n, self._since, self._lowers = self._preload_n, 0 * self._gains, self._gains < 0

    def ohm(self, force_n: np.ndarray, seconds: float) -> np.ndarray:
        """(rows, columns) resistances under forces, with preload, creep and hysteresis of the calls before."""
        force = np.maximum(force_n, 0.0) + self._preload_n
        self._lowers = np.where(force == self._force_n, self._lowers, force < self._force_n)
        lasts = np.minimum(force, self._force_n) >= self.cell.break_n
        self._since, self._force_n = np.where(lasts, self._since, seconds), force
        return self._gains * self.cell.ohm(force, self._celsius, seconds - self._since, self._lowers)

    def times_s(self, ohm: np.ndarray) -> np.ndarray:
        """(row lines, column lines) seconds of each column's fall through each cell, and through the ruler."""
        closed, found = np.isfinite(ohm), self._times_s.copy()
        logs = np.log(np.minimum(ohm, GRID_OHM[-1]))
        alone, among = (np.interp(logs, np.log(GRID_OHM), each) for each in self._logs)
        found[:-1, :-1] = np.exp(alone + (closed.sum(axis=0) - closed) / self._others * (among - alone))
        return found
