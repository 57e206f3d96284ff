"""The sheet as a circuit: levels, currents and times of its lines, switches, diodes and pins.

Units are SI; capacitances are in pF and times in us where a name says so.
"""

from contactfpga.design.circuit.static import Problem, check, load_checked, problems
from contactfpga.design.circuit.times import Needs, check_times, needed, needed_by, recommended_us
from contactfpga.design.circuit.values import (
    DIODES,
    SCHOTTKY,
    SILICON,
    Circuit,
    CircuitError,
    Diode,
    load_circuit,
    write_circuit,
)

__all__ = [
    "DIODES",
    "SCHOTTKY",
    "SILICON",
    "Circuit",
    "CircuitError",
    "Diode",
    "Needs",
    "Problem",
    "check",
    "check_times",
    "load_checked",
    "load_circuit",
    "needed",
    "needed_by",
    "problems",
    "recommended_us",
    "write_circuit",
]
