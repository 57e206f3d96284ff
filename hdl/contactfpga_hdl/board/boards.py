"""The supported boards, each described once: clock, pins, bridge, programmer. Loads no Amaranth.

Sheet lines sit on two rows of header pins. Rows take the first one from its start, columns the second one, and
whichever runs out goes on at the far end of the other: row k and column k are on the same pin in every sheet. Where a
Skin has shift registers, their few wires take the place of the rows or the columns.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping
from pathlib import Path

from contactfpga.skin import Skin, SkinError
from contactfpga_hdl.board import pll

NAME = "contactfpga"
"""Of the files that a build leaves."""

MAX_BRIDGE_ERROR = 0.03
"""FTDI's limit for the difference between its rate and that of the other end."""


@dataclasses.dataclass(frozen=True)
class Bridge:
    """The USB chip that carries the UART; it divides ``max_baud`` by 1, 1.5, or 2 and more in eighths."""

    chip: str
    usb: tuple[int, int]
    max_baud: int

    def nearest(self, baud: int) -> float:
        """The rate the chip makes when asked for ``baud``."""
        eighths = max(16, round(8 * self.max_baud / baud))
        rates = [self.max_baud, self.max_baud / 1.5, 8 * self.max_baud / eighths]
        return min(rates, key=lambda rate: abs(rate - baud))


@dataclasses.dataclass(frozen=True)
class Programmer:
    """The program that writes a bitstream into the board's flash."""

    tool: str
    options: tuple[str, ...]
    install: str


