"""The link, and the odometer's digits."""

from functools import partial
from typing import Any
from unittest import mock

from amaranth.hdl import Array, Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import wiring

from contactfpga.skin import Skin
from contactfpga.skin.derived import CHECK_BYTES
from contactfpga.wire import protocol
from contactfpga.wire.protocol import DIGIT_BITS, EPOCH_DIGITS, SENT_DIGITS
from contactfpga_hdl.link.link import HELLO_REGION, Link, hello_words, offset_bits, stored_hello
from contactfpga_hdl.link.odometer import LIVE_DIGITS, Odometer
from contactfpga_hdl.link.pack import Packer
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.inside import Inside
from contactfpga_sim.verify.proofs.proof import Proof
from contactfpga_sim.verify.proofs.streams import drain, feed

_SKIN = Skin(rows=1, columns=2, report="cells", settle_us=40)
_RESTS = _SKIN.replace(settle_us=2000)
"""Its frames are over a millisecond apart, so a second delimiter may follow a packet."""
_STATES = ("IDLE", "FETCH", "BYTE", "TAIL")
_RESTING_STATES = ("IDLE", "FETCH", "TAIL", "BYTE")
"""In the order of their numbers: that in which the link names them."""


def packed_frames_are_sent(proof: Proof, hello: bytes, skin: Skin = _SKIN) -> None:
    """Free: items at any time, tag and summary, wishes for a hello, its numbers, when bytes are taken, and one followed
    place of a frame and of the hello. Assumed: a complete frame was written up to its end, as ``frames_are_packed``
    shows.

    Claimed: a sent frame has at that place what the packer wrote there; a sent hello follows the protocol except for
    the digits of its state, which are digits, the first two the frames sent. A packet's bytes are followed by check
    bytes and one delimiter, then the next packet; if the Skin rests and none is taken in the next clock, by one more
    delimiter. A byte stays until it is taken; the next is offered two clocks later.
    Each complete frame is sent or counted as overwritten, and sequence numbers have no gap. The packer gets these
    numbers from the clock after ``decide`` until ``commit``. The link never asks for a restart.
    """
    m = proof.m
    with mock.patch.object(protocol, "encode_hello", return_value=hello):
        dut = _PackerAndLink(skin)
        inside = proof.put(dut)
        stored, first_word = stored_hello(skin), hello_words(skin).start
    place = proof.chosen(len(dut.packer.frames.end), "place")
    hello_place = proof.chosen(range(len(stored)), "hello_place")
    proof.given(hello_place < len(stored))
    feed(proof, dut.items, "items")
    drain(proof, dut.bytes, "bytes")
    for port, name in ((dut.tag, "tag"), (dut.summary, "summary")):
        m.d.comb += port.eq(proof.free(port.shape(), name))
    for port, name in ((dut.asked, "asked"), (dut.epoch, "epoch"), (dut.number, "number")):
        m.d.comb += port.eq(proof.free(port.shape(), name))
    packed = dut.packer.frames
    frames = _Frames(m, packed, inside["link.take_frame"], place)
    with m.If(packed.commit):
        proof.given((packed.end != 0) & (frames.written_now | (place >= packed.end)))
    wire = _Wire(m, dut, inside, frames, len(stored))
    taken = inside["link.take_frame"] | inside["link.take_hello"]
    proof.claim(~(taken & wire.sends) & ~(inside["link.take_frame"] & ~frames.waits))
    proof.claim(~(dut.bytes.valid & ~wire.sends) & ~(packed.commit & frames.waits))
    with m.If(wire.sends & ~proof.before(taken | dut.bytes.valid & dut.bytes.ready)):
        proof.claim(dut.bytes.valid)
    hello_byte = Array(stored)[hello_place]
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
    with m.If(dut.bytes.valid & (wire.again | (wire.index == wire.length + CHECK_BYTES))):
        proof.claim(dut.bytes.payload == protocol.DELIMITER)
    with m.If(frames.closing):
        proof.claim(packed.verdict.sequence == frames.sent[: len(packed.verdict.sequence)])
        proof.claim(packed.verdict.overwritten == frames.dropped)
    proof.claim(~inside["link.upset"])
    _lemmas(proof, inside, place, frames, wire)
    hello_region = Const(first_word)
    proof.lemma(inside.word("link.store", (hello_region + hello_place)[: len(hello_region)]) == hello_byte)


