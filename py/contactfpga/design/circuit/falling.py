"""Charged columns that fall through resistive cells: the instant of a sample is a threshold of resistance.

A column's charge leaves through its cell, a diode and the selected row; the pin's leakage and the diodes of pressed
cells in other rows, which are held at the supply, add and subtract. The time to the pin's threshold is an integral over
the cell's current: dV = (R + n kT/q / (I + Is)) dI. Cells of a row that fall together share the row's resistance.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Iterator

import numpy as np

from contactfpga.design.circuit.network import PF, charge
from contactfpga.design.circuit.values import THERMAL_V, Circuit, CircuitError, Falling
from contactfpga.skin import Skin

STEPS, ROUNDS = 60, 12
SIXTEENTHS = 16
COLD_C, USUAL_C, HOT_C = -20.0, 27.0, 70.0
GRID_OHM = np.geomspace(200.0, 2e6, 61)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Corner:
    """Conditions under which columns fall."""

    celsius: float = USUAL_C
    threshold_v: float = 0.0
    """Difference from the usual threshold."""
    leak_a: float = 0.0
    """Current that a pin takes out of its column; below 0 it feeds it."""
    tolerance: float = 0.0
    """Relative difference of the column's capacitor."""
    together: int = 1
    """Columns that fall at once in the selected row."""
    others: int = 0
    """Pressed cells of the column in other rows."""
    beside: int = 0
    """Neighboring columns that fell earlier, 0 to 2; of a row that falls together none."""


def parts(circuit: Circuit) -> Falling:
    """The circuit's columns. Raises :class:`CircuitError` if they do not fall."""
    if circuit.falling is None:
        raise CircuitError("there is no [circuit.falling]; it states how columns fall through resistive cells")
    return circuit.falling


def fall_s(circuit: Circuit, ohm: np.ndarray | float, rows: int, corner: Corner | None = None) -> np.ndarray:
    """Seconds in which a column falls to its pin's threshold through a cell of ``ohm``, on a sheet of ``rows``;
    infinite if it never does."""
    corner, falling = corner or Corner(), parts(circuit)
    diode, resistance = circuit.diode.at(corner.celsius), np.atleast_1d(np.asarray(ohm, float))
    step, saturation = diode.emission * THERMAL_V, diode.saturation_a
    end_v = falling.threshold_v + corner.threshold_v
    line_pf = circuit.line_pf + rows * circuit.crossing_pf + 2 * circuit.neighbor_pf * (corner.together == 1)
    farads = PF * (falling.column_pf * (1 + corner.tolerance) + line_pf)
    reverse_v = end_v - circuit.supply_v
    farads += corner.others * np.diff(charge(diode, np.array([0.0, reverse_v]))[0])[0] / reverse_v
    fallen_v = circuit.supply_v - step * math.log1p(1e-6 / saturation)  # by neighbors, about
    pulled_pf_v = circuit.neighbor_pf * corner.beside * fallen_v + circuit.crossing_pf * circuit.supply_v
    start_v = circuit.supply_v - PF * pulled_pf_v / farads
    whole = resistance + diode.series_ohm + corner.together * circuit.drive_ohm
    first, last = (_amperes(volts, whole, step, saturation) for volts in (end_v, start_v))
    amperes = np.geomspace(first, last, STEPS)
    volts = amperes * whole + step * np.log1p(amperes / saturation)
    upward = (circuit.supply_v - volts) / circuit.column_pull_ohm + corner.others * saturation - corner.leak_a
    out = amperes - upward
    slope = (whole + step / (amperes + saturation)) * amperes / np.where(out > 0, out, np.nan)
    middle = (slope[1:] + slope[:-1]) / 2 * np.diff(np.log(amperes), axis=0)
    return np.asarray(np.nan_to_num(farads * middle.sum(axis=0), nan=np.inf))


def _amperes(volts: float, ohm: np.ndarray, step: float, saturation: float) -> np.ndarray:
    """Current at which resistance and junction take these volts, by Newton's method from above."""
    x = np.minimum(volts / step, np.log1p(volts / (ohm * saturation)))
    for _ in range(ROUNDS):
        grown = saturation * ohm * np.exp(x)
        x -= (grown - saturation * ohm + step * x - volts) / (grown + step)
    return np.asarray(saturation * np.expm1(x))


def ruler_s(circuit: Circuit, rows: int, columns: int, corner: Corner | None = None) -> float:
    """Seconds in which the columns fall together through the ruler."""
    alone = dataclasses.replace(corner or Corner(), together=columns, others=0, beside=0)
    return float(fall_s(circuit, parts(circuit).ruler_ohm, rows, alone)[0])


