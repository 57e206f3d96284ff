"""Boards with an iCE40 and an FT2232H: iCEBreaker and iCEStick."""

from __future__ import annotations

from contactfpga.boards.spec import BoardSpec, Bridge, Programmer, pins_of
from contactfpga.skin import Skin

_PMOD = "1 2 3 4 7 8 9 10"
_FT2232H = Bridge("FT2232H", (0x0403, 0x6010), 1, 12_000_000, high_speed=True)  # interface 0 programs the flash
# iceprog comes with IceStorm, is what both boards' makers name, and finds the FT2232H by itself.
_ICEPROG = Programmer("iceprog", (), "sudo apt install fpga-icestorm")
# What a 74HC595 drives at 3.3 V, series resistors at its outputs, pull-ups that a row of 16 pressed switches bears.
_ON_REGISTERS = {"pin_ohm": 85.0, "series_ohm": 33.0, "line_pf": 50.0}
_PULLS: dict[str, dict[str, object]] = {"col2row": {"PULLUP": 1}, "row2col": {}}

ICEBREAKER = BoardSpec(
    name="icebreaker",
    title="iCEBreaker",
    fpga="iCE40UP5K",
    platform="amaranth_boards.icebreaker:ICEBreakerPlatform",
    clock_hz=12_000_000,
    pll="SB_PLL40_PAD",
    connectors={"pmod_0": "PMOD1A", "pmod_1": "PMOD1B", "pmod_2": "PMOD2"},
    row_side=pins_of("pmod_0", _PMOD) + pins_of("pmod_1", "1 2 3 4"),
    column_side=pins_of("pmod_2", "1 2 3 4 7 8 9") + pins_of("pmod_1", "7 8 9 10"),
    contact="pmod_2:10",
    standard={"IO_STANDARD": "SB_LVCMOS"},
    pulls=_PULLS,
    bridge=_FT2232H,
    programmer=_ICEPROG,
    bitstream="bin",
    constraints="icebreaker.pcf",
    skin=Skin(row_drive="74hc595", precharge_us=0.25, settle_us=2.0, release_us=0.5),
    circuit={**_ON_REGISTERS, "column_pull_ohm": 47_000.0},
)

ICESTICK = BoardSpec(
    name="icestick",
    title="iCEStick",
    fpga="iCE40HX1K",
    platform="amaranth_boards.icestick:ICEStickPlatform",
    clock_hz=12_000_000,
    pll="SB_PLL40_CORE",
    connectors={"j_1": "J1", "j_3": "J3", "pmod_0": "J2"},
    row_side=pins_of("j_1", "3 4 5 6 7 8 9 10") + pins_of("pmod_0", "1 2 3 4"),
    column_side=pins_of("j_3", "3 4 5 6 7 8 9 10") + pins_of("pmod_0", "7 8 9"),
    contact="pmod_0:10",
    standard={"IO_STANDARD": "SB_LVCMOS"},
    pulls=_PULLS,
    bridge=_FT2232H,
    programmer=_ICEPROG,
    bitstream="bin",
    constraints="icestick.pcf",
    # 1,257 logic cells of 1,280; driving the columns back would take 1,361, `run` more.
    skin=Skin(labeller="serial", row_drive="74hc595", release_us=4.0),
    circuit={**_ON_REGISTERS, "column_pull_ohm": 22_000.0},
)
