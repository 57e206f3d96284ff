"""Frames from the packer to the wire, newest first, with hellos between them."""

from typing import TYPE_CHECKING

from amaranth.hdl import Array, Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import crc, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import CHECK_BYTES, TIME_BITS
from contactfpga.wire import protocol, sheet_number
from contactfpga.wire.sheet_number import SheetPlace
from contactfpga_hdl.link.odometer import LIVE_DIGITS, Odometer
from contactfpga_hdl.link.pack import frames_signature
from contactfpga_hdl.payloads import faults_layout, slots_layout, summary_layout, tag_layout
from contactfpga_hdl.util.upset import upset_places

if TYPE_CHECKING:
    from contactfpga_hdl.link.other_packets import Readings, Reports

HELLO_REGION = 3

STATE_PLACE_BITS = (protocol.STATE_DIGITS - 1).bit_length()


class _Wire:
    def __init__(self, offset_bits: int):
        self.idle = Signal()  # there is none
        self.take_frame = Signal()  # the frame that waits is next
        self.take_hello = Signal()
        self.is_hello = Signal()
        self.take_report = Signal()  # of some Skins only, as units are
        self.take_units = Signal()
        self.offset = Signal(offset_bits)  # of the byte on offer, in its region
        self.fetches = Signal()  # that byte is read


class _Regions:
    def __init__(self, offset_bits: int):
        self.filling = Signal(2, init=0)
        self.waiting = Signal(2, init=1)
        self.sending = Signal(2, init=2)
        self.waits = Signal()  # a complete frame does
        self.waiting_end = Signal(offset_bits)


