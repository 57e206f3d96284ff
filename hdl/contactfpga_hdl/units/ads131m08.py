"""ADS131M08: 24 bits, eight channels at once, paced by the board (Texas Instruments SBAS950B)."""

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.cdc import FFSynchronizer

from contactfpga.skin import Skin
from contactfpga_hdl.units.ports import converter_ports

BITS, WORDS = 24, 10
"""Bits of a word, and words of a frame: status, eight channels, check; sizes at power-up. A frame must be read whole.
"""
CLOCKS = BITS * WORDS
LEVELS = 2 * CLOCKS + 2
"""Levels (half periods) of a frame; in the last one the converter is not selected."""
SKIPPED = 3
"""Frames omitted after power-up."""


class Ads131m08(wiring.Component):
    """Reads a frame for each conversion, SPI mode 0,1; ports as in
    :func:`~contactfpga_hdl.units.ports.converter_ports`.

    The converter keeps its power-up settings: 1024 modulator samples per result, all channels, gain 1. Zeros are sent,
    which request nothing. The converter keeps two unread results (8.5.1.9.1), and its first two results after power-up
    come from a filter with another delay (8.3.7.1.1), so the first :data:`SKIPPED` frames are omitted.

    A bit changes at a rising edge and is read at the next falling one. A channel is available three clocks after that
    of its last bit.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        units = skin.derived.units
        self.level_clocks, self.pace_clocks = units.level_clocks, units.pace_level_clocks
        super().__init__(converter_ports(skin))

    def elaborate(self, platform):
        m = Module()
        self._pace(m)
        ready_n = Signal(init=1)
        before = Signal(init=1)
        # Start, when a conversion is ready
        m.submodules.sync_ready = FFSynchronizer(self.pins.spi_ready_n, ready_n, init=1)
        m.d.sync += before.eq(ready_n)
        busy = Signal()
        skipped = Signal(range(SKIPPED + 1))  # frames that were left out
        counts = skipped == SKIPPED
        clock = Signal(range(self.level_clocks))  # of the level
        level = Signal(range(LEVELS))  # odd ones are high, but for the last one
        begins, ends = clock == 0, clock == self.level_clocks - 1
        starts = before & ~ready_n & ~busy
        # Levels of a frame
        with m.If(busy):
            m.d.sync += clock.eq(Mux(ends, 0, clock + 1))
            with m.If(ends):
                m.d.sync += level.eq(Mux(level == LEVELS - 1, 0, level + 1))
                with m.If(level == LEVELS - 1):
                    m.d.sync += [busy.eq(skipped == 0), skipped.eq(Mux(counts, SKIPPED, skipped + 1))]
        with m.If(starts):
            m.d.sync += busy.eq(1)
        # Pins
        m.d.sync += [
            self.sampled.eq(starts & counts),
            self.pins.spi_select_n.eq(~busy | (level == LEVELS - 1)),  # the pins follow a clock later
            self.pins.spi_clock.eq(busy & level[0] & (level < 2 * CLOCKS)),
        ]
        falls = busy & begins & ~level[0] & (level != 0)
        self._take(m, falls, counts)
        return m

    def _pace(self, m: Module) -> None:
        count = Signal(range(self.pace_clocks))
        toggles = count == self.pace_clocks - 1
        m.d.sync += [count.eq(Mux(toggles, 0, count + 1)), self.pins.spi_pace.eq(self.pins.spi_pace ^ toggles)]

    def _take(self, m: Module, falls: Value, counts: Value) -> None:
        bit = Signal()
        m.submodules.sync = FFSynchronizer(self.pins.spi_miso, bit)
        place = Signal(range(BITS))
        word = Signal(range(WORDS))
        last_bit = place == BITS - 1
        of_unit = counts & last_bit & (word >= 1) & (word <= self.skin.units)
        takes = Signal(2)
        of_last = Signal(2)
        shifted = Signal(BITS)
        m.d.sync += [
            takes.eq(Cat(falls, takes)),
            of_last.eq(Cat(falls & of_unit, of_last)),
            self.done.eq(of_last[-1]),
        ]
        with m.If(falls):
            m.d.sync += place.eq(Mux(last_bit, 0, place + 1))
            with m.If(last_bit):
                m.d.sync += word.eq(Mux(word == WORDS - 1, 0, word + 1))
        with m.If(takes[-1]):
            m.d.sync += shifted.eq(Cat(bit, shifted))
        with m.If(falls & of_unit):
            m.d.sync += [self.reading.unit.eq(word - 1), self.reading.last.eq(word == self.skin.units)]
        # Two's complement becomes a number from 0 on, with 0 in the middle.
        m.d.comb += self.reading.value.eq(Cat(shifted[:-1], ~shifted[-1]))
