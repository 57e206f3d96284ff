"""The link behind the packer: which frame is sent, and that its bytes are those that were packed."""

from functools import partial
from unittest import mock

from amaranth.hdl import Array, Cat, Const, Module, Mux, Signal

from contactfpga.skin import Skin
from contactfpga.skin.derived import CHECK_BYTES
from contactfpga.wire import protocol
from contactfpga_hdl.link.link import Link
from contactfpga_hdl.link.odometer import LIVE_DIGITS
from contactfpga_sim.proofs.bugs import Bug
from contactfpga_sim.proofs.case import Case
from contactfpga_sim.proofs.proof import Inside, Proof
from contactfpga_sim.proofs.streams import drain, feed

_SKIN = Skin(rows=1, columns=2, report="cells", settle_us=40)
_STATES = ("IDLE", "FETCH", "BYTE", "TAIL")
_HELLO_REGION = 3


def packed_frames_are_sent(proof: Proof, hello: bytes) -> None:
    """Free: items at any time, what tag and summary say, wishes for a hello, the numbers it tells, when bytes are taken
    and one place of a frame and one of the hello that are followed. Assumed: a complete frame was written as far as its
    end, as ``frames_are_packed`` shows.

    Claimed: what is sent of a frame at that place is what the packer wrote there. What is sent of a hello is what the
    protocol says, but for the digits of its state; each of these is a digit, and the first two are those of the frames
    sent. After as many bytes as a packet has come the check bytes and one delimiter, and only then the next packet
    begins. A byte stays until it is taken; the next one is offered two clocks later. Each complete frame is sent or
    counted as overwritten, and sequence numbers have no gap. The packer is told these numbers from the clock after
    ``decide`` until ``commit``.
    """
    m = proof.m
    with mock.patch.object(protocol, "encode_hello", return_value=hello):
        dut = Link(_SKIN)
    inside = proof.put(dut)
    place = proof.chosen(dut._offset_bits, "place")
    hello_place = proof.chosen(range(len(dut._hello)), "hello_place")
    proof.given(hello_place < len(dut._hello))
    feed(proof, dut.items, "items")
    drain(proof, dut.bytes, "bytes")
    for port, name in ((dut.tag, "tag"), (dut.summary, "summary")):
        m.d.comb += port.eq(proof.free(port.shape(), name))
    for port, name in ((dut.asked, "asked"), (dut.epoch, "epoch"), (dut.number, "number")):
        m.d.comb += port.eq(proof.free(port.shape(), name))
    packer = dut.packer
    frames = _Frames(m, dut, place)
    with m.If(packer.commit):
        proof.given((packer.end != 0) & (frames.written_now | (place >= packer.end)))
    wire = _Wire(m, dut, frames)
    taken = dut._take_frame | dut._take_hello
    proof.claim(~(taken & wire.busy) & ~(dut._take_frame & ~frames.waits))
    proof.claim(~(dut.bytes.valid & ~wire.busy) & ~(packer.commit & frames.waits))
    with m.If(wire.busy & ~proof.before(taken | dut.bytes.valid & dut.bytes.ready)):
        proof.claim(dut.bytes.valid)
    hello_byte = Array(dut._hello)[hello_place]
    in_state = (wire.index >= protocol.STATE_OFFSET) & (wire.index < protocol.STATE_OFFSET + protocol.STATE_DIGITS)
    with m.If(dut.bytes.valid & (wire.index < wire.length)):
        with m.If(wire.is_hello & in_state):
            proof.claim(dut.bytes.payload[7])
            for low in range(LIVE_DIGITS):
                with m.If(wire.index == protocol.STATE_OFFSET + low):
                    proof.claim(dut.bytes.payload[:7] == frames.sent.word_select(low, 7))
        with m.Elif(wire.is_hello & (wire.index == hello_place)):
            proof.claim(dut.bytes.payload == hello_byte)
        with m.Elif(~wire.is_hello & (wire.index == place)):
            proof.claim(dut.bytes.payload == frames.sent_value)
    with m.If(dut.bytes.valid & (wire.index == wire.length + CHECK_BYTES)):
        proof.claim(dut.bytes.payload == protocol.DELIMITER)
    with m.If(frames.closing):
        proof.claim(packer.verdict.sequence == frames.sent[: len(packer.verdict.sequence)])
        proof.claim(packer.verdict.overwritten == frames.dropped)
    _lemmas(proof, dut, inside, place, frames, wire)
    hello_region = Const(_HELLO_REGION << dut._offset_bits)
    proof.lemma(inside.word("store", (hello_region + hello_place)[: len(hello_region)]) == hello_byte)


