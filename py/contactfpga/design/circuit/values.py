"""The values of a sheet's circuit, and the table `[circuit]` of a Skin's file."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import field
from pathlib import Path
from typing import Any

from contactfpga.errors import ContactFPGAError
from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import is_finite, shown

THERMAL_V = 8.617333e-5 * 300.15
"""k T / q at 27 degrees Celsius, SPICE's default."""


class CircuitError(ContactFPGAError, ValueError):
    """An impossible or unworkable circuit."""


def _check_limits(where: str, values: Diode | Falling | Circuit) -> None:
    for one in dataclasses.fields(values):
        if not one.metadata:
            continue
        value, (low, high, *unit) = getattr(values, one.name), one.metadata["limits"]
        if not is_finite(value) or not low <= float(value) <= high:
            ends = " ".join([f"{low:.12g} and {high:.12g}", *unit])
            raise CircuitError(f"{one.name} in [{where}] is {shown(value)}; it must lie between {ends}")


@dataclasses.dataclass(frozen=True)
class Diode:
    """A Shockley junction with series resistance and depletion charge: SPICE's IS, N, RS, CJO, VJ and M."""

    saturation_a: float = field(metadata={"limits": (1e-18, 1e-3, "A"), "spice": "IS"})
    """Saturation current."""
    emission: float = field(metadata={"limits": (0.5, 5.0), "spice": "N"})
    """Emission coefficient."""
    series_ohm: float = field(metadata={"limits": (0.0, 1000.0, "ohm"), "spice": "RS"})
    """Series resistance."""
    junction_pf: float = field(metadata={"limits": (0.0, 1000.0, "pF"), "spice": "CJO"})
    """Junction capacitance at 0 V."""
    junction_v: float = field(metadata={"limits": (0.1, 2.0, "V"), "spice": "VJ"})
    """Junction potential."""
    grading: float = field(metadata={"limits": (0.0, 0.9), "spice": "M"})
    """Grading coefficient."""

    def __post_init__(self) -> None:
        _check_limits("diode", self)

    def at(self, celsius: float) -> Diode:
        """The diode at another temperature, for formulas that assume 27 degrees Celsius, by SPICE's law.

        Band gap and exponent are those of silicon, 1.11 eV and 3, or for an emission below 1.3 of a Schottky diode,
        0.69 eV and 2.
        """
        gap, power = (0.69, 2.0) if self.emission < 1.3 else (1.11, 3.0)
        ratio = (celsius + 273.15) / 300.15
        emission = self.emission * ratio
        grown = ratio ** (power / self.emission) * math.exp((ratio - 1) * gap / (emission * THERMAL_V))
        return dataclasses.replace(self, saturation_a=self.saturation_a * grown, emission=emission)


