"""Tables of docs/maker.md."""

from __future__ import annotations

from collections.abc import Iterable

from contactfpga.design.circuit import SCHOTTKY, SILICON, Circuit, needed, static
from contactfpga.design.circuit.times import MARGIN, Time
from contactfpga_sim.lab import writer

SIZE = 16
PULLED = Circuit(series_ohm=33.0, column_pull_ohm=22_000.0, row_pull_ohm=5600.0)
DIODES = {"Schottky (BAT54's kind)": SCHOTTKY, "silicon (1N4148's kind)": SILICON}
PULLS_OHM = (1000.0, 2200.0, 4700.0, 10_000.0, 22_000.0, 47_000.0, 100_000.0)
SERIES_OHM = (0.0, 33.0, 100.0, 220.0, 470.0)
PIN_OHM = 2 * Circuit().pin_ohm
"""Resistance of both shorted pins."""


def diodes_table() -> str:
    rows = [["diode", "pressed column", "left to VIL", "touched row (reversal)", "left to VIH", "`settle_us`"]]
    rows[0].append("`release_us` without precharge")
    for name, diode in DIODES.items():
        needs = needed(PULLED.replace(diode=diode), SIZE, SIZE)
        rows.append(
            [name, *_level(needs.pressed), *_level(needs.touched), _us(needs.settle), _us(needs.pulled_release)]
        )
    return writer.table_of(rows)


def pulls_table() -> str:
    rows = [
        ["pull-up", "`release_us` without precharge", "`settle_us`", "row's pin, all columns pressed", "left to VIL"]
    ]
    for ohm in PULLS_OHM:
        needs = needed(PULLED.replace(column_pull_ohm=ohm), SIZE, SIZE)
        over = " (too much)" if needs.pressed.pin_ma > PULLED.pin_ma else ""
        current = f"{needs.pressed.pin_ma:.1f} mA{over}"
        rows.append(
            [_kilo(ohm), _us(needs.pulled_release), _us(needs.settle), current, f"{needs.pressed.margin_v:.2f} V"]
        )
    return writer.table_of(rows)


def series_table() -> str:
    rows = [["resistor at each pin", "two pins shorted to each other", "pulses while lines charge", "`settle_us`"]]
    rows[0].append("left to VIL")
    for ohm in SERIES_OHM:
        circuit = PULLED.replace(series_ohm=ohm)
        needs = needed(circuit, SIZE, SIZE)
        shorted = 1e3 * circuit.supply_v / (PIN_OHM + 2 * ohm)
        peak = max(needs.row_peak_ma, needs.column_peak_ma)
        margin = f"{static.scan(circuit, SIZE, SIZE).margin_v:.2f} V"
        rows.append([f"{ohm:g} Ω" if ohm else "none", f"{shorted:.1f} mA", f"{peak:.0f} mA", _us(needs.settle), margin])
    return writer.table_of(rows)


def _level(worst: static.Worst) -> Iterable[str]:
    return f"{worst.level_v:.2f} V", f"{worst.margin_v:.2f} V"


def _us(time: Time) -> str:
    us = time.us(MARGIN)
    return "never" if us is None else f"{us:.2f}"


def _kilo(ohm: float) -> str:
    return f"{ohm / 1000:g} kΩ"
