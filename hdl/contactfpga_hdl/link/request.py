"""Requests and commands of the host among the received bytes (docs/protocol.md)."""

from typing import Any

from amaranth.hdl import Const, Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin.derived import CHECK_BYTES, HEARD_BITS
from contactfpga.wire import protocol, sheet_number
from contactfpga.wire.command import KIND_COMMAND, VALUE_DIGITS, WHAT_DIGITS
from contactfpga_hdl.link.uart import LINE_BITS

_NUMBER, _WHAT = 1, 1 + protocol.HEARD_DIGITS
"""Places in a packet from its COBS code: the number's first digit, and a command's kind."""
_VALUE = _WHAT + WHAT_DIGITS
_ARGUMENTS = WHAT_DIGITS + VALUE_DIGITS
_LONG_BIT = 3


class RequestReader(wiring.Component):
    """Finds requests bit by bit and stores only the number and the check's state. With ``commands`` it also finds
    commands, with kind and value after the number; with ``sheet`` it accepts only packets for this sheet number.

    received (out): high with ``good`` of the closing delimiter of a request or command.
    hello (out): in that clock, whether a hello is requested.
    heard, number (out): lowest bits, and all bits, of the packet's number, from the next clock; ``number`` is 0 from
        the clock after the first bit of the first digit of any later packet.
    command (out): with ``received``, whether the packet is a command.
    what, value (out): of the command, until the next packet.
    """

    def __init__(self, commands: bool = False, sheet: int | None = None):
        self.commands = commands
        self._closing = b"" if sheet is None else sheet_number.closing(sheet)
        self._kind = _WHAT + _ARGUMENTS * commands  # the last byte's place
        self._first_check = self._kind + len(self._closing) + 1
        self._whole = self._first_check + CHECK_BYTES  # bytes up to the delimiter
        digit = protocol.DIGIT_BITS
        orders = {"command": Out(1), "what": Out(digit * WHAT_DIGITS), "value": Out(digit * VALUE_DIGITS)}
        super().__init__(
            {
                "bits": In(LINE_BITS),
                "received": Out(1),
                "hello": Out(1),
                "heard": Out(HEARD_BITS),
                "number": Out(digit * protocol.HEARD_DIGITS),
                **(orders if commands else {}),
            }
        )

    def elaborate(self, platform):
        m = Module()
        beyond = self._whole + 1
        place = Signal(range(beyond + 1), init=beyond)  # bytes since the last delimiter; stays after the last
        bit = self.bits.index
        zero = Signal(init=1)  # all bits of this byte so far
        # Command or request, by its length
        is_command = Signal(name="is_command") if self.commands else Const(0, 1)
        if self.commands:
            with m.If(self.bits.bit & (place == 0) & (bit == _LONG_BIT)):
                m.d.sync += is_command.eq(self.bits.level)
        # Place in the packet; a request has no arguments
        with m.If(self.bits.bit):
            m.d.sync += zero.eq(zero & ~self.bits.level)
        with m.If(self.bits.good | self.bits.bad):
            m.d.sync += zero.eq(1)
            with m.If(self.bits.good & zero):
                m.d.sync += place.eq(0)
            with m.Elif(self.bits.bad | (place > self._whole)):
                m.d.sync += place.eq(beyond)
            with m.Else():
                m.d.sync += place.eq(place + 1)
                if self.commands:
                    with m.If((place == _WHAT - 1) & ~is_command):
                        m.d.sync += place.eq(self._kind)
        # CRC-16/MCRF4XX over everything before the check bytes, then over their own bits, which leaves all zeros
        crc = Signal(16, init=0xFFFF)
        first = self._first_check
        own = (place == first) | (place == first + 1)
        last = place == first + CHECK_BYTES - 1
        counts = (place < first) | own & (bit != 7) | last & (bit < 2)
        feedback = crc[0] ^ self.bits.level
        with m.If(self.bits.bit & counts):
            m.d.sync += crc.eq((crc >> 1) ^ (feedback.replicate(16) & 0x8408))
        with m.If(self.bits.good & zero):
            m.d.sync += crc.eq(0xFFFF)
        checked = crc == 0
        # Kind and sheet
        fits = Signal()
        wanted = Const(protocol.last_byte(protocol.KIND_REQUEST), 8).bit_select(bit, 1)
        if self.commands:
            wanted = Mux(is_command, Const(protocol.last_byte(KIND_COMMAND), 8).bit_select(bit, 1), wanted)
        with m.If(self.bits.bit & (place == self._kind)):
            with m.If(bit == 0):
                m.d.sync += [self.hello.eq(self.bits.level), fits.eq(1)]
            with m.If(bit >= protocol.FLAG_BITS):
                m.d.sync += fits.eq(fits & (self.bits.level == wanted))
        for at, byte in enumerate(self._closing, self._kind + 1):
            with m.If(self.bits.bit & (place == at)):
                m.d.sync += fits.eq(fits & (self.bits.level == Const(byte, 8).bit_select(bit, 1)))
        # Results
        m.d.comb += self.received.eq(self.bits.good & zero & (place == self._whole) & checked & fits)
        self._keep_number(m, place, bit)
        if self.commands:
            m.d.comb += self.command.eq(self.received & is_command)
            self._keep(m, self.what, _WHAT, _VALUE, place, bit)
            self._keep(m, self.value, _VALUE, self._kind, place, bit)
        return m

    def _keep_number(self, m: Module, place: Value, bit: Value) -> None:
        number = Signal.like(self.number)
        whole = Signal()
        self._keep(m, number, _NUMBER, _WHAT, place, bit, whole.eq(0))
        with m.If(self.received):
            m.d.sync += [whole.eq(1), self.heard.eq(number)]
        m.d.comb += self.number.eq(number & whole.replicate(len(number)))

    def _keep(self, m: Module, kept: Value, first: int, end: int, place: Value, bit: Value, *also: Any) -> None:
        with m.If(self.bits.bit & (place >= first) & (place < end) & (bit != 7)):
            m.d.sync += [kept.eq(kept >> 1), kept[-1].eq(self.bits.level), *also]
