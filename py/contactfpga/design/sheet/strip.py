"""The strip that leads a sheet's lines to the board: series resistors, pulls, shift registers, connectors.

From the matrix up: a place for each line, a channel of tracks, any shift registers with a second channel, and the
connectors. All parts are on the back.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence

from contactfpga.boards import spec, wiring
from contactfpga.boards.spec import BoardSpec
from contactfpga.design.circuit import Circuit
from contactfpga.design.sheet import channel
from contactfpga.design.sheet.channel import GRID_MM, Grid, Pin
from contactfpga.design.sheet.drawing import GND, SUPPLY, VIA_MM, Drawing
from contactfpga.design.sheet.parts import (
    CAPACITOR,
    HC165,
    HC595,
    HEADER_PINS,
    LVC595,
    LVC_OHM,
    RESISTOR,
    Part,
    column_capacitor,
    header,
    smallest_header,
)
from contactfpga.skin import Skin

PLACE_MM = 2.6
"""Width of a line's place: two resistors side by side."""
_BESIDE = PLACE_MM / 2
_PAD = RESISTOR.pads[0].height / 2
LINES_A_GROUND = 4
"""Number of neighboring cable wires that share a ground."""
ENABLE_OHM = 10_000
"""Resistor that disables the 74HC595 while the FPGA is configured (docs/boards.md)."""


_LABELS = {"U": (0.0, -4.35, False), "C": (0.0, -2.1, False), "R": (0.0, -2.1, False)}
"""Offsets of the printed references of the strip's chips and their parts; a connector has its name on both sides."""
_LINE_LABEL = 0.0, -1.5, True


@dataclasses.dataclass(frozen=True)
class Line:
    """A row or column where it leaves the matrix, on the top side."""

    net: str
    pin: str
    """Net beyond the series resistor, named as the gateware's port."""
    x: float
    kind: str
    pull: str
    used: bool = True
    """Whether the line has copper, hence items, in the matrix."""


@dataclasses.dataclass(frozen=True)
class _Unit:
    """A part of the strip whose height is not yet known."""

    letter: str
    part: Part
    value: str
    x: float
    turn: int
    nets: dict[str, str]

    def place(self, drawing: Drawing, y: float) -> list[Pin]:
        label = _LABELS.get(self.letter)
        one = drawing.place(self.letter, self.part, self.value, (self.x, y), self.nets, self.turn, label=label)
        return [
            Pin(self.nets[pad.number], *one.spot(pad.x, pad.y)) for pad in self.part.pads if pad.number in self.nets
        ]


def port(name: str, bit: int, bits: int) -> str:
    """Name of a wire as in the wiring table, with its bit if the port has several."""
    return name if bits == 1 else f"{name}[{bit}]"


def draw(
    drawing: Drawing, skin: Skin, circuit: Circuit, lines: Sequence[Line], base: float, board: BoardSpec | None
) -> tuple[float, ...]:
    """Draw the strip above ``base``, with connectors for a board's PMOD sockets if it has all wires there; returns its
    left, top and right end in mm."""
    grid = Grid(max(line.x for line in lines))  # so that nothing steps nearer to the edge than the last line
    below = [pin for line in lines for pin in _line(drawing, circuit, line, base, grid)]
    bottom = base - 4.6
    middle = (min(line.x for line in lines) + max(line.x for line in lines)) / 2
    chips = _chips(skin, circuit, middle, grid)
    plugs = _connectors(_for_pmods(skin, board) or _of_lines(skin), middle, grid, below=bool(chips))
    ends = [pin.x - VIA_MM / 2 for pin in below] + [max(line.x for line in lines) + _PAD]
    if chips:
        below, bottom, passed = _registers(drawing, chips, plugs, below, bottom)
        ends += passed
    top = bottom - channel.height(below + _tried(plugs)) - 3.0
    pins = below + [pin for plug in plugs for pin in _plug(drawing, plug, top)]
    channel.join(drawing, pins, bottom)
    widths = [(unit.x, unit.part.width / 2) for unit in plugs + chips]
    ends += [x - half for x, half in widths] + [x + half for x, half in widths]
    ends += [pin.x + side * VIA_MM / 2 for pin in below for side in (-1, 1)]
    return min(ends), top - plugs[0].part.height / 2, max(ends)


