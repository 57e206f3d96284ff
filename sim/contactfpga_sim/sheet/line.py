"""Columns that take time, as the compiled board has them: what is left of the sheet's circuit at each clock."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from contactfpga.circuit import phases
from contactfpga.circuit.network import Network
from contactfpga.circuit.phases import Levels
from contactfpga.circuit.values import Circuit


@dataclasses.dataclass(frozen=True)
class Line:
    """A column goes exponentially to the level that a pressed switch pulls it to, or back to the released one.

    Levels are shares of the way from the supply to ground. Both exponentials cross the threshold when the circuit's
    column crosses the level from which on it is surely read.
    """

    press_s: tuple[float, ...]
    """Time constants toward pressed, by how many columns the selected row pulls."""
    pulled: tuple[float, ...]
    """Share of the way at which a column comes to rest, by the same number."""
    release_s: float
    """Time constant toward released."""
    threshold: float
    """Share at which the pin reads pressed."""

    @classmethod
    def of(cls, circuit: Circuit, rows: int, columns: int, diodes: str = "col2row", most: int | None = None) -> Line:
        """Of a sheet whose rows are all pressed alike, the slowest; with at most ``most`` pressed switches a row."""
        levels = Levels.of(circuit, diodes)
        threshold = 1 - levels.low / circuit.supply_v
        counts = [count for count in (1, 2, 4, 8, 16, 32) if count < (most or columns)] + [most or columns]
        found = [_pressed(circuit, levels, rows, columns, count) for count in counts]
        wanted = np.arange(columns + 1)
        pulled = np.interp(wanted, counts, [share for _, share in found])
        seconds = np.interp(wanted, counts, [time_s for time_s, _ in found])
        reached = np.maximum(pulled, threshold * (1 + 1e-9))  # one that stays below it never reads pressed
        press = seconds / -np.log1p(-threshold / reached)
        release = phases.passed(phases.pulled_release(_alike(circuit, rows, columns, counts[-1]), levels)).seconds
        start = max(float(pulled[counts[-1]]), 1 - levels.high / circuit.supply_v)
        release_s = release / math.log(start / threshold) if start > threshold else release
        return cls(tuple(press.tolist()), tuple(pulled.tolist()), release_s, threshold)

    @staticmethod
    def share(constant_s: float, seconds: float) -> float:
        """How much of its way a level goes in this time."""
        return -math.expm1(-seconds / constant_s) if constant_s else 1.0


def _alike(circuit: Circuit, rows: int, columns: int, count: int) -> Network:
    """This many pressed switches in each row, side by side."""
    return Network(circuit, np.tile(np.arange(columns) < count, (rows, 1)))


def _pressed(circuit: Circuit, levels: Levels, rows: int, columns: int, count: int) -> tuple[float, float]:
    """Seconds until the last column reads pressed, 0 if that is never, and the share at which it comes to rest."""
    phase = phases.settle(_alike(circuit, rows, columns, count), levels)
    share = 1 - float(phases.rest_volts(phase)[:count].max()) / circuit.supply_v
    done = phases.passed(phase)
    seconds = float(phase.arrived(done.trace.seconds, done.trace.volts)[:count].max())
    return (seconds if math.isfinite(seconds) else 0.0), share
