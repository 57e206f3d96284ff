"""Converters that read pressure units over SPI."""

from __future__ import annotations

import dataclasses
from typing import Literal

from contactfpga.choices.choice import Choice
from contactfpga.choices.choice import find as find_choice


@dataclasses.dataclass(frozen=True)
class ConverterPace:
    """Timing of a converter that converts all channels by itself, paced by a clock from the board."""

    most_hz: int
    """Highest frequency of the pacing clock."""
    least_level_ns: int
    """Shortest level, high or low, of the pacing clock."""
    period: int
    """Periods of the pacing clock from one conversion to the next."""
    delay_halves: int
    """Half periods of the pacing clock from the middle of a conversion's average until it is ready."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Converter(Choice):
    """A converter that reads all units in sweeps.

    ``gateware``: a component with the ports of :func:`contactfpga_hdl.units.ports.converter_ports`; ``golden``: a
    :class:`contactfpga_sim.model.golden.units.ConverterRule`.
    """

    bits: int
    """Bits of a reading, at most 28."""
    channels: int
    limits: tuple[tuple[float, int], ...]
    """(supply in V, highest SPI clock in Hz) from the data sheet, rising; the first is the lowest supply."""
    most_v: float
    least_level_ns: int
    """Shortest level, high or low, of the SPI clock."""
    sweep_levels: int
    """Levels of the SPI clock (half periods) per unit in a sweep."""
    spacing_levels: int
    """Levels of the SPI clock between the samples of two units; 0 for simultaneous samples."""
    pace: ConverterPace | None = None

    def most_hz(self, supply_v: float) -> int:
        """Highest SPI clock in Hz; between two supplies of the data sheet that of the lower one."""
        return max((hz for volts, hz in self.limits if volts <= supply_v), default=0)


ConverterName = Literal["mcp3208", "ads131m08"]

CONVERTERS: dict[str, Converter] = {
    converter.name: converter
    for converter in (
        Converter(
            name="mcp3208",
            title="MCP3208",
            gateware="contactfpga_hdl.units.mcp3208:Mcp3208",
            golden="contactfpga_sim.model.golden.units:MCP3208",
            bits=12,
            channels=8,
            limits=((2.7, 1_000_000), (5.0, 2_000_000)),
            most_v=5.5,
            least_level_ns=250,
            sweep_levels=40,
            spacing_levels=40,
        ),
        # Texas Instruments SBAS950B, 6.6 and 6.7, 2.7 V and above: levels of 20 ns, and 20 ns until a bit is there;
        # twice that leaves time for pins and wires. 6.3 and 6.6: its own clock from 0.3 to 8.2 MHz with levels of
        # 49 ns. Table 8-12 and 8.3.5: 1024 modulator samples per result at power-up, two periods each. 8.3.7.1: a
        # sinc3 filter, which is as long as three results.
        Converter(
            name="ads131m08",
            title="ADS131M08",
            gateware="contactfpga_hdl.units.ads131m08:Ads131m08",
            golden="contactfpga_sim.model.golden.units:ADS131M08",
            bits=24,
            channels=8,
            limits=((2.7, 25_000_000),),
            most_v=3.6,
            least_level_ns=40,
            sweep_levels=0,
            spacing_levels=0,
            pace=ConverterPace(most_hz=8_200_000, least_level_ns=49, period=2048, delay_halves=3),
        ),
    )
}
"""Built-in converters by name; a new one needs an entry, gateware and a golden rule (docs/extend.md)."""


def find(value: object) -> Converter:
    return find_choice(Converter, CONVERTERS, value)
