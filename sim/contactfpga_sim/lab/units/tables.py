"""The table of docs/units.md: times of a sweep, and its share of the line."""

from __future__ import annotations

from contactfpga.skin import Skin
from contactfpga.skin.derived import CHECK_BYTES
from contactfpga.wire.units import plain_bytes
from contactfpga_sim.lab import writer

COUNTS = 1, 3, 6, 8
SHOWN = 6


def units_table() -> writer.Table:
    head = (
        "converter",
        "units",
        "supply",
        "SPI clock",
        "sweep",
        "sweeps per second",
        "packet",
        "at 3 Mbaud",
        "at 12 Mbaud",
    )
    rows = [_row(Skin(units=count, converter_v=supply_v)) for supply_v in (3.3, 5.0) for count in COUNTS]
    rows += [_row(Skin(units=count, converter="ads131m08")) for count in COUNTS[1:]]
    columns = ("converter", "supply", "sweep", "packet", "at 3 Mbaud", "at 12 Mbaud")
    return writer.Table(head, rows, lambda row: row[1] == str(SHOWN), columns)


def _row(skin: Skin) -> tuple[str, ...]:
    units = skin.derived.units
    sweep_us = round(units.sweep_clocks / skin.clock_hz * 1e6, 1)
    packet = 1 + plain_bytes(skin.units, units.converter.bits) + CHECK_BYTES + 1
    spi_mhz = skin.clock_hz / (2 * units.level_clocks) / 1e6
    of_units = (units.converter.title, f"{skin.units}", f"{skin.converter_v:g} V", f"{spi_mhz:g} MHz")
    of_sweep = (f"{sweep_us:g} µs", f"{1e6 / sweep_us:,.0f}")
    return *of_units, *of_sweep, f"{packet} bytes", *(f"{10 * packet / megabaud:.0f} µs" for megabaud in (3, 12))