SCHOTTKY = Diode(1.5e-7, 1.04, 4.0, 11.0, 0.3, 0.5)
"""Small-signal Schottky diode of the BAT54's kind: 0.24 V at 1 mA."""
SILICON = Diode(2.5e-9, 1.75, 0.6, 2.0, 0.75, 0.4)
"""Small-signal silicon diode of the 1N4148's kind: 0.59 V at 1 mA."""
DIODES = {"schottky": SCHOTTKY, "silicon": SILICON}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Falling:
    """Columns that are charged, float, and fall through resistive cells: the table ``[circuit.falling]``."""

    column_pf: float = field(default=220.0, metadata={"limits": (1.0, 100_000.0, "pF")})
    """Capacitor at each column."""
    tolerance: float = field(default=0.05, metadata={"limits": (0.0, 0.5)})
    """Relative tolerance of that capacitor."""
    ruler_ohm: float = field(default=25_000.0, metadata={"limits": (100.0, 1e7, "ohm")})
    """Resistor at each guard crossing."""
    threshold_v: float = field(default=1.4, metadata={"limits": (0.1, 5.0, "V")})
    """Level at which a pin changes its reading, between VIL and VIH."""
    threshold_spread_v: float = field(default=0.3, metadata={"limits": (0.0, 2.0, "V")})
    """Largest difference of an FPGA's threshold from that; its pins are alike."""
    leak_ua: float = field(default=10.0, metadata={"limits": (0.0, 1000.0, "uA")})
    """Largest leakage of a pin, in or out. An assumption: take the limit of your FPGA's data sheet."""
    noise_mv: float = field(default=5.0, metadata={"limits": (0.0, 1000.0, "mV")})
    """Standard deviation of a column's level at its threshold, from sample to sample. An assumption."""
    edge_mv: float = field(default=100.0, metadata={"limits": (-3000.0, 3000.0, "mV")})
    """Level that an edge of a motor's drive adds to all columns. An assumption."""
    edge_us: float = field(default=0.2, metadata={"limits": (0.0, 1000.0, "us")})
    """Time for which it does."""
    edge_hz: float = field(default=39_900.0, metadata={"limits": (0.0, 1e6, "Hz")})
    """Edges per second: two of each period of some 20 kHz."""

    def __post_init__(self) -> None:
        _check_limits("circuit.falling", self)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Circuit:
    """A sheet with its wires and the board's pins. Raises :class:`CircuitError` for impossible values.

    A line's resistance is that to its pin, as if all switches were at the far end.
    """

    line_pf: float = field(default=30.0, metadata={"limits": (0.1, 100_000.0, "pF")})
    """Capacitance of a line to ground, with its pin."""
    crossing_pf: float = field(default=2.0, metadata={"limits": (0.0, 1000.0, "pF")})
    """Capacitance of a row to a column at their crossing, with an open switch."""
    neighbor_pf: float = field(default=3.0, metadata={"limits": (0.0, 10_000.0, "pF")})
    """Capacitance of a line to each neighbor."""
    pin_ohm: float = field(default=40.0, metadata={"limits": (1.0, 10_000.0, "ohm")})
    """Resistance of a driving pin, high or low."""
    series_ohm: float = field(default=0.0, metadata={"limits": (0.0, 100_000.0, "ohm")})
    """Resistor between pin and line."""
    line_ohm: float = field(default=0.0, metadata={"limits": (0.0, 100_000.0, "ohm")})
    """Resistance of a line from end to end."""
    switch_ohm: float = field(default=100.0, metadata={"limits": (0.1, 1e6, "ohm")})
    """Resistance of a closed switch."""
    diode: Diode = SCHOTTKY
    """Diode in series with each switch; in a file also ``"schottky"`` or ``"silicon"``."""
    column_pull_ohm: float = field(default=100_000.0, metadata={"limits": (100.0, 1e8, "ohm")})
    """Resistor that keeps a column at its released level."""
    row_pull_ohm: float = field(default=10_000.0, metadata={"limits": (100.0, 1e8, "ohm")})
    """Resistor that pulls a row to its untouched level, for projections alone."""
    supply_v: float = field(default=3.3, metadata={"limits": (1.0, 5.5, "V")})
    """Supply of the board's pins."""
    low_v: float = field(default=0.8, metadata={"limits": (0.1, 5.0, "V")})
    """VIL: the highest level that is guaranteed to read as low."""
    high_v: float = field(default=2.0, metadata={"limits": (0.2, 5.5, "V")})
    """VIH: the lowest level that is guaranteed to read as high."""
    pin_ma: float = field(default=8.0, metadata={"limits": (0.1, 100.0, "mA")})
    """Largest permanent pin current; 8 mA is specified for pins of an iCE40 at 3.3 V and of an ECP5 with its usual
    drive strength."""
    falling: Falling | None = None
    """Columns that fall through resistive cells; None: switches pull them down."""

    def __post_init__(self) -> None:
        _check_limits("circuit", self)
        if not isinstance(self.diode, Diode):
            raise CircuitError(f"diode is {shown(self.diode)}; it must be a Diode, or one of {', '.join(DIODES)}")
        if not self.low_v < self.high_v < self.supply_v:
            raise CircuitError(
                f"low_v = {self.low_v:g}, high_v = {self.high_v:g} and supply_v = {self.supply_v:g} are not in order; "
                "VIL must lie below VIH, and VIH below the supply"
            )

    @property
    def drive_ohm(self) -> float:
        """Resistance between a line and the supply or ground of its pin."""
        return self.pin_ohm + self.series_ohm + self.line_ohm

    def replace(self, **changes: Any) -> Circuit:
        """A checked copy with some values changed."""
        return dataclasses.replace(self, **changes)


LIMITS: dict[str, tuple[float, float, str]] = {
    one.name: one.metadata["limits"] for one in dataclasses.fields(Circuit) if one.metadata
}
"""Lowest and highest value, and unit, of a circuit's numbers."""


def knee_v(diode: Diode) -> float:
    """Voltage above which Newton's method is limited."""
    step = diode.emission * THERMAL_V
    return step * math.log(step / (math.sqrt(2) * diode.saturation_a))


def load_circuit(path: str | Path) -> Circuit | None:
    """The circuit in a Skin's file; None without a table ``[circuit]``. Raises CircuitError."""
    return tomlfile.load_table(path, "circuit", _read, CircuitError)


def write_circuit(circuit: Circuit) -> str:
    """The TOML tables that :func:`load_circuit` reads back."""
    values = dataclasses.asdict(circuit)
    tables = {f"circuit.{name}": part for name in ("diode", "falling") if (part := values.pop(name)) is not None}
    lines = []
    for name, part in ({"circuit": values} | tables).items():
        lines += [f"\n[{name}]\n", *(f"{key} = {value}\n" for key, value in part.items())]
    return "".join(lines)


def _read(values: Any) -> Circuit:
    given = dict(tomlfile.fields_of(Circuit, "circuit", values, CircuitError))
    if isinstance(diode := given.get("diode"), str):
        if diode not in DIODES:
            raise CircuitError(f"diode is {shown(diode)}; it must be one of {', '.join(DIODES)}, or [circuit.diode]")
        given["diode"] = DIODES[diode]
    elif diode is not None:
        fields = tomlfile.fields_of(Diode, "circuit.diode", diode, CircuitError)
        missing = [field.name for field in dataclasses.fields(Diode) if field.name not in fields]
        if missing:
            raise CircuitError(f"{missing[0]} is missing in [circuit.diode]; it needs all of its fields")
        given["diode"] = Diode(**fields)
    if "falling" in given:
        given["falling"] = Falling(**tomlfile.fields_of(Falling, "circuit.falling", given["falling"], CircuitError))
    return Circuit(**given)