class _Frames:
    """Frames in their order: one is packed, one may wait, one is on the wire; how many were sent, how many were not.

    Of each, what was written at the followed place.
    """

    def __init__(self, m: Module, dut: Link, place):
        packer, write = dut.packer, dut.packer.write
        self.closing = Signal(name="closing")  # from the clock after the end mark to the frame's last one
        self.waits = Signal(name="waits")
        self.written = Signal(name="written")  # the place, in the frame that is packed
        self.packed_value, self.waiting_value, self.sent_value = (
            Signal(8, name=f"{n}_value") for n in ("packed", "waiting", "sent")
        )
        self.waiting_length, self.sent_length = (
            Signal.like(packer.end, name=f"{n}_length") for n in ("waiting", "sent")
        )
        self.sent = Signal(7 * LIVE_DIGITS, name="sent_frames")
        self.dropped = Signal.like(packer.verdict.overwritten, name="dropped_frames")
        hit = write.en & (write.offset == place)
        self.written_now = self.written | hit
        packed_now = Mux(hit, write.data, self.packed_value)
        m.d.sync += [self.written.eq(self.written_now), self.packed_value.eq(packed_now)]
        replaces = self.waits & ~dut._take_frame
        with m.If(dut._take_frame):
            m.d.sync += [self.waits.eq(0), self.sent.eq(self.sent + 1)]
            m.d.sync += [self.sent_value.eq(self.waiting_value), self.sent_length.eq(self.waiting_length)]
        with m.If(packer.decide):
            with m.If(packer.verdict.send):
                m.d.sync += [self.closing.eq(1), self.waits.eq(0), self.dropped.eq(self.dropped + replaces)]
            with m.Else():
                m.d.sync += self.written.eq(0)
        with m.If(packer.commit):
            m.d.sync += [self.closing.eq(0), self.waits.eq(1), self.written.eq(0)]
            m.d.sync += [self.waiting_value.eq(packed_now), self.waiting_length.eq(packer.end)]


class _Wire:
    """How many bytes of the frame or hello on the wire were taken."""

    def __init__(self, m: Module, dut: Link, frames: _Frames):
        self.busy, self.is_hello = Signal(name="busy"), Signal(name="is_hello")
        self.index = Signal(len(dut.packer.end) + 1, name="index")
        self.length = Mux(self.is_hello, len(dut._hello), frames.sent_length)
        with m.If(self.busy & dut.bytes.valid & dut.bytes.ready):
            m.d.sync += [self.index.eq(self.index + 1), self.busy.eq(self.index != self.length + CHECK_BYTES)]
        with m.If(dut._take_frame | dut._take_hello):
            m.d.sync += [self.busy.eq(1), self.index.eq(0), self.is_hello.eq(dut._take_hello)]


