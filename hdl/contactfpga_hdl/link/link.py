"""Whole frames from the packer to the wire, newest first, and hellos between them."""

from amaranth.hdl import Array, Cat, Const, Module, Mux, Signal
from amaranth.lib import crc, memory, stream, wiring
from amaranth.lib.fifo import SyncFIFOBuffered
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import CHECK_BYTES, Derived
from contactfpga.wire import protocol
from contactfpga_hdl.link.odometer import LIVE_DIGITS, Odometer
from contactfpga_hdl.link.pack import Packer
from contactfpga_hdl.payloads import item_layout, summary_layout, tag_layout

_HELLO_REGION = 3
"""The others hold frames."""

STATE_PLACE_BITS = (protocol.STATE_DIGITS - 1).bit_length()


class Link(wiring.Component):
    """Keeps one frame on the wire, the newest complete one waiting, and one being written.

    Items wait in front of the packer, where one can be packed two clocks after it came; barycenters wait before they
    are divided and come here one by one. Three regions of one memory
    change places between the three frames; a fourth holds the hello. A new frame drops the one that waits, counted, in
    the clock its end mark is packed, and waits in its place when it is complete. Nothing in here can hold up
    the stages before.

    The hello is fixed but for the digits of its state: each is taken in the clock before its byte is offered.
    ``asked`` is high for a clock when a hello is wanted, ``epoch`` when another 2^22 us are over.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = Derived(skin)
        self._hello = _stored_hello(skin)
        self._offset_bits = _offset_bits(skin)
        self.packer = Packer(skin, self._offset_bits)
        super().__init__(
            {
                "items": In(stream.Signature(item_layout(self.derived))),
                "tag": In(tag_layout(self.derived)),
                "summary": In(summary_layout(self.derived)),
                "asked": In(1),
                "epoch": In(1),
                "number": In(protocol.DIGIT_BITS * protocol.HEARD_DIGITS),
                "bytes": Out(stream.Signature(8)),
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules.packer = packer = self.packer
        if self.skin.report == "barycenter":
            wiring.connect(m, wiring.flipped(self.items), packer.items)
        else:
            self._queue(m)
        m.d.comb += [packer.tag.eq(self.tag), packer.summary.eq(self.summary)]
        self._take_frame = Signal()  # the wire takes the waiting frame
        self._waits = Signal()  # a complete frame waits
        self._place_frames(m)
        self._decide(m)
        self._time_hello(m)
        self._send(m)
        self._say_state(m)
        return m

    def _queue(self, m):
        m.submodules.backlog = backlog = SyncFIFOBuffered(
            width=len(self.items.payload.as_value()), depth=self.derived.backlog
        )
        m.d.comb += [
            backlog.w_data.eq(self.items.payload),
            backlog.w_en.eq(self.items.valid),
            self.items.ready.eq(backlog.w_rdy),
            self.packer.items.payload.eq(backlog.r_data),
            self.packer.items.valid.eq(backlog.r_rdy),
            backlog.r_en.eq(self.packer.items.ready),
        ]

    def _place_frames(self, m):
        """Which region is written, waits, or is on the wire."""
        self._filling = Signal(2, init=0)
        waiting = Signal(2, init=1)
        self._sending = Signal(2, init=2)
        self._waiting_end = Signal(self._offset_bits)
        with m.If(self._take_frame):
            m.d.sync += [self._waits.eq(0), self._sending.eq(waiting), waiting.eq(self._sending)]
        with m.If(self.packer.decide & self.packer.verdict.send):
            m.d.sync += self._waits.eq(0)
        with m.If(self.packer.commit):
            m.d.sync += [
                self._waits.eq(1),
                self._waiting_end.eq(self.packer.end),
                waiting.eq(self._filling),
                self._filling.eq(waiting),
            ]

    def _decide(self, m):
        """Whether a frame is sent, and its numbers. It goes next, so its sequence number is already known."""
        verdict = self.packer.verdict
        self._sent = Signal(LIVE_DIGITS * protocol.DIGIT_BITS)
        overwritten = Signal(self.derived.overwritten_bits)
        drops = self._waits & ~self._take_frame
        m.d.comb += [verdict.sequence.eq(self._sent), verdict.overwritten.eq(overwritten), verdict.send.eq(1)]
        m.d.sync += self._sent.eq(self._sent + self._take_frame)
        with m.If(self.packer.decide & verdict.send):
            m.d.sync += overwritten.eq(overwritten + drops)
        if self.skin.send == "on_change":
            keep_alive = self.derived.keep_alive_frames
            idle = Signal(range(keep_alive), init=keep_alive - 1)  # since the last frame sent
            waited, due = self._wait(idle, keep_alive)
            m.d.comb += verdict.send.eq(self.summary.changed | self.tag.requested | due)
            with m.If(self.packer.decide):
                m.d.sync += idle.eq(Mux(verdict.send, 0, waited))

    def _time_hello(self, m):
        self._hello_due = Signal(init=1)
        self._take_hello = Signal()
        period = self.derived.hello_frames
        since = Signal(range(max(2, period)))
        waited, due = self._wait(since, period)
        with m.If(self._take_hello):
            m.d.sync += self._hello_due.eq(0)
        with m.If(self.packer.decide):
            m.d.sync += since.eq(waited)
            with m.If(due):
                m.d.sync += [since.eq(0), self._hello_due.eq(1)]
        with m.If(self.asked):
            m.d.sync += self._hello_due.eq(1)

    def _wait(self, waited, limit):
        """A time with this frame's added, and whether that is ``limit``: in scans, adaptive ones in row times."""
        if self.skin.scan == "raster":
            return waited + 1, waited == limit - 1
        longer = waited + self.tag.slots
        return longer, longer >= limit

    def _send(self, m):
        init = [0] * hello_words(self.skin).start + list(self._hello)
        m.submodules.store = store = memory.Memory(shape=8, depth=len(init), init=init)
        read, write = store.read_port(), store.write_port()
        self._offset = Signal(self._offset_bits)
        self._sends_hello = Signal()
        end = Signal(self._offset_bits)
        seeds = Signal()  # one clock after a frame was taken
        self._idle, self._fetches = Signal(), Signal()
        self._digit = Signal(protocol.DIGIT_BITS)
        in_state = self._sends_hello & (self._offset >> STATE_PLACE_BITS == protocol.STATE_OFFSET >> STATE_PLACE_BITS)
        byte = Mux(in_state, Cat(self._digit, Const(1, 1)), read.data)
        m.d.comb += [
            write.en.eq(self.packer.write.en),
            write.addr.eq(Cat(self.packer.write.offset, self._filling)),
            write.data.eq(self.packer.write.data),
            read.addr.eq(Cat(self._offset, Mux(self._sends_hello, _HELLO_REGION, self._sending))),
        ]
        m.submodules.check = check = crc.catalog.CRC16_MCRF4XX(data_width=8).create()
        first, second = protocol.check_prefix(self.skin)
        tail = Signal(range(CHECK_BYTES + 1))
        m.d.sync += seeds.eq(self._take_frame)
        m.d.comb += [check.data.eq(byte), check.start.eq(self._take_hello | self._take_frame)]
        with m.If(self._take_frame):
            m.d.comb += [check.data.eq(first), check.valid.eq(1)]
        with m.Elif(seeds):
            m.d.comb += [check.data.eq(second), check.valid.eq(1)]
        with m.FSM(name="wire"):
            with m.State("IDLE"):
                m.d.comb += [
                    self._idle.eq(1),
                    self._take_hello.eq(self._hello_due),
                    self._take_frame.eq(self._waits & ~self._hello_due),
                ]
                m.d.sync += [
                    self._sends_hello.eq(self._hello_due),
                    end.eq(Mux(self._hello_due, len(self._hello), self._waiting_end)),
                    self._offset.eq(0),
                ]
                with m.If(self._hello_due | self._waits):
                    m.next = "FETCH"
            with m.State("FETCH"):
                m.d.comb += self._fetches.eq(1)
                m.next = "BYTE"
                with m.If(self._offset == end):
                    m.next = "TAIL"
            with m.State("BYTE"):
                leads = self._sends_hello & (self._offset == 0)  # the delimiter in front
                m.d.comb += [self.bytes.valid.eq(1), self.bytes.payload.eq(byte)]
                with m.If(self.bytes.ready):
                    m.d.comb += check.valid.eq(~leads)
                    m.d.sync += [self._offset.eq(self._offset + 1), tail.eq(0)]
                    m.next = "FETCH"
            with m.State("TAIL"):
                # The CRC in pieces of seven bits, so that none of its bytes is zero.
                closing = [Cat(check.crc[7 * i : 7 * i + 7], Const(1, 1)) for i in range(2)]
                closing += [Cat(check.crc[14:], Const(0x20, 6)), Const(protocol.DELIMITER, 8)]
                m.d.comb += [self.bytes.valid.eq(1), self.bytes.payload.eq(Array(closing)[tail])]
                with m.If(self.bytes.ready):
                    m.d.sync += tail.eq(tail + 1)
                    with m.If(tail == CHECK_BYTES):
                        m.next = "IDLE"

    def _say_state(self, m):
        """The digit at each place of a hello's state. The counters' high digits stand while a hello is sent."""
        m.submodules.odometer = odometer = Odometer()
        place = self._offset[:STATE_PLACE_BITS]
        high = self._sent[-1]
        before = Signal()
        m.d.sync += before.eq(high)
        m.d.comb += [
            odometer.sent.eq(before & ~high),
            odometer.epoch.eq(self.epoch),
            odometer.hold.eq(self._sends_hello & ~self._idle),
            odometer.place.eq(place),
        ]
        digit = Signal(protocol.DIGIT_BITS)
        live = Signal(protocol.DIGIT_BITS)
        number = [self.number.word_select(index, protocol.DIGIT_BITS) for index in range(protocol.HEARD_DIGITS)]
        sent = [self._sent.word_select(index, protocol.DIGIT_BITS) for index in range(LIVE_DIGITS)]
        first_of_number = protocol.SENT_DIGITS + protocol.EPOCH_DIGITS
        with m.Switch(place):
            for index, value in (*enumerate(sent), *enumerate([*number, self.tag.stuck], first_of_number)):
                with m.Case(index):
                    m.d.comb += digit.eq(value)
        with m.If(self._fetches):
            m.d.sync += live.eq(digit)
        m.d.comb += self._digit.eq(live | odometer.digit)  # of which one is 0


def hello_words(skin: Skin) -> range:
    """Where the hello lies in the memory."""
    first = _HELLO_REGION << _offset_bits(skin)
    return range(first, first + len(_stored_hello(skin)))


def _stored_hello(skin: Skin) -> bytes:
    """The hello from its leading delimiter on, without its check."""
    return protocol.encode_hello(skin)[: -CHECK_BYTES - 1]


def _offset_bits(skin: Skin) -> int:
    """Of a place in a region of the memory, which holds any frame or the hello."""
    return max(Derived(skin).max_stored_bytes, len(_stored_hello(skin))).bit_length()
