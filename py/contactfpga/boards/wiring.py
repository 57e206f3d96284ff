"""Connections of a board's pins, or of shift registers' outputs, to a sheet's lines; without Amaranth."""

from __future__ import annotations

import collections
import dataclasses
from collections.abc import Iterator, Sequence

from contactfpga.boards.spec import BoardSpec
from contactfpga.choices import converters
from contactfpga.skin import Skin
from contactfpga.skin.several import Several

OWN = "(on the board)"
"""Destination of a wire that nobody has to solder."""

ROW_OUTPUTS = ("QA", 15), ("QB", 1), ("QC", 2), ("QD", 3), ("QE", 4), ("QF", 5), ("QG", 6), ("QH", 7)
"""Outputs of a 74HC595 with their pins, that of line 0 first."""
COLUMN_INPUTS = ("H", 6), ("G", 5), ("F", 4), ("E", 3), ("D", 14), ("C", 13), ("B", 12), ("A", 11)
"""Inputs of a 74HC165 with their pins, that of line 0 first."""

_CHIP_PINS = {
    "row_clock": "SRCLK 11 of every 74HC595",
    "row_latch": "RCLK 12 of every 74HC595",
    "row_enable_n": "OE 13 of every 74HC595, 10 kΩ to 3.3 V",
    "row_data": "SER 14 of chip 0, chain {}, 74HC595",
    "column_clock": "CLK 2 of every 74HC165",
    "column_load_n": "SH/LD 1 of every 74HC165",
    "column_data": "QH 9 of chip 0, chain {}, 74HC165",
}

_CONVERTER_PINS = {
    "mcp3208": {
        "spi_clock": "CLK 13 of the MCP3208",
        "spi_select_n": "CS 10 of the MCP3208, 10 kΩ to its supply",
        "spi_mosi": "DIN 11 of the MCP3208",
        "spi_miso": "DOUT 12 of the MCP3208",
    },
    "ads131m08": {
        "spi_clock": "SCLK 19 of the ADS131M08",
        "spi_select_n": "CS 17 of the ADS131M08, 10 kΩ to its supply",
        "spi_mosi": "DIN 21 of the ADS131M08",
        "spi_miso": "DOUT 20 of the ADS131M08",
        "spi_ready_n": "DRDY 18 of the ADS131M08",
        "spi_pace": "XTAL1/CLKIN 23 of the ADS131M08",
    },
}
"""Pin of each port by converter name; a user's own converter shows the port."""


@dataclasses.dataclass(frozen=True)
class Connection:
    leads_to: str
    """Destination such as ``row 3``, ``guard column``, ``nothing``."""
    kind: str = ""
    """``row`` or ``column`` for a line of the sheet; otherwise ""."""
    pull: str = ""
    """Direction of the pull on a line of the sheet, ``up`` or ``down``; otherwise ""."""


@dataclasses.dataclass(frozen=True)
class Wire:
    port: str
    """Name in the constraints, with the bit of a wide port: ``rows[3]``, ``uart rx``."""
    pin: str
    """``connector:pin`` as in the platform; "" if the board itself connects the pin."""
    line: Connection


@dataclasses.dataclass(frozen=True)
class Output:
    chip: str
    chain: int
    number: int
    """Position of the chip in its chain; 0 is next to the board."""
    name: str
    pin: int
    line: Connection

    @property
    def place(self) -> tuple[str, str, str, str]:
        return self.chip, str(self.chain), str(self.number), f"{self.name} {self.pin}"


def wires(board: BoardSpec, skin: Skin | Several) -> list[Wire]:
    """All FPGA pins that the gateware uses, in port order."""
    found = []
    for port, pins in board.pins(skin).items():
        lines = _lines_of_sheet(skin, port, len(pins)) if isinstance(skin, Several) else _lines(skin, port, len(pins))
        names = [port] if len(pins) == 1 else [f"{port}[{bit}]" for bit in range(len(pins))]
        found += [Wire(name, pin, line) for name, pin, line in zip(names, pins, lines, strict=True)]
    found.append(Wire("contact", board.contact, Connection("stop input of the robot: high while touched")))
    for name, pin, other in zip(("rx", "tx"), board.uart or ("", ""), ("TXD", "RXD"), strict=True):
        place = f"{other} of the {board.bridge.chip}" + ("" if board.uart else f" {OWN}")
        found.append(Wire(f"uart {name}", pin, Connection(place)))
    found.append(Wire("clock", "", Connection(f"crystal {OWN}")))
    many = len(board.held_high) > 1
    for bit, _ in enumerate(board.held_high):
        name = f"held_high[{bit}]" if many else "held_high"
        found.append(Wire(name, "", Connection(f"another chip, held high {OWN}")))
    return found


