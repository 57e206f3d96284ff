"""ULX3S, with an ECP5 of either size."""

from __future__ import annotations

import dataclasses

from contactfpga.boards.spec import BoardSpec, Bridge, Programmer
from contactfpga.skin import Skin

_FT232H = Bridge("FT232H", (0x0403, 0x6014), None, 12_000_000, high_speed=True)  # on a module of its own
_FT231X = Bridge("FT231X", (0x0403, 0x6015), None, 3_000_000)
# fujprog is the maker's, but distributions package openFPGALoader. Without -f the bitstream is lost at power-off.
_LOADER = Programmer("openFPGALoader", ("-b", "ulx3s", "-f"), "sudo apt install openfpgaloader", "openfpgaloader-cli")
_PULLS: dict[str, dict[str, object]] = {"col2row": {"PULLMODE": "UP"}, "row2col": {"PULLMODE": "DOWN"}}


def _pairs(first: int, last: int) -> tuple[str, ...]:
    return tuple(f"gpio_0:{number}{sign}" for number in range(first, last + 1) for sign in "+-")


# By gpio.sch (docs/boards.md). Both pins of a pair are on one rail, so the rails hold for either order of a header's
# rows. J2 39 and 40 are 5 V, and J1's supply can be set to 2.5 V.
_PRINTED = {
    f"gpio_0:{number}{sign}": f"J{1 if number < 14 else 2} G{letter}{number}"
    for number in range(28)
    for sign, letter in ("+P", "-N")
}
_RAILS = {
    "GND": tuple(f"J{header} {pin}" for pins in ((3, 4, 21, 22), (37, 38)) for header in (1, 2) for pin in pins),
    "3V3": ("J2 1", "J2 2"),
}

ULX3S_12F = BoardSpec(
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
    pulls=_PULLS,
    bridge=_FT231X,
    programmer=_LOADER,
    bitstream="bit",
    constraints="ulx3s.lpf",
    # 3 Mbaud is 4 % off at 25 MHz.
    skin=Skin(precharge_us=0.25, settle_us=2.0, release_us=0.5, clock_hz=25_000_000, baud=1_000_000),
    circuit={"series_ohm": 33.0, "line_pf": 50.0, "column_pull_ohm": 47_000.0},
    printed=_PRINTED,
    rails=_RAILS,
    held_high=("L2",),  # GPIO0 of the ESP32: low puts it into its boot loader
)

ULX3S_85F = dataclasses.replace(
    ULX3S_12F,
    name="ulx3s-85f",
    title="ULX3S 85F",
    fpga="LFE5U-85F",
    platform="amaranth_boards.ulx3s:ULX3S_85F_Platform",
)

ULX3S_12F_FT232H = dataclasses.replace(
    ULX3S_12F,
    name="ulx3s-12f-ft232h",
    title="ULX3S 12F with FT232H",
    column_side=(*_pairs(18, 25), "gpio_0:27+"),
    uart=("gpio_0:26+", "gpio_0:26-"),
    bridge=_FT232H,
    constraints="ulx3s-ft232h.lpf",
    skin=Skin(precharge_us=0.25, settle_us=2.0, release_us=0.5, clock_hz=60_000_000, baud=12_000_000),
)