def _line(drawing: Drawing, circuit: Circuit, line: Line, base: float, grid: Grid) -> Iterator[Pin]:
    x, middle = line.x, base - 1.9
    if line.used:
        drawing.via(line.net, x, base)
        drawing.run(line.net, "B", (x, base), (x, middle + 0.8))
    ohms = f"{circuit.series_ohm:g}"
    drawing.place("R", RESISTOR, ohms, (x, middle), {"1": line.net, "2": line.pin}, 90, label=_LINE_LABEL)
    yield _stepped(drawing, line.pin, x, middle - 0.8, grid)
    beside = None
    if line.pull:
        ohms = f"{circuit.row_pull_ohm if line.kind == 'row' else circuit.column_pull_ohm:g}"
        beside = "R", RESISTOR, ohms, SUPPLY if line.pull == "up" else GND
    elif circuit.falling and line.kind == "column":
        falling = circuit.falling
        beside = "C", column_capacitor(falling.column_pf, falling.tolerance), f"{falling.column_pf:g}p", GND
    if beside:
        letter, part, value, rail = beside
        x -= _BESIDE
        drawing.run(line.net, "B", (line.x, middle + 0.8), (x, middle + 0.8))
        drawing.place(letter, part, value, (x, middle), {"1": line.net, "2": rail}, 90, label=_LINE_LABEL)
        yield _stepped(drawing, rail, x, middle - 0.8, grid)


def _stepped(drawing: Drawing, net: str, x: float, y: float, grid: Grid) -> Pin:
    step = grid.near(x, below=True)
    drawing.run(net, "B", (x, y), (x, y - 0.9), (step, y - 0.9))
    return Pin(net, step, y - 0.9)


def _tried(units: Sequence[_Unit]) -> list[Pin]:
    scratch = Drawing()
    return [pin for unit in units for pin in (_plug if unit.letter == "J" else _placed)(scratch, unit, 0.0)]


def _placed(drawing: Drawing, unit: _Unit, y: float) -> list[Pin]:
    return unit.place(drawing, y)


def _plug(drawing: Drawing, unit: _Unit, y: float) -> Iterator[Pin]:
    for pin in unit.place(drawing, y):
        if pin.y > y:
            yield pin
        else:
            drawing.run(pin.net, "B", (pin.x, pin.y), (pin.x + GRID_MM, y))
            yield Pin(pin.net, pin.x + GRID_MM, y)


_PMOD_RAILS = {"5": GND, "11": GND, "6": SUPPLY, "12": SUPPLY}
"""Pins of Digilent's PMOD interface beside its signals."""


