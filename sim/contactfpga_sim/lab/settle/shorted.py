"""Switches whose diode is shorted, under precharge: which current flows from row pin to row pin, and for how long."""

from __future__ import annotations

import dataclasses

import numpy as np

from contactfpga.design.circuit import Circuit, patterns, transient
from contactfpga.design.circuit.network import OFF, Drive, Network
from contactfpga_sim.lab.settle.breaks import PRECHARGE_US, SETTLE_US, SIZE, US

GAP_US = 1 / 24
"""A clock of 24 MHz."""
NAMES = ("precharge", "gap", "select", "gap")


@dataclasses.dataclass(frozen=True, eq=False)
class RowTime:
    """A row's time: what all lines do from the precharge on."""

    network: Network
    seconds: np.ndarray
    volts: np.ndarray
    amperes: np.ndarray
    """(n, lines) out of the pins that drive."""
    starts_us: tuple[float, ...]
    """Of the steps in :data:`NAMES`, and the end."""

    @property
    def column(self) -> np.ndarray:
        """Volts of the column with the faulty switches."""
        return self.volts[:, patterns.middle(self.network.columns)]

    def pin_ma(self, row: int) -> np.ndarray:
        """Out of the pin of a row."""
        return np.asarray(1e3 * self.amperes[:, self.network.columns + row])


def sheet(shorted: int, circuit: Circuit | None = None) -> Network:
    """A sheet with a pressed switch in the selected row, and this many more in its column whose diodes are shorted."""
    row, column = patterns.middle(SIZE), patterns.middle(SIZE)
    pressed, bare = np.zeros((2, SIZE, SIZE), bool)
    others = [other for other in range(SIZE) if other != row][:shorted]
    pressed[[row, *others], column] = True
    bare[others, column] = True
    return Network(circuit or Circuit(), pressed, bare)


def row_time(network: Network) -> RowTime:
    """One row of the scan, after one with the same pressed switches and a gap."""
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
    """For how long the pin of a row carries more than this."""
    flows = np.abs(found.pin_ma(row)) > above_ma
    steps = np.diff(found.seconds)
    return float(US * steps[flows[1:] & flows[:-1]].sum())