@dataclasses.dataclass(frozen=True)
class BoardSpec:
    """A board; pins are named as the platform names them, ``connector:pin``."""

    name: str
    title: str
    fpga: str
    platform: str
    """``module:class`` in amaranth_boards."""
    clock_hz: int
    """Its crystal. An on-chip oscillator is never used: it is off by too much for a UART."""
    pll: str
    """The cell that makes other clocks from it; which one depends on the crystal's pin."""
    connectors: Mapping[str, str]
    """What is printed beside each connector."""
    row_side: tuple[str, ...]
    column_side: tuple[str, ...]
    contact: str
    standard: Mapping[str, str]
    """Attributes of every pin."""
    pulls: Mapping[str, Mapping[str, object]]
    """Attributes of a column by the Skin's ``diodes``; none where the FPGA has no such resistor."""
    bridge: Bridge
    programmer: Programmer
    bitstream: str
    """Ending of the bitstream's file."""
    constraints: str
    """File in constraints/; boards with the same pins share it."""
    skin: Skin
    """A sheet that fits, built unless another one is given."""
    held_high: tuple[str, ...] = ()
    """FPGA pins that other chips on the board want high."""

    @property
    def lines(self) -> int:
        """How many wires to the sheet can be on pins."""
        return len(self.row_side) + len(self.column_side)

    def pins(self, skin: Skin) -> dict[str, tuple[str, ...]]:
        """Pins of each port that the gateware has at the sheet, lowest bit first."""
        return self._dealt(row_wires(skin), self.row_side + self.column_side[::-1]) | self._dealt(
            column_wires(skin), self.column_side + self.row_side[::-1]
        )

    @staticmethod
    def _dealt(wires: Mapping[str, int], side: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
        pins = iter(side)
        return {name: tuple(itertools.islice(pins, count)) for name, count in wires.items()}

    def label(self, pin: str) -> str:
        """What is printed on the board beside a pin."""
        connector, _, number = pin.partition(":")
        return f"{self.connectors[connector]} {number}"

    def check(self, skin: Skin) -> None:
        """Raise SkinError where ``skin`` cannot be built for this board."""
        if skin.clock_hz != self.clock_hz:
            pll.dividers(self.pll, self.clock_hz, skin.clock_hz)
        self._check_wires(skin)
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

    def _check_wires(self, skin: Skin) -> None:
        rows, columns = sum(row_wires(skin).values()), sum(column_wires(skin).values())
        if rows + columns <= self.lines:
            return
        direct_rows, direct_columns = skin.row_drive == "direct", skin.column_read == "direct"
        if direct_rows and (4 + columns <= self.lines or not direct_columns):
            remedy = 'set row_drive = "74hc595"'
        elif direct_columns:
            remedy = 'set column_read = "74hc165"'
        else:
            remedy = "use fewer chains"
        raise SkinError(
            f"{skin.rows} rows and {skin.columns} columns take {rows} + {columns} wires, {self.title} has {self.lines} "
            f"free pins beside `contact`; {remedy}"
        )


def row_wires(skin: Skin) -> dict[str, int]:
    """Bits of each port at the rows, in the order of their pins."""
    if skin.row_drive == "direct":
        return {"rows": skin.rows}
    return {"row_clock": 1, "row_latch": 1, "row_enable_n": 1, "row_data": skin.row_chains}


def column_wires(skin: Skin) -> dict[str, int]:
    """Bits of each port at the columns, in the order of their pins."""
    if skin.column_read == "direct":
        return {"columns": skin.columns}
    return {"column_clock": 1, "column_load_n": 1, "column_data": skin.column_chains}


def _pins(connector: str, numbers: str) -> tuple[str, ...]:
    return tuple(f"{connector}:{number}" for number in numbers.split())


def _pairs(first: int, last: int) -> tuple[str, ...]:
    return tuple(f"gpio_0:{number}{sign}" for number in range(first, last + 1) for sign in "+-")


_PMOD = "1 2 3 4 7 8 9 10"
_FT2232H = Bridge("FT2232H", (0x0403, 0x6010), 12_000_000)
_FT231X = Bridge("FT231X", (0x0403, 0x6015), 3_000_000)
# iceprog comes with IceStorm, is what both boards' makers name, and finds the FT2232H by itself.
_ICEPROG = Programmer("iceprog", (), "sudo apt install fpga-icestorm")
# fujprog is the maker's, but distributions package openFPGALoader. Without -f the bitstream is lost at power-off.
_LOADER = Programmer("openFPGALoader", ("-b", "ulx3s", "-f"), "sudo apt install openfpgaloader")
_ICE40_PULLS: dict[str, dict[str, object]] = {"col2row": {"PULLUP": 1}, "row2col": {}}
_ECP5_PULLS: dict[str, dict[str, object]] = {"col2row": {"PULLMODE": "UP"}, "row2col": {"PULLMODE": "DOWN"}}

_ICEBREAKER = BoardSpec(
    name="icebreaker",
    title="iCEBreaker",
    fpga="iCE40UP5K",
    platform="amaranth_boards.icebreaker:ICEBreakerPlatform",
    clock_hz=12_000_000,
    pll="SB_PLL40_PAD",
    connectors={"pmod_0": "PMOD1A", "pmod_1": "PMOD1B", "pmod_2": "PMOD2"},
    row_side=_pins("pmod_0", _PMOD) + _pins("pmod_1", "1 2 3 4"),
    column_side=_pins("pmod_2", "1 2 3 4 7 8 9") + _pins("pmod_1", "7 8 9 10"),
    contact="pmod_2:10",
    standard={"IO_STANDARD": "SB_LVCMOS"},
    pulls=_ICE40_PULLS,
    bridge=_FT2232H,
    programmer=_ICEPROG,
    bitstream="bin",
    constraints="icebreaker.pcf",
    skin=Skin(row_drive="74hc595", release_us=2.0),  # a switched-off row has to be lifted by the pull-ups
)

_ICESTICK = BoardSpec(
    name="icestick",
    title="iCEStick",
    fpga="iCE40HX1K",
    platform="amaranth_boards.icestick:ICEStickPlatform",
    clock_hz=12_000_000,
    pll="SB_PLL40_CORE",
    connectors={"j_1": "J1", "j_3": "J3", "pmod_0": "J2"},
    row_side=_pins("j_1", "3 4 5 6 7 8 9 10") + _pins("pmod_0", "1 2 3 4"),
    column_side=_pins("j_3", "3 4 5 6 7 8 9 10") + _pins("pmod_0", "7 8 9"),
    contact="pmod_0:10",
    standard={"IO_STANDARD": "SB_LVCMOS"},
    pulls=_ICE40_PULLS,
    bridge=_FT2232H,
    programmer=_ICEPROG,
    bitstream="bin",
    constraints="icestick.pcf",
    skin=Skin(rows=8, columns=8, labeller="serial"),  # `run` takes 1,422 logic cells of 1,280
)

_ULX3S_12F = BoardSpec(
    name="ulx3s-12f",
    title="ULX3S 12F",
    fpga="LFE5U-12F",
    platform="amaranth_boards.ulx3s:ULX3S_12F_Platform",
    clock_hz=25_000_000,
    pll="EHXPLLL",
    connectors={"gpio_0": "GPIO"},
    row_side=_pairs(0, 10),  # 11 to 13 lead to the ESP32, 14 to 17 to the ADC
    column_side=_pairs(18, 27)[:-1],
    contact="gpio_0:27-",
    standard={"IO_TYPE": "LVCMOS33"},
    pulls=_ECP5_PULLS,
    bridge=_FT231X,
    programmer=_LOADER,
    bitstream="bit",
    constraints="ulx3s.lpf",
    skin=Skin(rows=16, columns=16, clock_hz=25_000_000, baud=1_000_000),  # 3 Mbaud is 4 % off at 25 MHz
    held_high=("L2",),  # GPIO0 of the ESP32: low puts it into its boot loader
)

BOARDS = {
    board.name: board
    for board in (
        _ICEBREAKER,
        _ICESTICK,
        _ULX3S_12F,
        dataclasses.replace(
            _ULX3S_12F,
            name="ulx3s-85f",
            title="ULX3S 85F",
            fpga="LFE5U-85F",
            platform="amaranth_boards.ulx3s:ULX3S_85F_Platform",
        ),
    )
}


def find(name: str) -> BoardSpec:
    """The board of that name."""
    try:
        return BOARDS[name]
    except KeyError:
        raise SkinError(f"no board is called {name!r}; known are {', '.join(BOARDS)}") from None


def bitstream_path(board: BoardSpec, folder: Path) -> Path:
    """Where a build puts the bitstream."""
    return folder / f"{NAME}.{board.bitstream}"
