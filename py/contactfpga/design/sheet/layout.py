"""The layout of a sheet: the matrix of a Skin on two copper layers, with its strip and outline.

Columns run along y on the top side through the switches; rows run along x on the back under the diodes. All lines leave
above row 0, so a sheet around a closed cylinder needs nothing at its seam: a row descends between two columns on the
top side.
"""

from __future__ import annotations

import dataclasses
import math

from contactfpga import __version__
from contactfpga.boards import wiring
from contactfpga.boards.spec import BoardSpec
from contactfpga.design.circuit import SILICON, Circuit
from contactfpga.design.sheet import strip, tube
from contactfpga.design.sheet.drawing import (
    CLEARANCE_MM,
    EDGE_MM,
    PRINT_MM,
    TEXT_MM,
    TRACK_MM,
    VIA_MM,
    Drawing,
    Hole,
    PlacedPart,
    width_mm,
)
from contactfpga.design.sheet.parts import (
    DIODE,
    FIDUCIAL,
    RESISTOR,
    SILICON_DIODE,
    SWITCHES,
    Pad,
    SheetError,
    SwitchPart,
    comb,
    find_switch,
)
from contactfpga.design.sheet.strip import PLACE_MM, Line, port
from contactfpga.skin import Skin

FITTED = Circuit(series_ohm=33.0, column_pull_ohm=22_000.0, row_pull_ohm=5_600.0)
"""Resistors for a Skin's file without a circuit (docs/maker.md)."""

MARGIN_MM = 7.0
"""Board beyond the parts, for the mounting holes."""
HOLE_MM = 3.2

_DIODE_AT = -0.2, 0.5
"""Middle of a cell's diode; its pads are 1.1 mm to the left and right."""
_ROW_Y = 2.0
_FEED_Y = _ROW_Y + VIA_MM / 2 + CLEARANCE_MM + TRACK_MM / 2
"""Offset of the track that brings a row to its first switch, with room for a via."""
_ROW_START = -2.0
_GUARD_ROW_Y, _RULER_Y = 4.2, 2.7
"""Distance of the guard row from the last row, and what the ruler's resistors add to it."""
_BELOW_COMB = 3.3
"""Distance of a guard row with a ruler from the edge of the last row's cells, with room for its vias."""
_GUARD_VIA = 0.0, -0.6
_GUARD_DIODE_X, _RULER_X = -0.35, 1.2
_RULED_MM = 5.2
"""Height that a guard column's diode takes with its print."""
_GUARD_EDGE = 0.7
"""Distance from the guard column to the seam: half a resistor and :data:`EDGE_MM`."""


@dataclasses.dataclass(frozen=True)
class Layout:
    """A sheet with all positions."""

    skin: Skin
    circuit: Circuit
    """Values of the sheet's resistors."""
    switch: SwitchPart
    drawing: Drawing
    lines: tuple[Line, ...]
    """Lines from left to right, as they leave the matrix."""
    board: BoardSpec | None


_FIDUCIAL_X = 6.5
_PRINT_GAP = 0.25
"""From a pad to print: the mask's opening grows by 0.05 mm, and houses want 0.15 mm beside it."""


def lay_out(
    skin: Skin,
    circuit: Circuit | None = None,
    part: str | None = None,
    margin_mm: float = MARGIN_MM,
    board: BoardSpec | None = None,
) -> Layout:
    """Lay out the sheet of a Skin with the switch ``part``, a dome by default, or with combs for a resistive film if it
    has a ruler; with a ``board`` whose wires are all at PMOD sockets, its headers have their order.

    Raises :class:`SheetError` for cells finer than their parts, for a radius too small to bend to, for lines or tabs
    without a place around a closed cylinder, and for a ruler without its values, with switches, or around one.
    """
    switch = comb(skin.pitch_x_mm, skin.pitch_y_mm) if skin.ruler and part is None else find_switch(part or "dome")
    fitted = circuit or FITTED
    if skin.ruler and (part or fitted.falling is None or skin.closed):
        why = "the table [circuit.falling]" if fitted.falling is None else "combs, not switches" if part else ""
        raise SheetError(f"ruler is {skin.ruler}; its sheet needs {why or 'edges: it cannot be closed'}")
    _check(skin, switch)
    matrix = _Matrix(skin, switch, fitted)
    lines = matrix.lines()
    drawing = Drawing()
    base = -skin.pitch_y_mm / 2 - 0.4
    matrix.draw(drawing, base)
    left, top, right = strip.draw(drawing, skin, fitted, lines, base, board)
    _outline(drawing, skin, (left, top, right), margin_mm)
    _fiducials(drawing)
    _print(drawing, skin, switch)
    return Layout(skin, fitted, switch, drawing, tuple(lines), board)