class Link(wiring.Component):
    """Keeps one frame on the wire, the newest complete one waiting, and one being written.

    Three regions of one memory rotate among the three frames; a fourth holds the hello. As its end mark is packed, a
    new frame drops and counts a waiting one, whose place it takes when complete. Nothing here blocks the stages before.
    The hello is fixed except for the digits of its state, each read in the clock before its byte is offered.
    :mod:`contactfpga_hdl.link.other_packets` has the order of packets.

    frames (in): see :func:`~contactfpga_hdl.link.pack.frames_signature`.
    tag, summary (in): describe the frame from ``frames.decide`` to ``frames.commit``.
    asked (in): pulse when a hello is wanted.
    epoch (in): pulse every 2^22 us.
    time (in): device time in us, of a scan that waits.
    due (out): a frame is to be sent although nothing has changed.
    number (in): number of the last request.
    faults, slots (in): with ``guard`` or ``self_test``, see :class:`~contactfpga_hdl.link.faults.Reporter`.
    units (in): with units, see :func:`~contactfpga_hdl.units.pack.packet_signature`.
    bytes (out): stuffed packets; a byte is offered two clocks after the one before was taken. If the Skin ``rests``,
        a second delimiter follows a packet, unless another packet is taken in the clock after the first one. Several
        sheets have none.
    upset (out): high while two frames share a region because a bit of its number flipped by itself; never with
        ``dual``, which finds more.
    grant (in), holds (out): with a ``place`` among several sheets, see :class:`~contactfpga_hdl.several.RoundRobin`;
        packets then include the sheet's number.
    """

    def __init__(self, skin: Skin, place: SheetPlace | None = None):
        self.skin = skin
        self.place = place
        self.derived = skin.derived
        self._rests = place is None and self.derived.rests
        self._hello = stored_hello(skin, place)
        self._offset_bits = offset_bits(skin, place)
        super().__init__(
            {
                "frames": In(frames_signature(self.derived, self._offset_bits)),
                "tag": In(tag_layout(self.derived)),
                "summary": In(summary_layout(self.derived)),
                "asked": In(1),
                "epoch": In(1),
                "time": In(TIME_BITS),
                "due": Out(1),
                "number": In(protocol.DIGIT_BITS * protocol.HEARD_DIGITS),
                **self._optional_ports(),
                **({} if place is None else {"grant": In(1), "holds": Out(1)}),
                "upset": Out(1),
                "bytes": Out(stream.Signature(8)),
            }
        )

    def _hello_period(self, m: Module) -> Value:
        if self.derived.scan.waits:
            from contactfpga_hdl.link.due import hello_period

            return hello_period(m, self)
        period = self.derived.hello_frames
        since = Signal(range(max(2, period)))
        due = since == period - 1
        with m.If(self.frames.decide):
            m.d.sync += since.eq(Mux(due, 0, since + 1))
        return self.frames.decide & due

    def _optional_ports(self) -> dict[str, wiring.Member]:
        ports: dict[str, wiring.Member] = {}
        if (faults := faults_layout(self.derived)).size:
            ports["faults"] = In(faults)
        if self.skin.self_test:
            ports["slots"] = In(stream.Signature(slots_layout(self.derived)))
        if self.skin.units:
            from contactfpga_hdl.units.pack import packet_signature

            ports["units"] = In(packet_signature())
        return ports

    def elaborate(self, platform):
        m = Module()
        wire, regions = _Wire(self._offset_bits), _Regions(self._offset_bits)
        hello_due = Signal(init=1)
        # Regions rotate as a frame is taken, dropped or complete
        with m.If(wire.take_frame):
            m.d.sync += [
                regions.waits.eq(0),
                regions.sending.eq(regions.waiting),
                regions.waiting.eq(regions.sending),
            ]
        with m.If(self.frames.decide & self.frames.verdict.send):
            m.d.sync += regions.waits.eq(0)
        with m.If(self.frames.commit):
            m.d.sync += [
                regions.waits.eq(1),
                regions.waiting_end.eq(self.frames.end),
                regions.waiting.eq(regions.filling),
                regions.filling.eq(regions.waiting),
            ]
        if not self.skin.dual:
            m.d.comb += self.upset.eq(upset_places(regions.filling, regions.waiting, regions.sending))
        # Verdict on a frame whose end mark is packed
        verdict, decide = self.frames.verdict, self.frames.decide
        frames_sent = Signal(LIVE_DIGITS * protocol.DIGIT_BITS)
        overwritten = Signal(self.derived.overwritten_bits)
        drops = regions.waits & ~wire.take_frame
        m.d.comb += [verdict.sequence.eq(frames_sent), verdict.overwritten.eq(overwritten), verdict.send.eq(1)]
        m.d.sync += frames_sent.eq(frames_sent + wire.take_frame)
        with m.If(decide & verdict.send):
            m.d.sync += overwritten.eq(overwritten + drops)
        if self.skin.send == "on_change":
            from contactfpga_hdl.link.due import keep_alive

            keep_alive(m, self)
            fault_before = Signal()  # the flag of the frame before
            with m.If(decide):
                m.d.sync += fault_before.eq(self.tag.fault)
            changed = self.summary.changed | self.tag.fault ^ fault_before
            m.d.comb += verdict.send.eq(changed | self.tag.requested | self.due)
        # Hellos
        with m.If(wire.take_hello):
            m.d.sync += hello_due.eq(0)
        with m.If(self._hello_period(m) | self.asked):
            m.d.sync += hello_due.eq(1)
        # Packets
        byte = self._read_byte(m, wire, regions, self._state_digit(m, wire, frames_sent))
        others = self._others(m, wire)
        for other in others:
            byte = Mux(other.sent, other.byte, byte)
        self._send(m, wire, regions, hello_due, byte, others)
        return m

    def _others(self, m: Module, wire: _Wire) -> "list[Reports | Readings]":
        if not self._optional_ports():
            return []
        from contactfpga_hdl.link.other_packets import Readings, Reports

        kinds = [Reports] * hasattr(self, "faults") + [Readings] * hasattr(self, "units")
        return [kind(m, self, wire) for kind in kinds]

    def _read_byte(self, m: Module, wire: _Wire, regions: _Regions, digit: Value) -> Value:
        init = [0] * (HELLO_REGION << self._offset_bits) + list(self._hello)
        m.submodules.store = store = memory.Memory(shape=8, depth=len(init), init=init)
        read, write = store.read_port(), store.write_port()
        m.d.comb += [
            write.en.eq(self.frames.write.en),
            write.addr.eq(Cat(self.frames.write.offset, regions.filling)),
            write.data.eq(self.frames.write.data),
            read.addr.eq(Cat(wire.offset, Mux(wire.is_hello, HELLO_REGION, regions.sending))),
        ]
        in_state = wire.is_hello & (wire.offset >> STATE_PLACE_BITS == protocol.STATE_OFFSET >> STATE_PLACE_BITS)
        return Mux(in_state, Cat(digit, Const(1, 1)), read.data)

    def _send(
        self,
        m: Module,
        wire: _Wire,
        regions: _Regions,
        hello_due: Value,
        byte: Value,
        others: "list[Reports | Readings]",
    ) -> None:
        end = Signal.like(wire.offset)
        seeded = wire.take_frame | wire.take_report | wire.take_units
        seeds = Signal()  # one clock after anything but a hello was taken
        m.submodules.check = check = crc.catalog.CRC16_MCRF4XX(data_width=8).create()
        first, second = protocol.check_prefix(self.skin)
        closing = self._closing(check.crc)
        last = len(closing) - 1
        tail = Signal(range(len(closing)))
        ends = Signal()  # the packet, with this byte
        ended = Signal()  # a packet, and its delimiter was not repeated
        goes = hello, frame, either = hello_due, regions.waits & ~hello_due, hello_due | regions.waits
        if self.place is not None:
            hello, frame, either = (one & self.grant for one in goes)
        m.d.sync += seeds.eq(seeded)
        m.d.comb += [check.data.eq(byte), check.start.eq(wire.take_hello | seeded)]
        with m.If(seeded):
            m.d.comb += [check.data.eq(first), check.valid.eq(1)]
        with m.Elif(seeds):
            m.d.comb += [check.data.eq(second), check.valid.eq(1)]
        with m.FSM(name="wire"):
            with m.State("IDLE"):
                m.d.comb += [
                    wire.idle.eq(1),
                    wire.take_hello.eq(hello),
                    wire.take_frame.eq(frame),
                ]
                m.d.sync += [
                    wire.is_hello.eq(hello_due),
                    end.eq(Mux(hello_due, len(self._hello), regions.waiting_end)),
                    wire.offset.eq(0),
                ]
                with m.If(either):
                    m.next = "FETCH"
                if self._rests:
                    with m.Elif(ended):
                        m.d.sync += [ended.eq(0), tail.eq(last)]
                        m.next = "TAIL"
                for other in others:
                    with m.If(other.choose(m, hello_due, regions.waits)):
                        m.d.comb += wire.take_frame.eq(0)
                        m.d.sync += other.begin(end)
                        m.next = "FETCH"
            with m.State("FETCH"):
                m.d.comb += wire.fetches.eq(1)
                m.next = "BYTE"
                with m.If(wire.offset == end):
                    m.next = "TAIL"
            with m.State("BYTE"):
                leads = wire.is_hello & (wire.offset == 0)  # the delimiter in front
                m.d.comb += [self.bytes.valid.eq(1), self.bytes.payload.eq(byte)]
                with m.If(self.bytes.ready):
                    m.d.comb += check.valid.eq(~leads)
                    m.d.sync += [wire.offset.eq(wire.offset + 1), tail.eq(0), *([ended.eq(1)] * self._rests)]
                    m.next = "FETCH"
            with m.State("TAIL"):
                m.d.comb += [self.bytes.valid.eq(1), self.bytes.payload.eq(Array(closing)[tail])]
                if self.place is not None:
                    m.d.comb += [check.data.eq(self.bytes.payload), check.valid.eq(self.bytes.ready & (tail < 2))]
                with m.If(self.bytes.ready):
                    m.d.sync += tail.eq(tail + 1)
                    with m.If(tail == last):
                        m.d.comb += ends.eq(1)
                        m.next = "IDLE"
        if self.place is not None:
            taken = either | wire.take_report if others else either
            m.d.comb += self.holds.eq(~ends & (~wire.idle | taken))

    def _closing(self, crc: Value) -> list[Value]:
        """The sheet's number, if any, and the CRC in pieces of seven bits, so that no byte is zero."""
        number = b"" if self.place is None else sheet_number.closing(self.place.number)
        return [
            *(Const(byte, 8) for byte in number),
            *(Cat(crc[7 * i : 7 * i + 7], Const(1, 1)) for i in range(2)),
            Cat(crc[14:], Const(0x20, 6)),
            Const(protocol.DELIMITER, 8),
        ]

    def _state_digit(self, m: Module, wire: _Wire, frames_sent: Value) -> Value:
        """The digit at each place of a hello's state; high digits are stable while a hello is sent."""
        m.submodules.odometer = odometer = Odometer()
        place = wire.offset[:STATE_PLACE_BITS]
        high = frames_sent[-1]
        before = Signal()
        m.d.sync += before.eq(high)
        m.d.comb += [
            odometer.sent.eq(before & ~high),
            odometer.epoch.eq(self.epoch),
            odometer.hold.eq(wire.is_hello & ~wire.idle),
            odometer.place.eq(place),
        ]
        digit = Signal(protocol.DIGIT_BITS)
        live = Signal(protocol.DIGIT_BITS)
        number = [self.number.word_select(index, protocol.DIGIT_BITS) for index in range(protocol.HEARD_DIGITS)]
        live_digits = [frames_sent.word_select(index, protocol.DIGIT_BITS) for index in range(LIVE_DIGITS)]
        first_of_number = protocol.SENT_DIGITS + protocol.EPOCH_DIGITS
        with m.Switch(place):
            for index, value in (*enumerate(live_digits), *enumerate([*number, self.tag.stuck], first_of_number)):
                with m.Case(index):
                    m.d.comb += digit.eq(value)
        with m.If(wire.fetches):
            m.d.sync += live.eq(digit)
        return live | odometer.digit  # of which one is 0


def hello_words(skin: Skin) -> range:
    first = HELLO_REGION << offset_bits(skin)
    return range(first, first + len(stored_hello(skin)))


def stored_hello(skin: Skin, place: SheetPlace | None = None) -> bytes:
    """The hello from its leading delimiter on, without its check."""
    return protocol.encode_hello(skin, place=place)[: -CHECK_BYTES - 1]


def offset_bits(skin: Skin, place: SheetPlace | None = None) -> int:
    """Bits of an offset in a region of the memory."""
    return max(skin.derived.max_stored_bytes, len(stored_hello(skin, place))).bit_length()
