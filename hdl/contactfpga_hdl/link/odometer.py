"""Counters for years, in the digits of a hello."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.wire.protocol import DIGIT_BITS, EPOCH_DIGITS, SENT_DIGITS, STATE_DIGITS

LIVE_DIGITS = 2
"""Low digits of the count of sent frames, kept by the link; they contain a frame's sequence number."""

_EPOCH = SENT_DIGITS
_LAST = (_EPOCH - 1, _EPOCH + EPOCH_DIGITS - 1)


class Odometer(wiring.Component):
    """The high digits of the count of sent frames, and all of the epoch, at their places in a hello's state.

    A carry takes two clocks per changing digit. At first all digits are set to 0, a clock each, as memory has no reset.

    sent, epoch (in): pulses to count one more; one carry of each kind may wait.
    hold (in): no carry begins.
    place (in), digit (out): the digit at the previous clock's place while no carry is under way; 0 at other places.
    """

    def __init__(self):
        super().__init__(
            {
                "sent": In(1),
                "epoch": In(1),
                "hold": In(1),
                "place": In(range(STATE_DIGITS)),
                "digit": Out(DIGIT_BITS),
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules.digits = digits = memory.Memory(shape=DIGIT_BITS, depth=STATE_DIGITS, init=[])
        read, write = digits.read_port(), digits.write_port()
        sent_waits = Signal()
        epoch_waits = Signal()
        at = Signal.like(self.place)
        # Digit at the hello's place
        m.d.comb += [
            self.digit.eq(read.data),
            read.addr.eq(self.place),
            write.addr.eq(at),
            write.data.eq(read.data + 1),
        ]
        # Carry
        with m.FSM(name="carry", init="CLEAR"):
            with m.State("REST"):
                with m.If((sent_waits | epoch_waits) & ~self.hold):
                    m.d.sync += at.eq(Mux(sent_waits, LIVE_DIGITS, _EPOCH))
                    m.d.sync += [sent_waits.eq(0), epoch_waits.eq(epoch_waits & sent_waits)]
                    m.next = "READ"
            with m.State("READ"):
                m.d.comb += read.addr.eq(at)
                m.next = "WRITE"
            with m.State("WRITE"):
                m.d.comb += write.en.eq(1)
                m.d.sync += at.eq(at + 1)
                m.next = "REST"
                with m.If(read.data.all() & (at != _LAST[0]) & (at != _LAST[1])):
                    m.next = "READ"
            with m.State("CLEAR"):
                m.d.comb += [write.en.eq(1), write.data.eq(0)]
                m.d.sync += at.eq(at + 1)
                with m.If(at == STATE_DIGITS - 1):
                    m.next = "REST"
        # Carries that wait
        with m.If(self.sent):
            m.d.sync += sent_waits.eq(1)
        with m.If(self.epoch):
            m.d.sync += epoch_waits.eq(1)
        return m
