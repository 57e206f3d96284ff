"""Wiring of the starter kit: pins of board and sheet."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from contactfpga import picture_style as style
from contactfpga.boards import wiring
from contactfpga.design.circuit import load_circuit
from contactfpga.design.kits import Kit
from contactfpga.design.sheet import lay_out
from contactfpga.design.sheet.drawn import GND, SUPPLY
from contactfpga_sim.lab.diagrams.canvas import Canvas

STEP = 16.0
TOP = 62.0
BOARD_X, SHEET_X = 214.0, 470.0
PIN = 26.0
POWER = {"5": GND, "6": SUPPLY, "11": GND, "12": SUPPLY}
"""Power pins of a PMOD connector (docs/boards.md)."""
RAILS = {GND: style.BLACK, SUPPLY: style.VERMILLION}
OUT = style.GREEN
COLORS = style.BLUE, style.PURPLE, style.BROWN


class Pin(NamedTuple):
    number: str
    wire: str


def draw(kit: Kit, path: Path) -> Path:
    circuit = load_circuit(kit.skin_path)
    assert circuit is not None
    board = _board(kit)
    sheet = _sheet(kit)
    canvas = Canvas(TOP + STEP * (sum(map(len, board.values())) + 1.5 * len(board)) + 56)
    leads = {one.port: one.line.leads_to for one in wiring.wires(kit.board, kit.skin)}
    colors = _colors(board)
    ends = _connectors(canvas, board, BOARD_X, True, {}, colors)
    starts = _connectors(canvas, sheet, SHEET_X, False, leads, colors)
    for x, name in ((16.0, kit.board.title), (SHEET_X - 12, "sheet, at its back")):
        canvas.text(x, 22, name, fontweight="bold")
    for wire in (wire for wire in ends if wire in starts):
        for place in (0, -1) if wire in RAILS else (0,):
            _wire(canvas, ends[wire][place], starts[wire][place], colors[wire])
    _outputs(canvas, ends, leads)
    chips = sum(1 for _ in {(one.chain, one.number) for one in wiring.outputs(kit.skin)})
    y = canvas.axes.get_ylim()[0] - 34
    series, pull = wiring.ohms(circuit.series_ohm), wiring.ohms(circuit.column_pull_ohm)
    canvas.small(
        16, y, f"On the sheet already: {chips} 74HC595, {series} in each line, {pull} from each column to 3.3 V."
    )
    canvas.small(16, y + 16, "Connect every GND pin of J1 and J2 to a GND pin of the board.")
    return canvas.save(path)


def _board(kit: Kit) -> dict[str, list[Pin]]:
    used: dict[str, dict[str, str]] = {name: {} for name in kit.board.connectors}
    for one in wiring.wires(kit.board, kit.skin):
        connector, _, number = one.pin.partition(":")
        if number:
            used[connector][number] = one.port
    return {
        kit.board.connectors[connector]: [Pin(str(n), (POWER | wires).get(str(n), "")) for n in range(1, 13)]
        for connector, wires in used.items()
    }


def _sheet(kit: Kit) -> dict[str, list[Pin]]:
    layout = lay_out(kit.skin, load_circuit(kit.skin_path))
    plugs = [one for one in layout.drawing.placed if one.reference.startswith("J")]
    return {one.reference: [Pin(pin, net) for pin, net in one.nets.items()] for one in plugs}


def _connectors(
    canvas: Canvas,
    connectors: dict[str, list[Pin]],
    x: float,
    right: bool,
    leads: dict[str, str],
    colors: dict[str, str],
) -> dict[str, list[tuple[float, float]]]:
    found: dict[str, list[tuple[float, float]]] = {}
    y = TOP
    for name, pins in connectors.items():
        canvas.text(x + (-PIN if right else 0), y - 14, name, fontsize=style.SMALL)
        for pin in pins:
            color = colors[pin.wire]
            left = x - PIN if right else x
            canvas.box(left, y - STEP / 2 + 1, PIN, STEP - 2, style.GRAY, ec=color, lw=0.9)
            canvas.text(left + PIN / 2, y, pin.number, ha="center", fontsize=style.SMALL)
            words = _words(pin.wire, leads)
            at, side = (left - 6, "right") if right else (left + PIN + 6, "left")
            canvas.text(at, y, words, fontsize=style.SMALL, ha=side)
            found.setdefault(pin.wire, []).append((x, y))
            y += STEP
        y += 1.5 * STEP
    return found


def _words(wire: str, leads: dict[str, str]) -> str:
    if wire in RAILS:
        return {GND: "GND", SUPPLY: "3.3 V"}[wire]
    return leads.get(wire, wire).partition(",")[0] if leads else wire or "free"


def _colors(board: dict[str, list[Pin]]) -> dict[str, str]:
    colors = {pin.wire: COLORS[place % len(COLORS)] for place, pins in enumerate(board.values()) for pin in pins}
    return colors | RAILS | {"": style.GRAY, "contact": OUT, "alive": OUT}


def _wire(canvas: Canvas, start: tuple[float, float], end: tuple[float, float], color: str) -> None:
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Curve

    middle = (start[0] + end[0]) / 2
    curve = Curve([start, (middle, start[1]), (middle, end[1]), end], [1, 4, 4, 4])
    canvas.axes.add_patch(PathPatch(curve, fc="none", ec=color, lw=1.3))


def _outputs(canvas: Canvas, ends: dict[str, list[tuple[float, float]]], leads: dict[str, str]) -> None:
    for wire in ("contact", "alive"):
        ((x, y),) = ends[wire]
        canvas.arrow((x, y), (x + 22, y), color=OUT)
        canvas.small(x + 26, y, leads[wire].partition(":")[0].partition(" of")[0])
