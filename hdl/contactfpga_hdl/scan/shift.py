"""Chains of shift registers between the board's pins and a sheet with more wires.

All pins come from registers. A bit takes ``Derived.shift_clocks``, half of them with the shift clock high;
docs/boards.md has the wiring and the chips' times.
"""

from amaranth.hdl import Cat, Const, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.cdc import FFSynchronizer

from contactfpga.skin import Skin
from contactfpga_hdl.scan.lines import of_lines, on_lines
from contactfpga_hdl.scan.pins import column_reader, released_levels, row_driver


class RowChain(wiring.Component):
    """Rows on chains of 74HC595. A pattern is loaded ``Derived.row_shift_clocks`` clocks after ``shift``; the enable
    pin follows ``drive`` and ``release`` by one clock.

    A whole pattern, highest line of each chain first, is shifted while the one before is driven, so a random state
    lasts one pattern. The latch rises while no row is driven.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        super().__init__(row_driver(skin))

    def elaborate(self, platform):
        m = Module()
        derived = self.skin.derived
        lines, clocks = derived.row_chain_lines, derived.shift_clocks
        pattern = on_lines(self.pattern, self.skin.line_of_row)
        levels = ~pattern if self.skin.selects_low else pattern
        # Shift register clock, data and latch
        busy = Signal()
        left = Signal(range(lines + 1), init=lines)  # bits to shift; then the latch takes as long as one
        clock = Signal(range(clocks))
        latching = left == 0
        with m.If(self.shift | busy):
            m.d.sync += [busy.eq(1), clock.eq(clock + 1), self.pins.row_latch.eq(latching)]
            m.d.sync += self.pins.row_clock.eq(~latching & (clock >= clocks - clocks // 2))
            with m.If(clock == clocks - 1):
                m.d.sync += [clock.eq(0), left.eq(Mux(latching, lines, left - 1)), busy.eq(~latching)]
            for chain in range(self.skin.row_chains):
                part = levels[chain * lines : (chain + 1) * lines]
                m.d.sync += self.pins.row_data[chain].eq(Cat(Const(0, 1), part).bit_select(left, 1))
        with m.Else():
            m.d.sync += self.pins.row_latch.eq(0)
        # Enable
        with m.If(self.drive):
            m.d.sync += self.pins.row_enable_n.eq(0)
        with m.Elif(self.release):
            m.d.sync += self.pins.row_enable_n.eq(1)
        return m


class ColumnChain(wiring.Component):
    """Columns on chains of 74HC165.

    The load pulse captures all columns in its last clock. The first line of each chain needs no shift, each further one
    a rising edge; a bit is read in the last clock before the next edge.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        super().__init__(column_reader(skin))

    def elaborate(self, platform):
        m = Module()
        derived = self.skin.derived
        lines, clocks = derived.column_chain_lines, derived.shift_clocks
        busy = Signal()
        bit = Signal(range(lines + 1))  # 0 is the load pulse
        clock = Signal(range(clocks))
        ends = Signal()
        last = bit == lines
        # Load pulse and shift clock
        # The pins lag this count by their register, what comes back by that and the synchronizer's two stages.
        taken, done = Signal(3), Signal(3)
        m.d.sync += [taken.eq(Cat(ends & (bit != 0), taken)), done.eq(Cat(ends & last, done))]
        m.d.comb += self.done.eq(done[-1])
        with m.If(self.begin | busy):
            m.d.comb += ends.eq(clock == clocks - 1)
            m.d.sync += [busy.eq(~(ends & last)), clock.eq(Mux(ends, 0, clock + 1))]
            m.d.sync += self.pins.column_load_n.eq(bit != 0)
            m.d.sync += self.pins.column_clock.eq((bit > 1) & (clock < clocks // 2))
            with m.If(ends):
                m.d.sync += bit.eq(Mux(last, 0, bit + 1))
        # Levels
        synced = Signal(self.skin.column_chains)
        released = released_levels(self.skin, self.skin.column_chains)
        m.submodules.sync = FFSynchronizer(self.pins.column_data, synced, init=released)
        chains = []
        for line in synced:
            before = Signal(lines - 1)
            word = Cat(before, line)
            with m.If(taken[-1]):
                m.d.sync += before.eq(word[1:])
            chains.append(word)
        m.d.comb += self.levels.eq(of_lines(Cat(chains), self.skin.line_of_column))
        return m
