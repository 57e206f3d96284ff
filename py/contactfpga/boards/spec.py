"""Description of a board, without Amaranth.

Rows use one side of the header pins from its start, columns the other; lines that do not fit continue at the far end of
the other side. So row k and column k are on the same pin for every sheet. A few wires of shift registers replace the
lines.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from contactfpga.boards import pll
from contactfpga.skin import Skin, SkinError
from contactfpga.skin.several import Several

NAME = "contactfpga"

UNIT_PORTS = ("spi_ready_n", "spi_pace", "spi_clock", "spi_select_n", "spi_mosi", "spi_miso")
"""Ports of the converter of pressure units; a converter without its own pace lacks the first two."""


def unit_ports(skin: Skin) -> tuple[str, ...]:
    if not skin.units:
        return ()
    return UNIT_PORTS if skin.derived.units.converter.pace is not None else UNIT_PORTS[2:]


MAX_BRIDGE_ERROR = 0.03
"""FTDI's limit for the relative difference between the rates of both ends."""


@dataclasses.dataclass(frozen=True)
class Bridge:
    """The USB chip of the UART, which divides ``max_baud`` by 1, 1.5, or 2 and more in eighths."""

    chip: str
    usb: tuple[int, int]
    interface: int | None
    """Interface of the UART; None for a chip with one interface."""
    max_baud: int
    high_speed: bool = False
    """Whether the chip is a high-speed device, 480 Mbit/s; otherwise a full-speed one, 12 Mbit/s."""

    @property
    def frame_us(self) -> int:
        """Interval of USB's schedule in us: a microframe, or a frame (USB 2.0, 5.3.3)."""
        return 125 if self.high_speed else 1000

    @property
    def payload_bytes(self) -> int:
        """UART bytes in a full packet: the most of a bulk endpoint (USB 2.0, 5.8.3), less the two status bytes of
        FTDI's packets (AN232B-04)."""
        return (512 if self.high_speed else 64) - 2

    def nearest(self, baud: int) -> float:
        eighths = max(16, round(8 * self.max_baud / baud))
        rates = [self.max_baud, self.max_baud / 1.5, 8 * self.max_baud / eighths]
        return min(rates, key=lambda rate: abs(rate - baud))


@dataclasses.dataclass(frozen=True)
class Programmer:
    tool: str
    options: tuple[str, ...]
    install: str
    wheel: str = ""
    """Command of a wheel with the same program, which needs the system's libusb; "": none."""