def _for_pmods(skin: Skin, board: BoardSpec | None) -> list[tuple[str, list[str]]]:
    """Name and nets of a header for each PMOD socket, so that straight flat cables join both, and of one for the
    outputs."""
    found: list[tuple[str, list[str]]] = []
    if board is None:
        return found
    for connector, wires in board.pmods(skin).items():
        nets = wires | _PMOD_RAILS
        # a flat cable alternates between the rows of a header: pins 1 to 6 of the socket, and 7 to 12
        found.append((board.connectors[connector], [nets.get(str(k // 2 + 1 + k % 2 * 6), "") for k in range(12)]))
    if found:
        found.append(("OUTPUT", ["contact", GND, "alive" if skin.alive else "", GND, SUPPLY, GND]))
    return found


def _of_lines(skin: Skin) -> list[tuple[str, list[str]]]:
    """Nets of headers without a name, in the order of the lines."""
    found = []
    for wires in (spec.row_wires(skin), spec.column_wires(skin)):
        ports = [port(name, bit, bits) for name, bits in wires.items() for bit in range(bits)]
        most = HEADER_PINS[-1] * LINES_A_GROUND // (LINES_A_GROUND + 1) - 2
        count = -(-len(ports) // most)
        share = -(-len(ports) // count)
        found += [_with_grounds(ports[first : first + share]) for first in range(0, len(ports), share)]
    return [("", nets) for nets in found]


def _connectors(found: Sequence[tuple[str, list[str]]], middle: float, grid: Grid, below: bool) -> list[_Unit]:
    parts = [header(len(nets)) for _, nets in found]
    left = middle - sum(part.width + GRID_MM for part in parts) / 2
    units = []
    for part, (name, nets) in zip(parts, found, strict=True):
        x = grid.near(left + part.width / 2, below)
        left += part.width + GRID_MM
        named = {str(pin + 1): net for pin, net in enumerate(nets) if net}
        units.append(_Unit("J", part, name or part.name, x, 180, named))
    return units


def _with_grounds(ports: Sequence[str]) -> list[str]:
    nets = [*ports[:1]]
    for index, name in enumerate(ports[1:], 1):
        nets += [GND] * (index % LINES_A_GROUND == 0) + [name]
    spare = smallest_header(len(nets) + 2) - len(nets)
    return [*nets[:-1], SUPPLY, *[GND] * (spare - 1), nets[-1]]


SLOTS = 8, 10, 11, 12, 13, 14
"""Grid steps, from a chip's first pin on, at which tracks pass it."""
CHIP_STEPS = 15
"""Grid steps from chip to chip; its capacitor is at step 9."""


def _chips(skin: Skin, circuit: Circuit, middle: float, grid: Grid) -> list[_Unit]:
    nets = list(_chip_nets(skin, LVC595 if circuit.pin_ohm <= LVC_OHM else HC595))
    if not nets:
        return []
    start = grid.near(middle - len(nets) * CHIP_STEPS * GRID_MM / 2, below=False)
    units = []
    for index, (part, of_pins) in enumerate(nets):
        x = start + index * CHIP_STEPS * GRID_MM
        units.append(_Unit("U", part, part.order.partition(",")[0], x + 3.5 * GRID_MM, 180, of_pins))
        units.append(_Unit("C", CAPACITOR, "100n", x + 9 * GRID_MM, 90, {"1": GND, "2": SUPPLY}))
    if skin.row_drive != "direct":
        held = {"1": SUPPLY, "2": "row_enable_n"}
        units.append(_Unit("R", RESISTOR, str(ENABLE_OHM), start - 2 * GRID_MM, 90, held))
    return units


def _chip_nets(skin: Skin, register: Part) -> Iterator[tuple[Part, dict[str, str]]]:
    numbers: dict[str, int] = {}
    chips: dict[tuple[str, int, int], dict[str, str]] = {}
    for output in wiring.outputs(skin):
        side = "rows" if output.chip == "74HC595" else "columns"
        bits = skin.row_lines if side == "rows" else skin.column_lines
        line = numbers[side] = numbers.get(side, -1) + 1
        chips.setdefault((output.chip, output.chain, output.number), {})[str(output.pin)] = port(side, line, bits)
    for (chip, chain, number), pins in chips.items():
        more = (chip, chain, number + 1) in chips
        if chip == "74HC595":
            data = port("row_data", chain, skin.row_chains)
            before = data if number == 0 else f"row_{chain}_{number}"
            after = {"9": f"row_{chain}_{number + 1}"} if more else {}
            shared = {"8": GND, "10": SUPPLY, "11": "row_clock", "12": "row_latch", "13": "row_enable_n", "16": SUPPLY}
            yield register, pins | shared | {"14": before} | after
        else:
            data = port("column_data", chain, skin.column_chains)
            before = data if number == 0 else f"column_{chain}_{number}"
            after = {"10": f"column_{chain}_{number + 1}" if more else GND}
            shared = {"1": "column_load_n", "2": "column_clock", "8": GND, "15": GND, "16": SUPPLY}
            unused = {str(pin): GND for _, pin in wiring.COLUMN_INPUTS if str(pin) not in pins}
            yield HC165, pins | shared | unused | {"9": before} | after


def _registers(
    drawing: Drawing, chips: Sequence[_Unit], plugs: Sequence[_Unit], below: list[Pin], bottom: float
) -> tuple[list[Pin], float, list[float]]:
    """Draw the lower channel, the chips and passing tracks. Returns the upper channel's bottom pins and bottom, and the
    x range of the passing tracks."""
    tried = _tried(chips)
    lower = [pin for pin in tried if pin.y > 0]
    upper = [pin for pin in tried if pin.y < 0]
    passing = {pin.net for pin in below + lower} & {pin.net for pin in upper + _tried(plugs)}
    slots = _slots(passing, below + lower, chips)
    crossing = [Pin(net, x, 0.0) for net, x in slots.items()]
    middle = bottom - channel.height(below + lower + crossing) - 4.5
    pins = [pin for unit in chips for pin in unit.place(drawing, middle)]
    top = middle - 4.5
    for net, x in slots.items():
        drawing.run(net, "B", (x, middle + 3.5), (x, top))
    crossing = [Pin(net, x, middle + 3.5) for net, x in slots.items()]
    channel.join(drawing, below + [pin for pin in pins if pin.y > middle] + crossing, bottom)
    above = [pin for pin in pins if pin.y < middle] + [Pin(net, x, top) for net, x in slots.items()]
    return above, top, [x + side for x in slots.values() for side in (-GRID_MM, GRID_MM)]


def _slots(passing: set[str], pins: Sequence[Pin], chips: Sequence[_Unit]) -> dict[str, float]:
    firsts = [unit.x - 3.5 * GRID_MM for unit in chips if unit.letter == "U"]
    free = [first + step * GRID_MM for first in firsts for step in SLOTS]
    beyond = itertools.count(round((max(firsts) - firsts[0]) / GRID_MM) + CHIP_STEPS + 1)
    while len(free) < len(passing):
        free.append(firsts[0] + next(beyond) * GRID_MM)
    found = {}
    for net in sorted(passing):
        own = [pin.x for pin in pins if pin.net == net]
        wanted = sum(own) / len(own)
        found[net] = min(free, key=lambda x: (abs(x - wanted), x))
        free.remove(found[net])
    return found
