"""Levels of force as the soft kit's own gateware reads them, from the resistances of its cells."""

from __future__ import annotations

import numpy as np

from contactfpga.design.circuit import Circuit, falling
from contactfpga.design.circuit.falling import Corner
from contactfpga.skin import Skin
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.board.receiver import Receiver
from contactfpga_sim.model.sheet.falling import REST_V

SCANS = 2.4
"""Time, in scans, after which a frame has come whose scan began with the present cells."""


class LevelReader:
    """A compiled board of a Skin with levels."""

    def __init__(self, skin: Skin):
        self._board, self._receiver, self._skin = CompiledBoard(skin), Receiver(skin), skin

    def read(self, ohm: np.ndarray, circuit: Circuit, leak_a: float = 0.0) -> np.ndarray:
        """(rows, columns) levels in the board's map under cells of these resistances (infinite: open), each of which
        falls as if it were alone, with this leakage of its pin."""
        skin, volts = self._skin, falling.parts(circuit).threshold_v
        seconds = np.full((skin.row_lines, skin.column_lines), falling.ruler_s(circuit, skin.row_lines, skin.columns))
        known = falling.fall_s(circuit, falling.GRID_OHM, skin.row_lines, Corner(leak_a=leak_a))
        logs = np.log(np.minimum(ohm, falling.GRID_OHM[-1]))
        seconds[:-1, :-1] = np.exp(np.interp(logs, np.log(falling.GRID_OHM), np.log(known)))
        self._board.fall(seconds, 1 - REST_V / circuit.supply_v, 1 - volts / circuit.supply_v)
        pressed = np.ones((1, skin.rows, skin.columns), bool)
        self._board.hold(pressed, round(SCANS * skin.derived.frame_clocks))
        *_, last = self._receiver.take(enumerate(self._board.receive()))
        assert last.frame.levels is not None
        return last.frame.levels