def read_ohm(circuit: Circuit, rows: int, seconds: np.ndarray | float, corner: Corner | None = None) -> np.ndarray:
    """The largest resistances of cells that read pressed at these instants; 0 if none does, infinite if all do."""
    times = np.log(fall_s(circuit, GRID_OHM, rows, corner))
    return np.asarray(np.exp(np.interp(np.log(seconds), times, np.log(GRID_OHM), -math.inf, math.inf)))


def corners(circuit: Circuit, rows: int, columns: int, leak_ua: float) -> Iterator[tuple[Corner, Corner]]:
    """The ruler's slowest column and a cell's, at all corners of temperature, threshold, leakage, capacitor and pressed
    neighbors. Temperature and threshold are those of both; leakage and capacitor are each column's own."""
    spread, tolerance, worst = parts(circuit).threshold_spread_v, parts(circuit).tolerance, leak_ua * 1e-6
    patterns: tuple[dict[str, int], ...] = (
        {},
        {"together": columns},
        {"together": columns, "others": rows - 1},
        {"beside": 2},
    )
    for celsius, threshold, leak, other, end, pattern in itertools.product(
        (COLD_C, USUAL_C, HOT_C), (-spread, 0.0, spread), (-worst, worst), (-worst, worst), (-1, 1), patterns
    ):
        ruler = Corner(celsius=celsius, threshold_v=threshold, leak_a=other, tolerance=tolerance)
        yield ruler, dataclasses.replace(ruler, leak_a=leak, tolerance=end * tolerance, **pattern)


def error_octaves(
    circuit: Circuit, rows: int, columns: int, ohm: np.ndarray | float, leak_ua: float, ruled: bool = True
) -> np.ndarray:
    """Largest deviation of the resistance that reads pressed, in octaves, over all :func:`corners` with this leakage:
    of samples at which cells of ``ohm`` usually do, as multiples of the ruler's time or, not ``ruled``, at their usual
    instants."""
    usual_s = fall_s(circuit, ohm, rows)
    ruler_usual_s, worst = ruler_s(circuit, rows, columns), np.zeros(usual_s.shape)
    for ruler, cell in corners(circuit, rows, columns, leak_ua):
        share = ruler_s(circuit, rows, columns, ruler) / ruler_usual_s if ruled else 1.0
        with np.errstate(divide="ignore"):
            worst = np.maximum(worst, np.abs(np.log2(read_ohm(circuit, rows, usual_s * share, cell) / ohm)))
    return worst


def sixteenths(circuit: Circuit, skin: Skin, ohm: float) -> int:
    """The Skin's ``ruler`` at which a cell of ``ohm`` usually just reads pressed. A board takes 1 to 255."""
    usual = fall_s(circuit, ohm, skin.row_lines)[0] / ruler_s(circuit, skin.row_lines, skin.columns)
    return round(float(min(usual * SIXTEENTHS, 1e6)))


@functools.lru_cache(maxsize=1024)
def latest_us(circuit: Circuit, rows: int, columns: int, ruler: int) -> float:
    """Time of the latest sample at all corners with a Skin's ``ruler``: the least settle time. Raises
    :class:`CircuitError` if the columns do not fall."""
    conditions = {ruler for ruler, _ in corners(circuit, rows, columns, 0.0)}
    most_us = max(1e6 * ruler_s(circuit, rows, columns, one) for one in conditions)
    if math.isinf(most_us):
        what = f"columns do not fall through the ruler: column_pull_ohm = {circuit.column_pull_ohm:g}, or hot diodes"
        raise CircuitError(f"{what}, feed them; leave that resistor out (1e8), and take silicon diodes")
    return most_us * max(ruler, SIXTEENTHS) / SIXTEENTHS


def check(circuit: Circuit, skin: Skin) -> None:
    """Raise :class:`CircuitError` if a Skin's columns cannot fall, or the settle time is too short for its sample."""
    if not skin.ruler:
        raise CircuitError("ruler is 0; [circuit.falling] needs a Skin with a ruler, such as ruler = 16")
    if (needed_us := latest_us(circuit, skin.row_lines, skin.columns, skin.ruler)) > skin.settle_us:
        late = f"with ruler = {skin.ruler} the latest sample comes after {needed_us:.1f} us"
        raise CircuitError(f"settle_us is {skin.settle_us:g}; {late}")