def outputs(skin: Skin) -> list[Output]:
    found: list[Output] = []
    if skin.row_drive != "direct":
        found += _chained("74HC595", ROW_OUTPUTS, skin.row_chains, row_lines(skin))
    if skin.column_read != "direct":
        found += _chained("74HC165", COLUMN_INPUTS, skin.column_chains, column_lines(skin))
    return found


def parts(skin: Skin) -> dict[str, int]:
    lines = [*row_lines(skin), *column_lines(skin)]
    cells = skin.rows * skin.columns - len(skin.mask)
    chips = collections.Counter(chip for chip, *_ in {(one.chip, one.chain, one.number) for one in outputs(skin)})
    guards = len(lines) - skin.rows - skin.columns and skin.rows + skin.columns
    found = {
        "switches": cells,
        "diodes": 0 if skin.diodes == "none" else cells + guards,
        "series resistors": len(lines),
        "pull resistors": sum(bool(line.pull) for line in lines),
        "ruler resistors": skin.ruler and guards,
        "column capacitors": skin.ruler and skin.column_lines,
        **chips,
        "capacitors of 100 nF": chips.total(),
    }
    return {name: count for name, count in found.items() if count}


def row_lines(skin: Skin) -> list[Connection]:
    """Connection of each row's line; the guard row's comes last."""
    pull = ("down" if skin.selects_low else "up") if skin.reads_rows else ""
    return _sheet_lines("row", skin.line_of_row, skin.rows, pull)


def column_lines(skin: Skin) -> list[Connection]:
    """Connection of each column's line; the guard column's comes last."""
    pull = "" if skin.ruler else "up" if skin.selects_low else "down"
    return _sheet_lines("column", skin.line_of_column, skin.columns, pull)


def _sheet_lines(kind: str, line_of: Sequence[int], count: int, pull: str) -> list[Connection]:
    names = [f"{kind} {number}" for number in range(count)] + [f"guard {kind}"] * (len(line_of) - count)
    return [Connection(names[line_of.index(line)], kind, pull) for line in range(len(line_of))]


def _lines(skin: Skin, port: str, count: int) -> Sequence[Connection]:
    if port == "rows":
        return row_lines(skin)
    if port == "columns":
        return column_lines(skin)
    if port == "alive":
        return [Connection("watchdog: turns each ms while all is well")]
    if port.startswith("spi_"):
        return [Connection(_CONVERTER_PINS.get(converters.find(skin.converter).name, {}).get(port, port))]
    return [Connection(_CHIP_PINS[port].format(chain)) for chain in range(count)]


def _lines_of_sheet(several: Several, port: str, count: int) -> Sequence[Connection]:
    name, _, number = port.rpartition("_")
    lines = _lines(several.skins[int(number)], name, count)
    return [Connection(f"sheet {number}: {line.leads_to}") for line in lines]


def _chained(chip: str, names: Sequence[tuple[str, int]], chains: int, lines: Sequence[Connection]) -> Iterator[Output]:
    """Outputs of chains of n lines: chain j has lines j n to j n + n - 1, the first next to the board."""
    length = -(-len(lines) // chains)
    for index, line in enumerate(lines):
        chain, place = divmod(index, length)
        name, pin = names[place % len(names)]
        yield Output(chip, chain, place // len(names), name, pin, line)


def ohms(value: float) -> str:
    """A resistance as printed on a resistor's bag."""
    for limit, unit in ((1e6, "MΩ"), (1e3, "kΩ")):
        if value >= limit:
            return f"{value / limit:g} {unit}"
    return f"{value:g} Ω"