def smallest_pitch(skin: Skin, switch: SwitchPart) -> tuple[float, float]:
    """The finest pitch in mm, along x and y, at which a Skin's cells hold their parts."""
    wide = switch.part.width + CLEARANCE_MM
    cell = _FEED_Y + VIA_MM / 2 + CLEARANCE_MM - switch.via[1] + VIA_MM / 2
    high = max(switch.part.height + CLEARANCE_MM, 2 * switch.reach + TRACK_MM + CLEARANCE_MM, cell)
    if skin.ruler:
        high = max(high, _RULED_MM)
    if skin.columns > 1:
        wide = max(wide, 2 * switch.half_width + VIA_MM + 2 * CLEARANCE_MM, 2 * PLACE_MM)
    if skin.closed and skin.guard:
        wide = max(wide, 2 * (switch.half_width + CLEARANCE_MM + TRACK_MM / 2 + _GUARD_EDGE))
    return wide, high


def _guard_row_y(skin: Skin) -> float:
    below_comb = skin.pitch_y_mm / 2 + _BELOW_COMB
    return max(_GUARD_ROW_Y + _RULER_Y, below_comb) if skin.ruler else _GUARD_ROW_Y


def _too_fine(skin: Skin, switch: SwitchPart) -> list[tuple[str, float, float]]:
    pitches = ("pitch_x_mm", skin.pitch_x_mm), ("pitch_y_mm", skin.pitch_y_mm)
    limits = zip(pitches, smallest_pitch(skin, switch), strict=True)
    return [(name, pitch, limit) for (name, pitch), limit in limits if pitch < limit - 1e-9]


def _check(skin: Skin, switch: SwitchPart) -> None:
    for name, pitch, limit in _too_fine(skin, switch):
        steps = [f"set {name} = {limit:.4g} or more"]
        for part, other in () if skin.ruler else SWITCHES.items():
            still = {axis: finest for axis, _, finest in _too_fine(skin, other)}
            if still.get(name, 0.0) < limit:
                steps.append(f"take --part {part}" + "".join(f" and {axis} = {mm:.4g}" for axis, mm in still.items()))
        raise SheetError(
            f"{name} is {pitch:g}; a cell with {switch.part.name}, its diode and its tracks needs {limit:.4g} mm: "
            f"{', or '.join(steps)}"
        )