class _PackerAndLink(wiring.Component):
    def __init__(self, skin: Skin) -> None:
        self.packer, self.link = Packer(skin, offset_bits(skin)), Link(skin)
        packer, link = self.packer.signature.members, self.link.signature.members
        names = ("tag", "summary", "asked", "epoch", "number", "bytes")
        super().__init__({"items": packer["items"], **{name: link[name] for name in names}})

    def elaborate(self, platform):
        m = Module()
        m.submodules.packer, m.submodules.link = self.packer, self.link
        wiring.connect(m, wiring.flipped(self.items), self.packer.items)
        wiring.connect(m, self.packer.frames, self.link.frames)
        wiring.connect(m, self.link.bytes, wiring.flipped(self.bytes))
        for part in (self.packer, self.link):
            m.d.comb += [part.tag.eq(self.tag), part.summary.eq(self.summary)]
        m.d.comb += [getattr(self.link, name).eq(getattr(self, name)) for name in ("asked", "epoch", "number")]
        return m


class _Frames:
    """Frames being packed, waiting and on the wire; numbers of sent and unsent ones; their bytes at the followed
    place."""

    def __init__(self, m: Module, packed, take_frame, place):
        write = packed.write
        self.closing = Signal(name="closing")  # from the clock after the end mark to the frame's last one
        self.waits = Signal(name="waits")
        self.written = Signal(name="written")  # the place, in the frame that is packed
        self.packed_value, self.waiting_value, self.sent_value = (
            Signal(8, name=f"{n}_value") for n in ("packed", "waiting", "sent")
        )
        self.waiting_length, self.sent_length = (
            Signal.like(packed.end, name=f"{n}_length") for n in ("waiting", "sent")
        )
        self.sent = Signal(7 * LIVE_DIGITS, name="sent_frames")
        self.dropped = Signal.like(packed.verdict.overwritten, name="dropped_frames")
        hit = write.en & (write.offset == place)
        self.written_now = self.written | hit
        packed_now = Mux(hit, write.data, self.packed_value)
        m.d.sync += [self.written.eq(self.written_now), self.packed_value.eq(packed_now)]
        replaces = self.waits & ~take_frame
        with m.If(take_frame):
            m.d.sync += [self.waits.eq(0), self.sent.eq(self.sent + 1)]
            m.d.sync += [self.sent_value.eq(self.waiting_value), self.sent_length.eq(self.waiting_length)]
        with m.If(packed.decide):
            with m.If(packed.verdict.send):
                m.d.sync += [self.closing.eq(1), self.waits.eq(0), self.dropped.eq(self.dropped + replaces)]
            with m.Else():
                m.d.sync += self.written.eq(0)
        with m.If(packed.commit):
            m.d.sync += [self.closing.eq(0), self.waits.eq(1), self.written.eq(0)]
            m.d.sync += [self.waiting_value.eq(packed_now), self.waiting_length.eq(packed.end)]


class _Wire:
    def __init__(self, m: Module, dut: _PackerAndLink, inside: Inside, frames: _Frames, hello_length: int):
        self.busy, self.is_hello = Signal(name="busy"), Signal(name="is_hello")
        self.index = Signal(len(dut.packer.frames.end) + 1, name="index")
        self.ended, self.again = Signal(name="packet_ended"), Signal(name="again")
        self.sends = self.busy | self.again
        self.length = Mux(self.is_hello, hello_length, frames.sent_length)
        taken = inside["link.take_frame"] | inside["link.take_hello"]
        last = self.busy & (self.index == self.length + CHECK_BYTES)
        self.rests = dut.link.derived.rests
        if self.rests:
            m.d.sync += self.ended.eq(last & dut.bytes.valid & dut.bytes.ready)
            m.d.sync += self.again.eq(self.ended & ~taken | self.again & ~(dut.bytes.valid & dut.bytes.ready))
        with m.If(self.busy & dut.bytes.valid & dut.bytes.ready):
            m.d.sync += [self.index.eq(self.index + 1), self.busy.eq(~last)]
        with m.If(taken):
            m.d.sync += [self.busy.eq(1), self.index.eq(0), self.is_hello.eq(inside["link.take_hello"])]


