"""Bits as low pulses, for a line whose own bits are too short to be sampled (docs/protocol.md)."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from contactfpga_hdl.link.uart import LINE_BITS

LONGEST_ONE, LONGEST_MARK = 3, 7
"""Longest pulses in bits of the line; the host sends 1 for a one, 5 for a mark, 9 for a zero."""


class PulseReceiver(wiring.Component):
    """Line level in, bits out, each in the clock in which the line is high again after a pulse.

    A mark is a byte without bits, which is ``good``; a mark within a byte first makes that byte ``bad``, a clock
    earlier.

    pin (in): the line, through two synchronizer stages.
    bits (out): see :data:`~contactfpga_hdl.link.uart.LINE_BITS`; ``good`` comes in the clock after a byte's last bit.
    """

    def __init__(self, bit_clocks: int):
        self.bit_clocks = bit_clocks
        super().__init__({"pin": In(1, init=1), "bits": Out(LINE_BITS)})

    def elaborate(self, platform):
        m = Module()
        index = self.bits.index
        level = Signal(init=1)
        m.submodules.sync_pin = FFSynchronizer(self.pin, level, init=1)
        longest_one, longest_mark = LONGEST_ONE * self.bit_clocks, LONGEST_MARK * self.bit_clocks
        low = Signal(range(longest_mark + 2))  # clocks by now; stays above the longest mark
        ends = Signal()
        mark = Signal()
        whole = Signal()  # since a clock ago
        # Pulse: a bit, by its length, or a mark
        m.d.comb += [
            ends.eq(level & (low != 0)),
            mark.eq((low > longest_one) & (low <= longest_mark)),
            self.bits.level.eq(low <= longest_one),
            self.bits.bit.eq(ends & ~mark),
            self.bits.good.eq(whole | ends & mark & (index == 0)),
            self.bits.bad.eq(ends & mark & (index != 0)),
        ]
        # Length of the pulse, and place in the byte
        with m.If(level):
            m.d.sync += low.eq(0)
        with m.Elif(low <= longest_mark):
            m.d.sync += low.eq(low + 1)
        m.d.sync += whole.eq(self.bits.bit & (index == 7) | self.bits.bad)
        with m.If(ends):
            m.d.sync += index.eq(Mux(mark, 0, index + 1))
        return m