@dataclasses.dataclass(frozen=True)
class BoardSpec:
    """A board; pins have the platform's names, ``connector:pin``."""

    name: str
    title: str
    fpga: str
    platform: str
    """``module:class`` in amaranth_boards."""
    clock_hz: int
    """Frequency of the crystal. An on-chip oscillator is too imprecise for a UART."""
    pll: str
    """PLL cell for other clocks, which depends on the crystal's pin."""
    connectors: Mapping[str, str]
    """Print beside each connector."""
    row_side: tuple[str, ...]
    column_side: tuple[str, ...]
    contact: str
    standard: Mapping[str, str]
    """Attributes of every pin."""
    pulls: Mapping[str, Mapping[str, object]]
    """Attributes of a column by the Skin's ``diodes``; none if the FPGA lacks such a resistor."""
    bridge: Bridge
    programmer: Programmer
    bitstream: str
    constraints: str
    """File in constraints/, common to boards with the same pins."""
    skin: Skin
    circuit: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """Table ``[circuit]`` of the default sheet."""
    uart: tuple[str, str] | None = None
    """Connector pins of an external bridge for receiving and sending; None for a bridge on the board."""
    printed: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """Header of each pin and the print beside it, where wires are plugged one by one."""
    rails: Mapping[str, tuple[str, ...]] = dataclasses.field(default_factory=dict)
    """Header and number of the pins for single wires of ``GND`` and ``3V3``."""
    held_high: tuple[str, ...] = ()
    """FPGA pins that other chips on the board need high."""

    def pmods(self, skin: Skin) -> dict[str, dict[str, str]]:
        """Wire at each pin of each PMOD socket, by the socket's connector, `contact` too; empty if other connectors
        have wires of this Skin as well."""
        wires = {
            pin: port if len(pins) == 1 else f"{port}[{bit}]"
            for port, pins in self.pins(skin).items()
            for bit, pin in enumerate(pins)
        }
        found: dict[str, dict[str, str]] = {}
        for pin, wire in {**wires, self.contact: "contact"}.items():
            connector, _, number = pin.partition(":")
            found.setdefault(connector, {})[number] = wire
        return dict(sorted(found.items())) if all(name.startswith("pmod_") for name in found) else {}

    @property
    def lines(self) -> int:
        """Number of pins for wires to the sheet."""
        return len(self.row_side) + len(self.column_side)

    @property
    def alive(self) -> str:
        """Pin of ``alive``; without ``alive`` a pin of the sheet. Further sheets have the pins before it."""
        return self.column_side[-1]

    @property
    def converter(self) -> tuple[str, ...]:
        """Pins of :data:`UNIT_PORTS` for a Skin with units; without units pins of the sheet."""
        return self.row_side[-len(UNIT_PORTS) :]

    def pins(self, skin: Skin | Several) -> dict[str, tuple[str, ...]]:
        """Pins of each gateware port at the sheet and at the converter, and of ``alive``, lowest bit first; port names
        of several sheets end with the sheet's number."""
        if isinstance(skin, Several):
            alive = {f"alive_{number}": 1 for number, one in enumerate(skin.skins) if one.alive}
            columns = self.column_side[: len(self.column_side) - len(alive)]
            dealt = self._dealt(_of_sheets(skin, row_wires), self.row_side + columns[::-1])
            dealt |= self._dealt(_of_sheets(skin, column_wires), columns + self.row_side[::-1])
            return dealt | self._dealt(alive, self.column_side[::-1])
        columns = self.column_side[:-1] if skin.alive else self.column_side
        ports = unit_ports(skin)
        rows = self.row_side[: len(self.row_side) - len(ports)]
        dealt = self._dealt(row_wires(skin), rows + columns[::-1])
        dealt |= self._dealt(column_wires(skin), columns + rows[::-1])
        converter = self.converter[len(UNIT_PORTS) - len(ports) :]
        dealt |= {port: (pin,) for port, pin in zip(ports, converter, strict=True)}
        return dealt | ({"alive": (self.alive,)} if skin.alive else {})

    @staticmethod
    def _dealt(wires: Mapping[str, int], side: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
        pins = iter(side)
        return {name: tuple(itertools.islice(pins, count)) for name, count in wires.items()}

    def load(self, path: str | Path) -> Skin:
        """Read a Skin's file with defaults for ``clock_hz`` and ``baud`` from the board's own Skin."""
        return Skin.load(path, usual={"clock_hz": self.skin.clock_hz, "baud": self.skin.baud})

    def label(self, pin: str) -> str:
        connector, _, number = pin.partition(":")
        return f"{self.connectors[connector]} {number}"

    def check(self, skin: Skin | Several) -> None:
        """Raise SkinError if this board cannot be built for one or several sheets."""
        self.check_clock(skin)
        self.check_pins(skin)
        self.check_baud(skin)

    def check_clock(self, skin: Skin | Several) -> None:
        """Raise SkinError for a clock that neither crystal nor PLL gives."""
        if skin.clock_hz != self.clock_hz:
            pll.dividers(self.pll, self.clock_hz, skin.clock_hz)

    def check_pins(self, skin: Skin | Several) -> None:
        if isinstance(skin, Several):
            self._check_sheets(skin)
        else:
            self._check_wires(skin)

    def check_baud(self, skin: Skin | Several) -> None:
        """Raise SkinError for a rate that the bridge does not reach, or misses by more than a UART tolerates."""
        if skin.baud > self.bridge.max_baud:
            raise SkinError(
                f"baud is {skin.baud}, the {self.bridge.chip} of {self.title} reaches {self.bridge.max_baud} at most"
            )
        sent = skin.clock_hz / round(skin.clock_hz / skin.baud)
        error = self.bridge.nearest(skin.baud) / sent - 1
        if abs(error) > MAX_BRIDGE_ERROR:
            raise SkinError(
                f"baud is {skin.baud}: {self.title} sends {sent:.0f} and its {self.bridge.chip} reads at "
                f"{self.bridge.nearest(skin.baud):.0f}, {100 * error:+.1f} %; the limit is {100 * MAX_BRIDGE_ERROR:g} %"
            )

    def _check_sheets(self, several: Several) -> None:
        wires = [sum({**row_wires(skin), **column_wires(skin)}.values()) + skin.alive for skin in several.skins]
        if sum(wires) > self.lines:
            taken = " + ".join(map(str, wires))
            raise SkinError(
                f"{len(wires)} sheets take {taken} wires, {self.title} has {self.lines} free pins beside `contact`; "
                "use fewer chains or fewer sheets"
            )

    def _check_wires(self, skin: Skin) -> None:
        rows, columns = sum(row_wires(skin).values()), sum(column_wires(skin).values())
        free = self.lines - skin.alive - len(unit_ports(skin))
        if rows + columns <= free:
            return
        direct_rows, direct_columns = skin.row_drive == "direct", skin.column_read == "direct"
        if direct_rows and (4 + columns <= free or not direct_columns):
            remedy = 'set row_drive = "74hc595"'
        elif direct_columns:
            remedy = 'set column_read = "74hc165"'
        else:
            remedy = "use fewer chains"
        guarded = " with guard lines" if skin.guard else ""
        outputs = "`contact` and `alive`" if skin.alive else "`contact`"
        outputs += " and the converter" if skin.units else ""
        raise SkinError(
            f"{skin.rows} rows and {skin.columns} columns{guarded} take {rows} + {columns} wires, {self.title} has "
            f"{free} free pins beside {outputs}; {remedy}"
        )


def row_wires(skin: Skin) -> dict[str, int]:
    if skin.row_drive == "direct":
        return {"rows": skin.row_lines}
    return {"row_clock": 1, "row_latch": 1, "row_enable_n": 1, "row_data": skin.row_chains}


def column_wires(skin: Skin) -> dict[str, int]:
    if skin.column_read == "direct":
        return {"columns": skin.column_lines}
    return {"column_clock": 1, "column_load_n": 1, "column_data": skin.column_chains}


def _of_sheets(several: Several, wires: Callable[[Skin], Mapping[str, int]]) -> dict[str, int]:
    return {f"{name}_{number}": bits for number, skin in enumerate(several.skins) for name, bits in wires(skin).items()}


def pins_of(connector: str, numbers: str) -> tuple[str, ...]:
    return tuple(f"{connector}:{number}" for number in numbers.split())


def bitstream_path(board: BoardSpec, folder: Path) -> Path:
    return folder / f"{NAME}.{board.bitstream}"