def _lemmas(proof: Proof, inside: Inside, place, frames: _Frames, wire: _Wire) -> None:
    m = proof.m
    filling, waiting, sending = (inside[f"link.{name}"] for name in ("filling", "waiting", "sending"))
    proof.lemma((filling != waiting) & (waiting != sending) & (sending != filling))
    proof.lemma((filling != HELLO_REGION) & (waiting != HELLO_REGION) & (sending != HELLO_REGION))
    words = Array(inside.word("link.store", Cat(place, Const(region, 2))) for region in range(HELLO_REGION))
    proof.lemma(~frames.written | (words[filling] == frames.packed_value))
    with m.If(frames.waits):
        proof.lemma((words[waiting] == frames.waiting_value) | (place >= frames.waiting_length))
        proof.lemma((frames.waiting_length != 0) & (inside["link.waiting_end"] == frames.waiting_length))
    proof.lemma((inside["packer.part_state"] != 0) == frames.closing)
    proof.lemma(~(frames.waits & frames.closing) & (inside["link.waits"] == frames.waits))
    proof.lemma(Cat(inside["link.frames_sent"], inside["link.overwritten"]) == Cat(frames.sent, frames.dropped))
    state, tail = inside["link.wire_state"], inside["link.tail"]
    offset, end = inside["link.offset"], inside["link.end"]
    states = _RESTING_STATES if wire.rests else _STATES
    fetch, byte, in_tail = (state == states.index(name) for name in ("FETCH", "BYTE", "TAIL"))
    proof.lemma((state != 0) == wire.sends)
    proof.lemma(~wire.busy | (inside["link.is_hello"] == wire.is_hello))
    with m.If(wire.busy & ~wire.is_hello):
        proof.lemma((words[sending] == frames.sent_value) | (place >= frames.sent_length))
        proof.lemma(frames.sent_length != 0)
    with m.If(fetch | byte):
        proof.lemma((offset == wire.index) & (end == wire.length))
        proof.lemma((wire.index < wire.length) | fetch & (wire.index == wire.length) & (tail == 0))
    _lemmas_on_state(proof, inside, wire, fetch, byte)
    with m.If(in_tail):
        proof.lemma((tail <= CHECK_BYTES) & Mux(wire.again, tail == CHECK_BYTES, wire.index == wire.length + tail))
    if wire.rests:
        proof.lemma((~wire.again | in_tail) & ~(wire.busy & wire.again) & ~(wire.ended & wire.sends))
        begins = wire.busy & (wire.index == 0)
        proof.lemma(begins | (inside["link.ended"] == (wire.ended | wire.busy)))


def _lemmas_on_state(proof: Proof, inside: Inside, wire: _Wire, fetch, byte) -> None:
    m, state, at = proof.m, inside["link.odometer.carry_state"], inside["link.odometer.at"]
    carries, clears = (state == 1) | (state == 2), state == 3
    proof.lemma(~carries | (at >= LIVE_DIGITS) & (at <= 10))
    with m.If((fetch | byte) & wire.is_hello):
        passed = Cat(byte, wire.index)  # at least this many clocks since it was taken
        proof.lemma(~carries | (Cat(state == 2, at) >= passed + 2 * LIVE_DIGITS))
        proof.lemma(~clears | (at > passed))
        with m.If(byte & (wire.index >= protocol.STATE_OFFSET)):
            place = inside["link.offset"][: len(at)]
            proof.lemma(inside.part("link.odometer").digit == inside.word("link.odometer.digits", place))
        for place in range(LIVE_DIGITS):
            with m.If(byte & (wire.index == protocol.STATE_OFFSET + place)):
                proof.lemma(inside["link.live"] == inside["link.frames_sent"].word_select(place, 7))
    for place in range(LIVE_DIGITS):
        proof.lemma(inside.word("link.odometer.digits", Const(place, 4)) == 0)


