"""A resting sheet: worst levels and pin currents, and designs that cannot work."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from contactfpga.design.circuit import falling, patterns, phases, transient
from contactfpga.design.circuit.network import Network
from contactfpga.design.circuit.phases import Levels, Phase
from contactfpga.design.circuit.values import Circuit, CircuitError, load_circuit
from contactfpga.inputs.values import shell_words
from contactfpga.skin import Skin

NOISE_V = 0.3
"""Required distance of a level from VIL or VIH."""
LARGEST_OHM = 1e7


@dataclasses.dataclass(frozen=True)
class Problem:
    """A design error that no waiting cures, and its remedy."""

    what: str
    helps: str

    def __str__(self) -> str:
        return f"{self.what}; {self.helps}"


@dataclasses.dataclass(frozen=True)
class Worst:
    """Levels of the real sheet and pin currents, at rest."""

    level_v: float
    margin_v: float
    """Distance from VIL or VIH; negative on the wrong side."""
    pin_ma: float
    """Current of the driven line, in or out."""


def scan(circuit: Circuit, rows: int, columns: int, diodes: str = "col2row") -> Worst:
    """A selected row with all columns pressed, whose pin carries the current of all pulls."""
    network = Network(circuit, patterns.named(rows, columns)["one row"])
    levels = Levels.of(circuit, diodes)
    phase = phases.settle(network, levels)
    lines, amperes = _rest(phase)
    level = float(lines[:columns].max())
    row = columns + patterns.middle(rows)
    return Worst(shown_v(circuit, diodes, level), levels.low - level, 1e3 * abs(float(amperes[row])))


def projection(circuit: Circuit, rows: int, columns: int, diodes: str = "col2row") -> Worst:
    """One column that feeds all rows through its pressed switches."""
    network = Network(circuit, patterns.named(rows, columns)["one column"])
    levels = Levels.of(circuit, diodes)
    lines, amperes = _rest(phases.project_rows(network, levels))
    level = float(lines[columns:].min())
    column = patterns.middle(columns)
    return Worst(shown_v(circuit, diodes, level), level - levels.high, 1e3 * abs(float(amperes[column])))


def _rest(phase: Phase) -> tuple[np.ndarray, np.ndarray]:
    drive = phase.drives[-1]
    lines = transient.at_rest(phase.network, drive).lines
    return lines, phase.network.pin_amperes(lines, drive)


def shown_v(circuit: Circuit, diodes: str, volts: float) -> float:
    """Volts of the real sheet from those of the computing frame."""
    return circuit.supply_v - volts if diodes == "row2col" else volts


def problems(
    circuit: Circuit, rows: int, columns: int, diodes: str = "col2row", projects: bool = False
) -> list[Problem]:
    """Design errors of a sheet; with ``projects`` also in projections, as in ``scan = "reversal"``."""
    found = _problems(circuit, "column_pull_ohm", lambda one: scan(one, rows, columns, diodes), _SCAN, columns, diodes)
    if projects:
        judge = _problems(
            circuit, "row_pull_ohm", lambda one: projection(one, rows, columns, diodes), _PROJECTION, rows, diodes
        )
        found += judge
    return found


@dataclasses.dataclass(frozen=True)
class _Words:
    level: str
    current: str
    low: bool


_SCAN = _Words(
    "a pressed column comes to {level:.2f} V where all {count} switches of a row are pressed",
    "the pin of a row carries {ma:.3g} mA where all {count} switches of the row are pressed",
    True,
)
_PROJECTION = _Words(
    "in a projection a touched row comes to {level:.2f} V where one column feeds all {count} rows",
    "in a projection the pin of a column that feeds all {count} rows carries {ma:.3g} mA",
    False,
)


def _problems(
    circuit: Circuit, pull: str, worst: Callable[[Circuit], Worst], words: _Words, count: int, diodes: str
) -> list[Problem]:
    one = worst(circuit)
    found: list[str] = []
    if one.margin_v < NOISE_V:
        low = words.low == (diodes != "row2col")
        limit, goal = ("VIL", circuit.low_v - NOISE_V) if low else ("VIH", circuit.high_v + NOISE_V)
        side = "at most" if low else "at least"
        found.append(
            f"{words.level.format(level=one.level_v, count=count)}; {side} {goal:.2f} V are needed, {NOISE_V} V "
            f"{'below' if low else 'above'} {limit}"
        )
    if one.pin_ma > circuit.pin_ma:
        found.append(
            f"{words.current.format(ma=one.pin_ma, count=count)} for as long as it lasts; "
            f"pin_ma = {circuit.pin_ma:g} is allowed"
        )
    return [Problem(what, _helps(circuit, pull, worst)) for what in found]


def _helps(circuit: Circuit, pull: str, worst: Callable[[Circuit], Worst]) -> str:
    ohms = getattr(circuit, pull)
    while (ohms := _rounded(ohms * 1.2)) <= LARGEST_OHM:
        one = worst(circuit.replace(**{pull: ohms}))
        if one.margin_v >= NOISE_V and one.pin_ma <= circuit.pin_ma:
            return f"{pull} = {ohms:g} would do, instead of {getattr(circuit, pull):g}"
    return (
        f"no {pull} would do: take a Schottky diode, or less of pin_ohm, series_ohm, line_ohm and switch_ohm, which "
        f"are {circuit.pin_ohm:g}, {circuit.series_ohm:g}, {circuit.line_ohm:g} and {circuit.switch_ohm:g}"
    )


def _rounded(ohms: float) -> float:
    digits = 10 ** (len(str(int(ohms))) - 2)
    return float(-(-ohms // digits) * digits)


def check(circuit: Circuit, skin: Skin) -> None:
    """Raise :class:`CircuitError` if a Skin's sheet, with its guard lines, cannot work."""
    if skin.diodes == "none":
        raise CircuitError("diodes is 'none'; [circuit] describes sheets with a diode per switch, leave the table out")
    if circuit.falling or skin.ruler:
        falling.check(circuit, skin)
        return
    found: Sequence[Problem] = problems(circuit, skin.row_lines, skin.column_lines, skin.diodes, skin.reads_rows)
    if found:
        raise CircuitError(str(found[0]))


def load_checked(path: str | Path, skin: Skin) -> Circuit | None:
    """The circuit in a Skin's file; None without a table. Raises CircuitError as :func:`check` does."""
    circuit = load_circuit(path)
    if circuit is not None:
        try:
            check(circuit, skin)
        except CircuitError as error:
            raise CircuitError(f"{path}: {error}; `contactfpga settle --skin {shell_words(path)}` shows all") from None
    return circuit
