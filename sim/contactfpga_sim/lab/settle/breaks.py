"""Knobs of the sheet's circuit under precharge, turned until a time or a level is missed."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from contactfpga.design.circuit import Circuit, patterns, phases
from contactfpga.design.circuit.network import Network
from contactfpga.design.circuit.phases import Levels

SETTLE_US, PRECHARGE_US = 0.5, 0.25
"""Times of a fast scan."""
SIZE = 16
US = 1e6


@dataclasses.dataclass(frozen=True)
class Knob:
    """A value of the circuit that is turned, and what must stay on one side of a limit."""

    title: str
    axis: str
    """What is turned, with its unit."""
    outcome: str
    """What is computed, with its unit."""
    values: tuple[float, ...]
    runs: Mapping[str, Callable[[float], float]]
    limit: float
    below: bool
    """The outcome must stay below the limit."""
    breaks: str
    helps: str


def holds(knob: Knob, outcome: float) -> bool:
    """It is on the right side."""
    return outcome <= knob.limit if knob.below else outcome >= knob.limit


def edge(knob: Knob, outcomes: Sequence[float]) -> tuple[float | None, float | None]:
    """The last value that holds before the first that does not, and that one."""
    first = next((index for index, one in enumerate(outcomes) if not holds(knob, one)), len(outcomes))
    return (knob.values[first - 1] if first else None), (knob.values[first] if first < len(outcomes) else None)


@functools.cache
def turned(knob_name: str) -> dict[str, list[float]]:
    """The outcomes of every run of a knob."""
    knob = KNOBS[knob_name]
    return {name: [run(value) for value in knob.values] for name, run in knob.runs.items()}


def _settle_us(circuit: Circuit, names: Sequence[str], size: int = SIZE) -> float:
    found = []
    for name in names:
        phase = phases.settle(Network(circuit, patterns.named(size, size)[name]), Levels.of(circuit))
        found.append(US * phases.passed(phase).seconds)
    return max(found)


def _dip_v(circuit: Circuit, picofarad: float) -> float:
    network = Network(circuit.replace(neighbor_pf=picofarad), patterns.named(SIZE, SIZE)["one row but a cell"])
    trace = phases.passed(phases.settle(network, Levels.of(circuit))).trace
    return float(trace.volts[:, patterns.middle(SIZE)].min())


def _contact_us(circuit: Circuit, ohms: float) -> float:
    names = ("all", "all, every other cell of the row")
    return _settle_us(circuit.replace(switch_ohm=ohms), names)


def _line_us(ohms: float, picofarad: float) -> float:
    return _settle_us(Circuit(line_ohm=ohms, line_pf=picofarad), ("all",))


def _columns_us(pattern: str, columns: float) -> float:
    return _settle_us(Circuit(), (pattern,), int(columns))


KNOBS = {
    "coupling": Knob(
        title="Lines that lie close",
        axis="capacitance to each neighbor, pF",
        outcome="lowest level of the one unpressed column of a row, V",
        values=tuple(np.geomspace(1, 100, 25).round(2).tolist()),
        runs={
            "16x16, 30 pF a line": functools.partial(_dip_v, Circuit()),
            "the same, 100 pF a line": functools.partial(_dip_v, Circuit(line_pf=100.0)),
        },
        limit=Circuit().high_v,
        below=False,
        breaks="an unpressed column is below VIH",
        helps="a grounded trace between lines; more capacitance to ground; a smaller keeper and a longer `settle_us`",
    ),
    "contacts": Knob(
        title="Slow contacts",
        axis="resistance of a closed switch, ohm",
        outcome="time to settle, µs",
        values=tuple(np.geomspace(50, 10_000, 25).round().tolist()),
        runs={
            "16x16, 30 pF a line": functools.partial(_contact_us, Circuit()),
            "the same, 100 pF a line": functools.partial(_contact_us, Circuit(line_pf=100.0)),
        },
        limit=SETTLE_US,
        below=True,
        breaks="a pressed column is not yet below VIL after 0.5 µs",
        helps="contacts of less resistance; a longer `settle_us`",
    ),
    "lines": Knob(
        title="Long lines",
        axis="capacitance of a line, pF",
        outcome="time to settle, µs",
        values=tuple(np.geomspace(10, 1000, 25).round().tolist()),
        runs={
            "16x16, lines of 0 Ω": functools.partial(_line_us, 0.0),
            "lines of 50 Ω": functools.partial(_line_us, 50.0),
            "lines of 100 Ω": functools.partial(_line_us, 100.0),
        },
        limit=SETTLE_US,
        below=True,
        breaks="a pressed column is not yet below VIL after 0.5 µs",
        helps="wider traces; a sheet in parts; a longer `settle_us`",
    ),
    "columns": Knob(
        title="Many columns at one row",
        axis="rows and columns",
        outcome="time to settle, µs",
        values=(8, 16, 24, 32, 40, 48, 56, 64),
        runs={
            "one row pressed": functools.partial(_columns_us, "one row"),
            "the whole sheet pressed": functools.partial(_columns_us, "all"),
        },
        limit=SETTLE_US,
        below=True,
        breaks="a pressed column is not yet below VIL after 0.5 µs",
        helps="a longer `settle_us`; stronger row drivers; diodes of less capacitance",
    ),
}
"""Every knob by its name."""
