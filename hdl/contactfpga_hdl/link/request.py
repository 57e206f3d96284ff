"""What the host asks for: requests among the bytes at the receive pin (docs/protocol.md)."""

from amaranth.hdl import Const, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin.derived import CHECK_BYTES, HEARD_BITS
from contactfpga.wire import protocol
from contactfpga_hdl.link.uart import LINE_BITS

_CODE, _NUMBER, _KIND, _CHECK, _WHOLE = 0, 1, 1 + protocol.HEARD_DIGITS, 2 + protocol.HEARD_DIGITS, 8
"""Places in a packet: the stuffing's code, the first digit, the last byte, the first check byte; and its length."""


class RequestReader(wiring.Component):
    """Finds requests bit by bit; nothing but the number and what the check needs is kept.

    ``received`` is high with ``good`` of a request's closing delimiter, which has no bits where it comes as a pulse;
    ``hello`` then says if the request asks for one. From the next clock on ``heard`` holds the lowest bits of its
    number, and ``number`` all of it.
    ``number`` is 0 again from the clock after the first digit's first bit of any later packet.
    """

    def __init__(self):
        super().__init__(
            {
                "bits": In(LINE_BITS),
                "received": Out(1),
                "hello": Out(1),
                "heard": Out(HEARD_BITS),
                "number": Out(protocol.DIGIT_BITS * protocol.HEARD_DIGITS),
            }
        )

    def elaborate(self, platform):
        m = Module()
        place = Signal(range(_WHOLE + 2), init=_WHOLE + 1)  # bytes since the last delimiter; stays after the last
        bit = self.bits.index
        zero = Signal(init=1)  # all bits of this byte so far
        with m.If(self.bits.bit):
            m.d.sync += zero.eq(zero & ~self.bits.level)
        with m.If(self.bits.good | self.bits.bad):
            m.d.sync += zero.eq(1)
            with m.If(self.bits.good & zero):
                m.d.sync += place.eq(0)
            with m.Elif(self.bits.bad | (place > _WHOLE)):
                m.d.sync += place.eq(_WHOLE + 1)
            with m.Else():
                m.d.sync += place.eq(place + 1)
        checked = self._check(m, place, bit, restart=self.bits.good & zero)
        kind_fits = self._read_kind(m, place, bit)
        m.d.comb += self.received.eq(self.bits.good & zero & (place == _WHOLE) & checked & kind_fits)
        self._keep_number(m, place, bit)
        return m

    def _check(self, m: Module, place: Value, bit: Value, restart: Value) -> Value:
        """CRC-16/MCRF4XX of all before the check bytes, then of its own bits in these, which leaves all zeros."""
        crc = Signal(16, init=0xFFFF)
        own = (place == _CHECK) | (place == _CHECK + 1)
        last = place == _CHECK + CHECK_BYTES - 1
        counts = (place < _CHECK) | own & (bit != 7) | last & (bit < 2)
        feedback = crc[0] ^ self.bits.level
        with m.If(self.bits.bit & counts):
            m.d.sync += crc.eq((crc >> 1) ^ (feedback.replicate(16) & 0x8408))
        with m.If(restart):
            m.d.sync += crc.eq(0xFFFF)
        return crc == 0

    def _read_kind(self, m: Module, place: Value, bit: Value) -> Value:
        fits = Signal()
        wanted = Const(protocol.last_byte(protocol.KIND_REQUEST), 8).bit_select(bit, 1)
        with m.If(self.bits.bit & (place == _KIND)):
            with m.If(bit == 0):
                m.d.sync += [self.hello.eq(self.bits.level), fits.eq(1)]
            with m.If(bit >= protocol.FLAG_BITS):
                m.d.sync += fits.eq(fits & (self.bits.level == wanted))
        return fits

    def _keep_number(self, m: Module, place: Value, bit: Value) -> None:
        number = Signal.like(self.number)
        whole = Signal()
        with m.If(self.bits.bit & (place >= _NUMBER) & (place < _KIND) & (bit != 7)):
            m.d.sync += [number.eq(number >> 1), number[-1].eq(self.bits.level), whole.eq(0)]
        with m.If(self.received):
            m.d.sync += [whole.eq(1), self.heard.eq(number)]
        m.d.comb += self.number.eq(number & whole.replicate(len(number)))
