"""Whole frames from the packer to the wire, newest first, and hellos between them."""

from amaranth.hdl import Array, Cat, Const, Module, Mux, Signal
from amaranth.lib import crc, memory, stream, wiring
from amaranth.lib.fifo import SyncFIFOBuffered
from amaranth.lib.wiring import In, Out

from contactfpga import protocol
from contactfpga.derived import CHECK_BYTES, SEQUENCE_BITS, Derived
from contactfpga.skin import Skin
from contactfpga_hdl.pack import Packer
from contactfpga_hdl.payloads import item_layout, summary_layout


class Link(wiring.Component):
    """Keeps one frame on the wire, the newest complete one waiting, and one being written.

    Items wait in front of the packer, where one can be packed two clocks after it came. Three regions of one memory
    change places between the three frames; a fourth holds the hello. A new frame drops the one that waits, counted, in
    the clock its end mark is packed, and waits in its place when it is complete. Nothing in here can hold up
    the stages before.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = Derived(skin)
        self._region = self.derived.max_stored_bytes + self.derived.max_stored_bytes % 2
        self._hello = protocol.encode_hello(skin)[: -CHECK_BYTES - 1]
        self._depth = 3 * self._region + len(self._hello)
        self.packer = Packer(skin, address_bits=(self._depth - 1).bit_length())
        super().__init__(
            {
                "items": In(stream.Signature(item_layout(self.derived))),
                "summary": In(summary_layout(self.derived)),
                "received": In(1),
                "bytes": Out(stream.Signature(8)),
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules.packer = packer = self.packer
        m.submodules.backlog = backlog = SyncFIFOBuffered(
            width=len(self.items.payload.as_value()), depth=self.derived.backlog
        )
        m.d.comb += [
            backlog.w_data.eq(self.items.payload),
            backlog.w_en.eq(self.items.valid),
            self.items.ready.eq(backlog.w_rdy),
            packer.items.payload.eq(backlog.r_data),
            packer.items.valid.eq(backlog.r_rdy),
            backlog.r_en.eq(packer.items.ready),
            packer.summary.eq(self.summary),
        ]
        self._take_frame = Signal()  # the wire takes the waiting frame
        self._waits = Signal()  # a complete frame waits
        self._place_frames(m)
        self._decide(m)
        self._time_hello(m)
        self._send(m)
        return m

    def _place_frames(self, m):
        """Which region is written, waits, or is on the wire."""
        filling, waiting, sending = Signal(2, init=0), Signal(2, init=1), Signal(2, init=2)
        bases = Array(region * self._region for region in range(3))
        self._waiting_base = bases[waiting]
        self._waiting_end = Signal.like(self.packer.end)
        with m.If(self._take_frame):
            m.d.sync += [self._waits.eq(0), sending.eq(waiting), waiting.eq(sending)]
        with m.If(self.packer.decide & self.packer.verdict.send):
            m.d.sync += self._waits.eq(0)
        with m.If(self.packer.commit):
            m.d.sync += [
                self._waits.eq(1),
                self._waiting_end.eq(self.packer.end),
                waiting.eq(filling),
                filling.eq(waiting),
            ]
        m.d.comb += self.packer.base.eq(Mux(self.packer.commit, bases[waiting], bases[filling]))

    def _decide(self, m):
        """Whether a frame is sent, and its numbers. It goes next, so its sequence number is already known."""
        verdict = self.packer.verdict
        tag = self.summary.tag
        sent = Signal(SEQUENCE_BITS)
        overwritten = Signal(self.derived.overwritten_bits)
        waiting_requested = Signal()
        drops = self._waits & ~self._take_frame
        m.d.comb += [
            verdict.sequence.eq(sent + self._take_frame),
            verdict.overwritten.eq(overwritten + drops),
            verdict.requested.eq(tag.requested | drops & waiting_requested),
            verdict.send.eq(1),
        ]
        m.d.sync += sent.eq(verdict.sequence)
        with m.If(self.packer.decide & verdict.send):
            m.d.sync += [overwritten.eq(verdict.overwritten), waiting_requested.eq(verdict.requested)]
        if self.skin.send == "on_change":
            keep_alive = self.derived.keep_alive_frames
            idle = Signal(range(keep_alive), init=keep_alive - 1)  # frames since the last one sent
            due = idle == keep_alive - 1
            m.d.comb += verdict.send.eq(self.summary.changed | tag.requested | due)
            with m.If(self.packer.decide):
                m.d.sync += idle.eq(Mux(verdict.send, 0, idle + 1))

    def _time_hello(self, m):
        self._hello_due = Signal(init=1)
        self._take_hello = Signal()
        period = self.derived.hello_frames
        frames = Signal(range(max(2, period)))
        with m.If(self._take_hello):
            m.d.sync += self._hello_due.eq(0)
        with m.If(self.packer.decide):
            m.d.sync += frames.eq(frames + 1)
            with m.If(frames == period - 1):
                m.d.sync += [frames.eq(0), self._hello_due.eq(1)]
        with m.If(self.received):
            m.d.sync += self._hello_due.eq(1)

    def _send(self, m):
        init = [0] * (3 * self._region) + list(self._hello)
        m.submodules.store = store = memory.Memory(shape=8, depth=self._depth, init=init)
        read, write = store.read_port(), store.write_port()
        m.d.comb += [
            write.en.eq(self.packer.write.en),
            write.addr.eq(self.packer.write.addr),
            write.data.eq(self.packer.write.data),
        ]
        address = Signal.like(read.addr)
        end = Signal.like(self.packer.end)
        m.d.comb += read.addr.eq(address)
        m.submodules.check = check = crc.catalog.CRC16_MCRF4XX(data_width=8).create()
        tail = Signal(range(CHECK_BYTES + 1))
        m.d.comb += [check.data.eq(read.data), check.start.eq(self._take_hello | self._take_frame)]
        with m.FSM(name="wire"):
            with m.State("IDLE"):
                m.d.comb += [self._take_hello.eq(self._hello_due), self._take_frame.eq(self._waits & ~self._hello_due)]
                with m.If(self._take_hello):
                    m.d.sync += [address.eq(3 * self._region), end.eq(self._depth - 1)]
                    m.next = "FETCH"
                with m.Elif(self._take_frame):
                    m.d.sync += [address.eq(self._waiting_base), end.eq(self._waiting_end - 1)]
                    m.next = "FETCH"
            with m.State("FETCH"):
                m.next = "BYTE"
            with m.State("BYTE"):
                m.d.comb += [
                    self.bytes.valid.eq(1),
                    self.bytes.payload.eq(read.data),
                    check.valid.eq(self.bytes.ready),
                ]
                with m.If(self.bytes.ready):
                    m.d.sync += [address.eq(address + 1), tail.eq(0)]
                    m.next = "FETCH"
                    with m.If(address == end):
                        m.next = "TAIL"
            with m.State("TAIL"):
                # The CRC in pieces of seven bits, so that none of its bytes is zero.
                closing = [Cat(check.crc[7 * i : 7 * i + 7], Const(1, 1)) for i in range(2)]
                closing += [Cat(check.crc[14:], Const(0x20, 6)), Const(protocol.DELIMITER, 8)]
                m.d.comb += [self.bytes.valid.eq(1), self.bytes.payload.eq(Array(closing)[tail])]
                with m.If(self.bytes.ready):
                    m.d.sync += tail.eq(tail + 1)
                    with m.If(tail == CHECK_BYTES):
                        m.next = "IDLE"
