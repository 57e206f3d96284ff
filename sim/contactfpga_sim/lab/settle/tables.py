"""Currents through switches with shorted diodes; tables and pictures of docs/settle.md."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from contactfpga.design.circuit import SILICON, Circuit, needed, patterns, problems, transient
from contactfpga.design.circuit.network import OFF, Drive, Network
from contactfpga.design.circuit.times import MARGIN, Time
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.settle import breaks
from contactfpga_sim.lab.settle.breaks import PRECHARGE_US, SETTLE_US, SIZE, US
from contactfpga_sim.model.sheet import agreement
from contactfpga_sim.model.sheet.agreement import SpiceComparison

GAP_US = 1 / 24
NAMES = ("precharge", "gap", "select", "gap")


@dataclasses.dataclass(frozen=True, eq=False)
class RowTime:
    """All lines during a row time, from its precharge on."""

    network: Network
    seconds: np.ndarray
    volts: np.ndarray
    amperes: np.ndarray
    """(n, lines) out of the driving pins."""
    starts_us: tuple[float, ...]
    """Starts of the steps in :data:`NAMES`, and the end."""

    @property
    def column(self) -> np.ndarray:
        """Volts of the column with faulty switches."""
        return self.volts[:, patterns.middle(self.network.columns)]

    def pin_ma(self, row: int) -> np.ndarray:
        """Current out of a row's pin."""
        return np.asarray(1e3 * self.amperes[:, self.network.columns + row])


def sheet(shorted: int, circuit: Circuit | None = None) -> Network:
    """A sheet with a pressed switch in the selected row, and ``shorted`` more in its column with shorted diodes."""
    row, column = patterns.middle(SIZE), patterns.middle(SIZE)
    pressed, bare = np.zeros((2, SIZE, SIZE), bool)
    others = [other for other in range(SIZE) if other != row][:shorted]
    pressed[[row, *others], column] = True
    bare[others, column] = True
    return Network(circuit or Circuit(), pressed, bare)


def row_time(network: Network) -> RowTime:
    """A row time, after a row with the same pressed switches and a gap."""
    supply = network.circuit.supply_v
    selected = np.full(network.rows, supply)
    selected[patterns.middle(network.rows)] = 0.0
    drives = (
        Drive.of(supply, supply, network),
        Drive.of(OFF, supply, network),
        Drive.of(OFF, selected, network),
        Drive.of(OFF, supply, network),
    )
    lasts = (PRECHARGE_US, GAP_US, SETTLE_US, GAP_US)
    before = transient.at_rest(network, drives[2])
    state, now = transient.run(network, drives[1], before, GAP_US / US).end, 0.0
    seconds, volts, amperes, starts = [], [], [], [0.0]
    for drive, last_us in zip(drives, lasts):
        trace = transient.run(network, drive, state, last_us / US)
        seconds.append(now + trace.seconds)
        volts.append(trace.volts)
        amperes.append(network.pin_amperes(trace.volts, drive))
        state, now = trace.end, now + last_us / US
        starts.append(now * US)
    return RowTime(network, np.concatenate(seconds), np.concatenate(volts), np.concatenate(amperes), tuple(starts))


def flowing_us(found: RowTime, row: int, above_ma: float = 1.0) -> float:
    """Time for which a row's pin carries more than ``above_ma``."""
    flows = np.abs(found.pin_ma(row)) > above_ma
    steps = np.diff(found.seconds)
    return float(US * steps[flows[1:] & flows[:-1]].sum())


SHEETS = {
    "nominal": (16, Circuit()),
    "silicon diodes": (16, Circuit(diode=SILICON)),
    "switches of 500 Ω, 100 pF a line": (16, Circuit(switch_ohm=500.0, line_pf=100.0)),
    "switches of 1 kΩ, 50 pF a line": (16, Circuit(switch_ohm=1000.0, line_pf=50.0)),
    "10 pF to each neighbor": (16, Circuit(neighbor_pf=10.0)),
    "5 pF a crossing": (16, Circuit(crossing_pf=5.0)),
    "keepers of 10 kΩ": (16, Circuit(column_pull_ohm=10_000.0)),
    "64x64, rows pulled by 27 kΩ": (64, Circuit(row_pull_ohm=27_000.0)),
    "64x64, keepers of 27 kΩ too": (64, Circuit(row_pull_ohm=27_000.0, column_pull_ohm=27_000.0)),
}


SHOWN = [list(SHEETS)[number] for number in (0, 2, 7)]
"""Sheets that the page shows."""


def needs_table() -> writer.Table:
    rows = []
    for name, (size, circuit) in SHEETS.items():
        needs = needed(circuit, size, size)
        times = (needs.precharge, needs.settle, needs.release, needs.project, needs.project_columns)
        marks = "" if not problems(circuit, size, size, projects=True) else " (cannot work)"
        rows.append([name + marks, *map(_us, times), _us(needs.pulled_release)])
    head = ("16x16 unless said", "precharge", "settle", "release", "project rows", "columns", "without precharge")
    return writer.Table(head, rows, lambda row: row[0] in SHOWN)


def _us(time: Time) -> str:
    us = time.us(MARGIN)
    return "never" if us is None else f"{us:.2f}"


@functools.cache
def compared() -> tuple[SpiceComparison, ...]:
    return tuple(map(agreement.compared, agreement.cases()))


def summary_table() -> str:
    rows = [["phase", "circuits", "largest difference"]]
    for name in agreement.PHASES:
        errors = [abs(one.error) for one in compared() if one.case.phase.name == name]
        rows.append([name, str(len(errors)), f"{100 * max(errors):.2f} %"])
    rows.append(["all", str(len(compared())), f"{100 * max(abs(one.error) for one in compared()):.2f} %"])
    return writer.table_of(rows)


def breaks_table() -> writer.Table:
    """The page shows the first circuit of each knob."""
    rows = []
    for name, knob in breaks.KNOBS.items():
        for number, (run, sweep) in enumerate(breaks.sweeps(name).items()):
            last, first = sweep.holds_until, sweep.breaks_at
            rows.append(
                [
                    f"{knob.title}: {knob.axis}" if not number else "",
                    run,
                    "nowhere" if last is None else f"{last:,g}",
                    "" if first is None else f"**{first:,g}**",
                    "nothing" if sweep.broken is None else sweep.outcomes[sweep.broken].what,
                    knob.helps if not number else "",
                ]
            )
    head = ("knob", "circuit", "holds until", "breaks at", "what breaks", "what helps")
    return writer.Table(head, rows, lambda row: row[0], (head[0], *head[2:4], head[5]))


def shorted_table() -> str:
    head = ["shorted diodes in the column", "level of the column", "out of each of their rows' pins"]
    rows = [[*head, "into the selected row's pin", "for, per scan of 16 rows"]]
    row = patterns.middle(breaks.SIZE)
    for count in (0, 1, 2, 3, 7):
        found = row_time(sheet(count))
        end = found.starts_us.index(found.starts_us[3])
        last = int((found.seconds * breaks.US <= found.starts_us[end] * (1 - 1e-9)).nonzero()[0][-1])
        each, into = found.pin_ma(0)[last], -found.pin_ma(row)[last]
        flows = flowing_us(found, row) if count else 0.0
        rows.append(
            [
                str(count),
                f"{found.column[last]:.2f} V",
                f"{each:.1f} mA",
                f"{into:.1f} mA",
                f"{flows:.2f} µs" if count else "",
            ]
        )
    return writer.table_of(rows)