def _lemmas(proof: Proof, dut: Link, inside: Inside, place, frames: _Frames, wire: _Wire) -> None:
    m = proof.m
    filling, waiting, sending = dut._filling, inside["waiting"], dut._sending
    proof.lemma((filling != waiting) & (waiting != sending) & (sending != filling))
    proof.lemma((filling != _HELLO_REGION) & (waiting != _HELLO_REGION) & (sending != _HELLO_REGION))
    words = Array(inside.word("store", Cat(place, Const(region, 2))) for region in range(_HELLO_REGION))
    proof.lemma(~frames.written | (words[filling] == frames.packed_value))
    with m.If(frames.waits):
        proof.lemma((words[waiting] == frames.waiting_value) | (place >= frames.waiting_length))
        proof.lemma((frames.waiting_length != 0) & (dut._waiting_end == frames.waiting_length))
    proof.lemma((inside["packer.part_state"] != 0) == frames.closing)
    proof.lemma(~(frames.waits & frames.closing) & (dut._waits == frames.waits))
    proof.lemma(Cat(dut._sent, inside["overwritten"]) == Cat(frames.sent, frames.dropped))
    state, tail = inside["wire_state"], inside["tail"]
    offset, end = dut._offset, inside["end"]
    fetch, byte, in_tail = (state == _STATES.index(name) for name in ("FETCH", "BYTE", "TAIL"))
    proof.lemma((state != 0) == wire.busy)
    proof.lemma(~wire.busy | (dut._sends_hello == wire.is_hello))
    with m.If(wire.busy & ~wire.is_hello):
        proof.lemma((words[sending] == frames.sent_value) | (place >= frames.sent_length))
        proof.lemma(frames.sent_length != 0)
    with m.If(fetch | byte):
        proof.lemma((offset == wire.index) & (end == wire.length))
        proof.lemma((wire.index < wire.length) | fetch & (wire.index == wire.length) & (tail == 0))
    _lemmas_on_state(proof, dut, inside, wire, fetch, byte)
    with m.If(in_tail):
        proof.lemma((tail <= CHECK_BYTES) & (wire.index == wire.length + tail))


def _lemmas_on_state(proof: Proof, dut: Link, inside: Inside, wire: _Wire, fetch, byte) -> None:
    """Carries of the odometer are over before the first digit is fetched, and the digit on offer stands."""
    m, state, at = proof.m, inside["odometer.carry_state"], inside["odometer.at"]
    carries = state != 0
    proof.lemma((state <= 2) & (~carries | (at >= LIVE_DIGITS) & (at <= 10)))
    with m.If((fetch | byte) & wire.is_hello):
        passed = Cat(byte, wire.index)  # at least so many clocks since it was taken
        proof.lemma(~carries | (Cat(state == 2, at) >= passed + 2 * LIVE_DIGITS))
        with m.If(byte & (wire.index >= protocol.STATE_OFFSET)):
            place = dut._offset[: len(at)]
            proof.lemma(inside.part("odometer").digit == inside.word("odometer.digits", place))
        for place in range(LIVE_DIGITS):
            with m.If(byte & (wire.index == protocol.STATE_OFFSET + place)):
                proof.lemma(inside["live"] == dut._sent.word_select(place, 7))
    for place in range(LIVE_DIGITS):
        proof.lemma(inside.word("odometer.digits", Const(place, 4)) == 0)


_BUGS = (
    Bug("a byte does not wait", Link, "_send", "m.If(self.bytes.ready):\n                m.d.comb",
        "m.If(1):\n                m.d.comb"),
    Bug("the wrong region is sent", Link, "_place_frames", "self._sending.eq(waiting)",
        "self._sending.eq(self._filling)"),
    Bug("a frame is sent twice", Link, "_place_frames", "[self._waits.eq(0), self._sending", "[self._sending"),
    Bug("a byte is passed over", Link, "_send", "_offset.eq(self._offset + 1)", "_offset.eq(self._offset + 2)"),
    Bug("the last byte is left out", Link, "_send", "self._offset == end", "self._offset + 1 == end"),
    Bug("a check byte short", Link, "_send", "tail == CHECK_BYTES", "tail == CHECK_BYTES - 1"),
    Bug("a loss is not counted", Link, "_decide", "overwritten + drops", "overwritten"),
)  # fmt: skip
_HELLO = protocol.encode_hello(_SKIN)
_SHORT = _HELLO[:1] + _HELLO[-CHECK_BYTES - 1 :]  # goes out first, and a search has to come to the frames behind it
CASES = (
    Case("packed frames are sent", "1x2, cells", partial(packed_frames_are_sent, hello=_HELLO), 3),
    Case("packed frames are sent", "1x2, cells, hello of 1 byte", partial(packed_frames_are_sent, hello=_SHORT), 3,
         _BUGS, bug_clocks=40),
)  # fmt: skip
