"""Fault reports and slots of the self-test, byte by byte (docs/protocol.md)."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import memory, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.wire import faults
from contactfpga.wire.framing import DIGIT_BITS, cobs_encode
from contactfpga_hdl.payloads import faults_layout, slots_layout


class Reporter(wiring.Component):
    """Packets of kind 9 without their check. A report is due after each hello, and when it would differ from the last
    report: while none is on the wire, a byte is compared in each clock. Each digit is read in the clock before its byte
    is offered, so a report may mix the words before and after a change; then another follows.

    word (in): fault word, see :func:`~contactfpga_hdl.payloads.faults_layout`.
    slots (in): with ``self_test``, slots to be sent; ``ready`` in the clock after a slot's last byte was taken.
    greeted (in): pulse when a hello is sent.
    taken (in): pulse when the packet that is ``due`` is sent.
    sends (in): high from the next clock until the wire is idle again.
    place, fetches (in): place of the byte offered from the next clock; at the end ``place`` is ``length``.
    due (out): a packet waits.
    length (out): length of that packet.
    byte (out): offered byte.
    """

    def __init__(self, skin: Skin):
        layout = faults_layout(derived := skin.derived)
        self._report = report_of(layout.size, 0)
        self._slot = empty_slot(skin) if skin.self_test else b""
        place_bits = max(len(self._report), len(self._slot)).bit_length()
        super().__init__(
            {
                "word": In(layout),
                **({"slots": In(stream.Signature(slots_layout(derived)))} if skin.self_test else {}),
                "greeted": In(1),
                "taken": In(1),
                "sends": In(1),
                "place": In(place_bits),
                "fetches": In(1),
                "due": Out(1),
                "length": Out(place_bits),
                "byte": Out(8),
            }
        )

    def elaborate(self, platform):
        m = Module()
        report_due = Signal()
        is_slot = Signal(name="is_slot") if self._slot else Const(0)
        # Digit: of the report under way, or the one to compare
        watch = Signal((len(self._report) - 1).bit_length())
        at = Signal.like(watch)
        m.d.sync += watch.eq(watch + 1)
        m.d.comb += at.eq(Mux(self.sends, self.place, watch))
        now = _select(m, at, self._report, _digits(self.word.as_value()))
        # Memory of the report that was sent: between reports, one digit after the other is compared with it
        init = [*self._report, *[0] * ((1 << len(at)) - len(self._report))]
        m.submodules.sent = sent = memory.Memory(shape=8, depth=len(init), init=init)
        read, write = sent.read_port(), sent.write_port()
        offers = Signal()
        watched = Signal()
        m.d.sync += [offers.eq(self.fetches & self.sends & ~is_slot), watched.eq(~self.sends)]
        m.d.comb += [read.addr.eq(at), write.en.eq(offers), write.addr.eq(at), write.data.eq(self.byte)]
        differs = watched & ~self.sends & (read.data != self.byte)
        # Report, when it differs and after a hello
        with m.If(differs | self.greeted):
            m.d.sync += report_due.eq(1)
        with m.If(self.taken):
            m.d.sync += report_due.eq(0)
        m.d.comb += [self.due.eq(report_due), self.length.eq(len(self._report))]
        if self._slot:
            now = self._put_slots(m, is_slot, report_due, now)
        # Byte
        with m.If(self.fetches | ~self.sends):
            m.d.sync += self.byte.eq(now)
        return m

    def _put_slots(self, m: Module, is_slot: Value, report_due: Value, report: Value) -> Value:
        slot = self.slots.payload
        m.d.comb += self.due.eq(report_due | self.slots.valid)
        with m.If(~report_due):
            m.d.comb += self.length.eq(len(self._slot))
        with m.If(self.taken):
            m.d.sync += is_slot.eq(~report_due)
        m.d.comb += self.slots.ready.eq(self.sends & is_slot & self.fetches & (self.place == len(self._slot)))
        digits = [*_digits(slot.number), *_digits(Cat(slot.rows, slot.columns))]
        return Mux(self.sends & is_slot, _select(m, self.place, self._slot, digits), report)


def _select(m: Module, place: Value, empty: bytes, digits: list[Value]) -> Value:
    found = Signal(8)
    with m.Switch(place):
        for index, value in enumerate([Const(empty[0], 8), *digits, Const(empty[-1], 8)]):
            with m.Case(index):
                m.d.comb += found.eq(value)
    return found


def _digits(word: Value) -> list[Value]:
    cut = [word[start : start + DIGIT_BITS] for start in range(0, len(word), DIGIT_BITS)]
    return [Cat(bits, Const(0, DIGIT_BITS - len(bits)), Const(1, 1)) for bits in cut]


def report_of(bits: int, word: int) -> bytes:
    return cobs_encode(faults.encode_faults(word, bits))


def empty_slot(skin: Skin) -> bytes:
    """A stuffed slot of the self-test without readings."""
    return cobs_encode(faults.encode_slot(0, 0, skin.rows + skin.columns))