_IDLE, _FETCH, _BYTE, _TAIL = range(len(_STATES))


def _leaves(inside: Inside, state: int, when):
    return (inside["wire_state"] == state) & when


def _last_left_out(state, inside: Inside):
    return Mux(_leaves(inside, _FETCH, inside["offset"] + 1 == inside["end"]), _TAIL, state)


def _check_byte_short(state, inside: Inside):
    last = inside.component.bytes.ready & (inside["tail"] == CHECK_BYTES - 1)
    return Mux(_leaves(inside, _TAIL, last), _IDLE, state)


_BUGS = (
    Bug("a byte does not wait", Link, "wire_state",
        lambda state, inside: Mux(_leaves(inside, _BYTE, 1), _FETCH, state)),
    Bug("the wrong region is sent", Link, "sending",
        lambda region, inside: Mux(inside["take_frame"], inside["filling"], region)),
    Bug("a frame is sent twice", Link, "waits", lambda waits, inside: waits | inside["take_frame"]),
    Bug("a byte is passed over", Link, "offset", lambda offset, inside: offset + (offset == inside["offset"] + 1)),
    Bug("the last byte is left out", Link, "wire_state", _last_left_out),
    Bug("a check byte short", Link, "wire_state", _check_byte_short),
    Bug("a loss is not counted", Link, "overwritten", lambda _, inside: inside["overwritten"]),
)  # fmt: skip
_REST_BUGS = (Bug("a third delimiter", Link, "ended", lambda ended, inside: ended | (inside["tail"] == CHECK_BYTES)),)
_HELLO = protocol.encode_hello(_SKIN)
_SHORT = _HELLO[:1] + _HELLO[-CHECK_BYTES - 1 :]  # goes out first, and a search has to come to the frames after it


def first_is_sent(proof: Proof, **changes: Any) -> None:
    """Free: decisions about frames, and frames' contents.

    Claimed: no frame is dropped before one was sent. So after a restart a frame is packed before any is dropped, and
    ``contact`` can wait for its ``commit``. Nor is a frame dropped whose flag for faults differs from that of the frame
    before.
    """
    dut = Link(Skin(rows=2, columns=2, send="on_change", **changes))
    inside = proof.put(dut)
    for port, name in ((dut.summary, "summary"), (dut.tag, "tag"), (dut.time, "time")):
        proof.m.d.comb += Value.cast(port).eq(proof.free(Value.cast(port).shape(), name))
    decide, sends = dut.frames.decide, dut.frames.verdict.send
    proof.m.d.comb += decide.eq(proof.free(1, "decide"))
    sent = Signal(name="sent_one")
    proof.m.d.sync += sent.eq(sent | decide & sends)
    proof.claim(~decide | sends | sent)
    flag = Signal()  # of the frame before
    with proof.m.If(decide):
        proof.m.d.sync += flag.eq(dut.tag.fault)
    proof.claim(~decide | sends | (dut.tag.fault == flag))
    proof.lemma(inside["fault_before"] == flag)
    derived = dut.derived
    due = ("toggles", derived.keep_alive_toggles) if derived.scan.waits else ("pause", derived.keep_alive_frames - 1)
    proof.lemma(sent | (inside[due[0]] == due[1]))


_FIRST_BUGS = (
    Bug("a hello counts for it", Link, "due", lambda due, inside: due & inside["hello_due"]),
    Bug("a fault is no change", Link, "fault_before", lambda _, inside: inside.component.tag.fault),
    Bug("the time runs out", Link, "pause", lambda _, inside: inside["pause"] + 1),
)


_REST, _READ, _WRITE, _CLEAR = range(4)


