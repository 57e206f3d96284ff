"""Knobs of the circuit under precharge, moved until a time or level is missed."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from contactfpga.design.circuit import Circuit, patterns, phases
from contactfpga.design.circuit.network import Network
from contactfpga.design.circuit.phases import Levels
from contactfpga_sim.lab.knobs import Knob, Outcome, Sweep

SETTLE_US, PRECHARGE_US = 0.5, 0.25
SIZE = 16
HIGH_V = Circuit().high_v
"""Level below which a column reads as pressed or unclear."""
US = 1e6


@functools.cache
def sweeps(name: str) -> dict[str, Sweep]:
    return KNOBS[name].sweep()


def _settled(circuit: Circuit, names: Sequence[str], size: int = SIZE) -> Outcome:
    found = []
    for name in names:
        phase = phases.settle(Network(circuit, patterns.named(size, size)[name]), Levels.of(circuit))
        found.append(US * phases.passed(phase).seconds)
    what = f"a pressed column is not yet below VIL after {SETTLE_US:g} µs"
    return Outcome(max(found) <= SETTLE_US, what=what, amount=max(found))


def _dip(circuit: Circuit, picofarad: float) -> Outcome:
    network = Network(circuit.replace(neighbor_pf=picofarad), patterns.named(SIZE, SIZE)["one row but a cell"])
    trace = phases.passed(phases.settle(network, Levels.of(circuit))).trace
    lowest = float(trace.volts[:, patterns.middle(SIZE)].min())
    return Outcome(lowest >= HIGH_V, what="an unpressed column is below VIH", amount=lowest)


def _contact(circuit: Circuit, ohms: float) -> Outcome:
    names = ("all", "all, every other cell of the row")
    return _settled(circuit.replace(switch_ohm=ohms), names)


def _line(ohms: float, picofarad: float) -> Outcome:
    return _settled(Circuit(line_ohm=ohms, line_pf=picofarad), ("all",))


def _columns(pattern: str, columns: float) -> Outcome:
    return _settled(Circuit(), (pattern,), int(columns))


KNOBS = {
    knob.name: knob
    for knob in (
        Knob(
            name="coupling",
            title="Lines that lie close",
            axis="capacitance to each neighbor, pF",
            values=tuple(np.geomspace(1, 100, 25).round(2).tolist()),
            runs={
                "16x16, 30 pF a line": functools.partial(_dip, Circuit()),
                "the same, 100 pF a line": functools.partial(_dip, Circuit(line_pf=100.0)),
            },
            helps="a grounded trace between lines; more capacitance to ground; a smaller keeper and a longer "
            "`settle_us`",
        ),
        Knob(
            name="contacts",
            title="Slow contacts",
            axis="resistance of a closed switch, ohm",
            values=tuple(np.geomspace(50, 10_000, 25).round().tolist()),
            runs={
                "16x16, 30 pF a line": functools.partial(_contact, Circuit()),
                "the same, 100 pF a line": functools.partial(_contact, Circuit(line_pf=100.0)),
            },
            helps="contacts of less resistance; a longer `settle_us`",
        ),
        Knob(
            name="lines",
            title="Long lines",
            axis="capacitance of a line, pF",
            values=tuple(np.geomspace(10, 1000, 25).round().tolist()),
            runs={
                "16x16, lines of 0 Ω": functools.partial(_line, 0.0),
                "lines of 50 Ω": functools.partial(_line, 50.0),
                "lines of 100 Ω": functools.partial(_line, 100.0),
            },
            helps="wider traces; a sheet in parts; a longer `settle_us`",
        ),
        Knob(
            name="columns",
            title="Many columns at one row",
            axis="rows and columns",
            values=(8, 16, 24, 32, 40, 48, 56, 64),
            runs={
                "one row pressed": functools.partial(_columns, "one row"),
                "the whole sheet pressed": functools.partial(_columns, "all"),
            },
            helps="a longer `settle_us`; stronger row drivers; diodes of less capacitance",
        ),
    )
}
