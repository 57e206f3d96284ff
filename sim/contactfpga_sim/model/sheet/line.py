"""Settling lines in the compiled board: the sheet's circuit, reduced per clock."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from contactfpga.design.circuit import phases
from contactfpga.design.circuit.network import Network
from contactfpga.design.circuit.phases import Levels
from contactfpga.design.circuit.values import Circuit
from contactfpga.skin import Skin


@dataclasses.dataclass(frozen=True)
class ColumnLine:
    """A column settles exponentially to its pressed or its released level.

    Levels are shares of the way from supply to ground. Both exponentials cross the threshold when the circuit's column
    reaches the level that is guaranteed to be read.
    """

    press_s: tuple[float, ...]
    """Time constants toward pressed, by number of columns that the row pulls."""
    pulled: tuple[float, ...]
    """Final share of the way, by number of columns that the row pulls."""
    release_s: float
    """Time constant toward released."""
    threshold: float
    """Share at which the pin reads pressed."""

    @classmethod
    def of(
        cls, circuit: Circuit, rows: int, columns: int, diodes: str = "col2row", most: int | None = None
    ) -> ColumnLine:
        """The slowest column of a sheet with equally pressed rows, at most ``most`` switches each."""
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
        """Share of the way covered in this time."""
        return -math.expm1(-seconds / constant_s) if constant_s else 1.0


@dataclasses.dataclass(frozen=True)
class RowLine:
    """A released row settles, while columns drive, to the level to which pressed switches lift it, or to the untouched
    one. Levels are shares of the way from the untouched level to the columns'."""

    rise_s: tuple[float, ...]
    """Time constants toward touched, by the number of pressed switches."""
    lifted: tuple[float, ...]
    """Final share of the way, by the number of pressed switches."""
    fall_s: float
    """Time constant toward untouched."""
    threshold: float
    """Share at which the pin reads touched."""

    @classmethod
    def of(cls, circuit: Circuit, columns: int, diodes: str = "col2row") -> RowLine:
        """A row that is touched alone."""
        levels = Levels.of(circuit, diodes)
        threshold = levels.high / circuit.supply_v
        counts = [count for count in (1, 2, 4, 8, 16, 32) if count < columns] + [columns]
        found = [_lifted(circuit, levels, columns, count) for count in counts]
        wanted = np.arange(columns + 1)
        lifted = np.interp(wanted, counts, [share for _, share in found])
        seconds = np.interp(wanted, counts, [time_s for time_s, _ in found])
        reached = np.maximum(lifted, threshold * (1 + 1e-9))
        rise = seconds / -np.log1p(-threshold / reached)
        fall = phases.passed(phases.project_rows(_one_row(circuit, columns, 0), levels)).seconds
        return cls(tuple(rise.tolist()), tuple(lifted.tolist()), fall / math.log(1 / threshold), threshold)


def lines_of(circuit: Circuit, skin: Skin, most: int | None = None) -> tuple[ColumnLine, RowLine | None]:
    """Columns of a Skin's sheet, with at most ``most`` pressed switches per row, and rows if they are read."""
    if skin.guard:
        most = None  # the guard row presses all columns
    columns = ColumnLine.of(circuit, skin.row_lines, skin.column_lines, skin.diodes, most)
    return columns, RowLine.of(circuit, skin.column_lines, skin.diodes) if skin.reads_rows else None


def _one_row(circuit: Circuit, columns: int, count: int) -> Network:
    return Network(circuit, np.arange(columns)[None] < count)


def _lifted(circuit: Circuit, levels: Levels, columns: int, count: int) -> tuple[float, float]:
    """Seconds until a row reads touched, 0 if never, and its final share."""
    phase = phases.project_rows(_one_row(circuit, columns, count), levels, lifted=True)
    seconds = phases.passed(phase).seconds
    share = float(phases.rest_volts(phase)[columns]) / circuit.supply_v
    return (seconds if math.isfinite(seconds) else 0.0), share


def _alike(circuit: Circuit, rows: int, columns: int, count: int) -> Network:
    return Network(circuit, np.tile(np.arange(columns) < count, (rows, 1)))


def _pressed(circuit: Circuit, levels: Levels, rows: int, columns: int, count: int) -> tuple[float, float]:
    """Seconds until the last column reads pressed, 0 if never, and its final share."""
    phase = phases.settle(_alike(circuit, rows, columns, count), levels)
    share = 1 - float(phases.rest_volts(phase)[:count].max()) / circuit.supply_v
    done = phases.passed(phase)
    seconds = float(phase.arrived(done.trace.seconds, done.trace.volts)[:count].max())
    return (seconds if math.isfinite(seconds) else 0.0), share
