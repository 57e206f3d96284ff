"""The table `[circuit]` in a Skin's file."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from contactfpga.design.circuit import static
from contactfpga.design.circuit.values import DIODES, Circuit, CircuitError, Diode
from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import shown
from contactfpga.skin import Skin


def load(path: str | Path) -> Circuit | None:
    """The circuit in a Skin's file; None where it has no table ``[circuit]``. Raises CircuitError."""
    return tomlfile.load_table(path, "circuit", read, CircuitError)


def load_checked(path: str | Path, skin: Skin) -> Circuit | None:
    """The same for what works with a board of this Skin. Raises CircuitError for a sheet whose pins would carry more
    than they may, or whose levels are too near to VIL or VIH."""
    circuit = load(path)
    if circuit is not None:
        try:
            static.check(circuit, skin.rows, skin.columns, skin.diodes, skin.reads_rows)
        except CircuitError as error:
            raise CircuitError(f"{path}: {error}; `contactfpga settle --skin {path}` shows all") from None
    return circuit


def read(values: Any) -> Circuit:
    """The circuit that a TOML table describes; its keys are the fields of :class:`Circuit`. ``diode`` is a name or a
    table with the fields of :class:`Diode`."""
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
    return Circuit(**given)
