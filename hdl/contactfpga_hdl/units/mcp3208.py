"""MCP3208: 12 bits, eight channels, converted in turn (Microchip DS21298E, chapter 5 and table 1-1)."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.cdc import FFSynchronizer

from contactfpga.skin import Skin
from contactfpga_hdl.units.ports import converter_ports

CLOCKS = 19
"""SPI clocks of a conversion: start, single-ended, three bits of the channel, one for the sample, a null bit and twelve
bits, the highest first."""
SAMPLE_CLOCK = 6
"""SPI clock, counted from 1, whose falling edge holds the input."""
LEVELS = 40
"""Levels (half periods) of a conversion; in the last two, and at power-up, the converter is not selected."""


class Mcp3208(wiring.Component):
    """Sweeps the units without a pause, SPI mode 0,0; ports as in :func:`~contactfpga_hdl.units.ports.converter_ports`.

    A bit changes at a falling edge and is read at the next rising one. A reading is available three clocks after that.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.level_clocks = skin.derived.units.level_clocks
        super().__init__(converter_ports(skin))

    def elaborate(self, platform):
        m = Module()
        clock = Signal(range(self.level_clocks))  # of the level
        level = Signal(range(LEVELS), init=LEVELS - 2)  # odd ones are high
        unit = Signal.like(self.reading.unit, init=self.skin.units - 1)
        last_unit = unit == self.skin.units - 1
        begins = clock == 0  # the pins follow a clock later
        ends = clock == self.level_clocks - 1
        # Levels of a conversion, and its unit
        m.d.sync += clock.eq(Mux(ends, 0, clock + 1))
        with m.If(ends):
            m.d.sync += level.eq(Mux(level == LEVELS - 1, 0, level + 1))
            with m.If(level == LEVELS - 1):
                m.d.sync += unit.eq(Mux(last_unit, 0, unit + 1))
        # Pins
        command = Cat(Const(0b11, 2), unit[::-1])
        m.d.sync += [
            self.pins.spi_select_n.eq(level >= 2 * CLOCKS),
            self.pins.spi_clock.eq(level[0] & (level < 2 * CLOCKS)),
            self.pins.spi_mosi.eq(Cat(command, Const(0, 2 * CLOCKS)).bit_select(level >> 1, 1)),
            self.sampled.eq(begins & (level == 2 * SAMPLE_CLOCK) & (unit == 0)),
        ]
        self._take(m, begins & level[0] & (level < 2 * CLOCKS), level == 2 * CLOCKS - 1, unit, last_unit)
        return m

    def _take(self, m: Module, rises: Value, last_bit: Value, unit: Value, last_unit: Value) -> None:
        level = Signal()
        m.submodules.sync = FFSynchronizer(self.pins.spi_miso, level)
        takes = Signal(2)
        of_last = Signal(2)
        m.d.sync += [
            takes.eq(Cat(rises, takes)),
            of_last.eq(Cat(rises & last_bit, of_last)),
            self.done.eq(of_last[-1]),
        ]
        with m.If(takes[-1]):
            m.d.sync += self.reading.value.eq(Cat(level, self.reading.value))
        with m.If(rises & last_bit):
            m.d.sync += [self.reading.unit.eq(unit), self.reading.last.eq(last_unit)]
