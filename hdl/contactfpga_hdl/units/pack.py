"""Packets of readings, one per sweep; the newest complete one waits for the wire (docs/protocol.md)."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import TIME_BITS
from contactfpga.skin.units import digits_of_reading
from contactfpga.wire.framing import DIGIT_BITS, FLAG_BITS
from contactfpga.wire.units import KIND_UNITS, SEQUENCE_BITS, TRAILER_DIGITS, plain_bytes
from contactfpga_hdl.scan.frame_clock import FrameClock
from contactfpga_hdl.units.ports import reading_layout

PLACE_BITS = 6


def packet_signature() -> wiring.Signature:
    """Unit packets without their check, for the link.

    due (out): a packet waits.
    taken (in): pulse when the packet is sent.
    place (in): place of the byte offered from the next clock.
    byte (out): that byte.
    """
    return wiring.Signature({"due": Out(1), "taken": In(1), "place": In(PLACE_BITS), "byte": Out(8)})


class UnitPacker(wiring.Component):
    """Writes a packet's digits, one per clock: those of a reading after it, the rest after the last reading. Three
    regions of a memory rotate: the sweep being written, the waiting one, the one on the wire.

    sampled, done, reading (in): from the converter.
    over, armed (in): the packet's flags, read nine clocks after the last reading of two digits.
    packet (out): see :func:`packet_signature`.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = skin.derived
        self._digits = digits_of_reading(self.derived.units.converter.bits)
        super().__init__(
            {
                "sampled": In(1),
                "done": In(1),
                "reading": In(reading_layout(skin)),
                "over": In(1),
                "armed": In(1),
                "packet": Out(packet_signature()),
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules.store = store = memory.Memory(shape=8, depth=4 << PLACE_BITS, init=[])
        write, read = store.write_port(), store.read_port()
        filling, waiting, sending = (Signal(2, init=init) for init in range(3))
        packet, commit = self.packet, self._write(m, write, filling)
        # Regions rotate as a sweep completes or is taken
        with m.If(packet.taken):
            m.d.sync += [packet.due.eq(0), sending.eq(waiting), waiting.eq(sending)]
        with m.If(commit):
            m.d.sync += [packet.due.eq(1), waiting.eq(filling), filling.eq(Mux(packet.taken, sending, waiting))]
        # Byte; the first is the stuffing's code
        starts = Signal()
        m.d.sync += starts.eq(packet.place == 0)
        code = 1 + plain_bytes(self.skin.units, self.derived.units.converter.bits)
        m.d.comb += [read.addr.eq(Cat(packet.place, sending)), packet.byte.eq(Mux(starts, code, read.data))]
        return m

    def _write(self, m: Module, write: wiring.PureInterface, filling: Signal) -> Signal:
        """Write digits; returns a signal that is high when a sweep completes."""
        m.submodules.frame_clock = clock = FrameClock(self.skin)
        begun = Signal(TIME_BITS)
        sequence = Signal(SEQUENCE_BITS)
        word = Signal(DIGIT_BITS * max(self._digits, TRAILER_DIGITS))
        left = Signal(range(max(self._digits, TRAILER_DIGITS) + 1))
        place = Signal(PLACE_BITS)
        trails, closes = Signal(), Signal()
        # Digits of a reading, then of the trailer
        with m.If(self.sampled):
            m.d.sync += begun.eq(clock.time - self.derived.units.delay_us)
        m.d.sync += closes.eq(0)
        with m.If(self.done):
            m.d.sync += [word.eq(self.reading.value), left.eq(self._digits), trails.eq(0)]
            with m.If(self.reading.unit == 0):
                m.d.sync += place.eq(1)  # after the stuffing's code
        with m.Elif(left != 0):
            m.d.sync += [word.eq(word >> DIGIT_BITS), left.eq(left - 1), place.eq(place + 1)]
            with m.If((left == 1) & trails):
                m.d.sync += closes.eq(1)
            with m.Elif((left == 1) & self.reading.last):
                m.d.sync += [word.eq(Cat(begun, sequence)), left.eq(TRAILER_DIGITS), trails.eq(1)]
        m.d.sync += sequence.eq(sequence + closes)
        last = Cat(self.over, self.armed, Const(0, FLAG_BITS - 2), Const(KIND_UNITS, 4))
        m.d.comb += [
            write.addr.eq(Cat(place, filling)),
            write.data.eq(Mux(closes, last, Cat(word[:DIGIT_BITS], Const(1, 1)))),
            write.en.eq((left != 0) | closes),
        ]
        return closes
