"""Whether a sheet, its circuit and a board fit together, and values that do."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from contactfpga.boards.spec import BoardSpec
from contactfpga.design.circuit import Circuit, CircuitError, check, check_times, needed_by, recommended_us
from contactfpga.skin import Skin, SkinError

_LONGER = (1, 2, 4, 8)
"""Factors by which a row time grows until the shift registers and the labeller keep up."""
_SLOW_US = 100.0


def findings(board: BoardSpec, skin: Skin, circuit: Circuit | None) -> dict[str, str]:
    """Problems with pins, clock, baud rate, levels and times by subject, "" for none. Levels and times need a
    circuit."""
    asked: dict[str, Callable[[], None]] = {
        "pins": lambda: board.check_pins(skin),
        "clock": lambda: board.check_clock(skin),
        "baud": lambda: board.check_baud(skin),
    }
    if circuit is not None:
        asked["levels"] = lambda: check(circuit, skin)
        asked["times"] = lambda: check_times(circuit, skin)
    return {name: _said(ask) for name, ask in asked.items()}


def _said(ask: Callable[[], None]) -> str:
    try:
        ask()
    except (SkinError, CircuitError) as error:
        return str(error)
    return ""


def proposed(board: BoardSpec, skin: Skin, circuit: Circuit | None) -> dict[str, Any]:
    """Changes that make a Skin fit its circuit and the board: shift registers, the board's clock and baud rate, longer
    times. Raises SkinError if they do not suffice."""
    wrong = findings(board, skin, circuit)
    if wrong.get("levels"):
        raise SkinError(wrong["levels"])
    changes: dict[str, Any] = {}
    if wrong["clock"] or wrong["baud"]:
        changes |= {"clock_hz": board.skin.clock_hz, "baud": board.skin.baud}
    refused = wrong["pins"] or wrong.get("times") or ""
    for wiring in _wirings(skin) if wrong["pins"] else [{}]:
        for factor in _LONGER:
            tried = changes | wiring
            try:
                tried |= _times(skin, tried, circuit, factor)
                changed = skin.replace(**tried)
            except SkinError as error:
                refused = str(error)
                continue
            if not any(findings(board, changed, circuit).values()):
                return tried
    raise SkinError(refused)


def _wirings(skin: Skin) -> Iterator[dict[str, Any]]:
    rows: dict[str, Any] = {"row_drive": "74hc595"}
    columns: dict[str, Any] = {"column_read": "74hc165"} | ({"precharge_us": 0.0} if skin.precharge_us else {})
    yield from (rows, columns, rows | columns)


def _times(skin: Skin, changes: dict[str, Any], circuit: Circuit | None, factor: int) -> dict[str, Any]:
    found: dict[str, Any] = {"settle_us": skin.settle_us * factor} if factor > 1 else {}
    if circuit is not None and not circuit.falling:
        slow = skin.replace(**changes, settle_us=_SLOW_US)  # so that no row is too short to ask
        needs = needed_by(skin, circuit)
        for name, us in recommended_us(slow, needs).items():
            if us is not None and found.get(name, getattr(skin, name)) < us:
                found[name] = us
    return found
