"""Pins of an SPI converter, and common ports of converters."""

from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.units import INDEX_BITS


def unit_pins(skin: Skin) -> dict[str, wiring.Member]:
    """The pins at the converter; none without units. Some converters add a ready signal and a pacing clock."""
    if not skin.units:
        return {}
    pins = {"spi_clock": Out(1), "spi_select_n": Out(1, init=1), "spi_mosi": Out(1), "spi_miso": In(1)}
    if skin.derived.units.converter.pace is not None:
        pins |= {"spi_ready_n": In(1, init=1), "spi_pace": Out(1)}
    return pins


def reading_layout(skin: Skin) -> data.StructLayout:
    """A reading, its unit, and whether it is the sweep's last."""
    return data.StructLayout({"value": skin.derived.units.converter.bits, "unit": INDEX_BITS, "last": 1})


def converter_ports(skin: Skin) -> dict[str, wiring.Member]:
    """The ports of every converter.

    pins: pins at the converter, from registers.
    sampled (out): pulse as a sweep's first unit is sampled.
    done (out): pulse when a reading is available; units come in ascending order, at least 14 clocks apart.
    reading (out): valid with ``done``.
    """
    return {
        "pins": Out(wiring.Signature(unit_pins(skin))),
        "sampled": Out(1),
        "done": Out(1),
        "reading": Out(reading_layout(skin)),
    }