class _Matrix:
    def __init__(self, skin: Skin, switch: SwitchPart, circuit: Circuit):
        self.skin, self.switch = skin, switch
        self.diode = (SILICON_DIODE, "1N4148WS") if circuit.diode == SILICON else (DIODE, "BAT54WS")
        self.ruler = f"{circuit.falling.ruler_ohm:g}" if skin.ruler and circuit.falling else ""
        """Resistance between a guard line's crossing and its diode; "" for none."""
        self.px, self.py = skin.pitch_x_mm, skin.pitch_y_mm
        self.last_x = (skin.columns - 1) * self.px
        edge = self.px / 2 - _GUARD_EDGE if skin.closed else self.px / 2
        self.guard_x = self.last_x + edge
        self.masked = set(skin.mask)
        self.risers = self._risers()

    def row_y(self, row: int) -> float:
        return row * self.py if row < self.skin.rows else (self.skin.rows - 1) * self.py + _guard_row_y(self.skin)

    def row_net(self, row: int) -> str:
        return f"ROW{row}" if row < self.skin.rows else "ROW_GUARD"

    def column_net(self, column: int) -> str:
        return f"COL{column}" if column < self.skin.columns else "COL_GUARD"

    def _risers(self) -> list[float]:
        skin, gaps = self.skin, self.skin.columns - 1
        width = self.px - 2 * self.switch.half_width - VIA_MM - 2 * CLEARANCE_MM
        most = min(math.floor(self.px / PLACE_MM + 1e-9) - 1, math.floor(width / PLACE_MM + 1e-9) + 1) if gaps else 0
        each = min(most, -(-skin.row_lines // max(gaps, 1)))
        if skin.closed and gaps * most < skin.row_lines:
            raise SheetError(
                f"rows is {skin.rows}; around a closed cylinder a sheet of {skin.columns} columns at {self.px:.4g} mm "
                f"has place for at most {gaps * most - skin.guard} rows, {most} between two columns; take more "
                "columns, or a larger radius_mm"
            )
        between = [(gap + 0.5) * self.px + (k - (each - 1) / 2) * PLACE_MM for gap in range(gaps) for k in range(each)]
        beside = max(self.px / 2, PLACE_MM, self.switch.half_width + VIA_MM)
        spill = max(0, skin.row_lines - len(between))
        return [-beside - k * PLACE_MM for k in reversed(range(spill))] + between[: skin.row_lines]

    def lines(self) -> list[Line]:
        skin = self.skin
        rows, columns = wiring.row_lines(skin), wiring.column_lines(skin)
        found = []
        for row, number in enumerate(skin.line_of_row):
            pin, pull = port("rows", number, skin.row_lines), rows[number].pull
            found.append(Line(self.row_net(row), pin, self.risers[row], "row", pull, bool(self._ends(row))))
        for column, number in enumerate(skin.line_of_column):
            pin, pull = port("columns", number, skin.column_lines), columns[number].pull
            x = column * self.px if column < skin.columns else self.guard_x
            used = column == skin.columns or self._last(column) >= 0
            found.append(Line(self.column_net(column), pin, x, "column", pull, used))
        return sorted(found, key=lambda line: line.x)

    def _ends(self, row: int) -> list[float]:
        found = [column for column in range(self.skin.columns) if (row, column) not in self.masked]
        ends = [column * self.px + _DIODE_AT[0] + 1.1 for column in found]
        return [*ends, self.guard_x + _GUARD_DIODE_X] if self.skin.guard and row < self.skin.rows else ends

    def _last(self, column: int) -> int:
        """The last row with an item on a column, the guard row included; -1 for none."""
        if self.skin.guard:
            return self.skin.rows
        return max((row for row in range(self.skin.rows) if (row, column) not in self.masked), default=-1)

    def draw(self, drawing: Drawing, base: float) -> None:
        for column in range(self.skin.columns):
            if self._last(column) >= 0:
                x = column * self.px
                drawing.run(self.column_net(column), "F", (x, base), (x, -self.switch.reach))
        for row in range(self.skin.rows):
            for column in range(self.skin.columns):
                self._cell(drawing, row, column)
        if self.skin.guard:
            self._guard_column(drawing, base)
            for column in range(self.skin.columns):
                self._guard_cell(drawing, column)
        for row in range(self.skin.row_lines):
            self._row(drawing, row, base)

    def _cell(self, drawing: Drawing, row: int, column: int) -> None:
        x, y, net = column * self.px, self.row_y(row), self.column_net(column)
        reach, last = self.switch.reach, self._last(column)
        if row < min(last, self.skin.rows - 1):
            drawing.run(net, "F", (x, y + reach), (x, y + self.py - reach))
        if (row, column) in self.masked:
            if row < last:
                drawing.run(net, "F", (x, y - reach), (x, y + reach))
            return
        node = self.row_net(row) if self.skin.diodes == "none" else f"N{row}_{column}"
        value = self.switch.part.name if self.switch.part.order else ""  # combs of copper are no part to order
        drawing.place("SW", self.switch.part, value, (x, y), {"1": net, "2": node}, back=False)
        column_tracks = self.switch.column[: len(self.switch.column) - (self.switch.tail if row == last else 0)]
        for tracks, name in ((column_tracks, net), (self.switch.diode, node)):
            for x1, y1, x2, y2 in tracks:
                drawing.run(name, "F", (x + x1, y + y1), (x + x2, y + y2))
        self._to_row(drawing, (x, y), self.switch.via, node, self.row_net(row))

    def _to_row(
        self, drawing: Drawing, cell: tuple[float, float], offset: tuple[float, float], node: str, row: str
    ) -> None:
        x, y = cell
        via = x + offset[0], y + offset[1]
        right = x + _DIODE_AT[0] + 1.1
        drawing.via(node, *via)
        if self.skin.diodes == "none":
            drawing.run(node, "B", via, (right, via[1]), (right, y + _ROW_Y))
            return
        self._diode_to_row(drawing, cell, node, row)
        left, middle_y = x + _DIODE_AT[0] - 1.1, y + _DIODE_AT[1]
        drawing.run(node, "B", via, (left, via[1]), (left, middle_y))

    def _diode_to_row(self, drawing: Drawing, cell: tuple[float, float], node: str, row: str) -> None:
        middle = cell[0] + _DIODE_AT[0], cell[1] + _DIODE_AT[1]
        self._diode(drawing, middle, node, row, 180, (-0.3, -1.08))
        drawing.run(row, "B", (middle[0] + 1.1, middle[1]), (middle[0] + 1.1, cell[1] + _ROW_Y))

    def _diode(
        self,
        drawing: Drawing,
        middle: tuple[float, float],
        node: str,
        row: str,
        turn: int,
        label: tuple[float, float],
    ) -> None:
        low = self.skin.diodes == "col2row"
        nets = {"1": row, "2": node} if low else {"1": node, "2": row}
        drawing.place("D", *self.diode, middle, nets, turn if low else (turn + 180) % 360, label=(*label, False))

    def _guard_cell(self, drawing: Drawing, column: int) -> None:
        x, y, net = column * self.px, self.row_y(self.skin.rows), self.column_net(column)
        end = (self.skin.rows - 1) * self.py + self.switch.reach
        row = self.row_net(self.skin.rows)
        if not self.ruler:
            drawing.run(net, "F", (x, end), (x, y + _GUARD_VIA[1]))
            self._to_row(drawing, (x, y), _GUARD_VIA, net, row)
            return
        node, middle, via_y = f"NG{column}", (x + _DIODE_AT[0], y - _RULER_Y + 0.8), y - _RULER_Y - 0.3
        nets = {"1": node, "2": net}
        one = drawing.place("R", RESISTOR, self.ruler, middle, nets, label=(0.0, -1.15, False))
        (left, ruler_y), right = (one.spot(pad.x, pad.y) for pad in RESISTOR.pads)
        drawing.run(net, "F", (x, end), (x, via_y))
        drawing.via(net, x, via_y)
        drawing.run(net, "B", (x, via_y), (right[0], via_y), right)
        self._diode_to_row(drawing, (x, y), node, row)
        diode_x = middle[0] - 1.1
        drawing.run(node, "B", (left, ruler_y), (diode_x, ruler_y), (diode_x, y + _DIODE_AT[1]))

    def _guard_column(self, drawing: Drawing, base: float) -> None:
        x, net = self.guard_x, self.column_net(self.skin.columns)
        drawing.run(net, "F", (x, base), *((x, self.row_y(row)) for row in range(self.skin.rows)))
        for row in range(self.skin.rows):
            y, at = self.row_y(row), x + _GUARD_DIODE_X
            drawing.via(net, x, y)
            node = net
            if self.ruler:
                node = f"NG_{row}"
                middle, nets = (x + _RULER_X, y), {"1": net, "2": node}
                one = drawing.place("R", RESISTOR, self.ruler, middle, nets, 90, label=(1.2, 0.0, True))
                low, high = (one.spot(pad.x, pad.y) for pad in RESISTOR.pads)
                drawing.run(net, "B", (x, y), (low[0], y), low)
                drawing.run(node, "B", high, (high[0], y - 1.1), (at, y - 1.1))
            else:
                drawing.run(net, "B", (at, y - 1.1), (x, y - 1.1), (x, y))
            self._diode(drawing, (at, y), node, self.row_net(row), 90, (-1.2, -2.4))
            drawing.run(self.row_net(row), "B", (at, y + 1.1), (at, y + _ROW_Y))

    def _row(self, drawing: Drawing, row: int, base: float) -> None:
        x, y, net = self.risers[row], self.row_y(row), self.row_net(row)
        along = [(end, y + _ROW_Y) for end in self._ends(row)]
        if not along:
            return
        if x < _ROW_START:
            foot = x, y + _ROW_Y
            drawing.run(net, "B", foot, *along)
        else:
            foot = x, y + _FEED_Y
            drawing.run(net, "B", foot, (_ROW_START, foot[1]), (_ROW_START, y + _ROW_Y), *along)
        drawing.via(net, *foot)
        drawing.run(net, "F", foot, (x, base))


def _outline(drawing: Drawing, skin: Skin, ends: tuple[float, ...], margin_mm: float) -> None:
    left, top, right = ends
    around = -skin.pitch_x_mm / 2, (skin.columns - 0.5) * skin.pitch_x_mm
    if skin.closed:
        if min(left - around[0], around[1] - right) < EDGE_MM - 1e-6:
            raise SheetError(
                f"radius_mm is {skin.radius_mm:g}: connectors, shift registers and resistors lie from {left:.1f} to "
                f"{right:.1f} mm, and the closed sheet's edges at {around[0]:.1f} and {around[1]:.1f}, {EDGE_MM} mm of "
                "them free; take fewer lines or a larger radius"
            )
        left, right = around
    else:
        left, right = min(left, around[0]) - margin_mm, max(right, around[1]) + margin_mm
    bottom = (skin.rows - 1) * skin.pitch_y_mm + max(skin.pitch_y_mm / 2, skin.guard * (_guard_row_y(skin) + 3.2))
    drawing.outline = left, top - margin_mm, right, bottom + margin_mm
    inset = margin_mm / 2
    for y in (drawing.outline[1] + inset, drawing.outline[3] - inset):
        drawing.holes += [Hole(x, y, HOLE_MM) for x in (left + inset, right - inset)]
    if skin.closed:
        drawing.tab_mm = margin_mm
        drawing.holes += [Hole(right + inset, hole.y, HOLE_MM) for hole in drawing.holes[::2]]
    tube.check(skin, drawing.tab_mm)


def _fiducials(drawing: Drawing) -> None:
    """Three marks beside the holes of the back, on which an assembler's machine aligns itself."""
    a, b, c, *_ = drawing.holes
    for hole, side in ((a, 1), (b, -1), (c, 1)):
        drawing.place("FID", FIDUCIAL, "", (hole.x + side * _FIDUCIAL_X, hole.y), {})


def _print(drawing: Drawing, skin: Skin, switch: SwitchPart) -> None:
    """The board's name on the back; on the front, numbers of rows and columns and, at each connector's pins, the wires'
    names."""
    left, top, right, _ = drawing.outline
    name = f"{skin.rows}x{skin.columns} {skin.name[:8]} {skin.fingerprint.hex()[:8]}"
    for line, words in enumerate((f"contactfpga {__version__}", name)):
        drawing.text(words, (left + right) / 2, top + 2.0 + 2.0 * line, "B", height=1.2)
    for column in range(skin.columns):
        drawing.text(str(column), column * skin.pitch_x_mm + 1.2, -skin.pitch_y_mm / 2 - 1.4)
    x = _beside(skin, switch)
    if x is not None:
        for row in range(skin.rows):
            drawing.text(str(row), x, row * skin.pitch_y_mm + width_mm(str(row)) / 2, upward=True)
    for one in (one for one in drawing.placed if one.reference.startswith("J")):
        socket = "" if one.value == one.part.name else one.value
        drawing.text(f"{one.reference} {socket}".rstrip(), one.x, one.y - one.part.height / 2 - 1.0, "B", height=1.5)
        drawing.text(one.reference, one.x - one.part.width / 2 + 2.2, one.y, height=1.5)
        for pad in one.part.pads:
            _pin_name(drawing, one, pad)


def _beside(skin: Skin, switch: SwitchPart) -> float | None:
    """Middle of the row numbers in x: left of the cells, or around a closed cylinder, whose edge is there, between the
    first two columns; None without room."""
    room = switch.half_width + _PRINT_GAP + (TEXT_MM + PRINT_MM) / 2
    if not skin.closed:
        return -room
    return skin.pitch_x_mm / 2 if skin.pitch_x_mm >= 2 * room else None


def _pin_name(drawing: Drawing, one: PlacedPart, pad: Pad) -> None:
    net = one.nets.get(pad.number, "NC")
    for long, short in (("columns[", "col"), ("rows[", "row"), ("column_", "c-"), ("row_", "r-"), ("_n", "")):
        net = net.replace(long, short)
    words = net.replace("[", "").rstrip("]")
    x, y = one.spot(pad.x, pad.y)
    start = pad.height / 2 + _PRINT_GAP + PRINT_MM / 2
    drawing.text(words, x, y - start if y < one.y else y + start + width_mm(words), upward=True)
