"""UART: 8 data bits, no parity, one stop bit, lowest bit first."""

from amaranth.hdl import Cat, Const, Module, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out


class Transmitter(wiring.Component):
    """Bytes in, line level out. A byte takes ten bits of ``bit_clocks``; the next one follows without a gap.

    bytes (in): a byte is taken in the last clock of the stop bit before, or when nothing is sent.
    pin (out): the line; the start bit begins in the clock after a byte is taken.
    """

    def __init__(self, bit_clocks: int):
        self.bit_clocks = bit_clocks
        super().__init__({"bytes": In(stream.Signature(8)), "pin": Out(1, init=1)})

    def elaborate(self, platform):
        m = Module()
        clock = Signal(range(self.bit_clocks))
        bits_left = Signal(range(11))
        shift = Signal(9, init=0x1FF)
        bit_ends = clock == 0
        m.d.comb += self.bytes.ready.eq((bits_left == 0) | (bits_left == 1) & bit_ends)
        with m.If(self.bytes.valid & self.bytes.ready):
            m.d.sync += [
                Cat(self.pin, shift).eq(Cat(Const(0, 1), self.bytes.payload, Const(1, 1))),
                clock.eq(self.bit_clocks - 1),
                bits_left.eq(10),
            ]
        with m.Elif(bits_left != 0):
            m.d.sync += clock.eq(clock - 1)
            with m.If(bit_ends):
                m.d.sync += [
                    Cat(self.pin, shift).eq(Cat(shift, Const(1, 1))),
                    clock.eq(self.bit_clocks - 1),
                    bits_left.eq(bits_left - 1),
                ]
        return m


LINE_BITS = wiring.Signature({"level": Out(1, init=1), "bit": Out(1), "index": Out(3), "good": Out(1), "bad": Out(1)})
"""Output of a receiver: ``bit`` is a pulse in each data bit, with its ``level`` and its ``index`` in the byte; ``good``
or ``bad`` is a pulse after the last bit."""


class Receiver(wiring.Component):
    """Line level in, bits out, each sampled in its middle; ``good`` and ``bad`` in that of the stop bit.

    Bit n, from 1 for the lowest to 9 for the stop bit, is sampled ``2 + bit_clocks // 2 + n * bit_clocks`` clocks after
    the pin fell. A start bit that is over in its middle is ignored.

    pin (in): the line, through two synchronizer stages.
    bits (out): see :data:`LINE_BITS`.
    """

    def __init__(self, bit_clocks: int):
        self.bit_clocks = bit_clocks
        super().__init__({"pin": In(1, init=1), "bits": Out(LINE_BITS)})

    def elaborate(self, platform):
        m = Module()
        level = self.bits.level
        m.submodules.sync_pin = FFSynchronizer(self.pin, level, init=1)
        half = self.bit_clocks // 2
        clock = Signal(range(self.bit_clocks))
        bits_left = Signal(range(11))  # counting the start bit; 0: waiting for one
        # Bits, sampled in their middle
        with m.If(bits_left == 0):
            with m.If(~level):
                m.d.sync += [bits_left.eq(10), clock.eq(half - 1)]
        with m.Elif(clock != 0):
            m.d.sync += clock.eq(clock - 1)
        with m.Else():
            m.d.sync += [bits_left.eq(bits_left - 1), clock.eq(self.bit_clocks - 1)]
            starts, stops = bits_left == 10, bits_left == 1
            with m.If(starts & level):
                m.d.sync += bits_left.eq(0)  # no start bit, only noise
            m.d.comb += [
                self.bits.bit.eq(~starts & ~stops),
                self.bits.good.eq(stops & level),
                self.bits.bad.eq(stops & ~level),
            ]
        with m.If(self.bits.bit):
            m.d.sync += self.bits.index.eq(self.bits.index + 1)
        return m
