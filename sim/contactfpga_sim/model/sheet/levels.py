"""What a faulty sheet reads as a circuit, row by row, once its columns have settled."""

from __future__ import annotations

import numpy as np

from contactfpga.design.circuit import Circuit, phases
from contactfpga.design.circuit.network import Network
from contactfpga.design.circuit.phases import Levels


def at_rest(circuit: Circuit, cells: np.ndarray, bare: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Of (rows, columns) bool pressed cells, scanned row by row: those that read pressed, those whose level is neither
    low nor high, and the most that a pin of a row that is not selected carries, in A."""
    levels, network = Levels.of(circuit), Network(circuit, cells, bare)
    read, undefined, most = np.zeros_like(cells), np.zeros_like(cells), 0.0
    for row in range(len(cells)):
        phase = phases.settle(network, levels, row)
        volts, drive = phases.rest_volts(phase), phase.drives[-1]
        columns = volts[: network.columns]
        read[row] = columns <= levels.low
        undefined[row] = (columns > levels.low) & (columns < levels.high)
        most = max(most, float(np.delete(network.pin_amperes(volts, drive), network.columns + row).max()))
    return read, undefined, most