def digits_are_the_counts(proof: Proof, counter: str) -> None:
    """Free: pulses of both counters at any time, hold, and the read place. Assumed: no pulse comes while one of its
    kind waits.

    Claimed: once cleared, without a carry under way or waiting, the digits are the number of pulses, modulo their
    range; ``digit`` is that of the place a clock before; other places hold 0.
    """
    m = proof.m
    dut = Odometer()
    inside = proof.put(dut)
    for port, name in ((dut.sent, "sent"), (dut.epoch, "epoch"), (dut.hold, "hold"), (dut.place, "place")):
        m.d.comb += port.eq(proof.free(port.shape(), name))
    state, at = inside["carry_state"], inside["at"]
    waits = {"sent": inside["sent_waits"], "epoch": inside["epoch_waits"]}
    proof.given(~(dut.sent & waits["sent"]) & ~(dut.epoch & waits["epoch"]))
    first, last = (LIVE_DIGITS, SENT_DIGITS - 1) if counter == "sent" else (SENT_DIGITS, SENT_DIGITS + EPOCH_DIGITS - 1)
    words = {place: inside.word("digits", Const(place, 4)) for place in range(16)}
    value = Cat(words[place] for place in range(first, last + 1))
    counted = Signal(len(value), name="counted")
    with m.If(getattr(dut, counter)):
        m.d.sync += counted.eq(counted + 1)
    ours = (at >= first) & (at <= last)
    carry = Signal(len(value), name="carry")
    for place in range(first, last + 1):
        with m.If((state != _REST) & (state != _CLEAR) & (at == place)):
            m.d.comb += carry.eq(1 << DIGIT_BITS * (place - first))
    with m.If((state == _REST) & ~waits[counter]):
        proof.claim(value == counted)
    with m.If(proof.before(state == _REST)):
        before = proof.before(dut.place)
        for place in range(16):
            with m.If((before == place) & (state == _REST)):
                proof.claim(dut.digit == words[place])
    for place in (*range(LIVE_DIGITS), *range(SENT_DIGITS + EPOCH_DIGITS, 16)):
        proof.claim((words[place] == 0) | (state == _CLEAR))
    with m.If(state == _CLEAR):
        proof.lemma(counted == waits[counter])
        for place, word in words.items():
            proof.lemma((word == 0) | (place >= at))
    with m.Else():
        proof.lemma((value + carry + waits[counter])[: len(value)] == counted)
        proof.lemma((state == _REST) | ours | _others(at, counter))
    with m.If(state == _WRITE):
        read = Signal(DIGIT_BITS, name="read")
        for place, word in words.items():
            with m.If(at == place):
                m.d.comb += read.eq(word)
        proof.lemma(dut.digit == read)


def _others(at, counter: str):
    low, high = (SENT_DIGITS, SENT_DIGITS + EPOCH_DIGITS - 1) if counter == "sent" else (LIVE_DIGITS, SENT_DIGITS - 1)
    return (at >= low) & (at <= high)


_ODOMETER_BUGS = (
    Bug("the epoch begins a place late", Odometer, "at",
        lambda at, inside: at + ((inside["carry_state"] == _REST) & (at == SENT_DIGITS) & (inside["at"] != at))),
    Bug("a pulse is lost while the other counter's waits", Odometer, "epoch_waits",
        lambda waits, inside: waits & ~((inside["carry_state"] == _REST) & inside["sent_waits"])),
)  # fmt: skip
CASES = (
    ProofCase("packed frames are sent", "1x2, cells", partial(packed_frames_are_sent, hello=_HELLO), 3, campaign=True),
    ProofCase("packed frames are sent", "1x2, cells, hello of 1 byte", partial(packed_frames_are_sent, hello=_SHORT), 3,
              _BUGS, bug_clocks=40),
    ProofCase("packed frames are sent", "1x2, cells, at rest, hello of 1 byte",
              partial(packed_frames_are_sent, hello=_SHORT, skin=_RESTS), 3, _REST_BUGS, bug_clocks=40),
    ProofCase("the first frame is sent", "raster", partial(first_is_sent, scan="raster"), 2, _FIRST_BUGS),
    ProofCase("the first frame is sent", "line reversal", partial(first_is_sent, scan="reversal", precharge_us=1.0), 2),
    ProofCase("digits are the counts", "frames sent", partial(digits_are_the_counts, counter="sent"), 2),
    ProofCase("digits are the counts", "epoch", partial(digits_are_the_counts, counter="epoch"), 2, _ODOMETER_BUGS,
              bug_clocks=30),
)  # fmt: skip
